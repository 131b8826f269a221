"""The obstacles of the agent's body, seen from above.

AI2-THOR tests an upright capsule of 0.2 m radius. Its ends are round, so it comes nearer to low
obstacles than to high ones.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.solids import Solid, solid_of
from er_gym.sim.world import World

RADIUS = 0.2
"""Radius of the agent's capsule, metres."""
_TOP = 1.75
"""Height of the top of the capsule over the floor, metres."""
_COUNTER_DEPTH = 0.7
"""Depth of the arms of an L- or U-shaped counter, metres."""
_PANES = frozenset({"Window", "ShowerGlass"})
_PANE = 0.4
"""A pane with a thicker box is bent or goes round a corner, metres. Its box is mostly air."""
_BOWL_WIDTH = 0.45
"""Width of a toilet's bowl, metres. Some recorded boxes include the open lid."""


@dataclass(frozen=True)
class Footprints:
    """Q obstacles, each a rectangle in its own frame.

    Attributes:
        middle: (Q, 2) x and z of the rectangle's middle, world frame, metres.
        turn: (Q, 2) cosine and sine of its heading.
        half: (Q, 2) half its width and depth, metres.
        reach: (Q,) the least distance between it and the agent's middle, metres.
    """

    middle: NDArray[np.float64]
    turn: NDArray[np.float64]
    half: NDArray[np.float64]
    reach: NDArray[np.float64]

    @staticmethod
    def of(world: World, slack: float = 0.0) -> Footprints:
        """The obstacles on the floor of a world for a capsule that is ``slack`` metres thinner."""
        parts = [
            (solid, part)
            for i, kind in enumerate(world.types)
            if kind != "Floor"
            for solid in (solid_of(world, i),)
            for part in _obstructing_parts(kind, solid)
        ]
        boxes = np.array([part for _, part in parts]).reshape(-1, 2, 3)
        centres = np.array([solid.middle for solid, _ in parts]).reshape(-1, 3)
        yaw = np.radians([solid.yaw for solid, _ in parts])
        cos, sin = np.cos(yaw), np.sin(yaw)
        x, z = ((boxes[:, 0] + boxes[:, 1]) / 2)[:, [0, 2]].T
        middle = centres[:, [0, 2]] + np.stack([x * cos + z * sin, z * cos - x * sin], axis=1)
        low, high = (boxes[:, :, 1] + centres[:, None, 1] - world.ground).T
        reach = _reach(low, high) - slack
        met = reach > 0.0
        half = (boxes[:, 1] - boxes[:, 0])[:, [0, 2]] / 2
        return Footprints(middle[met], np.stack([cos, sin], axis=1)[met], half[met], reach[met])

    def gaps(self, q: int, x: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.float64]:
        """Metres from points to obstacle q; inside it, minus the distance to its edge.

        Args:
            x, z: coordinates of the points, metres; their shapes must broadcast.
        """
        (dx, dz), (cos, sin) = self.middle[q], self.turn[q]
        x, z = x - dx, z - dz
        across = np.abs(x * cos - z * sin) - self.half[q, 0]
        along = np.abs(x * sin + z * cos) - self.half[q, 1]
        outside = np.hypot(np.maximum(across, 0.0), np.maximum(along, 0.0))
        return np.asarray(outside + np.minimum(np.maximum(across, along), 0.0))

    def spans(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper corners (Q, 2) of the area that each obstacle blocks, metres."""
        cos, sin = np.abs(self.turn).T
        wide, deep = self.half.T
        out = np.stack([wide * cos + deep * sin, wide * sin + deep * cos], axis=1)
        out += self.reach[:, None]
        return self.middle - out, self.middle + out


def _reach(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """(Q,) how near the capsule's middle comes to obstacles between two heights (Q,); 0 if it
    passes."""
    below = np.clip(RADIUS - high, 0.0, RADIUS)
    above = np.clip(low - (_TOP - RADIUS), 0.0, RADIUS)
    inside = (high > 0.0) & (low < _TOP)
    away = np.sqrt(RADIUS**2 - np.maximum(below, above) ** 2)
    return np.where(inside, away, 0.0)


def _obstructing_parts(kind: str, solid: Solid) -> NDArray[np.float64]:
    """(K, 2, 3) corners of the parts that block the agent, about the solid's middle, before its
    turn."""
    if kind in _PANES and np.ptp(solid.upright[..., [0, 2]], axis=(0, 1)).min() > _PANE:
        return solid.upright[:0]
    if kind == "CounterTop" and len(solid.upright) > 1:
        return _arms(solid.upright)
    if kind == "Toilet":
        parts = solid.upright.copy()
        parts[:, :, 0] = np.where(
            parts[:, :, 1].min(axis=1, keepdims=True) <= parts[:, :, 1].min() + 1e-6,
            np.clip(parts[:, :, 0], -_BOWL_WIDTH / 2, _BOWL_WIDTH / 2),
            parts[:, :, 0],
        )
        return parts
    return solid.upright


def _arms(parts: NDArray[np.float64]) -> NDArray[np.float64]:
    """The strips of a bent counter's parts (K, 2, 3) that lie near the edges of its box.

    Such a counter runs along walls, and its box ends at them. Its parts are the area of the box
    that the recorded positions leave free. Those are 0.25 m apart, so the parts reach too far into
    the room.
    """
    low, high = parts[:, 0].min(axis=0), parts[:, 1].max(axis=0)
    strips = []
    for axis in (0, 2):
        for near_low in (True, False):
            strip = parts.copy()
            if near_low:
                strip[:, 1, axis] = np.minimum(strip[:, 1, axis], low[axis] + _COUNTER_DEPTH)
            else:
                strip[:, 0, axis] = np.maximum(strip[:, 0, axis], high[axis] - _COUNTER_DEPTH)
            strips.append(strip)
    found = np.concatenate(strips)
    return found[(found[:, 0] < found[:, 1]).all(axis=1)]
