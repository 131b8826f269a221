"""The floor that the record proves: the recorded positions and the area between them.

AI2-THOR's agent walked to the recorded positions, on a grid of 0.25 m. It passes freely between
neighbours. So three things are floor, whatever boxes overlap them: the positions, the segments
between neighbours, and the squares whose four corners are recorded.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import load_scene

RECORDED_STEP = 0.25
"""Spacing of the recorded positions, metres."""


@dataclass(frozen=True)
class Cells:
    """A bitmap over the floor.

    Attributes:
        origin: (2,) x and z of the middle of cell [0, 0], metres.
        side: of a cell, metres.
        on: (X, Z) bool.
    """

    origin: NDArray[np.float64]
    side: float
    on: NDArray[np.bool_]

    def grown(self, radius: float) -> Cells:
        """The cells that a disc of ``radius`` metres covers when its middle moves over all cells
        that are on."""
        reach = int(radius / self.side + 1e-9)
        wide, deep = self.on.shape
        found = np.zeros((wide + 2 * reach, deep + 2 * reach), dtype=bool)
        # Add one row of the disc at a time: the cells within `half` along z of a cell that is on.
        counts = np.zeros((wide, deep + 2 * reach + 1), dtype=np.int16)
        counts[:, reach + 1 : reach + 1 + deep] = self.on
        counts = np.cumsum(counts, axis=1, dtype=np.int16)
        counts = np.pad(counts, ((0, 0), (reach, reach)), mode="edge")
        for dx in range(-reach, reach + 1):
            half = int(np.sqrt((radius / self.side + 1e-9) ** 2 - dx * dx))
            first = reach - half
            last = first + 2 * half + 1
            width = deep + 2 * reach
            rows = counts[:, last : last + width] > counts[:, first : first + width]
            found[reach + dx : reach + dx + wide] |= rows
        return Cells(self.origin - reach * self.side, self.side, found)


@lru_cache(maxsize=256)
def recorded_cells(scene_name: str, side: float) -> Cells:
    """The proven floor of a recorded scene, in cells that divide the recorded step evenly."""
    per_step = round(RECORDED_STEP / side)
    nodes = np.round(load_scene(scene_name).reachable / RECORDED_STEP).astype(int)
    low = nodes.min(axis=0) - 1
    at = np.zeros(nodes.max(axis=0) - low + 2, dtype=bool)
    at[tuple((nodes - low).T)] = True
    on = np.zeros(np.array(at.shape) * per_step, dtype=bool)
    along_x = at[:-1] & at[1:]
    along_z = at[:, :-1] & at[:, 1:]
    full = along_x[:, :-1] & along_x[:, 1:]
    for between, span_x, span_z in (
        (at, 1, 1),
        (along_x, per_step + 1, 1),
        (along_z, 1, per_step + 1),
        (full, per_step + 1, per_step + 1),
    ):
        for i, k in np.argwhere(between) * per_step:
            on[i : i + span_x, k : k + span_z] = True
    return Cells(low * RECORDED_STEP, RECORDED_STEP / per_step, on)
