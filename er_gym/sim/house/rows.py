"""The rows of a scene's tables, one for each object of a house."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.house.assets import Asset, Part, asset
from er_gym.sim.house.schema import House, HouseObject
from er_gym.sim.house.walls import HALF, PlacedHole
from er_gym.sim.rotation import unity_rotation
from er_gym.sim.scene import PROPERTIES, STATES

FLOOR_ID = "Floor|+00.00|+00.00|+00.00"
"""The id of the floor: one object for all rooms."""
_UPRIGHT = 1.0
"""A fixed object at a quarter turn, to within so many degrees, has no oriented box."""
_CASING = 0.06
"""How far the casing of a door or a window reaches from the middle of its wall, metres."""


@dataclass(frozen=True)
class Row:
    """An object: what the columns of :class:`er_gym.sim.scene.Scene` say of it.

    Attributes:
        middle: (3,) of its box, which is its position.
        size: (3,) of its box in its own frame, metres.
        parent: the id of the object that the house puts it in.
    """

    id: str
    type: str
    middle: NDArray[np.float64]
    size: NDArray[np.float64]
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    asset: str = ""
    has: frozenset[str] = frozenset()
    states: frozenset[str] = frozenset()
    openness: float = 0.0
    mass: float = 0.0
    materials: tuple[str, ...] | None = None
    parent: str = ""

    @property
    def extent(self) -> NDArray[np.float64]:
        """(3,) size of its box along the world's axes, metres."""
        return np.asarray(np.abs(unity_rotation(self.rotation)) @ self.size).round(6)

    @property
    def obb(self) -> NDArray[np.float64]:
        """(4, 3) its oriented box, as scenes have it; not a number for fixed, upright objects."""
        x, y, z = self.rotation
        upright = abs((y + 45.0) % 90.0 - 45.0) < _UPRIGHT and not (x or z)
        if upright and not self.has & {"pickupable", "moveable"}:
            return np.full((4, 3), np.nan)
        return np.stack([-self.size / 2, *np.diag(self.size)])

    @property
    def flags(self) -> tuple[list[bool], list[bool]]:
        return [p in self.has for p in PROPERTIES], [s in self.states for s in STATES]


def floor_row(house: House, ground: float) -> Row:
    """The floor, under all rooms."""
    corners = np.array([corner for room in house.rooms for corner in room.polygon])
    low, high = corners.min(axis=0), corners.max(axis=0)
    x, z = ((low + high) / 2).tolist()
    wide, deep = (high - low).tolist()
    return Row(
        FLOOR_ID,
        "Floor",
        np.array([x, ground - 0.005, z]),
        np.array([wide, 0.01, deep]),
        has=frozenset({"receptacle"}),
    )


def object_rows(objects: Iterable[HouseObject]) -> Iterator[Row]:
    """The objects of a house, each followed by its parts."""
    for each in objects:
        kind = asset(each.asset)
        tilt_x, yaw, tilt_z = (angle % 360.0 for angle in each.rotation)
        turn = (_level(tilt_x), _level(yaw), _level(tilt_z))
        middle = np.array(each.position)
        yield Row(
            each.id,
            kind.type,
            middle,
            np.array(kind.size),
            turn,
            kind.id,
            kind.has,
            _states(each, kind),
            each.openness if "openable" in kind.has else 0.0,
            kind.mass,
            kind.materials or None,
            each.parent,
        )
        yield from _parts(each, kind.parts, middle, turn)


def _level(angle: float) -> float:
    """An angle that is nearly a quarter turn as that quarter turn: files have 270.0001."""
    nearest = round(angle / 90.0) * 90.0
    return nearest % 360.0 if abs(angle - nearest) < 0.01 else angle


def _states(each: HouseObject, kind: Asset) -> frozenset[str]:
    found = {
        "isOpen": each.openness > 0.0 and "openable" in kind.has,
        "isToggled": each.on and "toggleable" in kind.has,
        "isDirty": each.dirty and "dirtyable" in kind.has,
    }
    return frozenset(name for name, holds in found.items() if holds)


def _parts(
    each: HouseObject,
    parts: Sequence[Part],
    middle: NDArray[np.float64],
    turn: tuple[float, float, float],
) -> Iterator[Row]:
    matrix = unity_rotation(turn)
    for k, part in enumerate(parts):
        yield Row(
            f"{each.id}|{part.type}_{k}",
            part.type,
            middle + matrix @ np.array(part.middle),
            np.array(part.size),
            turn,
            has=part.has,
        )


def hole_rows(holes: Iterable[PlacedHole]) -> Iterator[Row]:
    """The doors and windows, in the order of the holes."""
    for each in holes:
        wall, at = each.wall, each.wall.start[each.wall.axis]
        middle = np.zeros(3)
        middle[2 * wall.axis], middle[2 - 2 * wall.axis] = at, (each.low + each.high) / 2
        middle[1] = (each.bottom + each.top) / 2
        size = np.array([each.high - each.low, each.top - each.bottom, 2 * _CASING])
        yield Row(
            each.hole.id,
            each.hole.kind,
            middle,
            size,
            (0.0, each.yaw, 0.0),
            each.hole.asset,
            states=frozenset({"isOpen"} if each.hole.open and each.hole.kind == "Doorway" else ()),
            openness=1.0 if each.hole.open and each.hole.kind == "Doorway" else 0.0,
        )


def wall_row(ident: str, boxes: NDArray[np.float64]) -> Row:
    """A wall, around all of its boxes (K, 2, 3)."""
    low, high = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    return Row(ident, "Wall", (low + high) / 2, np.maximum(high - low, 2 * HALF))
