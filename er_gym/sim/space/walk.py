"""Where the agent can stand.

The record is a set of positions on a 0.25 m grid from which AI2-THOR's agent, a capsule of 0.2 m
radius, touches nothing. Between neighbouring recorded positions the agent passes freely, so the
walkable floor is taken to be those positions, the segments between neighbours and the grid cells
with all four corners recorded. Furniture boxes are not consulted: boxes of L-shaped things cover
free floor, the record does not.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import load_scene

RECORDED_STEP = 0.25
"""Spacing of the recorded positions, metres."""
CELL = 0.05
"""Side of the cells that the floor is cut into, metres."""
_PER_STEP = round(RECORDED_STEP / CELL)


@dataclass(frozen=True)
class WalkableFloor:
    """The walkable floor as a bitmap of 5 cm cells.

    Attributes:
        origin: (2,) x and z of the centre of cell [0, 0], metres.
        exact: (X, Z) bool, the recorded positions and what lies between them.
        near: the same, grown by one cell: 5 cm of tolerance for grids that miss the recorded lines.
    """

    origin: NDArray[np.float64]
    exact: NDArray[np.bool_]
    near: NDArray[np.bool_]

    @staticmethod
    def from_recorded(positions: NDArray[np.float64]) -> WalkableFloor:
        """Build it from (P, 2) recorded x, z positions."""
        nodes = np.round(positions / RECORDED_STEP).astype(int)
        low = nodes.min(axis=0) - 1
        at = np.zeros(nodes.max(axis=0) - low + 2, dtype=bool)
        at[tuple((nodes - low).T)] = True
        exact = np.zeros(np.array(at.shape) * _PER_STEP, dtype=bool)
        along_x = at[:-1] & at[1:]
        along_z = at[:, :-1] & at[:, 1:]
        full = along_x[:, :-1] & along_x[:, 1:]
        for between, span_x, span_z in (
            (at, 1, 1),
            (along_x, _PER_STEP + 1, 1),
            (along_z, 1, _PER_STEP + 1),
            (full, _PER_STEP + 1, _PER_STEP + 1),
        ):
            for i, k in np.argwhere(between) * _PER_STEP:
                exact[i : i + span_x, k : k + span_z] = True
        padded = np.pad(exact, 1)
        near = np.zeros_like(exact)
        for dx in (0, 1, 2):
            for dz in (0, 1, 2):
                near |= padded[dx : dx + exact.shape[0], dz : dz + exact.shape[1]]
        return WalkableFloor(low * RECORDED_STEP, exact, near)

    def contains(self, points: NDArray[np.float64], *, tolerant: bool = True) -> NDArray[np.bool_]:
        """Which of (..., 2) x, z points can be stood on, to within 2.5 cm (tolerant: 7.5 cm)."""
        bitmap = self._near_framed if tolerant else self._exact_framed
        if points.shape in ((2,), (1, 2)):  # one place, as at every step: ten times as fast
            (x, z), (west, south) = points.ravel().tolist(), self.origin.tolist()
            i = min(max(round((x - west) / CELL), -1), self.exact.shape[0])
            k = min(max(round((z - south) / CELL), -1), self.exact.shape[1])
            return np.full(points.shape[:-1], bitmap[i, k])
        cells = np.round((points - self.origin) / CELL)
        cells = np.minimum(np.maximum(cells, -1.0), self.exact.shape).astype(int)
        return np.asarray(bitmap[cells[..., 0], cells[..., 1]])

    # With a frame of cells that are no floor: at the far ends, which index -1 finds too.

    @cached_property
    def _near_framed(self) -> NDArray[np.bool_]:
        return np.pad(self.near, (0, 1))

    @cached_property
    def _exact_framed(self) -> NDArray[np.bool_]:
        return np.pad(self.exact, (0, 1))

    def swept(self, radius: float) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """The cells that a disc of ``radius`` metres sweeps as its middle walks the floor.

        Returns:
            (2,) x and z of the centre of cell [0, 0], metres, and the bitmap of :data:`CELL` cells.
        """
        reach = int(radius / CELL)
        grown = np.zeros(np.array(self.exact.shape) + 2 * reach, dtype=bool)
        x_cells, z_cells = self.exact.shape
        for dx in range(-reach, reach + 1):
            for dz in range(-reach, reach + 1):
                if np.hypot(dx, dz) * CELL <= radius:
                    x, z = reach + dx, reach + dz
                    grown[x : x + x_cells, z : z + z_cells] |= self.exact
        return self.origin - reach * CELL, grown

    def path_is_clear(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> bool:
        """Whether the straight way between two (2,) x, z points stays on the walkable floor."""
        count = max(2, int(np.ceil(np.linalg.norm(end - start) / CELL)) + 1)
        way = start + np.linspace(0.0, 1.0, count)[1:, None] * (end - start)
        return bool(self.contains(way).all())

    def grid(self, step: float) -> NDArray[np.float64]:
        """The (G, 2) walkable points whose coordinates are multiples of ``step`` metres, sorted.

        At 0.25 m these are the recorded positions themselves.
        """
        low = self.origin
        high = low + np.array(self.exact.shape) * CELL
        xs, zs = (
            np.arange(np.ceil(low[axis] / step), np.floor(high[axis] / step) + 1) * step
            for axis in (0, 1)
        )
        points = np.stack(np.meshgrid(xs, zs, indexing="ij"), axis=-1).reshape(-1, 2)
        return points[self.contains(points, tolerant=step < RECORDED_STEP)]


@lru_cache(maxsize=128)
def walkable_floor(scene_name: str) -> WalkableFloor:
    """The walkable floor of a recorded scene."""
    return WalkableFloor.from_recorded(load_scene(scene_name).reachable)


@lru_cache(maxsize=512)
def walkable_grid(scene_name: str, step: float) -> NDArray[np.float64]:
    """(G, 2) walkable points of a scene on a grid of ``step`` metres; read-only."""
    grid = walkable_floor(scene_name).grid(step)
    grid.setflags(write=False)
    return grid
