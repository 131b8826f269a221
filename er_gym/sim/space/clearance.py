"""Whether an object would collide with anything at another place, or on a straight line."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.room_bounds import room_bounds
from er_gym.sim.space.solids import solid_of
from er_gym.sim.world import World

_SKIN = 0.02
"""Boxes may overlap by this much without a collision, metres: recorded boxes are generous."""
_STEP = 0.025
"""Distance between two tested places on the line, metres."""
_FLOOR = [0, 2]


class Clearance:
    """The obstacles for object i and its contents.

    Args:
        ignored: rows that it may pass through, besides itself and its receptacles.
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
        # Boxes that it already overlaps where it is are not obstacles: recorded boxes are rough.
        self._beside = ~self._overlaps(self._low, self._high)

    def _overlaps(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.bool_]:
        low, high = low + _SKIN, high - _SKIN
        high = np.maximum(low + 1e-6, high)  # a box thinner than that is tested at its lower side
        return np.asarray(((self._boxes[:, 0] < high) & (self._boxes[:, 1] > low)).all(axis=1))

    def obstacle(self, offset: NDArray[np.float64], placing: bool = False) -> str | None:
        """The obstacle that the object meets after a shift by (3,) metres.

        Args:
            placing: the object is put there and not pushed, so boxes that it overlaps now count as
                well.

        Returns:
            The obstacle's id, "a wall", or None if the place is free.
        """
        low, high = self._room
        if ((self._low + offset)[_FLOOR] < low[_FLOOR]).any() or (
            (self._high + offset)[_FLOOR] > high[_FLOOR]
        ).any():
            return "a wall"
        met = self._overlaps(self._low + offset, self._high + offset)
        return self._first(met if placing else met & self._beside)

    def met_by(self, low: NDArray[np.float64], high: NDArray[np.float64]) -> str | None:
        """The obstacle that the object newly meets in another box, (3,) corners in metres; None if
        there is none."""
        return self._first(self._overlaps(low, high) & self._beside)

    def _first(self, met: NDArray[np.bool_]) -> str | None:
        rows = self._whose[met]
        return self._ids[rows[0]] if len(rows) else None

    def on_the_way(self, offset: NDArray[np.float64]) -> str | None:
        """The obstacle that the object meets on a straight way of (3,) metres; None if there is
        none."""
        steps = max(1, int(np.ceil(np.linalg.norm(offset) / _STEP)))
        met = (self.obstacle(offset * (k + 1) / steps) for k in range(steps))
        return next((each for each in met if each is not None), None)

    def slide_distance(self, ahead: NDArray[np.float64], reach: float) -> float:
        """How far the object slides along a level (3,) direction until it meets an obstacle,
        metres."""
        for far in np.arange(_STEP, reach + _STEP / 2, _STEP):
            if self.obstacle(far * ahead) is not None:
                return float(far - _STEP)
        return reach
