"""From where an object can be interacted with: AI2-THOR's ``GetInteractablePoses``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.visibility import (
    in_frustum,
    lines_of_sight,
    sample_points,
    within_reach,
)
from er_gym.sim.world import Agent, World

HORIZONS = (-30.0, 0.0, 30.0, 60.0)
"""Camera tilts that AI2-THOR tries when none are asked for, degrees, down positive."""
_BATCH = 32
"""Positions that one call of the ray kernel looks from."""


def interactable_poses(
    world: World,
    i: int,
    positions: NDArray[np.float64],
    rotations: Sequence[float],
    horizons: Sequence[float],
    standings: Sequence[bool],
    max_poses: int | None = None,
) -> list[Agent]:
    """Poses from which object i is visible, hence can be interacted with.

    Args:
        positions: (P, 2) x and z where the agent may stand, tried in order.
        rotations, horizons: degrees. standings: whether to stand or crouch.
        max_poses: stop after so many.
    """
    settings = world.settings
    points, owners = sample_points(world, [i])
    directions = np.array([(r % 360.0, h) for r in rotations for h in horizons])
    found: list[Agent] = []
    for batch in range(0, len(positions), _BATCH):
        places = _standing_at(world, positions[batch : batch + _BATCH], standings)
        places = [p for p in places if _reaches(world, i, p)]
        if not places or not len(directions):
            continue
        eyes = np.array([place.camera for place in places])
        clear = lines_of_sight(world, eyes, [i], points, owners)
        clear &= within_reach(points, eyes[:, None], settings.visibility_distance)
        in_picture = in_frustum(
            (points - eyes[:, None])[:, None],
            directions[:, 0, None],
            directions[:, 1, None],
            settings.field_of_view,
            settings.width / settings.height,
        )
        for place, direction in np.argwhere((clear[:, None] & in_picture).any(axis=2)).tolist():
            rotation, horizon = directions[direction].tolist()
            found.append(replace(places[place], rotation=rotation, horizon=horizon))
            if max_poses is not None and len(found) >= max_poses:
                return found
    return found


def _standing_at(
    world: World, positions: NDArray[np.float64], standings: Sequence[bool]
) -> list[Agent]:
    y = world.agent.position[1]
    return [
        Agent(np.array([x, y, z]), standing=standing)
        for x, z in positions
        for standing in standings
    ]


def _reaches(world: World, i: int, agent: Agent) -> bool:
    """Whether any part of object i's box is within the visibility distance; cheap."""
    axes = [0, 2]
    here = agent.position[axes]
    gap = here - np.clip(here, world.low[i, axes], world.high[i, axes])
    return float(np.hypot(*gap)) <= world.settings.visibility_distance
