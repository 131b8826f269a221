"""Which object a type name stands for. Objects are given by their rows in a table."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from math import hypot

from er_gym.tasks.task import AgentPose, KeyAction, Task
from er_gym.thor import ObjectTable

TARGET, EXPLORE = "target", "explore"
POLICIES = (TARGET, EXPLORE)
"""``target`` looks at the task, as the paper does; ``explore`` never does."""


def select_for_task(
    task: Task,
    pending: Sequence[KeyAction],
    verb: str,
    candidates: Sequence[int],
    objects: ObjectTable,
) -> int:
    """The candidate that the task is about, else the first in scene order.

    Objects of key actions still to be done with this verb come first, then those of any key action
    to come, then the task's other objects.
    """
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
    """The nearest candidate that has not been visited, the nearest of all when all have been.

    Args:
        visited: ids of objects.
    """
    fresh = [row for row in candidates if objects.ids[row] not in visited] or candidates
    return min(fresh, key=lambda row: distance(objects, row, agent))


def distance(objects: ObjectTable, row: int, agent: AgentPose) -> float:
    """Horizontal distance from the agent to the middle of an object's box, metres."""
    x, _, z = objects.centre[row].tolist()
    return hypot(x - agent.x, z - agent.z)


def navigation_target(task: Task, goal: int, objects: ObjectTable) -> int:
    """Where going to an object leads.

    Going to a receptacle that does not open and holds one of the task's related objects means going
    to that object.
    """
    if objects.has["receptacle"][goal] and not objects.has["openable"][goal]:
        for object_id in task.related_objects:
            row = objects.row.get(object_id)
            if row is not None and row in objects.contents[goal]:
                return row
    return goal


def closed_container_of(goal: int, objects: ObjectTable) -> int | None:
    """The outermost closed receptacle that an object is in, None if it is in none."""
    shut = [
        parent
        for parent in objects.parents[goal]
        if objects.has["openable"][parent] and not objects.has["isOpen"][parent]
    ]
    return shut[-1] if shut else None
