"""The points of a thing that are looked for when one asks whether it is visible."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

_SPACING = 0.5
"""Big boxes get a point about every so many metres, small ones three along each side."""
_MOST = 11
_INSET = 0.08
"""How far inside the box's faces the outer points lie, as a fraction of its size."""


def surface_fractions(size: NDArray[np.float64]) -> NDArray[np.float64]:
    """(P, 3) points on the surface of a box of (3,) metres, as fractions of its size."""
    counts = np.clip(np.ceil(size / _SPACING) + 1, 3, _MOST).astype(int)
    return _surface_grid(*counts.tolist())


@lru_cache(maxsize=1024)
def _surface_grid(*counts: int) -> NDArray[np.float64]:
    axes = [np.linspace(_INSET, 1.0 - _INSET, count) for count in counts]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    on_surface = np.zeros(counts, dtype=bool)
    for axis in range(3):
        for face in (0, -1):
            on_surface[(slice(None),) * axis + (face,)] = True
    return grid[on_surface]
