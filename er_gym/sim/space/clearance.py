"""Whether a thing runs into anything where it is wanted, or on its way along."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.room_bounds import room_bounds
from er_gym.sim.space.solids import solid_of
from er_gym.sim.world import World

_SKIN = 0.02
"""Boxes may overlap by this much, metres: recorded ones are generous."""
_STEP = 0.025
"""Between the places at which a way is looked at, metres."""
_FLOOR = [0, 2]


class Clearance:
    """What object i, with what lies in it, may run into.

    Args:
        ignored: rows of what it may pass through, besides itself and what it lies in or on.
    """

    def __init__(self, world: World, i: int, ignored: tuple[int, ...] = ()) -> None:
        aside = {i, *world.inside(i), *world.ancestors(i), *ignored, *world.of_type("Floor")}
        rows = [k for k in np.flatnonzero(world.exists).tolist() if k not in aside]
        parts = [solid_of(world, k).boxes for k in rows]
        self._boxes = np.concatenate([np.empty((0, 2, 3)), *parts])
        self._whose = np.repeat(rows, [len(part) for part in parts]).astype(int)
        self._room = room_bounds(world.scene.name)
        self._ids = world.object_ids
        self._low, self._high = world.low[i].copy(), world.high[i].copy()
        # What it overlaps already, by the record, is not in its way.
        self._beside = ~self._overlaps(np.zeros(3))

    def _overlaps(self, offset: NDArray[np.float64]) -> NDArray[np.bool_]:
        low, high = self._low + offset + _SKIN, self._high + offset - _SKIN
        high = np.maximum(low + 1e-6, high)  # of what is thinner than that, the lower side
        return np.asarray(((self._boxes[:, 0] < high) & (self._boxes[:, 1] > low)).all(axis=1))

    def obstacle(self, offset: NDArray[np.float64], anew: bool = False) -> str | None:
        """What the thing runs into when shifted by (3,) metres: an id, "a wall", None for nothing.

        Args:
            anew: it is put there, not pushed: what it overlaps where it is now counts as well.
        """
        low, high = self._room
        if ((self._low + offset)[_FLOOR] < low[_FLOOR]).any() or (
            (self._high + offset)[_FLOOR] > high[_FLOOR]
        ).any():
            return "a wall"
        met = self._overlaps(offset)
        if not anew:
            met &= self._beside
        rows = self._whose[met]
        return self._ids[rows[0]] if len(rows) else None

    def way(self, ahead: NDArray[np.float64], reach: float) -> float:
        """How far it slides along a level (3,) direction until it touches something, metres."""
        for far in np.arange(_STEP, reach + _STEP / 2, _STEP):
            if self.obstacle(far * ahead) is not None:
                return float(far - _STEP)
        return reach
