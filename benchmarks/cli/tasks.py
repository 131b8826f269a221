"""``er-gym tasks``: generate, verify, show, count and convert tasks."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.activity import doing
from benchmarks.cli.errors import BadInput, bad_input, report_set_aside
from benchmarks.cli.executor import ExecutorOptions, processors, with_executor_options
from benchmarks.cli.generate import generate
from benchmarks.cli.options import FOLDER, PATH, force_option, split
from benchmarks.cli.suites import fitted_tasks, refuse_if_none
from benchmarks.terminal import echo, terminal

if TYPE_CHECKING:
    from er_gym.tasks.suites import Suite


@click.group()
def tasks() -> None:
    """Generate, verify, show, count and convert tasks."""


tasks.add_command(generate)


@tasks.command()
@click.argument("suites", nargs=-1, required=True, metavar="SUITE|FILE...")
@with_executor_options()
def verify(suites: tuple[str, ...], executor_options: ExecutorOptions) -> int:
    """Play every task with the solver, and list those that cannot be done.

    The exit code is 1 if there is such a task, or one that is set aside because it does not fit its
    scene. The solver knows the key actions; it must succeed from the task's own start, within the
    step limit, and earn the whole reward.
    """
    from contextlib import closing
    from operator import attrgetter

    from benchmarks.cli.progress import Progress
    from er_gym.rollout.verification import make_verifier
    from er_gym.rollout.worker_pool import LostJob

    console = terminal(stderr=True)
    failed = 0
    for name in suites:
        with bad_input():
            suite = _suite(name)
            fitted = fitted_tasks(suite)
        todo, aside = fitted.tasks, fitted.set_aside
        report_set_aside(suite.name, (), fitted.substitutions)
        for one in aside:
            echo(f"{suite.name}: set aside: {one}")
        solved = 0
        progress = Progress(console, suite.name, len(todo))
        with (
            executor_options.workforce(progress.say, processors()) as workforce,
            progress,
            closing(
                workforce.worker_backend.run_jobs(
                    make_verifier, todo, workers=workforce.workers, affinity_key=attrgetter("scene")
                )
            ) as results,
        ):
            for task, verdict in results:
                problem, detail = "the engine died", ""
                if not isinstance(verdict, LostJob):
                    problem, detail = verdict.problem, verdict.detail
                solved += not problem
                progress.episode(not problem)
                if problem:
                    echo(": ".join(filter(None, (suite.name, task.id, problem, detail))))
        every = len(todo) + len(aside)
        failed += every - solved
        told = f"; {len(aside)} set aside" if aside else ""
        echo(f"{suite.name}: {solved} of {every} tasks can be done{told}")
    return 1 if failed else 0


@tasks.command()
@click.argument("suite", metavar="SUITE|FILE")
@click.argument("ids", nargs=-1, metavar="[ID...]")
@click.option(
    "--limit",
    type=click.IntRange(min=1),
    default=3,
    show_default=True,
    help=("Without ids: the number of tasks of each type."),
)
@click.option(
    "--types", metavar="NAMES", help="Without ids: only these types, separated by commas."
)
def show(suite: str, ids: tuple[str, ...], limit: int, types: str | None) -> None:
    """Print tasks in readable form."""
    from dataclasses import fields

    from er_gym.tasks.describe import describe
    from er_gym.tasks.difficulty import Difficulty
    from er_gym.tasks.resolve import resolve_tasks
    from er_gym.tasks.types import BY_NAME, types_named

    with bad_input():
        found = _suite(suite)
        every, aside = found.tasks, list(found.set_aside)
        if ids:
            known = {task.id: task for task in every}
            aside = [one for one in aside if one.task in ids]
            ids = tuple(i for i in ids if i not in {one.task for one in aside})
            unknown = [i for i in ids if i not in known]
            if unknown:
                some = ", ".join(list(known)[:3])
                raise BadInput(f"no task {unknown[0]!r} in {suite}; ids are such as {some}")
            chosen = [known[i] for i in ids]
        else:
            kinds = types_named(split(types)) or tuple(BY_NAME.values())
            by_kind = [[task for task in every if task.type is kind] for kind in kinds]
            chosen = [task for of_kind in by_kind for task in of_kind[:limit]]
        fitted = resolve_tasks(chosen)
        aside += fitted.set_aside
        refuse_if_none(fitted.tasks, aside, f"{suite}: no task to show")
    report_set_aside(suite, aside, fitted.substitutions)
    names = [field.name for field in fields(Difficulty)]
    pages = []
    for task in fitted.tasks:
        told = task.extra.get("difficulty")  # the file's author may mean something else by it
        figures = None
        if isinstance(told, Mapping) and all(
            type(told.get(name)) in (int, float) for name in names
        ):
            figures = Difficulty(**{name: told[name] for name in names})
        pages.append(describe(task, figures))
    echo("\n\n".join(pages))


@tasks.command()
@click.argument("suite", metavar="SUITE|FILE")
@click.option("--out", type=FOLDER, help=("Draw the charts into this folder, as PNG."))
@force_option
def stats(suite: str, out: Path | None, force: bool) -> None:
    """Count a suite's tasks by type, room, scene and split, and draw the distributions."""
    from benchmarks.scoring.task_counts import print_counts

    with bad_input(ImportError):
        found = _suite(suite)
        report_set_aside(found.name, found.set_aside)
        print_counts(found.tasks, {}, by_scene=True)
        if out is not None:
            from benchmarks.scoring.charts import draw_charts

            doing("drawing the charts")
            for file in draw_charts(found.tasks, out, found.name, force=force):
                echo(file)


