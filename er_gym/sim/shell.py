"""What a house has besides its objects: rooms, the boxes of its walls, and the floor between them.

A recorded iTHOR room has no shell: what is known of its walls is estimated from its objects.
Lengths are metres, points (x, z), in AI2-THOR's frame.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Point = tuple[float, float]


@dataclass(frozen=True)
class Room:
    """A room of a house.

    Attributes:
        id: such as ``"room|2"``.
        category: "kitchens", "living_rooms", "bedrooms" or "bathrooms".
        polygon: its corners; all edges run along x or z.
    """

    id: str
    category: str
    polygon: tuple[Point, ...]

    def contains(self, x: NDArray[np.float64], z: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether points lie inside; the shapes of their coordinates must broadcast."""
        inside = np.zeros(np.broadcast(x, z).shape, dtype=bool)
        for (x0, z0), (x1, z1) in zip(
            self.polygon, (*self.polygon[1:], self.polygon[0]), strict=True
        ):
            if x0 == x1:  # a ray towards +x crosses the edges along z
                inside ^= (x < x0) & (z >= min(z0, z1)) & (z < max(z0, z1))
        return inside


@dataclass(frozen=True)
class Opening:
    """A hole in a wall.

    Attributes:
        glass: whether it is a window, which can be looked through and not walked through.
        axis: 0 if its wall is at one x, 1 if it is at one z.
        at: that coordinate.
        span: its ends along the other axis.
        heights: its lower and its upper edge.
    """

    glass: bool
    axis: int
    at: float
    span: tuple[float, float]
    heights: tuple[float, float]


@dataclass(frozen=True, eq=False)
class Shell:
    """The rooms, walls and floor of a house.

    Attributes:
        rooms: in the order of the house.
        openings: its open doors and its windows.
        walls: for the rows of wall objects, the (K, 2, 3) boxes that each consists of.
        ground, ceiling: heights.
        start: x, z and heading in degrees of the agent at the beginning.
        origin: (2,) x and z of the middle of cell [0, 0] of ``free``.
        free: (X, Z) cells of the floor on which the agent can stand (:mod:`er_gym.sim.space`).
    """

    rooms: tuple[Room, ...]
    openings: tuple[Opening, ...]
    walls: Mapping[int, NDArray[np.float64]]
    ground: float
    ceiling: float
    start: tuple[float, float, float]
    origin: NDArray[np.float64]
    free: NDArray[np.bool_]

    @property
    def category(self) -> str:
        """The kind of its first room."""
        return self.rooms[0].category

    @property
    def bounds(self) -> tuple[Point, Point]:
        """The lower and the upper corner of the rectangle around all rooms."""
        corners = np.array([corner for room in self.rooms for corner in room.polygon])
        (x0, z0), (x1, z1) = corners.min(axis=0).tolist(), corners.max(axis=0).tolist()
        return (x0, z0), (x1, z1)
