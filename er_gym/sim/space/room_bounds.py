"""How large a room is: AI2-THOR's ``sceneBounds``, which no record of objects holds.

AI2-THOR encloses everything it draws; walls and ceilings are drawn but are not objects. What is
known is the Floor's box and what hangs on the walls: a room ends a wall's thickness beyond what
stands in it, and its ceiling is a little above the highest thing. The figures here are what 40
recorded bounds have in common (see docs/fidelity.md, with what is missed).
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import SCENE_NUMBERS, Scene, load_scene

_UNDER_FLOOR = 0.2
"""From the bottom of the bounds to the floor that one stands on, metres."""


class Slacks(NamedTuple):
    """How far the bounds are from what the record holds, metres.

    Attributes:
        wall: from the outermost object on a side to the outside of the wall.
        lintel: from the top of the highest window to the top of the ceiling.
        headroom: the same from the highest of all other things. Less than over a window: cabinets,
            curtains and shower heads reach higher up.
        storey: the least from the floor to the top of the ceiling in living rooms and bedrooms,
            which need hold nothing tall. The other kinds have cabinets or a shower.
    """

    wall: float = 0.1
    lintel: float = 0.45
    headroom: float = 0.35
    storey: float = 2.8


@lru_cache(maxsize=128)
def room_bounds(scene_name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The lower and upper corner (3,) of a recorded scene, walls and ceiling included; metres."""
    return estimate_bounds(load_scene(scene_name), Slacks())


def estimate_bounds(
    scene: Scene, slacks: Slacks
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """As :func:`room_bounds`, with other slacks; not cached."""
    half = scene.aabb_size / 2
    # Upwards and outwards on all sides: the lower corner with its sign turned, then the upper.
    ends = np.stack([half - scene.aabb_center, half + scene.aabb_center])
    floor = scene.types.index("Floor")
    ground = ends[:, floor]
    outer = np.delete(ends, floor, axis=1).max(axis=1) + slacks.wall
    number = int(scene.name.removeprefix("FloorPlan"))
    # A bathroom's floor goes on behind the walls (up to 2.3 m); elsewhere it ends with them.
    if number not in SCENE_NUMBERS["bathrooms"]:
        outer = np.maximum(outer, ground)
    above = [slacks.lintel if kind == "Window" else slacks.headroom for kind in scene.types]
    ceiling = (ends[1, :, 1] + above).max()
    if number in SCENE_NUMBERS["living_rooms"] or number in SCENE_NUMBERS["bedrooms"]:
        ceiling = max(ceiling, ground[1, 1] + slacks.storey)
    outer[:, 1] = _UNDER_FLOOR - ground[1, 1], ceiling
    return -outer[0], outer[1]
