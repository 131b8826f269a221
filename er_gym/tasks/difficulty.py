"""The difficulty of a task, measured from the task and its scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import dist
from typing import Any

from er_gym.tasks import verbs
from er_gym.tasks.task import Task, whole_id


@dataclass(frozen=True)
class Difficulty:
    """The difficulty of one task, measured along its key actions.

    Attributes:
        hidden_depth: the number of containers that must be opened.
        distractors: the number of other objects of the types that key actions name.
        distance: metres from the agent's first position through the objects to which it navigates,
            in straight lines on the floor plan between the centres of their bounding boxes, with
            every object where it is when the episode begins. Actual walks differ: furniture makes
            them longer, and stopping within reach makes them shorter.
        length: the number of key actions.
    """

    hidden_depth: int
    distractors: int
    distance: float
    length: int


def hidden_depth(task: Task) -> int:
    """The number of key actions that open something."""
    return sum(action.verb == verbs.OPEN for action in task.key_actions)


def length(task: Task) -> int:
    """The number of key actions, ``end`` included."""
    return len(task.key_actions)


def difficulty(
    task: Task, objects: Sequence[Mapping[str, Any]], start_xz: tuple[float, float]
) -> Difficulty:
    """Measure a task in its scene.

    A slice, which does not exist yet, counts as its whole. Other missing objects are ignored. The
    task must have the ids of the scene (:func:`~er_gym.tasks.resolve.resolve_task`).

    Args:
        task: the task.
        objects: ``event.metadata["objects"]`` when the episode begins.
        start_xz: x and z of the agent when the episode begins, metres, AI2-THOR's world frame.
    """
    there = {entry["objectId"]: entry for entry in objects}
    return Difficulty(
        hidden_depth=hidden_depth(task),
        distractors=_distractors(task, there),
        distance=_distance(task, there, start_xz),
        length=length(task),
    )


def _distractors(task: Task, there: Mapping[str, Mapping[str, Any]]) -> int:
    types = {action.actual_type for action in task.key_actions}
    acted_on = {_standing_for(action.object_id, there) for action in task.key_actions}
    return sum(
        entry["objectType"] in types and object_id not in acted_on
        for object_id, entry in there.items()
    )


def _distance(
    task: Task, there: Mapping[str, Mapping[str, Any]], start_xz: tuple[float, float]
) -> float:
    gone_to = [
        _standing_for(action.object_id, there)
        for action in task.key_actions
        if action.verb == verbs.NAVIGATE
    ]
    stops = [start_xz, *(_middle(there[object_id]) for object_id in gone_to if object_id)]
    return sum(dist(one, other) for one, other in pairwise(stops))


def _standing_for(object_id: str, there: Mapping[str, object]) -> str:
    """The id if the scene has it, else the id of the whole object, else ``""``."""
    return next((name for name in (object_id, whole_id(object_id)) if name in there), "")


def _middle(entry: Mapping[str, Any]) -> tuple[float, float]:
    center = entry["axisAlignedBoundingBox"]["center"]
    return center["x"], center["z"]
