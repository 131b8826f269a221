"""The heading of a fixed object's front.

For most types the front is AI2-THOR's own +z: that side of every recorded fridge, microwave, sofa,
dresser and desk faces the room. Drawers and cabinets do not follow this rule. Their front is the
side that faces the room, and a drawer has the front of the furniture that it is part of.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import load_scene

_BY_THE_ROOM = frozenset({"Drawer", "Cabinet"})
_HOSTS = frozenset({"Dresser", "SideTable", "Desk", "TVStand", "CoffeeTable"})
_TWO_SIDED = frozenset({"CoffeeTable"})
"""Types that stand in the open and have drawers on two sides."""
_MARGIN = 0.1
"""How far a drawer may stick out of its furniture, metres."""
_AT_THE_BACK = 0.2
"""A drawer that is nearer to the back of its furniture by this much opens there, metres."""
_DOUBT = 0.3
"""Two sides may each be the front if their distances to the floor differ by less, metres."""
_ASIDE = 3.0
"""A metre to the side counts as this many metres ahead."""
SIDES = ((1, 1), (0, 1), (1, -1), (0, -1))
"""World axis (0 x, 1 z) and sign of each side, by quarter turns of its heading from +z."""


@lru_cache(maxsize=128)
def facings(scene_name: str) -> NDArray[np.float64]:
    """(N,) recorded heading of each object's front, degrees; quarter turns for fixed objects."""
    scene = load_scene(scene_name)
    found = scene.rotation[:, 1].copy()
    if scene.shell is not None:  # its parts have the heading of what they are part of
        found.setflags(write=False)
        return found
    for i in np.flatnonzero(np.isnan(scene.obb[:, 0, 0])).tolist():
        quarters = round(scene.rotation[i, 1] / 90.0) % 4
        if scene.types[i] in _BY_THE_ROOM:
            quarters = _towards_the_room(scene_name, i, quarters)
        found[i] = quarters * 90.0
    found.setflags(write=False)
    return found


def _towards_the_room(scene_name: str, i: int, quarters: int) -> int:
    """Quarter turns of a drawer's or cabinet's front; ``quarters`` are those of its rotation."""
    scene = load_scene(scene_name)
    half = scene.aabb_size / 2
    low, high = scene.aabb_center - half, scene.aabb_center + half
    for j, kind in enumerate(scene.types):
        here = scene.aabb_center[i]
        inside = (low[j] - _MARGIN <= here).all() and (here <= high[j] + _MARGIN).all()
        if kind in _HOSTS and inside:
            front = round(float(scene.rotation[j, 1]) / 90.0) % 4
            if kind in _TWO_SIDED and _at_back(low[i], high[i], low[j], high[j], front):
                return (front + 2) % 4
            return front
    gaps = np.array([_gap(scene.reachable, low[i], high[i], *side) for side in SIDES])
    likely = np.flatnonzero(gaps < gaps.min() + _DOUBT).tolist()
    pose = scene.openable_poses.get(i)
    hints = [quarters] if pose is None else [round(pose.rotation / 90.0 + 2) % 4, quarters]
    return next((hint for hint in hints if hint in likely), int(gaps.argmin()))


def _at_back(
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    host_low: NDArray[np.float64],
    host_high: NDArray[np.float64],
    quarters: int,
) -> bool:
    """Whether a drawer is nearer to the back of its furniture than to its front."""
    axis, sign = SIDES[quarters]
    upper, lower = (host_high - high)[2 * axis], (low - host_low)[2 * axis]
    ahead, behind = (upper, lower) if sign > 0 else (lower, upper)
    return bool(behind < ahead - _AT_THE_BACK)


def _gap(
    reachable: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    axis: int,
    sign: int,
) -> float:
    """Metres from one side of a box to where the agent can stand; sideways counts more."""
    across, ahead = reachable[:, 1 - axis], reachable[:, axis]
    face = high[2 * axis] if sign > 0 else low[2 * axis]
    beyond = (ahead - face) * sign
    other = 2 * (1 - axis)
    aside = np.maximum(np.maximum(low[other] - across, across - high[other]), 0.0)
    there = beyond > 0.0
    gaps = np.hypot(beyond[there], _ASIDE * aside[there])
    return float(gaps.min(initial=np.inf))
