"""Grids of points on boxes."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

_SPACING = 0.5
"""Distance between the points of large boxes, metres. Small boxes have three along each side."""
_MOST = 11
INSET, ROUND = 0.03, 0.2
"""How far inside a box's edges the outer points lie, as a fraction of its size: for furniture, and
for round objects, since the corners of their boxes are air."""


def surface_fractions(size: NDArray[np.float64], inset: float = INSET) -> NDArray[np.float64]:
    """(P, 3) points on the surface of a box of (3,) metres, as fractions of its size."""
    counts = np.clip(np.ceil(size / _SPACING) + 1, 3, _MOST).astype(int)
    return _surface_grid(inset, *counts.tolist())


@lru_cache(maxsize=1024)
def _surface_grid(inset: float, *counts: int) -> NDArray[np.float64]:
    axes = [np.linspace(inset, 1.0 - inset, count) for count in counts]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    on_surface = np.zeros(counts, dtype=bool)
    for axis in range(3):
        for face in (0, -1):
            on_surface[(slice(None),) * axis + (face,)] = True
    return grid[on_surface]


def points_on_top(box: NDArray[np.float64]) -> NDArray[np.float64]:
    """(P, 3) points on the upper face of a (2, 3) box, metres: a floor shows no other face."""
    return points_on_face(box, 1, 1)


def points_on_face(
    box: NDArray[np.float64],
    axis: int,
    sign: int,
    out: float = 0.0,
    spacing: float = _SPACING,
) -> NDArray[np.float64]:
    """(P, 3) points on one face of a (2, 3) box, or ``out`` metres in front of it."""
    low, high = box
    size = high - low
    along = [k for k in range(3) if k != axis]
    counts = np.clip(np.ceil(size[along] / spacing) + 1, 3, _MOST).astype(int)
    first, second = (np.linspace(INSET, 1.0 - INSET, count) for count in counts.tolist())
    shares = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)
    points = np.empty((len(shares), 3))
    points[:, along] = low[along] + shares * size[along]
    points[:, axis] = high[axis] + out if sign > 0 else low[axis] - out
    return points
