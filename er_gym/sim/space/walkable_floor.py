"""The floor that the agent can stand on.

AI2-THOR moves a capsule about and lists the positions that it reaches. Here the capsule is tested
against the parts of objects (:mod:`er_gym.sim.space.footprints`). Walls are not objects, so the
edge of the floor is not known. It is taken to lie a little beyond the recorded positions: their
grid of 0.25 m leaves a gap to the furniture. Recorded positions are floor, whatever overlaps them.
docs/fidelity.md compares the result with AI2-THOR's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import Scene, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.footprints import RADIUS, Footprints
from er_gym.sim.space.recorded_floor import RECORDED_STEP, Cells, recorded_cells
from er_gym.sim.world import World

CELL = 0.025
"""Side of a cell of the floor, metres."""
_TOUCH = 0.01
"""How deep inside an obstacle the agent's middle may be and still count as beside it, metres."""

Bitmap = NDArray[np.bool_]


class Rules(NamedTuple):
    """Constants that fit AI2-THOR's positions best, metres (see docs/fidelity.md).

    Attributes:
        beyond: how far the floor extends beyond the recorded floor.
        wall: how far the agent stays from the edge of the Floor object, which extends under walls.
        slack: how much nearer to a box than its radius the body comes; recorded boxes are generous.
    """

    beyond: float = 0.45
    wall: float = 0.28
    slack: float = 0.012


