"""A suite of two rooms, with pictures so small that drawing them costs nothing.

Its name, for ``--suite``, is ``small_suite:small``.
"""

from __future__ import annotations

from dataclasses import replace

from er_gym.tasks import jsonl_format
from er_gym.tasks.suites import Suite, load_suite

NAME = "small_suite:small"
SCENES = ("FloorPlan201", "FloorPlan401")


def small() -> Suite:
    """The benchmark's tasks in two rooms, with pictures of 64 x 36 pixels."""
    every = load_suite("er-1k")
    tasks = tuple(task for task in every.tasks if task.scene in SCENES)
    return replace(
        every,
        name=NAME,
        tasks=tasks,
        digest=jsonl_format.digest(tasks),
        env={**every.env, "width": 64, "height": 36},
    )
