"""Where the agent can stand on any grid: the walkable floor, less what furniture covers."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import load_scene
from er_gym.sim.space.walk import RECORDED_STEP, walkable_grid
from er_gym.sim.world import AGENT_HEIGHT, Settings, World

_LOWEST, _HIGHEST = 0.1, 1.5
"""What begins higher over the floor than the second, or ends lower than the first, is in nobody's
way; metres."""
_TOUCH = 0.01


@lru_cache(maxsize=512)
def standing_places(scene_name: str, step: float) -> NDArray[np.float64]:
    """(G, 2) x, z places of a scene where the agent can stand, on a grid of ``step`` metres.

    At the step of the record these are the recorded positions. On finer grids, which are filled in
    between them, places inside a part of the furniture are left out; a part that a recorded
    position lies in is taken to be wrong there. Read-only.
    """
    places = walkable_grid(scene_name, step)
    if step >= RECORDED_STEP:
        return places
    recorded = load_scene(scene_name).reachable
    covered = np.zeros(len(places), dtype=bool)
    for part in _parts_in_the_way(scene_name):
        if not _inside(recorded, part).any():
            covered |= _inside(places, part)
    free = places[~covered]
    free.setflags(write=False)
    return free


def _parts_in_the_way(scene_name: str) -> NDArray[np.float64]:
    """(Q, 2, 2) corners x, z of the parts of furniture that a body meets."""
    world = World.load(load_scene(scene_name), Settings())
    ground = world.agent.position[1] - AGENT_HEIGHT
    furniture = [
        world.shape(i).boxes
        for i, kind in enumerate(world.types)
        if kind != "Floor" and not world.has(i, "pickupable")
    ]
    parts = np.concatenate(furniture)
    met = (parts[:, 1, 1] > ground + _LOWEST) & (parts[:, 0, 1] < ground + _HIGHEST)
    return np.asarray(parts[met][:, :, [0, 2]])


def _inside(points: NDArray[np.float64], part: NDArray[np.float64]) -> NDArray[np.bool_]:
    return np.asarray(((points > part[0] + _TOUCH) & (points < part[1] - _TOUCH)).all(axis=1))
