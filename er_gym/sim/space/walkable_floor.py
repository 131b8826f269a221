"""Where the agent can stand: where its capsule touches nothing, near what the record shows it on.

AI2-THOR walks a capsule about and lists where it gets to. Here the capsule is tested against the
parts of things (:mod:`er_gym.sim.space.footprints`). Walls are not objects, so how far free floor
goes on is not known; it is taken to end a little beyond the recorded positions, whose grid of
0.25 m leaves out what lies between its points and the furniture. Recorded positions are floor
whatever overlaps them. docs/fidelity.md has the comparison with AI2-THOR.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import Scene, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.footprints import RADIUS, Footprints
from er_gym.sim.space.recorded_floor import RECORDED_STEP, Cells, recorded_cells
from er_gym.sim.world import World

CELL = 0.025
"""Side of the cells that the floor is cut into, metres."""
_TOUCH = 0.01
"""How deep in a part the agent's middle can be and count as beside it, metres."""

Bitmap = NDArray[np.bool_]


class Rules(NamedTuple):
    """What the comparison with AI2-THOR's positions settled, metres (see docs/fidelity.md).

    Attributes:
        beyond: how far beyond the recorded floor free floor goes on.
        wall: how far from the edge of the scene's Floor the agent stays: that goes on under walls.
        slack: how much nearer to a box than its radius the body comes; recorded boxes are generous.
    """

    beyond: float = 0.45
    wall: float = 0.28
    slack: float = 0.012


@dataclass(frozen=True)
class Floor:
    """Where the agent can stand and walk, as bitmaps of cells of 2.5 cm.

    Attributes:
        origin: (2,) x and z of the middle of cell [0, 0], metres.
        free: (X, Z) bool, where it can stand. The outermost cells are not free.
        passable: (X, Z) bool, the same and the ways between neighbouring recorded positions.
        certain: (X, Z) bool, the free floor that the record shows.
    """

    origin: NDArray[np.float64]
    free: Bitmap
    passable: Bitmap
    certain: Bitmap

    def contains(self, points: NDArray[np.float64]) -> Bitmap:
        """Which of (..., 2) x, z points the agent can stand on, to within 1.3 cm."""
        return self._look_up(self.free, points)

    def is_certain(self, points: NDArray[np.float64]) -> Bitmap:
        """Which of (..., 2) x, z points are on floor that the record shows."""
        return self._look_up(self.certain, points)

    def path_is_clear(self, start: NDArray[np.float64], end: NDArray[np.float64]) -> bool:
        """Whether the agent can go straight from one (2,) x, z point to another, and stand there.

        The start itself is not asked about: whoever was forced into furniture can step out of it.
        """
        count = max(2, int(np.ceil(np.linalg.norm(end - start) / CELL)) + 1)
        way = start + np.linspace(0.0, 1.0, count)[1:, None] * (end - start)
        on_the_way = self._look_up(self.passable, way[:-1]).all()
        return bool(on_the_way and self.contains(end))

    def nearest_free(self, point: NDArray[np.float64], error: float) -> tuple[int, int] | None:
        """The free cell nearest to a (2,) point; None if the nearest is farther off than an error.

        Half a cell is none.
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
        """(G, 2) x, z places on a grid, sorted: what one gets to from the recorded floor.

        Args:
            step: of the grid, metres. offset: x and z of any of its points.
        """
        high = self.origin + np.array(self.free.shape) * CELL
        axes = [
            np.arange(np.ceil((low - by) / step), np.floor((top - by) / step) + 1) * step + by
            for low, top, by in zip(self.origin, high, offset, strict=True)
        ]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        on = self.contains(points)
        if step < RECORDED_STEP:  # between points farther apart, floor may be that no point is on
            on = connected(on & self.is_certain(points), on)
        return np.asarray(points[on].round(6))

    def _look_up(self, bitmap: Bitmap, points: NDArray[np.float64]) -> Bitmap:
        wide, deep = bitmap.shape
        if points.ndim == 1:  # one place, as at every step: ten times as fast
            (x, z), (west, south) = points.tolist(), self.origin.tolist()
            column = min(max(round((x - west) / CELL), 0), wide - 1)
            row = min(max(round((z - south) / CELL), 0), deep - 1)
            return np.asarray(bitmap[column, row])
        cells = np.clip(np.round((points - self.origin) / CELL), 0.0, (wide - 1, deep - 1))
        columns, rows = np.moveaxis(cells.astype(int), -1, 0)
        return np.asarray(bitmap[columns, rows])


def connected(seeds: Bitmap, on: Bitmap) -> Bitmap:
    """(X, Z) cells of ``on`` that one gets to from ``seeds``, which are on, by sides of cells."""
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
    """The floor of a recorded scene, as it is before anything is moved or opened."""
    return compute_floor(scene_name, Rules())


def compute_floor(scene_name: str, rules: Rules) -> Floor:
    """As :func:`floor_of`, with other rules; not cached."""
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
        passed = np.zeros_like(near)  # what the body sweeps on the recorded floor
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
    """(G, 2) x, z places of a scene where the agent can stand, on a grid; sorted, read-only.

    Args:
        step: of the grid, metres. offset: x and z of any of its points.
    """
    places = floor_of(scene_name).grid(step, offset)
    places.setflags(write=False)
    return places


def _stamped(
    prints: Footprints, origin: NDArray[np.float64], near: Bitmap, nodes: Bitmap
) -> tuple[Bitmap, Bitmap, Bitmap]:
    """Where, about the floor that is near, the body touches a part, and its middle is in one.

    The box of a part that a recorded position is in is wrong there: a round table's, a bent desk's.
    The third bitmap has such boxes; only so much of them is solid as the body does not pass through
    on the recorded floor.
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
    """Set the cells that are on in a bitmap whose cell [0, 0] has its middle at (2,) origin."""
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
    """The recorded floor on the lines of the recorded grid, one point of which is (2,) ``node``."""
    per_step = round(RECORDED_STEP / CELL)
    i, k = (
        np.arange(n) % per_step == at % per_step for n, at in zip(certain.shape, node, strict=True)
    )
    return np.asarray(certain & np.logical_or.outer(i, k))
