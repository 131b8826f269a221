"""Make docs/models.md, what trained language models can do, from the directories of their ladders.

    python -m benchmarks.pages.models --ladder runs/ladder/er-tiny-text \\
        --ablation runs/ablation/tiny-text --run runs/beside/searcher

Nothing is played or trained: all figures are read from the directories.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import click

from agents.finetune.run_files import METRICS
from benchmarks.cli.errors import bad_input
from benchmarks.cli.options import force_option
from benchmarks.harness.output import ROOT
from benchmarks.pages.baselines import machine
from benchmarks.pages.failure_maps import draw_examples, examples, failure_shares, in_words
from benchmarks.scoring.drawing import draw, write_charts
from benchmarks.scoring.report import RunReport, load_run
from benchmarks.scoring.series import Axis, Chart, Series, points
from benchmarks.scoring.splits import split_results, split_table
from benchmarks.study.kinds import ABLATION, LADDER, Study
from benchmarks.study.ladder_settings import CONTROLS, LadderSettings
from benchmarks.study.results import Result
from benchmarks.study.run import PlanRecord
from er_gym.tables import Table, as_markdown
from er_gym.writing import MARKDOWN_MARK, check_output, write_output

_SMOOTH = 0.9
"""The share that the mean of the losses before has in a point of the curve."""


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
        climbed = [Study.open(LADDER, path) for path in ladders]
        parts = [_ladder_section(*each, out.parent / "images", force) for each in climbed]
        parts += _generalisation([ladder for ladder, _ in climbed], others)
        ablated = [Study.open(ABLATION, path) for path in ablations]
        parts += [_ablation_section(*each, out.parent / "images", force) for each in ablated]
        page = MARKDOWN_MARK + _INTRODUCTION.format(machine=machine()) + "\n".join(parts)
        write_output(out, page, force=force)
    click.echo(out)


def _run_of(result: Result) -> RunReport:
    """The only evaluation of a rung."""
    (run,) = result.runs.values()
    return run


def _heading(study: Study, title: str, command: str) -> list[str]:
    """A study's title, what it is, and how it is run."""
    out = f"runs/{study.kind.name}/{study.path.name}"
    return [
        f"## {title}",
        "",
        study.settings.description,
        "",
        "```sh",
        f"er-gym {command} --config {study.path.name} --out {out}",
        "```",
        "",
    ]


def _ladder_section(ladder: Study, record: PlanRecord, images: Path, force: bool) -> str:
    """What a ladder has come to."""
    name = ladder.path.name
    ((part, results),) = ladder.results()
    success = replace(part.picture(results), title=f"{name}: success after each stage")
    pictures = {
        f"{name}-ladder": draw(success),
        f"{name}-loss": draw(_losses(ladder), height=3.6),
    }
    last = _run_of([r for r in results if not r.of.faults and r.name not in CONTROLS][-1])
    chosen = examples(last.episodes)
    if chosen:
        pictures[f"{name}-failures"] = draw_examples(last.manifest, chosen)
    write_charts(images, pictures, force=force)
    lines = [
        *_heading(ladder, name, "ladder"),
        as_markdown(part.tables(results)),
        f"![Success after each stage](images/{name}-ladder.png)",
        "",
        f"![Loss of each fine-tuning](images/{name}-loss.png)",
        "",
        as_markdown([_failure_table(results), _cost_table(record)]),
    ]
    if chosen:
        lines += [
            "One failure of each kind, of the last stage, of median length. Circles mark the "
            "objects of the task; numbers are steps.",
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


def _failure_table(results: Sequence[Result]) -> Table:
    """Why the episodes of each rung failed."""
    shares = [failure_shares(_run_of(each).episodes) for each in results]
    kinds = list(dict.fromkeys(kind for each in shares for kind in each))
    return Table(
        title="Why episodes failed, in % of all",
        head=("rung", "faults", *kinds),
        rows=tuple(
            (
                rung.name,
                f"{100 * rung.of.faults:g}",
                *(f"{100 * each.get(kind, 0.0):.1f}" for kind in kinds),
            )
            for rung, each in zip(results, shares, strict=True)
        ),
        text_columns=1,
    )


def _cost_table(record: PlanRecord) -> Table:
    """How long each phase took."""
    phases = record.done
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


def _losses(ladder: Study) -> Chart:
    """The loss of each fine-tuning over the updates of all."""
    series = []
    before = 0
    for phase in ladder.plan.phases:
        file = ladder.path / phase.out / METRICS
        if phase.command[0] != "finetune" or not file.exists():
            continue
        lines = [json.loads(line) for line in file.read_text(encoding="utf-8").splitlines()]
        losses = [line["loss"] for line in lines]
        for number in range(1, len(losses)):
            losses[number] = _SMOOTH * losses[number - 1] + (1 - _SMOOTH) * losses[number]
        updates = [before + line["update"] for line in lines]
        series.append(Series(phase.name, points([*zip(updates, losses, strict=True)])))
        before = updates[-1]
    title = f"{ladder.path.name}: loss of the tokens that are learnt"
    return Chart(title, Axis("updates"), Axis("loss per token", log=True), series)


def _generalisation(ladders: Iterable[Study], others: Iterable[tuple[str, Path]]) -> list[str]:
    """How new the tasks are that the models and others have done; nothing if there are none."""
    named = [
        (ladder.path.name, _run_of(rung))
        for ladder in ladders
        if isinstance(ladder.settings, LadderSettings)
        for _, results in ladder.results()
        for rung in results
        if not rung.of.faults and rung.name == [*ladder.settings.stages][-1]
    ]
    named += [(name, load_run(path)) for name, path in others]
    reports = [
        replace(run, manifest=run.manifest.model_copy(update={"agent": name}))
        for name, run in named
    ]
    if not reports:
        return []
    return [f"## Generalization\n\n{as_markdown([split_table(split_results(reports))])}"]


def _ablation_section(ablation: Study, record: PlanRecord, images: Path, force: bool) -> str:
    """The tables and pictures of an ablation."""
    name = ablation.path.name
    lines = _heading(ablation, f"Ablations: {name}", "ablate")
    for part, results in ablation.results():
        lines.append(as_markdown(part.tables(results)))
        if part.pictured:
            chart = part.picture(results)
            picture = {f"ablation-{name}-{part.name}": draw(chart)}
            (file,) = write_charts(images, picture, force=force)
            lines += [f"![{chart.title}](images/{file.name})", ""]
    minutes = _minutes(sum(each.seconds for each in record.done))
    lines += [f"All of it took {minutes} minutes.", ""]
    return "\n".join(lines)


_INTRODUCTION = """# Models

This page shows how well small language models play after training with er-gym, most of them from
random weights, and why their episodes fail. `python -m benchmarks.pages.models` makes it from the
directories of `er-gym ladder` and `er-gym ablate` ([ladder.md](ladder.md)). All episodes use
`instances="explore"`, where the environment does not look at the task to choose which object a type
name means, and the corrected scorer. Intervals are at 95 %. Each model is the one at the end of its
ladder. We chose the training data of the third stages after we had evaluated earlier choices on
the same tasks ([ladder.md](ladder.md) lists all of them). The policies of reinforcement learning
are in [baselines.md](baselines.md). [zoo.md](zoo.md) lists the models that come with er-gym.

Times are those of {machine}, with no GPU. Other programs used the machine meanwhile.

"""


if __name__ == "__main__":
    main()
