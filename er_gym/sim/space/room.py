"""How large a room is: AI2-THOR's ``sceneBounds``, which no record of objects holds.

Walls and ceilings are not objects. What is known is the Floor's box and what hangs on the walls;
the figures here are what 40 recorded bounds have in common (see docs/fidelity.md, with what is
missed).
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import SCENE_NUMBERS, load_scene

_HEADROOM = {"kitchens": 0.35, "living_rooms": 0.5, "bedrooms": 0.5, "bathrooms": 0.3}
"""From the top of the highest object to the top of the bounds, metres: the median by room kind."""
_UNDER_FLOOR = 0.2
"""From the bottom of the bounds to the floor that one stands on, metres."""
_STRAY_FLOOR = 0.3
_WALL = 0.1
"""In bathrooms the recorded floor may go on behind a wall: where it sticks out beyond every other
object by more than the first, the bounds end the second beyond those. Metres."""


@lru_cache(maxsize=128)
def room_box(scene_name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The lower and upper corner (3,) of a recorded scene, walls and ceiling included; metres."""
    scene = load_scene(scene_name)
    kind = next(k for k, numbers in SCENE_NUMBERS.items() if int(scene_name[9:]) in numbers)
    half = scene.aabb_size / 2
    # Upwards and outwards on all sides: the lower corner with its sign turned, then the upper.
    ends = np.stack([half - scene.aabb_center, half + scene.aabb_center])
    floor = scene.types.index("Floor")
    others = np.delete(ends, floor, axis=1).max(axis=1)
    ground = ends[:, floor]
    outer = np.maximum(ground, others)
    if kind == "bathrooms":
        outer = np.where(ground - others > _STRAY_FLOOR, others + _WALL, outer)
    outer[0, 1] = _UNDER_FLOOR - ground[1, 1]
    outer[1, 1] = others[1, 1] + _HEADROOM[kind]
    return -outer[0], outer[1]
