"""Where further agents start.

AI2-THOR takes the places that the first agent reaches by steps of two grid lengths, the nearest
ones first, and leaves out the first five. Here places at which agents would overlap are left out
too.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

import numpy as np

from er_gym.sim.space.footprints import RADIUS
from er_gym.sim.space.walkable_floor import floor_of, standing_places

_DIRECTIONS = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
_LEFT_OUT = 5
"""The agent's own place and its four neighbours."""
_SHORTEST, _COARSE = 0.1, 0.25
"""The shortest steps, and those of the grid on which agents stand if no step leads on, metres."""
Place = tuple[float, float]


def start_places(scene_name: str, start: Place, grid: float, count: int) -> list[Place]:
    """The x and z of up to ``count`` further agents, metres; fewer if there is no room.

    Args:
        start: where the first agent stands.
        grid: the length of its steps, metres.
    """
    taken = [start]
    for place in _candidates(scene_name, start, max(2 * grid, _SHORTEST)):
        if len(taken) > count:
            break
        if all(np.hypot(place[0] - x, place[1] - z) >= 2 * RADIUS for x, z in taken):
            taken.append(place)
    return taken[1 : count + 1]


def _candidates(scene_name: str, start: Place, step: float) -> Iterator[Place]:
    places = _reached(scene_name, start, step)
    for _ in range(_LEFT_OUT):
        next(places, None)
    yield from places
    near = standing_places(scene_name, _COARSE)
    order = np.linalg.norm(near - start, axis=1).argsort(kind="stable")
    yield from ((x, z) for x, z in near[order].tolist())


def _reached(scene_name: str, start: Place, step: float) -> Iterator[Place]:
    """The places that are reached by steps from ``start``, the fewest steps first."""
    floor, todo, seen = floor_of(scene_name), deque([(0, 0)]), {(0, 0)}
    while todo:
        node = todo.popleft()
        here = np.array(start) + np.array(node) * step
        x, z = here.round(6).tolist()
        yield x, z
        for direction in _DIRECTIONS:
            on = node[0] + int(direction[0]), node[1] + int(direction[1])
            if on not in seen:
                seen.add(on)
                if floor.path_is_clear(here, here + step * direction):
                    todo.append(on)
