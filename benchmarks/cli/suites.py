"""The tasks that a command's options name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from benchmarks.cli.errors import BadInput

if TYPE_CHECKING:
    from er_gym.tasks.errors import SetAsideTask
    from er_gym.tasks.resolve import ResolvedTasks
    from er_gym.tasks.suites import Suite


def suite_given(name: str | None, tasks_file: Path | None) -> Suite:
    """The suite of ``--suite`` or ``--tasks-file``.

    Raises:
        BadInput: both are given, or none.
        ValueError: there is no such suite, or the file holds none.
    """
    from er_gym.tasks.suites import load_suite, suite_from_file, suite_names

    if name is not None and tasks_file is not None:
        raise BadInput("give --suite or --tasks-file, not both")
    if tasks_file is not None:
        return suite_from_file(tasks_file)
    if name is None:
        raise BadInput(f"give --suite (one of: {', '.join(suite_names())}) or --tasks-file")
    return load_suite(name)


def fresh_suite(name: str | None, seed: int, workers: int) -> Suite:
    """The tasks that a suite's configuration gives for another seed.

    They are made once, in :func:`~er_gym.tasks.suites.suite_home`.

    Raises:
        BadInput: no suite is named.
        ValueError: er-gym has no such suite.
        click.exceptions.Exit: they could not be made; the reason has been printed.
    """
    from benchmarks.cli.generate import generate
    from er_gym.tasks.suites import suite_config, suite_from_file, suite_home

    if name is None:
        raise BadInput("--fresh needs --suite: it makes tasks as that suite's configuration says")
    config, file = suite_config(name), suite_home() / f"{name}-fresh-{seed}.jsonl.gz"
    if config.seed == seed:
        raise BadInput(f"--fresh {seed}: {name} itself has this seed; give another one")
    if not file.exists():
        asked = ["--suite", name, "--seed", str(seed), "--out", str(file)]
        code = generate.main([*asked, "--workers", str(workers)], standalone_mode=False)
        if code:
            raise click.exceptions.Exit(code)
    return replace(suite_from_file(file), env=config.env)


def chosen_tasks(suite: Suite, types: Sequence[str], scenes: Sequence[str]) -> Suite:
    """The suite with only the tasks of these types in these scenes; empty for any.

    Raises:
        BadInput: there are none.
    """
    from er_gym.tasks.types import canonical_names

    wanted = set(canonical_names(types))
    present = {task.scene for task in suite.tasks}
    unknown = [scene for scene in scenes if scene not in present]
    if unknown:
        raise BadInput(
            f"{suite.name} has no task in {unknown[0]}; it plays in {len(present)} scenes"
        )
    tasks = tuple(
        task
        for task in suite.tasks
        if (not wanted or task.type.name in wanted) and (not scenes or task.scene in scenes)
    )
    if not tasks:
        where = f" in {', '.join(scenes)}" if scenes else ""
        raise BadInput(f"{suite.name} has no task of the types {', '.join(sorted(wanted))}{where}")
    return replace(suite, tasks=tasks)


def fitted_tasks(suite: Suite, backend: str = "embedded") -> ResolvedTasks:
    """The suite's tasks with the ids of their scenes; set aside are the faulty ones, too.

    Those that come with er-gym fit the embedded engine as they are, so no room is looked at.

    Raises:
        BadInput: all are set aside.
    """
    from er_gym.tasks.resolve import ResolvedTasks, resolve_tasks
    from er_gym.tasks.suites import comes_with_er_gym

    if backend == "embedded" and comes_with_er_gym(suite):
        return ResolvedTasks(suite.tasks)
    fitted = resolve_tasks(suite.tasks, backend)
    set_aside = (*suite.set_aside, *fitted.set_aside)
    refuse_if_none(fitted.tasks, set_aside, f"{suite.name}: no task can be played")
    return replace(fitted, set_aside=set_aside)


def refuse_if_none(tasks: Sequence[object], set_aside: Sequence[SetAsideTask], what: str) -> None:
    """Raise BadInput, with the reasons, if every task is set aside."""
    from er_gym.tasks.errors import summarise_set_aside

    if set_aside and not tasks:
        raise BadInput(f"{what}: {summarise_set_aside(set_aside)}")
