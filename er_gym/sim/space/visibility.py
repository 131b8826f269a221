"""What the agent sees.

An object is visible when two things hold. It is no farther than the visibility distance from the
agent (see :mod:`er_gym.sim.space.outlines`). And one of its sample points is inside the camera's
frustum, with nothing between it and the camera (see :mod:`er_gym.sim.space.line_of_sight`).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.agent import Agent
from er_gym.sim.settings import Settings
from er_gym.sim.space.line_of_sight import LinesOfSight
from er_gym.sim.space.line_of_sight_builder import lines_of_sight
from er_gym.sim.world import World

NEAR_PLANE = 0.1
"""Distance of the camera's near plane, metres."""


def in_frustum(
    offsets: NDArray[np.float64],
    rotation: NDArray[np.float64] | float,
    horizon: NDArray[np.float64] | float,
    field_of_view: float,
    aspect: float,
) -> NDArray[np.bool_]:
    """Which points are in a camera's picture.

    Args:
        offsets: (..., 3) from the camera to the points, metres, world frame.
        rotation, horizon: degrees, broadcast against the points.
        field_of_view: vertical, degrees.
        aspect: width of the picture divided by its height.
    """
    yaw, pitch = np.radians(rotation), np.radians(horizon)
    x, y, z = offsets[..., 0], offsets[..., 1], offsets[..., 2]
    sin_yaw, cos_yaw, sin_pitch, cos_pitch = np.sin(yaw), np.cos(yaw), np.sin(pitch), np.cos(pitch)
    # Computing in place takes half the time.
    right, ahead = x * cos_yaw, x * sin_yaw
    right -= z * sin_yaw
    ahead += z * cos_yaw
    forward, up = ahead * cos_pitch, ahead * sin_pitch
    forward -= y * sin_pitch
    up += y * cos_pitch
    found = forward > NEAR_PLANE
    forward *= np.tan(np.radians(field_of_view) / 2)
    found &= np.abs(up, out=up) <= forward
    forward *= aspect
    found &= np.abs(right, out=right) <= forward
    return np.asarray(found)


def visible(world: World, agent: Agent | None = None) -> NDArray[np.bool_]:
    """(N,) whether the agent sees each object, from its pose or from another one."""
    agent = agent or world.agent
    known, settings = lines_of_sight(world), world.settings
    question = (
        *agent.position.tolist(),
        agent.standing,
        agent.rotation,
        agent.horizon,
        settings.field_of_view,
        settings.width / settings.height,
        settings.visibility_distance,
    )
    found = known.cached(question, lambda: _look(known, agent, settings)).copy()
    held = world.in_hand
    if held:
        found[[i for i in held if not world.hidden[i]]] = True
    return found


def _look(known: LinesOfSight, agent: Agent, settings: Settings) -> NDArray[np.bool_]:
    camera = agent.camera
    clear = known.viewpoint(camera).clear_points
    seen = in_frustum(
        (
            known.coordinates.take(clear, axis=1) - camera[:, None]
        ).T,  # four times as fast as indexing
        agent.rotation,
        agent.horizon,
        settings.field_of_view,
        settings.width / settings.height,
    )
    found = np.zeros(len(known.point_count), dtype=bool)
    found[known.point_owner[clear[seen]]] = True
    near = known.within_distance(agent.position, settings.visibility_distance)
    return found if near is None else found & near
