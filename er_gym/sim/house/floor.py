"""The floor of a house on which the agent can stand."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import Scene
from er_gym.sim.settings import Settings
from er_gym.sim.shell import Shell
from er_gym.sim.space.footprints import RADIUS, Footprints
from er_gym.sim.space.walkable_floor import CELL, Rules
from er_gym.sim.world import World

Bitmap = NDArray[np.bool_]


def free_floor(scene: Scene, shell: Shell) -> tuple[NDArray[np.float64], Bitmap]:
    """(2,) the middle of cell [0, 0], and (X, Z) the cells where the agent can stand.

    The floor may consist of several parts that do not hang together.
    """
    (x0, z0), (x1, z1) = shell.bounds
    origin = np.floor(np.array([x0, z0]) / CELL) * CELL - CELL
    count = np.ceil((np.array([x1, z1]) - origin) / CELL).astype(int) + 2
    x, z = (o + np.arange(n) * CELL for o, n in zip(origin, count.tolist(), strict=True))
    free = np.zeros(count, dtype=bool)
    for room in shell.rooms:
        free |= room.contains(x[:, None], z)
    for opening in shell.openings:  # thresholds lie between rooms whose edges do not meet
        if not opening.glass:
            across = np.abs((x, z)[opening.axis] - opening.at) <= RADIUS
            along = (x, z)[1 - opening.axis]
            on = (opening.span[0] <= along) & (along <= opening.span[1])
            place: Bitmap = np.logical_and.outer(across, on)
            free |= place if opening.axis == 0 else place.T
    _stamp(free, Footprints.of(World.load(scene, Settings()), Rules().slack), origin, x, z)
    free[[0, -1]] = free[:, [0, -1]] = False
    return origin, free


def _stamp(
    free: Bitmap,
    prints: Footprints,
    origin: NDArray[np.float64],
    x: NDArray[np.float64],
    z: NDArray[np.float64],
) -> None:
    """Switch off the cells where the body would touch an obstacle."""
    low, high = ((corner - origin) / CELL for corner in prints.spans())
    first = np.clip(np.ceil(low), 0, free.shape).astype(int)
    last = np.clip(np.floor(high) + 1, 0, free.shape).astype(int)
    for q in np.flatnonzero((first < last).all(axis=1)).tolist():
        (i, k), (to_i, to_k) = first[q], last[q]
        gaps = prints.gaps(q, x[i:to_i, None], z[k:to_k])
        free[i:to_i, k:to_k] &= gaps >= prints.reach[q]


def part_with(free: Bitmap, cell: tuple[int, int]) -> Bitmap:
    """(X, Z) the free cells that hang together with one of them."""
    found = np.zeros_like(free)
    found[cell] = free[cell]
    before = 0
    while (count := int(np.count_nonzero(found))) > before:
        before = count
        found = _whole_runs(found, free)
        found = _whole_runs(found.T, free.T).T
    return found


def largest_part(free: Bitmap) -> Bitmap:
    """(X, Z) the largest part of the free floor that hangs together."""
    left, best = free.copy(), np.zeros_like(free)
    while np.count_nonzero(left) > np.count_nonzero(best):
        row, column = np.unravel_index(int(left.argmax()), left.shape)
        part = part_with(free, (int(row), int(column)))
        if np.count_nonzero(part) > np.count_nonzero(best):
            best = part
        left &= ~part
    return best


def _whole_runs(found: Bitmap, on: Bitmap) -> Bitmap:
    """The runs of cells along the second axis of which a cell has been found."""
    starts = on.copy()
    starts[:, 1:] &= ~on[:, :-1]
    runs = np.cumsum(starts).reshape(on.shape)
    hit = np.zeros(int(runs[-1, -1]) + 1, dtype=bool)
    hit[runs[found]] = True
    return on & hit[runs]
