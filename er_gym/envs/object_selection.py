"""Selects the object that a type name stands for. Objects are rows of an ``ObjectTable``."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from math import hypot

from er_gym.tasks.task import AgentPose, KeyAction, Task
from er_gym.thor import ObjectTable

TARGET, EXPLORE = "target", "explore"
POLICIES = (TARGET, EXPLORE)
"""``target`` prefers the task's objects, as the paper does; ``explore`` ignores the task."""


def select_for_task(
    task: Task,
    pending: Sequence[KeyAction],
    verb: str,
    candidates: Sequence[int],
    objects: ObjectTable,
) -> int:
    """The candidate that matters most to the task, else the first in scene order.

    Objects of pending key actions with this verb come first, then objects of other pending key
    actions, then the task's other objects.

    Args:
        pending: the key actions not done yet.
        verb: what the agent does to the object.
        candidates: rows of objects, in scene order, at least one.
    """
    if len(candidates) == 1:
        return candidates[0]
    allowed = {objects.ids[row]: row for row in candidates}
    for object_id in _by_relevance(task, pending, verb):
        if object_id in allowed:
            return allowed[object_id]
    return candidates[0]


def _by_relevance(task: Task, pending: Sequence[KeyAction], verb: str) -> Iterable[str]:
    yield from (action.object_id for action in pending if action.verb == verb)
    yield from (action.object_id for action in pending)
    for action in pending:
        yield from action.related_objects
    yield from (action.object_id for action in task.key_actions)
    yield from task.target_objects
    yield from task.related_objects


def select_nearest(
    candidates: Sequence[int],
    objects: ObjectTable,
    agent: AgentPose,
    visited: Collection[str] = (),
) -> int:
    """The nearest candidate not visited yet, or the nearest of all if all have been visited.

    Args:
        candidates: rows of objects, at least one.
        agent: the agent's pose.
        visited: ids of the objects visited.
    """
    fresh = [row for row in candidates if objects.ids[row] not in visited] or candidates
    return min(fresh, key=lambda row: distance(objects, row, agent))


def distance(objects: ObjectTable, row: int, agent: AgentPose) -> float:
    """Horizontal distance from the agent to the middle of an object's box, metres."""
    x, _, z = objects.centre[row].tolist()
    return hypot(x - agent.x, z - agent.z)


def navigation_target(task: Task, goal: int, objects: ObjectTable) -> int:
    """The row of the object that the agent goes to when it navigates to ``goal``.

    If ``goal`` is a receptacle that does not open and holds one of the task's related objects, the
    agent goes to that object.
    """
    if objects.has["receptacle"][goal] and not objects.has["openable"][goal]:
        for object_id in task.related_objects:
            row = objects.row.get(object_id)
            if row is not None and row in objects.contents[goal]:
                return row
    return goal


def closed_container_of(goal: int, objects: ObjectTable) -> int | None:
    """The row of the outermost closed receptacle around an object, None if there is none."""
    shut = [
        parent
        for parent in objects.parents[goal]
        if objects.has["openable"][parent] and not objects.has["isOpen"][parent]
    ]
    return shut[-1] if shut else None
