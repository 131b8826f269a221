"""AI2-THOR's GetReachablePositions: the positions that the agent reaches by steps of one length.

AI2-THOR's agent walked to all recorded positions. So an agent that reaches one of them reaches all
that are on its grid, even where our boxes leave no gap.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import load_scene
from er_gym.sim.space.walkable_floor import Floor, floor_of

_STEPS = np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
_ON_GRID = 1e-4
"""How far from a node a recorded position may be and count as on the grid, metres."""
_OFF_GRID = 7
"""Decimals, in metres, to which two positions of one grid agree."""


class Grid:
    """A grid of positions with a given step, divided into connected parts.

    Args:
        floor: the floor that the agent walks on.
        recorded: (R, 2) x and z of positions that can all be reached from each other.
        step: spacing of the grid, metres.
        yaw: heading of its second axis, degrees clockwise from +z.
        offset: (right, ahead) coordinates of any node along the grid's axes, metres.
    """

    def __init__(
        self,
        floor: Floor,
        recorded: NDArray[np.float64],
        step: float,
        yaw: float,
        offset: tuple[float, float],
    ) -> None:
        self._floor = floor
        self._axes = _axes(yaw)
        self._step = step
        self._offset = np.array(offset)
        self._places: dict[tuple[int, int], NDArray[np.float64]] = {}
        nodes = self._nodes(recorded)
        self._recorded = nodes[np.abs(self.place(nodes) - recorded).max(axis=1) < _ON_GRID]

    def place(self, nodes: NDArray[np.int64]) -> NDArray[np.float64]:
        """(..., 2) x and z, metres, of (..., 2) nodes."""
        return np.asarray((nodes * self._step + self._offset) @ self._axes)

    def node(self, place: NDArray[np.float64]) -> tuple[int, int]:
        """The node at (2,) x and z."""
        right, ahead = self._nodes(place).tolist()
        return right, ahead

    def _nodes(self, places: NDArray[np.float64]) -> NDArray[np.int64]:
        """(..., 2) nodes nearest to (..., 2) x and z."""
        along = places @ self._axes.T - self._offset
        return np.asarray((along / self._step).round().astype(np.int64))

    def reachable_from(self, start: NDArray[np.float64]) -> NDArray[np.float64]:
        """(P, 2) x and z of the positions that can be reached from (2,) ``start``, itself included.

        They are sorted and read-only.
        """
        first = self.node(start)
        if first not in self._places:
            nodes = self._flood(first)
            places = self.place(nodes).round(6)
            places = places[np.lexsort(places.T[::-1])]
            places.setflags(write=False)
            if self._floor.contains(start):  # off the floor there may be no way back
                self._places.update(dict.fromkeys(map(tuple, nodes.tolist()), places))
            else:
                self._places[first] = places
        return self._places[first]

    def _flood(self, first: tuple[int, int]) -> NDArray[np.int64]:
        seen = {first}
        found = self._spread(np.array([first]), seen)
        recorded = set(map(tuple, self._recorded.tolist()))
        missed = sorted(recorded - seen)
        if missed and len(missed) < len(recorded):
            seen.update(missed)
            found = np.concatenate([found, self._spread(np.array(missed), seen)])
        return found

    def _spread(self, frontier: NDArray[np.int64], seen: set[tuple[int, int]]) -> NDArray[np.int64]:
        """The nodes of the frontier, and all new nodes that can be reached from them."""
        found = [frontier]
        while len(frontier):
            ends = (frontier[:, None] + _STEPS).reshape(-1, 2)
            starts = np.repeat(frontier, len(_STEPS), axis=0)
            new = np.array([end not in seen for end in map(tuple, ends.tolist())])
            ends, starts = ends[new], starts[new]
            clear = self._floor.paths_are_clear(self.place(starts), self.place(ends))
            frontier = np.unique(ends[clear], axis=0)
            seen.update(map(tuple, frontier.tolist()))
            found.append(frontier)
        return np.concatenate(found)


def _axes(yaw: float) -> NDArray[np.float64]:
    """(2, 2) x and z of the directions to the right and ahead."""
    sin, cos = np.sin(np.radians(yaw)), np.cos(np.radians(yaw))
    return np.array([(cos, -sin), (sin, cos)])


@lru_cache(maxsize=256)
def _grid(scene_name: str, step: float, yaw: float, offset: tuple[float, float]) -> Grid:
    return Grid(floor_of(scene_name), load_scene(scene_name).reachable, step, yaw, offset)


def reachable_positions(
    scene_name: str, start: NDArray[np.float64], step: float, yaw: float = 0.0
) -> NDArray[np.float64]:
    """(P, 2) x and z of the positions that the agent reaches from (2,) ``start``.

    Args:
        step: of the grid, metres.
        yaw: direction of the steps, degrees clockwise from +z; steps across it count as well.
    """
    turned = round(yaw % 90.0, 3)  # a quarter turn gives the same grid
    along = start @ _axes(turned).T
    right, ahead = ((along % step).round(_OFF_GRID) % step).tolist()
    return _grid(scene_name, step, turned, (right, ahead)).reachable_from(start)