@tasks.command()
@click.argument("suite", metavar="SUITE|FILE|FOLDER")
@click.argument("out", metavar="FILE|FOLDER", type=PATH)
@click.option(
    "--task-ids", multiple=True, metavar="ID,…", help="Convert these tasks; may be repeated."
)
@force_option
def convert(suite: str, out: Path, task_ids: tuple[str, ...], force: bool) -> None:
    """Convert tasks to another format without loss.

    If a task cannot be read, the command names it and converts the others.

    FILE.json is the paper's test file. FILE.jsonl and FILE.jsonl.gz are er-gym's own format. A
    folder holds the paper's generator files, one for each scene and type, and is read and written
    as a whole. The paper's files do not say who wrote them, so an existing one is replaced only
    with --force.
    """
    from er_gym.rollout.selection import select
    from er_gym.tasks import jsonl_format, paper_format
    from er_gym.tasks.paper_generator import read_generated, write_generator_tasks

    with bad_input():
        read = read_generated(suite) if Path(suite).is_dir() else _suite(suite)
        aside = read.set_aside
        found = select(read.tasks, task_ids=split(*task_ids), set_aside=aside)
        refuse_if_none(found, aside, f"{suite}: no task can be read")
        report_set_aside(suite, aside)
        doing(f"writing {out}")
        if out.name.endswith((".jsonl", ".jsonl.gz")):
            jsonl_format.write_tasks(out, found, force=force)
        elif out.suffix == ".json":
            paper_format.write_tasks(out, found, force=force)
        elif out.suffix:
            raise BadInput(f"{out}: give FILE.json, FILE.jsonl, FILE.jsonl.gz or a folder")
        else:
            write_generator_tasks(out, found, force=force)
    echo(f"{len(found)} tasks: {out}")


# -- parts ----------------------------------------------------------------------------------------


def _suite(name: str) -> Suite:
    """A suite by its name, or a task file."""
    from er_gym.tasks.suites import load_suite, suite_from_file, suite_names

    path = Path(name)
    doing(f"reading the tasks of {name}")
    if name in suite_names() or not (path.exists() or name.endswith((".json", ".jsonl", ".gz"))):
        return load_suite(name)
    return suite_from_file(path)
