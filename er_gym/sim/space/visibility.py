"""What the agent sees.

An object is visible when one of its sample points is inside the camera's frustum, no farther than
the visibility distance from the agent (horizontally, as AI2-THOR measures it: its search volume is
an upright capsule around the agent), and on an unobstructed line from the camera.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.rays import blocked_by
from er_gym.sim.world import Agent, World

NEAR_PLANE = 0.1
"""Distance of the camera's near plane, metres."""
_CACHED_VIEWPOINTS = 64


def sample_points(
    world: World, rows: Sequence[int]
) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Points spread over some objects: (P, 3) metres, and (P,) which of the K rows each is of."""
    points = [world.sample_points(i) for i in rows]
    owners = np.repeat(np.arange(len(rows)), [len(p) for p in points])
    return np.concatenate(points), owners


def lines_of_sight(
    world: World,
    eyes: NDArray[np.float64],
    rows: Sequence[int],
    points: NDArray[np.float64],
    owners: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """Which sample points of some objects nothing hides from which camera positions.

    An object is not hidden by its own box, nor by what it lies in or on. What is shut away is
    hidden from everywhere.

    Args:
        eyes: (E, 3) camera positions, metres.
        rows: the K objects; points: (P, 3) and owners: (P,) as :func:`sample_points` gives them.

    Returns:
        (E, P) bool.
    """
    low, high, solid_of = world.solids()
    column = np.full(len(world) + 1, len(solid_of))
    column[solid_of] = np.arange(len(solid_of))
    may_hide = np.ones((len(rows), len(solid_of) + 1), dtype=bool)
    for k, i in enumerate(rows):
        may_hide[k, column[[i, *world.ancestors(i)]]] = False
    origins = np.repeat(eyes.astype(np.float32), len(points), axis=0)
    targets = np.tile(points.astype(np.float32), (len(eyes), 1))
    blocked = blocked_by(origins, targets, low, high).reshape(len(eyes), len(points), -1)
    clear = ~(blocked & may_hide[owners, :-1]).any(axis=2)
    return np.asarray(clear & ~world.hidden[np.asarray(rows)[owners]])


def in_frustum(
    offsets: NDArray[np.float64],
    rotation: NDArray[np.float64] | float,
    horizon: NDArray[np.float64] | float,
    field_of_view: float,
    aspect: float,
) -> NDArray[np.bool_]:
    """Which points a camera has in its picture.

    Args:
        offsets: (..., 3) from the camera to the points, metres, world frame.
        rotation, horizon: degrees, broadcast against the points.
        field_of_view: vertical, degrees. aspect: the picture's width by its height.
    """
    yaw, pitch = np.radians(rotation), np.radians(horizon)
    x, y, z = offsets[..., 0], offsets[..., 1], offsets[..., 2]
    right = x * np.cos(yaw) - z * np.sin(yaw)
    ahead = x * np.sin(yaw) + z * np.cos(yaw)
    forward = ahead * np.cos(pitch) - y * np.sin(pitch)
    up = ahead * np.sin(pitch) + y * np.cos(pitch)
    vertical = forward * np.tan(np.radians(field_of_view) / 2)
    return np.asarray(
        (forward > NEAR_PLANE) & (np.abs(up) <= vertical) & (np.abs(right) <= vertical * aspect)
    )


def within_reach(
    points: NDArray[np.float64], positions: NDArray[np.float64], distance: float
) -> NDArray[np.bool_]:
    """Which of (..., 3) points are within a horizontal distance of (..., 3) positions, metres."""
    x = points[..., 0] - positions[..., 0]
    z = points[..., 2] - positions[..., 2]
    return np.asarray(x * x + z * z <= distance * distance)


def visible(world: World, agent: Agent | None = None) -> NDArray[np.bool_]:
    """(N,) which objects the agent sees, from where it is or from another pose."""
    agent = agent or world.agent
    key = tuple(agent.camera.round(3).tolist())
    cached = world.sights.get(key)
    if cached is None:
        rows = np.flatnonzero(world.exists)
        points, owners = sample_points(world, rows.tolist())
        clear = lines_of_sight(world, agent.camera[None], rows.tolist(), points, owners)[0]
        if len(world.sights) >= _CACHED_VIEWPOINTS:
            world.sights.pop(next(iter(world.sights)))
        # Only what can be seen in some direction is worth keeping.
        cached = world.sights[key] = points[clear], rows[owners[clear]]
    points, of_object = cached
    settings = world.settings
    seen = within_reach(points, agent.position, settings.visibility_distance) & in_frustum(
        points - agent.camera,
        agent.rotation,
        agent.horizon,
        settings.field_of_view,
        settings.width / settings.height,
    )
    result = np.zeros(len(world), dtype=bool)
    result[of_object[seen]] = True
    result[[i for i in world.in_hand if not world.hidden[i]]] = True
    return result
