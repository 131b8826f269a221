"""Make docs/models.md, what trained language models can do, from the directories of their ladders.

    python -m benchmarks.pages.models --ladder runs/ladder/er-tiny-text \\
        --ablation runs/ablation/tiny-text --run runs/beside/searcher

Nothing is played or trained: all figures are read from the directories.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from agents.finetune.run_files import METRICS
from benchmarks.ablation.chart import draw_study
from benchmarks.ablation.result import read_study, study_table
from benchmarks.ablation.settings import AblationSettings
from benchmarks.cli.errors import bad_input
from benchmarks.cli.options import force_option
from benchmarks.harness.output import ROOT
from benchmarks.ladder.chart import draw_ladder
from benchmarks.ladder.phases import Rung, plan_of, rungs
from benchmarks.ladder.result import read_results, result_tables
from benchmarks.ladder.settings import CONTROLS, LadderSettings
from benchmarks.pages.baselines import machine
from benchmarks.pages.failure_maps import draw_examples, examples, failure_shares, in_words
from benchmarks.plan.run import PlanRecord
from benchmarks.scoring.drawing import GRID, INK, MUTED, canvas, own_style, write_chart
from benchmarks.scoring.report import RunReport, load_run
from benchmarks.scoring.splits import split_results, split_table
from benchmarks.scoring.tables import Table, as_markdown
from er_gym.rollout.run_directory import MANIFEST
from er_gym.writing import MARKDOWN_MARK, check_output, write_output

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_COLOURS = ("#2470ad", "#2a8c82", "#b5762a", "#54278f", "#a33b4a")
_SMOOTH = 0.9
"""The share that the mean of the losses before has in a point of the curve."""


@dataclass(frozen=True)
class Climbed:
    """A ladder that was climbed, as far as it was.

    Attributes:
        path: its directory, which has the name of its configuration.
        settings: of the ladder.
        record: what has been done.
    """

    path: Path
    settings: LadderSettings
    record: PlanRecord

    @staticmethod
    def load(path: Path) -> Climbed:
        """Read it.

        Raises:
            ValueError: it is no directory of a ladder.
            OSError: it cannot be read.
        """
        record = PlanRecord.model_validate_json((path / "ladder.json").read_bytes())
        return Climbed(path, LadderSettings.model_validate(record.settings), record)

    @property
    def name(self) -> str:
        """Of its configuration."""
        return self.path.name

    def measured(self) -> list[tuple[Rung, RunReport]]:
        """The rungs that have been measured, and their runs."""
        return [
            (rung, load_run(self.path / rung.run))
            for rung in rungs(self.settings)
            if (self.path / rung.run / MANIFEST).exists()
        ]


@click.command()
@click.option("--ladder", "ladders", multiple=True, type=click.Path(path_type=Path))
@click.option("--ablation", "ablations", multiple=True, type=click.Path(path_type=Path))
@click.option(
    "--run",
    "others",
    multiple=True,
    type=(str, click.Path(path_type=Path)),
    metavar="NAME DIR",
    help="Another run of er-gym bench for the table of generalisation, and who played it.",
)
@click.option("--out", type=click.Path(path_type=Path), default=ROOT / "docs" / "models.md")
@force_option
def main(
    ladders: tuple[Path, ...],
    ablations: tuple[Path, ...],
    others: tuple[tuple[str, Path], ...],
    out: Path,
    force: bool,
) -> None:
    """Write docs/models.md and its pictures."""
    if not (ladders or ablations):
        raise click.UsageError("give --ladder or --ablation")
    with bad_input():
        check_output(out, force=force)
        climbed = [Climbed.load(path) for path in ladders]
        parts = [_ladder_section(each, out.parent / "images", force) for each in climbed]
        parts += _generalisation(climbed, others)
        parts += [_ablation_section(path, out.parent / "images", force) for path in ablations]
        page = MARKDOWN_MARK + _INTRODUCTION.format(machine=machine()) + "\n".join(parts)
        write_output(out, page, force=force)
    click.echo(out)


def _ladder_section(ladder: Climbed, images: Path, force: bool) -> str:
    """What a ladder has come to."""
    name, settings = ladder.name, ladder.settings
    results = read_results(settings, ladder.path)
    runs = ladder.measured()
    pictures = {
        f"{name}-ladder.png": draw_ladder(results, f"{name}: success after each stage"),
        f"{name}-loss.png": _draw_losses(ladder),
    }
    last = [run for rung, run in runs if not rung.faults and rung.name not in CONTROLS][-1]
    chosen = examples(last.episodes)
    if chosen:
        pictures[f"{name}-failures.png"] = draw_examples(last.manifest, chosen)
    for file, figure in pictures.items():
        write_chart(images / file, figure, force=force, dpi=100)
    lines = [
        f"## {name}",
        "",
        settings.description,
        "",
        "```sh",
        f"er-gym ladder --config {name} --out runs/ladder/{name}",
        "```",
        "",
        as_markdown(result_tables(results)),
        f"![Success after each stage](images/{name}-ladder.png)",
        "",
        f"![Loss of each fine-tuning](images/{name}-loss.png)",
        "",
        as_markdown([_failure_table(runs), _cost_table(ladder)]),
    ]
    if chosen:
        lines += [
            "One failure of each kind, of the last stage, of median length. Circles mark what the "
            "task is about; numbers are steps.",
            "",
            f"![Failures on maps](images/{name}-failures.png)",
            "",
            *(
                f"- **{each.kind}**: *{each.record.instruction}* ({each.record.scene}): "
                f"{in_words(each)}"
                for each in chosen
            ),
            "",
        ]
    return "\n".join(lines)


def _failure_table(runs: Sequence[tuple[Rung, RunReport]]) -> Table:
    """Why the episodes of each rung failed."""
    shares = [failure_shares(run.episodes) for _, run in runs]
    kinds = list(dict.fromkeys(kind for each in shares for kind in each))
    return Table(
        title="Why episodes failed, in % of all",
        head=("rung", "faults", *kinds),
        rows=tuple(
            (
                rung.name,
                f"{100 * rung.faults:g}",
                *(f"{100 * each.get(kind, 0.0):.1f}" for kind in kinds),
            )
            for (rung, _), each in zip(runs, shares, strict=True)
        ),
        text_columns=1,
    )


def _cost_table(ladder: Climbed) -> Table:
    """How long each phase took."""
    phases = ladder.record.done
    total = sum(each.seconds for each in phases)
    rows = [(each.name, f"er-gym {each.command[0]}", _minutes(each.seconds)) for each in phases]
    return Table(
        title="What it cost",
        head=("phase", "command", "minutes"),
        rows=(*rows, ("all", "", _minutes(total))),
        text_columns=2,
    )


def _minutes(seconds: float) -> str:
    return f"{seconds / 60:.1f}"


@own_style()
def _draw_losses(ladder: Climbed) -> Figure:
    """The loss of each fine-tuning over its updates."""
    figure, axes = canvas(8.5, 3.6, f"{ladder.name}: loss of the tokens that are learnt")
    tuned = [
        phase
        for phase in plan_of(ladder.settings, ladder.path).phases
        if phase.command[0] == "finetune" and (ladder.path / phase.out / METRICS).exists()
    ]
    before = 0
    for colour, phase in zip(_COLOURS, tuned, strict=False):
        told = (ladder.path / phase.out / METRICS).read_text(encoding="utf-8").splitlines()
        lines = [json.loads(line) for line in told]
        losses = [line["loss"] for line in lines]
        for number in range(1, len(losses)):
            losses[number] = _SMOOTH * losses[number - 1] + (1 - _SMOOTH) * losses[number]
        updates = [before + line["update"] for line in lines]
        axes.plot(updates, losses, color=colour, linewidth=1.4, label=phase.name)
        before = updates[-1]
    axes.set_yscale("log")
    axes.set_xlabel("updates", color=MUTED)
    axes.set_ylabel("loss per token", color=MUTED)
    axes.grid(color=GRID, linewidth=0.8)
    axes.legend(frameon=False, labelcolor=INK)
    return figure


def _generalisation(ladders: Iterable[Climbed], others: Iterable[tuple[str, Path]]) -> list[str]:
    """How new the tasks are that the models and others have done; nothing if there are none."""
    named = [
        (ladder.name, run)
        for ladder in ladders
        for rung, run in ladder.measured()
        if not rung.faults and rung.name == [*ladder.settings.stages][-1]
    ]
    named += [(name, load_run(path)) for name, path in others]
    reports = [
        replace(run, manifest=run.manifest.model_copy(update={"agent": name}))
        for name, run in named
    ]
    if not reports:
        return []
    return [f"## How far it carries\n\n{as_markdown([split_table(split_results(reports))])}"]


def _ablation_section(path: Path, images: Path, force: bool) -> str:
    """The tables and pictures of an ablation."""
    record = PlanRecord.model_validate_json((path / "ablation.json").read_bytes())
    settings = AblationSettings.model_validate(record.settings)
    name = path.name
    lines = [
        f"## Ablations: {name}",
        "",
        settings.description,
        "",
        "```sh",
        f"er-gym ablate --config {name} --out runs/ablation/{name}",
        "```",
        "",
    ]
    for key, study in settings.studies.items():
        rows = read_study(settings, study, path)
        if not rows:
            continue
        lines.append(as_markdown([study_table(study, rows)]))
        if study.numbers:
            file = f"ablation-{name}-{key}.png"
            write_chart(images / file, draw_study(study, rows), force=force, dpi=100)
            lines += [f"![{study.title}](images/{file})", ""]
    minutes = _minutes(sum(each.seconds for each in record.done))
    lines += [f"All of it took {minutes} minutes.", ""]
    return "\n".join(lines)


_INTRODUCTION = """# Models

This page shows what small language models learn with er-gym, from nothing or little, and where they
fail. `python -m benchmarks.pages.models` makes it from the directories of `er-gym ladder` and
`er-gym ablate` ([ladder.md](ladder.md)). All episodes use `instances="explore"`, where the
environment does not look at the task to choose which object a type name means, and the corrected
scorer. Intervals are at 95 %. Each model is the one at the end of its training. What the third
stages learn from was chosen after earlier tries had been measured with the same tasks
([ladder.md](ladder.md) has them all). The policies of reinforcement learning are in
[baselines.md](baselines.md). [zoo.md](zoo.md) lists the models that come with er-gym.

Times are those of {machine}, with no GPU. Other programs used the machine meanwhile.

"""


if __name__ == "__main__":
    main()
