"""How hard a task is, in figures that can be read off it and its scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import dist
from typing import Any

from er_gym.tasks import verbs
from er_gym.tasks.task import Task

_WHOLE = 4
"""How many parts of an id name the whole object: its type and three coordinates."""


@dataclass(frozen=True)
class Difficulty:
    """Figures of one task, all as the plan of its key actions has them.

    Attributes:
        hidden_depth: how many containers must be opened.
        distractors: how many other objects of the types that key actions name there are.
        distance: metres from the agent's first place to the first thing gone to, from there to the
            next, and so on: straight lines over the floor plan, from middle to middle, with
            everything where it is when the episode begins. Walks differ: furniture makes them
            longer, stopping within an arm's reach makes them shorter.
        length: how many key actions there are.
    """

    hidden_depth: int
    distractors: int
    distance: float
    length: int


def hidden_depth(task: Task) -> int:
    """How many times the key actions open something."""
    return sum(action.verb == verbs.OPEN for action in task.key_actions)


def length(task: Task) -> int:
    """How many key actions a task has, ``end`` among them."""
    return len(task.key_actions)


def difficulty(
    task: Task, objects: Sequence[Mapping[str, Any]], start_xz: tuple[float, float]
) -> Difficulty:
    """Measure a task in its scene.

    An object that is not there yet, such as a slice, stands where its whole stands; what is not
    there at all is passed over. Ids have to be spelled as the scene spells them
    (:func:`~er_gym.tasks.resolve.resolve_task`).

    Args:
        objects: ``event.metadata["objects"]`` when the episode begins.
        start_xz: x and z of the agent then, metres, AI2-THOR's world frame.
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
    """The id itself, else its whole's, if the scene has that; ``""`` where it has neither."""
    whole = "|".join(object_id.split("|")[:_WHOLE])
    return next((name for name in (object_id, whole) if name in there), "")


def _middle(entry: Mapping[str, Any]) -> tuple[float, float]:
    center = entry["axisAlignedBoundingBox"]["center"]
    return center["x"], center["z"]
