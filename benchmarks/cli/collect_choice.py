"""What ``er-gym collect`` collects: the suite, and the parts of the recipe."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.cli.errors import BadInput
from benchmarks.cli.suites import suite_given

if TYPE_CHECKING:
    from agents.expert.recipe import Recipe
    from er_gym.tasks.suites import Suite


def source_of(
    name: str | None, tasks_file: Path | None, played: Path | None
) -> tuple[Suite, dict[str, Any]]:
    """The suite with the tasks, and the environment in which they are played.

    Args:
        name, tasks_file: what names the suite.
        played: the run whose tasks they are; None for no run.

    Raises:
        BadInput: the tasks of the run are not found, or the suite has others.
        ValueError: there is no such suite, or the file holds none.
    """
    from er_gym.rollout.run_directory import RunDirectory

    if played is None:
        suite = suite_given(name, tasks_file)
        return suite, {"backend": "embedded", **suite.env}
    manifest = RunDirectory.open(played).manifest
    try:
        suite = suite_given(name if name or tasks_file else manifest.suite, tasks_file)
    except ValueError as error:
        if name or tasks_file:
            raise
        raise BadInput(
            f"{played} was played with the tasks of {manifest.suite}, which are not found by that "
            f"name ({error}); give the --tasks-file or --suite of that run"
        ) from None
    if suite.digest != manifest.suite_digest:
        raise BadInput(
            f"{played} was played with other tasks than those of {suite.name}; give the --suite "
            f"or --tasks-file of that run, which was {manifest.suite}"
        )
    env = {key: value for key, value in manifest.env.items() if key not in ("obs_mode", "faults")}
    # Pictures are drawn at the suite's size, whatever the run's agent looked at.
    size = {key: suite.env[key] for key in ("width", "height") if key in suite.env}
    return suite, {**env, **size}


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
