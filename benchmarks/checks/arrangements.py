"""How much wider an interval is that takes the tasks of one arrangement of a room to be alike.

    python -m benchmarks.checks.arrangements RUN... [--before RUN]

The tasks of a generated suite share arrangements: where one hides a thing well, several tasks fail
together. The usual intervals count tasks as independent. That is right for the tasks of that suite,
and too narrow for what another suite of the same kind would give. With ``--before`` the table shows
how much more each run does than that one, in the tasks of both; other tasks do not count.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from statistics import fmean
from typing import NamedTuple

import click

from benchmarks.scoring.metrics import Estimate, between, success_rate
from benchmarks.scoring.report import RunReport, load_run
from benchmarks.scoring.samples import arrangement_of, group_by
from benchmarks.scoring.scorers import CORRECTED
from er_gym.rollout.run_directory import RunDirectoryError
from er_gym.tables import Table, as_markdown

_COLUMNS = ("Run", "Tasks", "Arrangements")
_INTERVALS = ("By tasks", "By arrangements")


class _Played(NamedTuple):
    """An episode: its task, its arrangement, and whether the task was done."""

    task: str
    arrangement: str
    success: bool


def _played(run: RunReport) -> list[_Played]:
    return [
        _Played(score.task_id, arrangement_of(episode.scene, score.task_id), score.success)
        for episode, score in zip(run.episodes, run.scores[CORRECTED.name], strict=True)
    ]


def _rates(played: Sequence[_Played]) -> dict[str, float]:
    """By task: the share of its episodes that are successes."""
    parts = group_by(played, lambda each: each.task)
    return {task: fmean(each.success for each in part) for task, part in parts.items()}


def _row(run: RunReport, before: RunReport | None) -> tuple[str, ...]:
    played = _played(run)
    if not played:
        raise click.ClickException(f"{run.path} has no episode")
    where = {each.task: each.arrangement for each in played}
    if before is None:
        successes = [each.success for each in played]
        groups = [each.task for each in played], [each.arrangement for each in played]
        estimates = [success_rate(each, successes) for each in groups]
    else:
        now, then = _rates(played), _rates(_played(before))
        where = {task: arrangement for task, arrangement in where.items() if task in then}
        if not where:
            raise click.ClickException(f"{run.path} and {before.path} have no task in common")
        changes = [now[task] - then[task] for task in where]
        estimates = [between(each, changes) for each in (list(where), list(where.values()))]
    tasks, different = str(len(where)), str(len(set(where.values())))
    shown = f"{100 * estimates[0].mean:.1f}"
    return run.path.name, tasks, different, shown, *map(_interval, estimates)


def _interval(estimate: Estimate) -> str:
    if estimate.low is None or estimate.high is None:
        return ""
    return f"{100 * estimate.low:.1f} to {100 * estimate.high:.1f}"


@click.command(help=__doc__)
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--before", type=click.Path(path_type=Path), help="A run directory of er-gym bench.")
def main(runs: tuple[Path, ...], before: Path | None) -> None:
    try:
        first = load_run(before) if before else None
        rows = tuple(_row(load_run(run), first) for run in runs)
    except RunDirectoryError as error:
        raise click.ClickException(str(error)) from error
    title = f"Success, gain over {before.name}, in %" if before else "Success in %"
    columns = (*_COLUMNS, "Gain" if before else "Success", *_INTERVALS)
    click.echo(as_markdown([Table(title, columns, rows, 1)]))


if __name__ == "__main__":
    main()
