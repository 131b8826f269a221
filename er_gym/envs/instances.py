"""Which object a type name stands for."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from math import hypot
from typing import Any

from er_gym.envs.legality import Objects
from er_gym.tasks.task import KeyAction, Task

TARGET, EXPLORE = "target", "explore"
POLICIES = (TARGET, EXPLORE)
"""``target`` looks at the task, as the paper does; ``explore`` never does."""


def by_task(
    task: Task,
    pending: Sequence[KeyAction],
    verb: str,
    candidates: Sequence[str],
) -> str:
    """The candidate that the task is about, else the first in scene order.

    Objects of key actions still to be done with this verb come first, then those of any key action
    to come, then the task's other objects.
    """
    allowed = set(candidates)
    for object_id in _of_interest(task, pending, verb):
        if object_id in allowed:
            return object_id
    return candidates[0]


def _of_interest(task: Task, pending: Sequence[KeyAction], verb: str) -> Iterable[str]:
    yield from (action.object_id for action in pending if action.verb == verb)
    yield from (action.object_id for action in pending)
    for action in pending:
        yield from action.related_objects
    yield from (action.object_id for action in task.key_actions)
    yield from task.target_objects
    yield from task.related_objects


def nearest(
    candidates: Sequence[str],
    objects: Objects,
    agent: Mapping[str, float],
    visited: Collection[str] = (),
) -> str:
    """The nearest candidate that has not been visited, the nearest of all when all have been."""
    fresh = [c for c in candidates if c not in visited] or list(candidates)
    return min(fresh, key=lambda c: distance(objects[c], agent))


def distance(entry: Mapping[str, Any], agent: Mapping[str, float]) -> float:
    """Horizontal distance from the agent to the middle of an object's box, metres."""
    centre = entry["axisAlignedBoundingBox"]["center"]
    return hypot(centre["x"] - agent["x"], centre["z"] - agent["z"])


def redirected(task: Task, goal: str, objects: Objects) -> str:
    """Where going to an object leads.

    Going to a receptacle that does not open and holds one of the task's related objects means going
    to that object.
    """
    entry = objects[goal]
    if entry["receptacle"] and not entry["openable"]:
        held = set(entry["receptacleObjectIds"] or ())
        for object_id in task.related_objects:
            if object_id in held:
                return object_id
    return goal


def container_in_the_way(goal: str, objects: Objects) -> str:
    """The outermost closed receptacle that an object is in, "" if it is in none."""
    shut = [
        parent
        for parent in objects[goal]["parentReceptacles"] or ()
        if objects[parent]["openable"] and not objects[parent]["isOpen"]
    ]
    return shut[-1] if shut else ""
