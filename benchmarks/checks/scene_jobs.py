"""What the fuzz and the soak share: which scenes, how many processes, and a bar."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any, TypeVar

import click
import numpy as np
from rich.console import Console

from benchmarks.cli.progress import bar
from er_gym.rollout.worker_pool import LostJob, run_jobs
from er_gym.thor import SCENE_NAMES

Job = TypeVar("Job")
Result = TypeVar("Result")


def choose_scenes(asked: str) -> list[str]:
    """Scenes by number, spread over the kinds of room; "all"; or names separated by commas.

    Raises: ValueError: the text has another form.
    """
    if asked == "all":
        return list(SCENE_NAMES)
    if asked.isdecimal() and 1 <= int(asked) <= len(SCENE_NAMES):
        chosen = np.linspace(0, len(SCENE_NAMES), int(asked), endpoint=False).astype(int)
        return [SCENE_NAMES[k] for k in chosen]
    names = asked.split(",")
    unknown = [name for name in names if name not in SCENE_NAMES]
    if unknown:
        raise ValueError(
            f"--scenes takes all, a number from 1 to {len(SCENE_NAMES)} or names such as "
            f"FloorPlan1,FloorPlan201; not {unknown[0]!r}"
        )
    return names


def _chosen(context: click.Context, parameter: click.Parameter, asked: str) -> list[str]:
    try:
        return choose_scenes(asked)
    except ValueError as error:
        raise click.UsageError(str(error)) from None


def play_options(actions: int) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """The options ``--scenes``, ``--actions`` with this default, ``--seed`` and ``--workers``."""
    options = (
        click.option(
            "--scenes", default="all", callback=_chosen, help="all, how many, or names.",
            show_default=True,
        ),
        click.option("--actions", default=actions, show_default=True, type=click.IntRange(1)),
        click.option("--seed", default=0, show_default=True, type=click.IntRange(0)),
        click.option("--workers", default=2, show_default=True, type=click.IntRange(1)),
    )  # fmt: skip

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


def run_scene_jobs(
    make: Callable[[], Callable[[Job], Result]],
    jobs: Sequence[Job],
    workers: int,
    lost: Callable[[Job, str], Result],
) -> Iterator[Result]:
    """Do every job once in ``workers`` processes (1: in this process).

    ``lost`` says what becomes of a job whose process died, and in which words.
    """
    if workers == 1:
        yield from map(make(), jobs)
        return
    for job, result in run_jobs(make, jobs, workers=workers, tries=1):
        if isinstance(result, LostJob):
            yield lost(job, f"the process died, exit code {result.exitcode}")
        else:
            yield result


def with_bar(
    what: str, total: int, reports: Iterable[Result], status: Callable[[], str]
) -> Iterator[Result]:
    """The reports, with a bar that says the status after each has been taken."""
    with bar(Console(stderr=True)) as shown:
        task = shown.add_task(what, total=total, status="starting")
        for report in reports:
            yield report
            shown.update(task, advance=1, status=status())
