"""What tests of several packages make their cases with."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

from er_gym.tasks.task import KeyAction, Task, type_of_id
from er_gym.tasks.types import task_type

Play = Callable[..., list[dict[str, Any]]]
"""Plays texts in a task: the infos of reset and of each step, with reward, ended and cut."""


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