@dataclass(frozen=True)
class Floor:
    """The floor as bitmaps of cells of 2.5 cm.

    Attributes:
        origin: (2,) x and z of the middle of cell [0, 0], metres.
        free: (X, Z) bool, where the agent can stand. The outermost cells are not free.
        passable: (X, Z) bool, the free cells and the lines between neighbouring recorded positions.
        certain: (X, Z) bool, the free floor that the record proves.
    """

    origin: NDArray[np.float64]
    free: Bitmap
    passable: Bitmap
    certain: Bitmap

    def contains(self, points: NDArray[np.float64]) -> Bitmap:
        """Whether the agent can stand on each of (..., 2) x, z points, to within 1.3 cm."""
        return self._look_up(self.free, points)

    def has(self, x: float, z: float) -> bool:
        """Whether the agent can stand on one point: ten times as fast, for what every step asks."""
        return self._at(self.free, x, z)

    def is_certain(self, points: NDArray[np.float64]) -> Bitmap:
        """Whether each of (..., 2) x, z points is on floor that the record proves."""
        return self._look_up(self.certain, points)

    def path_is_clear(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> bool:
        """Whether the agent can move straight from one (2,) x, z point to another and stand there.

        The start is not tested, so that an agent that was forced into furniture can step out of it.
        """
        count = max(2, int(np.ceil(np.linalg.norm(end - start) / CELL)) + 1)
        way = start + np.linspace(0.0, 1.0, count)[1:, None] * (end - start)
        on_the_way = self._look_up(self.passable, way[:-1]).all()
        return bool(on_the_way and self.contains(end))

    def nearest_free(self, point: NDArray[np.float64], error: float) -> tuple[int, int] | None:
        """The free cell nearest to a (2,) point, None if it is farther away than ``error`` metres.

        A distance of up to one cell is always accepted.
        """
        cells = np.argwhere(self.free)
        away = np.linalg.norm(self.origin + cells * CELL - point, axis=1)
        nearest = int(away.argmin())
        if away[nearest] > max(error, CELL):
            return None
        column, row = cells[nearest].tolist()
        return column, row

    def paths_are_clear(self, starts: NDArray[np.float64], ends: NDArray[np.float64]) -> Bitmap:
        """(K,) :meth:`path_is_clear` of (K, 2) starts and ends, all equally far apart."""
        if not len(starts):
            return np.zeros(0, dtype=bool)
        count = max(2, int(np.ceil(np.linalg.norm(ends[0] - starts[0]) / CELL)) + 1)
        shares = np.linspace(0.0, 1.0, count)[1:-1, None]
        ways = starts[:, None] + shares * (ends - starts)[:, None]
        return np.asarray(self._look_up(self.passable, ways).all(axis=1) & self.contains(ends))

    def grid(self, step: float, offset: tuple[float, float]) -> NDArray[np.float64]:
        """(G, 2) x, z of the grid's nodes that can be reached from the recorded floor, sorted.

        Args:
            step: spacing of the grid, metres.
            offset: x and z of any node.
        """
        high = self.origin + np.array(self.free.shape) * CELL
        axes = [
            np.arange(np.ceil((low - by) / step), np.floor((top - by) / step) + 1) * step + by
            for low, top, by in zip(self.origin, high, offset, strict=True)
        ]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        on = self.contains(points)
        if step < RECORDED_STEP:  # a coarser grid may have no node on some floor
            on = connected(on & self.is_certain(points), on)
        return np.asarray(points[on].round(6))

    def _look_up(self, bitmap: Bitmap, points: NDArray[np.float64]) -> Bitmap:
        wide, deep = bitmap.shape
        if points.ndim == 1:
            return np.asarray(self._at(bitmap, *points.tolist()))
        cells = np.clip(np.round((points - self.origin) / CELL), 0.0, (wide - 1, deep - 1))
        columns, rows = np.moveaxis(cells.astype(int), -1, 0)
        return np.asarray(bitmap[columns, rows])

    def _at(self, bitmap: Bitmap, x: float, z: float) -> bool:
        wide, deep = bitmap.shape
        west, south = self._corner
        column = min(max(round((x - west) / CELL), 0), wide - 1)
        row = min(max(round((z - south) / CELL), 0), deep - 1)
        return bool(bitmap[column, row])

    @cached_property
    def _corner(self) -> tuple[float, float]:
        west, south = self.origin.tolist()
        return west, south


def connected(seeds: Bitmap, on: Bitmap) -> Bitmap:
    """(X, Z) cells of ``on`` that are connected by their sides to ``seeds``, which are all on."""
    found, before = seeds.copy(), 0
    while (count := int(np.count_nonzero(found))) > before:
        before = count
        found[1:] |= found[:-1] & on[1:]
        found[:-1] |= found[1:] & on[:-1]
        found[:, 1:] |= found[:, :-1] & on[:, 1:]
        found[:, :-1] |= found[:, 1:] & on[:, :-1]
    return found


@lru_cache(maxsize=128)
def floor_of(scene_name: str) -> Floor:
    """The floor of a scene, before anything is moved or opened."""
    shell = load_scene(scene_name).shell
    if shell is not None:
        return Floor(shell.origin, shell.free, shell.free, shell.free)
    return compute_floor(scene_name, Rules())


def compute_floor(scene_name: str, rules: Rules) -> Floor:
    """The same with other rules; not cached."""
    scene = load_scene(scene_name)
    recorded = recorded_cells(scene_name, CELL)
    grown = recorded.grown(rules.beyond)
    origin, near = grown.origin - CELL, np.pad(grown.on, 1)
    certain, nodes = np.zeros_like(near), np.zeros_like(near)
    _lay(recorded, certain, origin)
    at = np.round((scene.reachable - origin) / CELL).astype(int)
    nodes[tuple(at.T)] = True
    prints = Footprints.of(World.load(scene, Settings()), rules.slack)
    touched, covered, bent = _stamped(prints, origin, near, nodes)
    if bent.any():
        passed = np.zeros_like(near)  # the area that the body covers on the recorded floor
        _lay(recorded.grown(RADIUS), passed, origin)
        _lay(Cells(origin, CELL, bent & ~passed).grown(RADIUS - _TOUCH), touched, origin)
    lines = _between_neighbours(certain, at[0])
    certain = certain & ~covered | nodes
    free = near & ~touched & _inside_walls(scene, rules.wall, origin, near.shape)
    free = connected(certain, free | certain)
    return Floor(origin, free, free | lines, certain)


@lru_cache(maxsize=512)
def standing_places(
    scene_name: str, step: float, offset: tuple[float, float] = (0.0, 0.0)
) -> NDArray[np.float64]:
    """(G, 2) x, z of the grid's nodes where the agent can stand in a scene; sorted, read-only.

    Args:
        step: spacing of the grid, metres.
        offset: x and z of any node.
    """
    places = floor_of(scene_name).grid(step, offset)
    places.setflags(write=False)
    return places


def _stamped(
    prints: Footprints, origin: NDArray[np.float64], near: Bitmap, nodes: Bitmap
) -> tuple[Bitmap, Bitmap, Bitmap]:
    """Three bitmaps: where the body touches an obstacle, where its middle is inside one, and bent
    ones.

    If a recorded position is inside an obstacle, the obstacle's box is wrong: the table is round,
    or the desk is bent. The third bitmap holds such boxes. They are solid only where the body does
    not pass on the recorded floor.
    """
    touched, covered, bent = (np.zeros_like(nodes) for _ in range(3))
    x, z = (west + np.arange(n) * CELL for west, n in zip(origin, nodes.shape, strict=True))
    low, high = ((corner - origin) / CELL for corner in prints.spans())
    first = np.clip(np.ceil(low), 0, nodes.shape).astype(int)
    last = np.clip(np.floor(high) + 1, 0, nodes.shape).astype(int)
    for q in np.flatnonzero((first < last).all(axis=1)).tolist():
        (x0, z0), (x1, z1) = first[q], last[q]
        if not near[x0:x1, z0:z1].any():
            continue
        gaps = prints.gaps(q, x[x0:x1, None], z[z0:z1])
        inside = gaps < -_TOUCH
        if (inside & nodes[x0:x1, z0:z1]).any():
            bent[x0:x1, z0:z1] |= inside
        else:
            covered[x0:x1, z0:z1] |= inside
            touched[x0:x1, z0:z1] |= gaps < prints.reach[q]
    return touched, covered, bent


def _lay(cells: Cells, over: Bitmap, origin: NDArray[np.float64]) -> None:
    """Switch on the cells in a bitmap whose cell [0, 0] has its middle at (2,) origin."""
    first = np.round((cells.origin - origin) / CELL).astype(int)
    (x0, z0), (x1, z1) = np.maximum(first, 0), np.minimum(first + cells.on.shape, over.shape)
    (i0, k0), (i1, k1) = (x0, z0) - first, (x1, z1) - first
    over[x0:x1, z0:z1] |= cells.on[i0:i1, k0:k1]


def _inside_walls(
    scene: Scene, wall: float, origin: NDArray[np.float64], shape: tuple[int, ...]
) -> Bitmap:
    floor = scene.types.index("Floor")
    half = scene.aabb_size[floor] / 2
    low, high = (scene.aabb_center[floor] - half)[[0, 2]], (scene.aabb_center[floor] + half)[[0, 2]]
    x, z = (o + np.arange(n) * CELL for o, n in zip(origin, shape, strict=True))
    inside: Bitmap = np.logical_and.outer(
        (x >= low[0] + wall) & (x <= high[0] - wall),
        (z >= low[1] + wall) & (z <= high[1] - wall),
    )
    return inside


def _between_neighbours(certain: Bitmap, node: NDArray[np.int64]) -> Bitmap:
    """The recorded floor on the lines of the recorded grid, one node of which is the cell (2,)
    ``node``."""
    per_step = round(RECORDED_STEP / CELL)
    i, k = (
        np.arange(n) % per_step == at % per_step for n, at in zip(certain.shape, node, strict=True)
    )
    return np.asarray(certain & np.logical_or.outer(i, k))
