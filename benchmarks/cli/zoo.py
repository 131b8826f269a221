"""``er-gym zoo``: the small trained models that come with er-gym."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from benchmarks.cli.errors import BadInput, bad_input, needing
from benchmarks.cli.options import FOLDER, Words
from benchmarks.terminal import echo, stdout

if TYPE_CHECKING:
    from agents.zoo.card import Card, Figure, Rate
    from agents.zoo.index import ZooModel
    from er_gym.tables import Table

FORMATS = ("table", "md")
DTYPES = ("float16", "bfloat16", "float32")
"""As in ``agents.packing``, which imports torch; a test compares."""
_NAME = re.compile(r"[a-z0-9]+([.-][a-z0-9]+)*")
_NONE = "-"


class _Zoo(click.Group):
    """``er-gym zoo NAME`` is ``er-gym zoo show NAME``."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args[0] not in self.commands and not args[0].startswith("-"):
            args = ["show", *args]
        return super().resolve_command(ctx, args)


@click.group(
    cls=_Zoo, invoke_without_command=True, subcommand_metavar="[NAME | COMMAND [ARGUMENTS]...]"
)
@click.option("--format", "layout", type=click.Choice(FORMATS), default="table", show_default=True)
@click.pass_context
def zoo(context: click.Context, layout: str) -> None:
    """List the trained models that come with er-gym, or show the card of one.

    `er-gym bench --suite mini --agent zoo:NAME` plays with a model.
    """
    if context.invoked_subcommand is not None:
        return
    from agents.zoo.index import find_model, model_names
    from benchmarks.scoring.tables import print_tables
    from er_gym.tables import as_markdown

    with bad_input():
        table = _list([find_model(name) for name in model_names()])
    if layout == "md":
        echo(as_markdown([table]), nl=False)
    else:
        print_tables([table], stdout())


@zoo.command()
@click.argument("name")
def show(name: str) -> None:
    """Show a model's card: its figures, and the commands that play it and train it again."""
    from agents.zoo.index import find_model
    from benchmarks.scoring.tables import print_tables

    with bad_input():
        model = find_model(name)
    card = model.card
    echo(f"{name}: {card.title}")
    echo()
    for what, words in _about(model).items():
        echo(f"{what:<12}{words}")
    for figure in card.figures:
        print_tables([_figure_table(card, figure)], stdout())
    echo("\nIt plays so:")
    plays = [_bench(name, figure) for figure in card.figures]
    for command in plays or [f"er-gym bench --suite mini --agent zoo:{name}"]:
        echo(f"  {command}")
    echo("\nIt was made so:")
    for command in card.made_by:
        echo(f"  {command}")


