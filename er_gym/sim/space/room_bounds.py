"""The size of a room: AI2-THOR's ``sceneBounds``, which is not part of the recorded data.

AI2-THOR's bounds enclose everything that it draws. It draws walls and ceilings, too, which are not
objects. The record has only the Floor's box and the objects on the walls. A room ends a wall's
thickness beyond its outermost objects, and its ceiling is a little above the highest one. The
constants here fit 40 recorded bounds (see docs/fidelity.md, also for the error).
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import SCENE_NUMBERS, Scene, load_scene

_UNDER_FLOOR = 0.2
"""Distance from the bottom of the bounds up to the floor, metres."""


class Slacks(NamedTuple):
    """Distances from recorded objects to the bounds, metres.

    Attributes:
        wall: from the outermost object on a side to the outside of the wall.
        lintel: from the top of the highest window to the top of the ceiling.
        headroom: from the highest other object to the top of the ceiling. It is less than over a
            window, because cabinets, curtains and shower heads reach higher.
        storey: the least height from the floor to the top of the ceiling in living rooms and
            bedrooms, which may hold nothing tall. The other rooms have cabinets or a shower.
    """

    wall: float = 0.1
    lintel: float = 0.45
    headroom: float = 0.35
    storey: float = 2.8


@lru_cache(maxsize=128)
def room_bounds(scene_name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lower and upper corner (3,) of a recorded scene with its walls and ceiling, metres."""
    return estimate_bounds(load_scene(scene_name), Slacks())


@lru_cache(maxsize=128)
def room_corners(scene_name: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The same as plain numbers, for what is asked at every step."""
    low, high = room_bounds(scene_name)
    return tuple(low.tolist()), tuple(high.tolist())


def estimate_bounds(
    scene: Scene, slacks: Slacks
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The same with other slacks; not cached. Those of a house are known."""
    if scene.shell is not None:
        (west, south), (east, north) = scene.shell.bounds
        low = (west, scene.shell.ground - _UNDER_FLOOR, south)
        return np.array(low), np.array((east, scene.shell.ceiling, north))
    half = scene.aabb_size / 2
    # The lower corner with its sign turned, then the upper one: both grow outwards.
    ends = np.stack([half - scene.aabb_center, half + scene.aabb_center])
    floor = scene.types.index("Floor")
    ground = ends[:, floor]
    outer = np.delete(ends, floor, axis=1).max(axis=1) + slacks.wall
    number = int(scene.name.removeprefix("FloorPlan"))
    # A bathroom's floor continues behind the walls (up to 2.3 m). Other floors end at the walls.
    if number not in SCENE_NUMBERS["bathrooms"]:
        outer = np.maximum(outer, ground)
    above = [slacks.lintel if kind == "Window" else slacks.headroom for kind in scene.types]
    ceiling = (ends[1, :, 1] + above).max()
    if number in SCENE_NUMBERS["living_rooms"] or number in SCENE_NUMBERS["bedrooms"]:
        ceiling = max(ceiling, ground[1, 1] + slacks.storey)
    outer[:, 1] = _UNDER_FLOOR - ground[1, 1], ceiling
    return -outer[0], outer[1]
