"""What the agent's body runs into: the parts of things, seen from above.

AI2-THOR tests an upright capsule of 0.2 m radius. Its ends are round, so it comes nearer to what is
low than to what is as high as its side.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.solids import Solid, solid_of
from er_gym.sim.world import World

RADIUS = 0.2
"""Of the agent's capsule, metres."""
_TOP = 1.75
"""Height of the top of the capsule over the floor, metres."""
_COUNTER_DEPTH = 0.7
"""Depth of the arms of a counter that bends, metres."""
_PANES = frozenset({"Window", "ShowerGlass"})
_PANE = 0.4
"""A pane whose box is thicker is bent or goes round a corner: its box is air, metres."""
_BOWL_WIDTH = 0.45
"""Width of a toilet's bowl, metres. The box of some holds the open lid, too."""


@dataclass(frozen=True)
class Footprints:
    """Q parts that stand in the way, each a rectangle in its own frame.

    Attributes:
        middle: (Q, 2) x and z of the rectangle's middle, world frame, metres.
        turn: (Q, 2) cosine and sine of its heading.
        half: (Q, 2) half its width and depth, metres.
        reach: (Q,) how near to it the agent's middle can come, metres.
    """

    middle: NDArray[np.float64]
    turn: NDArray[np.float64]
    half: NDArray[np.float64]
    reach: NDArray[np.float64]

    @staticmethod
    def of(world: World, slack: float = 0.0) -> Footprints:
        """All parts that the capsule, made ``slack`` metres thinner, meets on the floor."""
        parts = [
            (solid, part)
            for i, kind in enumerate(world.types)
            if kind != "Floor"
            for solid in (solid_of(world, i),)
            for part in _obstructing_parts(kind, solid)
        ]
        boxes = np.array([part for _, part in parts])
        centres = np.array([solid.middle for solid, _ in parts])
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
        """Metres from points to part q; inside it, negative to its edge.

        Args:
            x, z: of the points, metres; of shapes that broadcast.
        """
        (dx, dz), (cos, sin) = self.middle[q], self.turn[q]
        x, z = x - dx, z - dz
        across = np.abs(x * cos - z * sin) - self.half[q, 0]
        along = np.abs(x * sin + z * cos) - self.half[q, 1]
        outside = np.hypot(np.maximum(across, 0.0), np.maximum(along, 0.0))
        return np.asarray(outside + np.minimum(np.maximum(across, along), 0.0))

    def spans(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lower and upper corners (Q, 2) of the area in which each part is in the way, metres."""
        cos, sin = np.abs(self.turn).T
        wide, deep = self.half.T
        out = np.stack([wide * cos + deep * sin, wide * sin + deep * cos], axis=1)
        out += self.reach[:, None]
        return self.middle - out, self.middle + out


def _reach(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """(Q,) how near the capsule's middle comes to parts from (Q,) heights to others; 0: over it."""
    below = np.clip(RADIUS - high, 0.0, RADIUS)
    above = np.clip(low - (_TOP - RADIUS), 0.0, RADIUS)
    inside = (high > 0.0) & (low < _TOP)
    away = np.sqrt(RADIUS**2 - np.maximum(below, above) ** 2)
    return np.where(inside, away, 0.0)


def _obstructing_parts(kind: str, solid: Solid) -> NDArray[np.float64]:
    """(K, 2, 3) corners of what is solid of a thing, about its middle, before its turn."""
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
    """Of parts (K, 2, 3) of a counter that bends, what is near its box's edges.

    Such a counter runs along walls, which are where its box ends. The parts are what the recorded
    positions, 0.25 m apart, leave over of the box; they reach too far into the room.
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
