"""The boxes that the walls of a house consist of, around its doors and windows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.house.schema import House, HouseError, HouseHole, HouseWall

HALF = 0.01
"""Half the thickness of a wall, metres: AI2-THOR's are as thin as paper."""
_SLACK = 0.05
"""How far a hole may stick out of its wall, metres."""
_LEAST = 1e-3


@dataclass(frozen=True)
class PlacedHole:
    """A door or a window in the world's frame.

    Attributes:
        wall: the wall that it is measured along.
        low, high: its ends along the wall's direction, x or z.
        bottom, top: its heights.
        yaw: the direction that its wall faces, degrees: into the room of that wall.
    """

    hole: HouseHole
    wall: HouseWall
    low: float
    high: float
    bottom: float
    top: float
    yaw: float


def placed_holes(house: House) -> tuple[PlacedHole, ...]:
    """The doors and windows of a house, in its order.

    Raises:
        HouseError: one is in no wall of the house, or sticks out of it.
    """
    walls = {wall.id: wall for wall in house.walls}
    return tuple(_placed(hole, walls.get(hole.walls[0])) for hole in house.holes if hole.walls)


def _placed(hole: HouseHole, wall: HouseWall | None) -> PlacedHole:
    if wall is None:
        raise HouseError(f"{hole.id}: there is no wall {hole.walls[0]!r}")
    along = 1 - wall.axis
    start, end = wall.start[along], wall.end[along]
    if hole.right > abs(end - start) + _SLACK or hole.left < -_SLACK:
        raise HouseError(
            f"{hole.id} sticks out of {wall.id}, which is {abs(end - start):.2f} m long"
        )
    sign = 1.0 if end > start else -1.0
    low, high = sorted((start + sign * hole.left, start + sign * hole.right))
    # Seen from inside, a room's walls follow one another clockwise seen from above.
    yaw = (90.0 if sign > 0 else 270.0) if wall.axis == 0 else (180.0 if sign > 0 else 0.0)
    return PlacedHole(hole, wall, low, high, wall.low + hole.low, wall.low + hole.high, yaw)


def wall_boxes(wall: HouseWall, holes: Iterable[PlacedHole]) -> NDArray[np.float64]:
    """(K, 2, 3) the boxes of a wall without the holes that are open, metres."""
    along = 1 - wall.axis
    start, end = sorted((wall.start[along], wall.end[along]))
    cuts = sorted(
        (max(each.low, start), min(each.high, end), each.bottom, each.top)
        for each in holes
        if each.hole.open and _is_in(each, wall)
    )
    boxes = [_box(wall, *piece) for piece in _pieces(start, end, wall.low, wall.high, cuts)]
    return np.array(boxes).reshape(-1, 2, 3)


def _is_in(hole: PlacedHole, wall: HouseWall) -> bool:
    """Whether a hole is in a wall: in that which it names, or in another at the same place."""
    at, own = wall.start[wall.axis], hole.wall.start[hole.wall.axis]
    along = 1 - wall.axis
    start, end = sorted((wall.start[along], wall.end[along]))
    near = wall.axis == hole.wall.axis and abs(at - own) < _SLACK
    return near and hole.low < end - _LEAST and hole.high > start + _LEAST


def _pieces(
    start: float,
    end: float,
    low: float,
    high: float,
    cuts: Sequence[tuple[float, float, float, float]],
) -> Iterator[tuple[float, float, float, float]]:
    """From and to along the wall, bottom and top of each solid piece."""
    at = start
    for left, right, bottom, top in cuts:
        if left > at + _LEAST:
            yield at, left, low, high
        if bottom > low + _LEAST:
            yield left, right, low, min(bottom, high)
        if top < high - _LEAST:
            yield left, right, max(top, low), high
        at = max(at, right)
    if end > at + _LEAST:
        yield at, end, low, high


def _box(wall: HouseWall, left: float, right: float, low: float, high: float) -> list[list[float]]:
    at, corners = wall.start[wall.axis], [[0.0, low, 0.0], [0.0, high, 0.0]]
    for corner, side, end in zip(corners, (-HALF, HALF), (left, right), strict=True):
        corner[2 * wall.axis], corner[2 - 2 * wall.axis] = at + side, end
    return corners
