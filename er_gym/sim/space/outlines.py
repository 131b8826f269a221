"""How far things are from the agent, as AI2-THOR measures it.

AI2-THOR looks for objects in an upright capsule around the agent: an object is within reach when
any part of it is no farther than the visibility distance, measured along the floor. Which of its
points is seen then does not matter: one sees the far end of a table by which one stands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.solids import Solid

_FLOOR = [0, 2]


@dataclass(frozen=True)
class Outlines:
    """The parts of K objects seen from above, each in the frame turned to its object's heading.

    Attributes:
        middle: (Q, 2) x and z that the corners of part q count from, world frame, metres.
        turn: (Q, 2) cosine and sine of its heading.
        low, high: (Q, 2) corners.
        first: (K,) the first part of each object.
    """

    middle: NDArray[np.float64]
    turn: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    first: NDArray[np.int64]

    @staticmethod
    def of(solids: Sequence[Solid]) -> Outlines:
        """The outlines of some shapes, each of one part or more."""
        counts = [len(solid.upright) for solid in solids]
        corners = np.concatenate([solid.upright for solid in solids])[:, :, _FLOOR]
        yaw = np.radians([solid.yaw for solid in solids])
        turn = np.stack([np.cos(yaw), np.sin(yaw)], axis=1)
        middle = np.array([solid.middle for solid in solids])[:, _FLOOR]
        return Outlines(
            np.repeat(middle, counts, axis=0),
            np.repeat(turn, counts, axis=0),
            corners[:, 0],
            corners[:, 1],
            np.cumsum([0, *counts[:-1]]),
        )

    def gaps(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """(P, K) metres along the floor from (P, 2) x, z positions to the objects."""
        away = positions[:, None] - self.middle
        cos, sin = self.turn.T
        own = np.stack(
            [away[..., 0] * cos - away[..., 1] * sin, away[..., 0] * sin + away[..., 1] * cos],
            axis=-1,
        )
        own -= np.clip(own, self.low, self.high)
        return np.asarray(
            np.minimum.reduceat(np.hypot(own[..., 0], own[..., 1]), self.first, axis=1)
        )
