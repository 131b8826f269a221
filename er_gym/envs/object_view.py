"""The objects in view, each with where it is: what a caption of the picture could say.

The observation ``objects`` is a row of numbers for each object type;
``env.unwrapped.details["object_views"]`` has the same in words, one :class:`ObjectView` for each
object in view.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from math import cos, radians, sqrt
from typing import Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from er_gym.tasks.task import AgentPose
from er_gym.thor.objects import KIND_OF, TYPES, ObjectTable

Side: TypeAlias = Literal["left", "ahead", "right"]
_AHEAD = 12.0
"""Degrees to either side of the view's axis that count as ahead."""
FEATURES = ("count", "sin", "cos", "distance", "open", "toggled")
"""The columns of the observation: how many objects of the type are in view; of the nearest one, the
sine and cosine of its bearing, its distance in tens of metres, whether it is open or switched on.
All are 0 for a type that is not in view."""
_COUNT_SCALE, _DISTANCE_SCALE = 10.0, 10.0


@dataclass(frozen=True)
class ObjectView:
    """An object in view.

    Attributes:
        object_id, object_type: AI2-THOR's.
        bearing: degrees from the direction in which the agent looks, clockwise: negative is left.
        distance: metres from the agent to the centre of the object's box, along the floor.
        on: the type of the innermost visible receptacle that it lies in or on, ``""`` for none.
        is_open: whether it is open; None if it cannot be opened.
        is_toggled: whether it is switched on; None if it has no switch.
    """

    object_id: str
    object_type: str
    bearing: float
    distance: float
    on: str = ""
    is_open: bool | None = None
    is_toggled: bool | None = None

    @property
    def side(self) -> Side:
        """Where it is in the picture."""
        if abs(self.bearing) <= _AHEAD:
            return "ahead"
        return "left" if self.bearing < 0 else "right"


def views_of_objects(
    objects: ObjectTable, visible: NDArray[np.bool_], pose: AgentPose
) -> tuple[ObjectView, ...]:
    """The objects in view without the held one and the floor, nearest first.

    Args:
        objects: the N objects of the scene.
        visible: (N,) AI2-THOR's ``visible``.
        pose: the agent's, metres and degrees in the world frame.
    """
    rows = [
        row
        for row in np.flatnonzero(visible).tolist()
        if row != objects.held and objects.type_of(row) != "Floor"
    ]
    east = objects.centre[rows, 0] - pose.x
    north = objects.centre[rows, 2] - pose.z
    distances = np.hypot(east, north).round(4)
    bearings = ((np.degrees(np.arctan2(east, north)) - pose.rotation + 180) % 360 - 180).round(3)
    found = []
    for row, bearing, distance in zip(rows, bearings.tolist(), distances.tolist(), strict=True):
        holders = (holder for holder in objects.parents[row] if visible[holder])
        holder = next((k for k in holders if objects.type_of(k) != "Floor"), None)
        found.append(
            ObjectView(
                object_id=objects.ids[row],
                object_type=objects.type_of(row),
                bearing=bearing,
                distance=distance,
                on="" if holder is None else objects.type_of(holder),
                is_open=_state(objects, "isOpen", "openable", row),
                is_toggled=_state(objects, "isToggled", "toggleable", row),
            )
        )
    return tuple(sorted(found, key=lambda each: (each.distance, each.object_id)))


def apart(one: ObjectView, other: ObjectView) -> float:
    """The distance between two objects of a view along the floor, metres."""
    angle = radians(one.bearing - other.bearing)
    square = one.distance**2 + other.distance**2 - 2 * one.distance * other.distance * cos(angle)
    return sqrt(max(square, 0.0))


def lies_elsewhere(object_type: str, place: str, views: Iterable[ObjectView]) -> bool:
    """Whether objects of a type are in view, and none lies in or on a type of place, as far as the
    view tells where they lie."""
    found = [view.on for view in views if view.object_type == object_type]
    return bool(found) and not {"", place} & {*found}


def nearest_to(goal: ObjectView, views: Iterable[ObjectView]) -> tuple[str, ...]:
    """The types of the objects of a view, those nearest to one of its objects first; that one's own
    type is the first."""
    nearest = sorted(views, key=lambda view: apart(goal, view))
    return tuple(dict.fromkeys(view.object_type for view in nearest))


def _state(objects: ObjectTable, state: str, ability: str, row: int) -> bool | None:
    return bool(objects.has[state][row]) if objects.has[ability][row] else None


def object_features(views: Sequence[ObjectView]) -> NDArray[np.float32]:
    """(T, len(FEATURES)) float32, -1 to 1, of views, the nearest first; see :data:`FEATURES`."""
    table = np.zeros((len(TYPES), len(FEATURES)), dtype=np.float32)
    for view in reversed(views):  # the nearest is written last
        row = table[KIND_OF[view.object_type]]
        angle = np.radians(view.bearing)
        row[0] = min(row[0] + 1 / _COUNT_SCALE, 1.0)
        row[1:] = (
            np.sin(angle),
            np.cos(angle),
            min(view.distance / _DISTANCE_SCALE, 1.0),
            bool(view.is_open),
            bool(view.is_toggled),
        )
    return table
