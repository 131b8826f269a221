"""Where a line meets objects, as AI2-THOR's colliders stop it: at the boxes they are made of."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.rotation import unity_rotation
from er_gym.sim.space.solids import solid_of
from er_gym.sim.world import World

Floats = NDArray[np.float64]
_TINY = 1e-12


def entry(world: World, i: int, start: Floats, way: Floats) -> float:
    """How far along a line object i begins, as a multiple of ``way``; infinite if it is missed.

    Args:
        start, way: (3,) a point and a direction, world frame, metres.
    """
    solid = solid_of(world, i)
    turn = unity_rotation(np.array([0.0, solid.yaw, 0.0]))
    at, along = (start - solid.middle) @ turn, way @ turn
    along = np.where(np.abs(along) < _TINY, _TINY, along)
    ends = (solid.upright - at) / along
    enter, leave = ends.min(axis=1).max(axis=1), ends.max(axis=1).min(axis=1)
    hit = (enter <= leave) & (leave > 0.0)
    return float(np.maximum(enter[hit], 0.0).min(initial=np.inf))


def first_hit(
    world: World, rows: Iterable[int], start: Floats, way: Floats
) -> tuple[int | None, float]:
    """The first of some objects on a line, None if it meets none, and how far along it begins."""
    met = [(entry(world, i, start, way), i) for i in rows]
    far, row = min(met, default=(np.inf, -1))
    return (row, far) if np.isfinite(far) else (None, np.inf)
