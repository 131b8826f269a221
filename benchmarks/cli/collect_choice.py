"""What ``er-gym collect`` collects: the tasks, and the parts of the recipe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.cli.errors import BadInput

if TYPE_CHECKING:
    from agents.expert.recipe import Recipe
    from er_gym.tasks.resolve import ResolvedTasks
    from er_gym.tasks.suites import Suite


def source_of(
    name: str | None, tasks_file: Path | None, correct: Path | None
) -> tuple[Suite, dict[str, Any]]:
    """The suite with the tasks, and the environment in which they are played."""
    from er_gym.rollout.run_directory import RunDirectory
    from er_gym.tasks.suites import load_suite, suite_from_file, suite_names

    if name is not None and tasks_file is not None:
        raise BadInput("give --suite or --tasks-file, not both")
    if correct is None:
        if name is None and tasks_file is None:
            raise BadInput(f"give --suite (one of: {', '.join(suite_names())}) or --tasks-file")
        suite = load_suite(name) if name is not None else suite_from_file(_given(tasks_file))
        return suite, {"backend": "embedded", **suite.env}
    manifest = RunDirectory.open(correct).manifest
    if tasks_file is not None:
        suite = suite_from_file(tasks_file)
    else:
        suite = load_suite(name or manifest.suite)
    if suite.digest != manifest.suite_digest:
        raise BadInput(
            f"{correct} was played with other tasks than those of {suite.name}; give the --suite "
            f"or --tasks-file of that run, which was {manifest.suite}"
        )
    env = {key: value for key, value in manifest.env.items() if key not in ("obs_mode", "faults")}
    # Pictures are drawn at the suite's size, whatever the run's agent looked at.
    return suite, {**env, **{key: suite.env[key] for key in _SIZE if key in suite.env}}


_SIZE = ("width", "height")


def _given(path: Path | None) -> Path:
    assert path is not None
    return path


def chosen_tasks(suite: Suite, types: Sequence[str], scenes: Sequence[str]) -> Suite:
    """The suite with only the tasks that were asked for."""
    from er_gym.tasks.types import canonical_names

    wanted = set(canonical_names(types))
    there = {task.scene for task in suite.tasks}
    unknown = [scene for scene in scenes if scene not in there]
    if unknown:
        raise BadInput(f"{suite.name} has no task in {unknown[0]}; it plays in {len(there)} scenes")
    tasks = tuple(
        task
        for task in suite.tasks
        if (not wanted or task.type.name in wanted) and (not scenes or task.scene in scenes)
    )
    if not tasks:
        where = f" in {', '.join(scenes)}" if scenes else ""
        raise BadInput(f"{suite.name} has no task of the types {', '.join(sorted(wanted))}{where}")
    return replace(suite, tasks=tasks)


def fitted_tasks(suite: Suite, backend: str) -> ResolvedTasks:
    """The suite's tasks with the ids of their scenes; set aside are the faulty ones, too."""
    from er_gym.tasks.errors import summarise_set_aside
    from er_gym.tasks.resolve import resolve_tasks

    fitted = resolve_tasks(suite.tasks, backend)
    aside = (*suite.set_aside, *fitted.set_aside)
    if aside and not fitted.tasks:
        raise BadInput(f"{suite.name}: no task can be played: {summarise_set_aside(aside)}")
    return replace(fitted, set_aside=aside)


def chosen_recipe(name: str | None, parts: Sequence[str], kinds: Sequence[str]) -> Recipe:
    """The recipe, by default the paper's, with only the parts and kinds that were asked for."""
    from agents.expert.recipe import DEFAULT, load_recipe

    recipe = load_recipe(DEFAULT if name is None else name).only(parts)
    if not kinds:
        return recipe
    return recipe.model_copy(update={"parts": _of_kinds(recipe.parts, kinds)})


def _of_kinds(parts: Mapping[str, Any], kinds: Sequence[str]) -> dict[str, Any]:
    """The parts in which an expert plays these kinds, with no other kinds."""
    experts = [row for row in parts.values() if row.actor == "expert"]
    if not experts:
        raise BadInput(f"--kinds is for parts that an expert plays, not for {', '.join(parts)}")
    known = dict.fromkeys(kind for row in experts for kind in row.all_kinds)
    for kind in kinds:
        if kind not in known:
            raise BadInput(f"unknown kind {kind!r}; the recipe has: {', '.join(known)}")
    left = {}
    for name, row in parts.items():
        shares = {kind: share for kind, share in row.kinds.items() if kind in kinds}
        if any(shares.values()):
            left[name] = row.model_copy(update={"kinds": shares})
    return left
