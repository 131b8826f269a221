"""From where an object can be interacted with: AI2-THOR's ``GetInteractablePoses``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.reach import Outlines
from er_gym.sim.space.visibility import in_frustum, sights
from er_gym.sim.world import Agent, World

HORIZONS = (-30.0, 0.0, 30.0, 60.0)
"""Camera tilts that AI2-THOR tries when none are asked for, degrees, down positive."""
_REMEMBERED = 64
"""Answers over more positions than these are not kept."""
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
) -> tuple[Agent, ...]:
    """Poses from which object i is visible, hence can be interacted with.

    Args:
        positions: (P, 2) x and z where the agent may stand, tried in order.
        rotations, horizons: degrees. standings: whether to stand or crouch.
        max_poses: stop after so many.
    """
    settings = world.settings
    lens = (settings.field_of_view, settings.width / settings.height, settings.visibility_distance)
    filters = (tuple(rotations), tuple(horizons), tuple(standings), max_poses)
    question = (i, positions.tobytes(), filters, lens, world.agent.position[1])

    def search() -> tuple[Agent, ...]:
        return tuple(_search(world, i, positions, *filters))

    # Where the hand is, is no part of an arrangement; and the poses of a whole room take megabytes.
    if i in world.in_hand or len(positions) > _REMEMBERED:
        return search()
    return sights(world).remembered(question, search)


def _search(
    world: World,
    i: int,
    positions: NDArray[np.float64],
    rotations: Sequence[float],
    horizons: Sequence[float],
    standings: Sequence[bool],
    max_poses: int | None,
) -> list[Agent]:
    settings, known = world.settings, sights(world)
    points = world.sample_points(i).astype(np.float32)
    of = np.full(len(points), i, dtype=np.int16)
    held = world.in_hand
    directions = np.array([(r % 360.0, h) for r in rotations for h in horizons])
    found: list[Agent] = []
    gaps = Outlines.of([world.shape(i)]).gaps(positions)[:, 0]
    near = positions[gaps <= settings.visibility_distance]
    for batch in range(0, len(near), _BATCH):
        places = _standing_at(world, near[batch : batch + _BATCH], standings)
        if not places or not len(directions):
            continue
        eyes = np.array([place.camera for place in places])
        if len(eyes) == 1 and i not in held:
            # Whoever asks for one position will look about from there next: keep what is found.
            mine = known.of == i
            clear = known.clear_from(eyes[0], mine)[mine][None]
        else:
            clear = known.clear(eyes, points, of)
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