@zoo.command()
@click.argument("run", type=FOLDER)
@click.option("--name", required=True, type=Words(), help="The model's name: letters, digits, -.")
@click.option("--title", required=True, type=Words(), help="What it does, in a few words.")
@click.option(
    "--figures",
    "runs",
    multiple=True,
    type=FOLDER,
    help="A run directory of er-gym bench with this model; may be repeated.",
)
@click.option(
    "--made-by",
    multiple=True,
    type=Words(),
    help="A command that trains it; may be repeated.  [default: what RUN says]",
)
@click.option("--dtype", type=click.Choice(DTYPES), default=DTYPES[0], show_default=True)
@click.option("--into", type=FOLDER, help="The folder of the models.  [default: the package's]")
def add(
    run: Path,
    name: str,
    title: str,
    runs: tuple[Path, ...],
    made_by: tuple[str, ...],
    dtype: str,
    into: Path | None,
) -> None:
    """Put the model of a training run into the zoo, or bring it up to date; for maintainers.

    RUN is a run directory of er-gym train-rl or er-gym finetune. The figures are read from the run
    directories, never entered by hand. First add the model without them, play it as zoo:NAME, then
    add it again with them.
    """
    if not _NAME.fullmatch(name) or name in zoo.commands:
        raise BadInput(
            f"{name!r:.80} is no name for a model; give lower-case letters and digits, such as "
            "single-search"
        )
    with needing("packing a model", "er-gym[rl,local]"):
        from agents import packing
    from agents.zoo.card import Card, card_text
    from agents.zoo.index import CARD
    from agents.zoo.index import FOLDER as MODELS
    from benchmarks.cli.zoo_figures import RUN, figure_of, take_over_settings
    from benchmarks.scoring.report import load_run
    from er_gym import __version__
    from er_gym.writing import write_atomic

    models = into or MODELS
    with bad_input():
        reports = [load_run(path) for path in runs]
        figures = [figure_of(report, name, run) for report in reports]
        with packing.new_folder(models, name) as draft:
            packed = packing.pack(run, draft, dtype)
            if packed.kind == "language model":
                take_over_settings(reports, draft)
            played_it = [figure.played_by != RUN for figure in figures]
            if any(played_it) and not packing.same_files(draft, models / name):
                raise ValueError(
                    f"zoo:{name} in {runs[played_it.index(True)]} had other files than {run} gives "
                    "now; add it without --figures, and play it again"
                )
            commands = made_by or packed.made_by
            if not commands:
                raise ValueError(
                    f"{run} does not say which command made it; give each with --made-by"
                )
            card = Card(
                title=title,
                kind=packed.kind,
                parameters=packed.parameters,
                dtype=dtype,
                bytes=packing.size_of(draft),
                trained_on=packed.trained_on,
                er_gym=__version__,
                figures=tuple(figures),
                made_by=commands,
            )
            write_atomic(draft / CARD, card_text(card))
    echo(f"{models / name}: {_size(card)}, {card.parameters:,} parameters")


# -- words ---------------------------------------------------------------------------------------


def _bench(name: str, figure: Figure) -> str:
    options = f" {figure.options}" if figure.options else ""
    return f"er-gym bench --suite {figure.suite}{options} --agent zoo:{name}"


def _about(model: ZooModel) -> dict[str, Any]:
    card = model.card
    return {
        "kind": card.kind,
        "weights": f"{card.parameters:,} parameters in {card.dtype}, {_size(card)}",
        "needs": f"pip install 'er-gym[{model.player.extra}]'",
        "trained on": card.trained_on,
        "licence": card.licence,
        "er-gym": card.er_gym,
        "folder": model.folder,
    }


def _size(card: Card) -> str:
    return f"{card.bytes / 1e6:.1f} MB" if card.bytes >= 1e6 else f"{card.bytes / 1e3:.0f} kB"


def _list(models: list[ZooModel]) -> Table:
    from er_gym.tables import Table

    words = ("Name", "What it does", "Extra", "Tasks")
    return Table(
        title="The zoo, success in %",
        head=(*words, "Parameters", "Size", "n", "Success", "95 %"),
        rows=tuple(
            _row(model, figure) for model in models for figure in model.card.figures or (None,)
        ),
        text_columns=len(words),
        notes=("er-gym zoo NAME shows a card; er-gym bench --agent zoo:NAME plays",),
    )


def _row(model: ZooModel, figure: Figure | None) -> tuple[str, ...]:
    card = model.card
    tasks = f"{figure.suite} {figure.options}".strip() if figure else _NONE
    about = (model.name, card.title, model.player.extra, tasks)
    rate = _rate(figure.success) if figure else (_NONE,) * 3
    return (*about, f"{card.parameters:,}", _size(card), *rate)


def _figure_table(card: Card, figure: Figure) -> Table:
    from er_gym.tables import Table

    weights = card.dtype if figure.played_by != "run" else "the training run's weights"
    return Table(
        title=f"{figure.suite} {figure.options}".strip(),
        head=("", "n", "Success in %", "95 %"),
        rows=(
            ("All", *_rate(figure.success)),
            *((group, *_rate(rate)) for group, rate in figure.groups.items()),
        ),
        text_columns=1,
        notes=(f"played with {weights} on {figure.date}, er-gym {figure.er_gym}",),
    )


def _rate(rate: Rate) -> tuple[str, str, str]:
    return str(rate.n), f"{rate.percent:.1f}", f"{rate.low:.1f} to {rate.high:.1f}"
