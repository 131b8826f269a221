"""AI2-THOR's ``GetInteractablePoses``: the poses from which an object can be interacted with.

AI2-THOR is stricter here than with ``visible``, as is published in its code: the very point that
the agent sees must be within the distance, and not merely some part of the object.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.agent import CAMERA_CROUCHING, CAMERA_STANDING, Agent
from er_gym.sim.space.bodies import hidden, hiding
from er_gym.sim.space.frustum import in_frustum
from er_gym.sim.space.line_of_sight_builder import lines_of_sight
from er_gym.sim.space.outlines import Outlines
from er_gym.sim.space.solids import solid_of
from er_gym.sim.space.solids.sample_points import sample_points
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World

HORIZONS = (-30.0, 0.0, 30.0, 60.0)
"""Camera tilts that AI2-THOR tries if none are given, degrees, positive looking down."""
_REMEMBERED = 64
"""Answers for more positions than these are not cached."""
_BATCH = 64
"""Camera positions in one call of the ray kernel."""

_NEARER_THE_MIDDLE = {"Fridge": 0.7}
"""Types whose points of AI2-THOR lie farther from their edges than ours, and the share of the way
from the middle to ours at which they lie; from the three counts of poses that its tests expect of a
fridge (FloorPlan28). All 30 fridges still can be opened from their recorded poses."""

Poses = NDArray[np.float64]
"""(K, 6): x, y and z in metres, rotation and horizon in degrees, 1 for standing or 0."""


def interactable_poses(
    world: World,
    i: int,
    positions: NDArray[np.float64],
    rotations: Sequence[float],
    horizons: Sequence[float],
    standings: Sequence[bool],
    max_poses: int | None = None,
    max_distance: float | None = None,
) -> Poses:
    """Poses from which object i is visible and so can be interacted with.

    Args:
        positions: (P, 2) x and z where the agent may stand, tried in order.
        rotations, horizons: degrees.
        standings: whether to stand or crouch.
        max_poses: stop after this many poses.
        max_distance: the largest distance to the object, metres; None for the visibility distance.
    """
    distance = world.settings.visibility_distance if max_distance is None else max_distance
    wanted = _Wanted(tuple(rotations), tuple(horizons), tuple(standings), max_poses, distance)

    def search() -> Poses:
        found = _search(world, i, positions, wanted)
        found.setflags(write=False)
        return found

    in_hand = i in world.carried
    one = len(positions) == len(rotations) == len(horizons) == len(standings) == 1
    if one and not in_hand and max_distance is None:
        # A caller who asks for one pose mostly goes there next, so this visibility is needed
        # anyway.
        return _one_pose(world, i, positions[0], rotations[0] % 360.0, horizons[0], standings[0])
    # An arrangement does not include the hand's position. The poses of a whole room take megabytes.
    if in_hand or len(positions) > _REMEMBERED:
        return search()
    settings = world.settings
    lens = (settings.field_of_view, settings.width / settings.height)
    question = (i, positions.tobytes(), wanted, lens, world.agent.position[1], *hiding(world))
    return lines_of_sight(world).cached(question, search)


class _Wanted(NamedTuple):
    """The poses that are looked for at each position."""

    rotations: tuple[float, ...]
    horizons: tuple[float, ...]
    standings: tuple[bool, ...]
    most: int | None
    distance: float


def _search(world: World, i: int, positions: NDArray[np.float64], wanted: _Wanted) -> Poses:
    found = [np.empty((0, 6))]
    if world.hidden[i]:
        return found[0]
    settings = world.settings
    near = _within_reach(world, i, positions, wanted.distance)
    yaws, tilts = np.array(wanted.rotations) % 360.0, np.array(wanted.horizons)
    upright = np.array(wanted.standings, dtype=bool)
    lifts = np.where(upright, CAMERA_STANDING, CAMERA_CROUCHING)
    eyes, count = np.empty((len(near) * len(lifts), 3)), 0
    eyes[:, [0, 2]] = np.repeat(near, len(lifts), axis=0)
    eyes[:, 1] = world.agent.position[1] + np.tile(lifts, len(near))
    for first in range(0, len(eyes), _BATCH):
        batch = eyes[first : first + _BATCH]
        points, clear = _lines_to(world, i, batch, wanted.distance)
        eye, point = clear.nonzero()
        if not len(eye):
            continue
        in_picture = in_frustum(
            (points[point] - batch[eye])[:, None, None],
            yaws[:, None],
            tilts,
            settings.field_of_view,
            settings.width / settings.height,
        )
        some, where = np.unique(eye, return_index=True)
        eye, yaw, tilt = np.logical_or.reduceat(in_picture, where).nonzero()
        place, body = np.divmod(first + some[eye], len(lifts))
        poses = np.empty((len(eye), 6))
        poses[:, [0, 2]], poses[:, 1] = near[place], world.agent.position[1]
        poses[:, 3], poses[:, 4], poses[:, 5] = yaws[yaw], tilts[tilt], upright[body]
        found.append(poses)
        count += len(poses)
        if wanted.most is not None and count >= wanted.most:
            break
    return np.concatenate(found)[: wanted.most]


def _one_pose(
    world: World,
    i: int,
    position: NDArray[np.float64],
    rotation: float,
    horizon: float,
    standing: bool,
) -> Poses:
    x, y, z = float(position[0]), float(world.agent.position[1]), float(position[1])
    pose = Agent(np.array([x, y, z]), rotation, horizon, standing)
    if not visible(world, pose)[i]:
        return np.empty((0, 6))
    distance = world.settings.visibility_distance
    corners = np.stack([world.low[i], world.high[i]])[:, [0, 2]]
    away = np.abs(corners - position).max(axis=0)
    # Where all of an object is near, its visible point is.
    if world.types[i] in _NEARER_THE_MIDDLE or np.hypot(away[0], away[1]) >= distance:
        wanted = _Wanted((rotation,), (horizon,), (standing,), None, distance)
        return _search(world, i, position[None], wanted)
    return np.array([[x, y, z, rotation, horizon, standing]])


def _within_reach(
    world: World, i: int, positions: NDArray[np.float64], distance: float
) -> NDArray[np.float64]:
    """The (P, 2) positions at which object i is within a distance, metres."""
    away = np.abs(np.array(lines_of_sight(world).extent)[:, None] - positions).max(
        axis=0, initial=0.0
    )
    if i not in world.carried and (np.hypot(away[:, 0], away[:, 1]) <= distance).all():
        return positions  # everything in the room is within the distance
    return positions[Outlines.of([solid_of(world, i)]).gaps(positions)[:, 0] <= distance]


def _lines_to(
    world: World, i: int, eyes: NDArray[np.float64], distance: float
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """(Q, 3) sample points of object i, and (E, Q) whether they are within a distance of eyes
    (E, 3), along the floor, and nothing hides them."""
    found = sample_points(world, i)
    share = _NEARER_THE_MIDDLE.get(world.types[i])
    if share is not None:
        middle = (world.low[i] + world.high[i]) / 2
        found = middle + (found - middle) * share
    points = found.astype(np.float32)
    clear = lines_of_sight(world).unobstructed(eyes, points, i)
    bodies = hiding(world)
    if bodies:
        clear = clear & ~hidden(bodies, eyes, points)
    away = (
        np.abs(eyes.max(axis=0) - points.min(axis=0)),
        np.abs(eyes.min(axis=0) - points.max(axis=0)),
    )
    farthest = np.maximum(*away)
    if np.hypot(farthest[0], farthest[2]) < distance:
        return points, clear
    x, z = (points[None, :, axis] - eyes[:, None, axis] for axis in (0, 2))
    return points, clear & (np.hypot(x, z) < distance)
