"""Checks of the options of ``reset``."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from er_gym.envs.arguments import short_repr
from er_gym.tasks.task import Task


def checked_options(options: Any) -> Mapping[str, Any]:
    """Check what ``reset(options=…)`` was given.

    Raises:
        ValueError: it is no mapping, it has an unknown option, or the task or scene is none.
    """
    if not isinstance(options, Mapping):
        raise ValueError(
            f"options at reset are {short_repr(options)}; give a dictionary such as "
            "{'scene': 'FloorPlan1'}"
        )
    unknown = sorted(short_repr(name) for name in options if name not in ("task", "scene", "suite"))
    if unknown:
        raise ValueError(f"unknown option {unknown[0]} at reset; there are: task, scene, suite")
    for name, kinds in (("task", Task | str), ("scene", str | Mapping)):
        if not isinstance(options.get(name), kinds | None) or options.get(name) == "":
            raise ValueError(
                f"option {name!r} at reset is {short_repr(options[name])}; give a "
                f"{'Task or its id' if name == 'task' else 'scene such as FloorPlan1, or a house'}"
            )
    return options
