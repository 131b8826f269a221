"""Shortest paths over the floor. Like AI2-THOR's, a path is the list of its corners."""

from __future__ import annotations

import heapq
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.walkable_floor import CELL, Floor, floor_of

_NEIGHBOURS = [
    (i, k, float(np.hypot(i, k))) for i in (-1, 0, 1) for k in (-1, 0, 1) if (i, k) != (0, 0)
]
Cell = tuple[int, int]


class ShortestPaths:
    """The shortest paths from one cell to all others.

    Args:
        floor: the floor that the agent walks on.
        start: a free cell.
    """

    def __init__(self, floor: Floor, start: Cell) -> None:
        self._floor = floor
        self._start = start
        self._free = floor.free
        self._length = np.full(floor.free.shape, np.inf)
        self._before: dict[Cell, Cell] = {}
        self._spread()

    def _spread(self) -> None:
        """Dijkstra's algorithm over the free cells. No free cell touches the edge of the bitmap."""
        length, free = self._length, self._free.tolist()
        reached = length.tolist()
        reached[self._start[0]][self._start[1]] = 0.0
        todo = [(0.0, self._start)]
        while todo:
            so_far, (i, k) = heapq.heappop(todo)
            if so_far > reached[i][k]:
                continue
            for di, dk, step in _NEIGHBOURS:
                x, z = i + di, k + dk
                # Two cells that touch only at a corner are not connected.
                if not (free[x][z] and free[x][k] and free[i][z]) or (
                    so_far + step >= reached[x][z]
                ):
                    continue
                reached[x][z] = so_far + step
                self._before[x, z] = (i, k)
                heapq.heappush(todo, (so_far + step, (x, z)))
        self._length = np.array(reached)

    def length_to(self, cell: Cell) -> float:
        """Length of the path to a cell, metres; infinite if there is no path."""
        return float(self._length[cell]) * CELL

    def corners(self, cell: Cell) -> list[Cell]:
        """The corners of the path to a cell, with its start and its end."""
        way = [cell]
        while way[-1] != self._start:
            way.append(self._before[way[-1]])
        way.reverse()
        found, at = [way[0]], 0
        while at < len(way) - 1:
            farthest = next(
                j for j in range(len(way) - 1, at, -1) if self._straight(way[at], way[j])
            )
            at = farthest
            found.append(way[at])
        return found

    def _straight(self, one: Cell, other: Cell) -> bool:
        count = 2 * max(abs(one[0] - other[0]), abs(one[1] - other[1])) + 1
        line = np.array(one) + np.linspace(0.0, 1.0, count)[:, None] * np.subtract(other, one)
        columns, rows = np.round(line).astype(int).T
        return bool(self._free[columns, rows].all())


@lru_cache(maxsize=64)
def shortest_paths_from(scene_name: str, start: Cell) -> ShortestPaths:
    """The shortest paths from a free cell of a scene's floor."""
    return ShortestPaths(floor_of(scene_name), start)


def shortest_path(
    scene_name: str, start: NDArray[np.float64], ends: NDArray[np.float64], error: float
) -> tuple[int, NDArray[np.float64]] | None:
    """The shortest path over the floor from one position to the nearest of several.

    Args:
        start: (2,) x and z, metres.
        ends: (E, 2) x and z, metres.
        error: how far these may be off the floor, metres.

    Returns:
        The index of the nearest end, and the path's (C, 2) corners; None if there is no path.
    """
    floor = floor_of(scene_name)
    first = floor.nearest_free(start, error)
    if first is None:
        return None
    paths = shortest_paths_from(scene_name, first)
    cells = [floor.nearest_free(end, error) for end in ends]
    lengths = [np.inf if cell is None else paths.length_to(cell) for cell in cells]
    if not lengths or not np.isfinite(min(lengths)):
        return None
    nearest = int(np.argmin(lengths))
    last = cells[nearest]
    assert last is not None  # its length is finite
    corners = floor.origin + np.array(paths.corners(last)) * CELL
    corners[0] = start
    if len(corners) == 1:
        corners = np.array([start, ends[nearest]])
    corners[-1] = ends[nearest]
    return nearest, corners
