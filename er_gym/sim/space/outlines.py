"""The distance from the agent to objects, as AI2-THOR measures it.

AI2-THOR looks for objects in an upright capsule around the agent. An object is within reach when
any part of it is no farther than the visibility distance, measured along the floor. It does not
matter which of its points is seen: at one end of a table, the agent may see only the other end.
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
    """The parts of K objects seen from above, each in a frame with its object's heading.

    Attributes:
        middle: (Q, 2) x and z of the origin of part q's frame, world frame, metres.
        turn: (Q, 2) cosine and sine of its heading.
        low, high: (Q, 2) corners in that frame, metres.
        first: (K,) index of each object's first part.
    """

    middle: NDArray[np.float64]
    turn: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    first: NDArray[np.int64]

    @staticmethod
    def of(solids: Sequence[Solid]) -> Outlines:
        """The outlines of some solids, each of which has at least one part."""
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
        """(P, K) metres along the floor from positions (P, 2), x and z, to the objects."""
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
