"""Helpers that tests of several packages use for their cases."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

from er_gym.tasks.task import KeyAction, Task, type_of_id
from er_gym.tasks.types import task_type

Play = Callable[..., list[dict[str, Any]]]
"""Plays texts in a task: the infos of reset and of each step, with reward, ended and cut."""


def in_one_test(
    name: str, values: Iterable[Any]
) -> Callable[[Callable[..., None]], Callable[..., None]]:
    """``pytest.mark.parametrize`` for data: one test, whose argument takes each value in turn.

    Every value is tried, and the failure names all those that failed, each with its error. Use it
    where a case takes microseconds, so that a test of its own would cost more than what it checks.
    """
    cases = list(values)
    if not cases:
        raise ValueError(f"no values for {name}: a test of nothing cannot fail")

    def decorate(check: Callable[..., None]) -> Callable[..., None]:
        @functools.wraps(check)
        def test(**fixtures: Any) -> None:
            failed: dict[int, Exception] = {}
            for index, case in enumerate(cases):
                try:
                    check(**fixtures, **{name: case})
                except Exception as error:
                    failed[index] = error
            if failed:
                told = "\n".join(
                    f"{name}={cases[index]!r}: {type(error).__name__}: {error}"
                    for index, error in failed.items()
                )
                raise AssertionError(
                    f"{len(failed)} of {len(cases)} cases failed\n{told}"
                ) from next(iter(failed.values()))

        wanted = inspect.signature(check).parameters
        kept = [wanted[each] for each in wanted if each != name]
        test.__signature__ = inspect.Signature(kept)  # type: ignore[attr-defined]
        return test

    return decorate


def make_task(
    kind: str,
    *key_actions: tuple[str, str],
    instruction: str = "Do it.",
    scene: str = "FloorPlan1",
    **fields: Any,
) -> Task:
    """A task with key actions given as (verb, object id)."""
    keys = tuple(
        KeyAction(verb, object_id, type_of_id(object_id)) for verb, object_id in key_actions
    )
    return Task("test", task_type(kind), scene, instruction, (*keys, KeyAction("end")), **fields)


def no_directory(folder: Path) -> Path:
    return folder / "none" / "here"


def empty_directory(folder: Path) -> Path:
    return folder


def damaged_model(folder: Path) -> Path:
    (folder / "modules.json").write_text("[{", encoding="utf-8")
    return folder


NO_MODELS = (no_directory, empty_directory, damaged_model)
"""Each makes, in a folder, what is no model of sentence-transformers."""
