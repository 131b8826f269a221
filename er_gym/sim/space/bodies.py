"""The bodies of the other agents: they stop an agent and hide what is behind them.

Each is an upright cylinder about the agent's centre, of the radius and the height of AI2-THOR's
capsule, whether it stands or crouches. An agent that shares a place with another sees and walks out
of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, hypot, radians, sin, tan

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.agent import Agent
from er_gym.sim.space.footprints import RADIUS
from er_gym.sim.space.frustum import Lens
from er_gym.sim.world import World

HALF_HEIGHT = 0.9
"""Half the height of the body, metres."""
_CLOSER = 1e-6
"""A step that brings two overlapping agents nearer by less does not, metres."""

_TINY = 1e-12
_FLOOR = [0, 2]

Body = tuple[float, float, float]
"""The centre of a body: x, y and z, metres."""


def blocking(world: World, start: NDArray[np.float64], end: NDArray[np.float64]) -> int | None:
    """The id of the first agent, by its number, that is in the way of the acting one.

    Args:
        start, end: (3,) of a straight level step, metres.
    """
    along_x, _, along_z = (end - start).tolist()
    square = along_x * along_x + along_z * along_z
    for number, other in sorted(world.others.items()):
        to_x, to_y, to_z = (other.agent.position - start).tolist()
        if abs(to_y) >= 2 * HALF_HEIGHT:
            continue
        share = (to_x * along_x + to_z * along_z) / square if square else 0.0
        share = min(max(share, 0.0), 1.0)
        nearest = hypot(to_x - share * along_x, to_z - share * along_z)
        if nearest < min(2 * RADIUS, hypot(to_x, to_z)) - _CLOSER:
            return number
    return None


def hiding(world: World, own: bool = False) -> tuple[Body, ...]:
    """The bodies that hide things from the acting agent; () while agents are not visible.

    Args:
        own: its own body, too: a third-party camera sees all.
    """
    if not world.others or not world.settings.agents_visible:
        return ()
    found = [other.agent for _, other in sorted(world.others.items())]
    return tuple(map(body_of, (*found, world.agent) if own else found))


def body_of(agent: Agent) -> Body:
    """The body of an agent."""
    x, y, z = agent.position.tolist()
    return x, y, z


def in_sight(body: Body, eye: Sequence[float], lens: Lens) -> bool:
    """Whether a body may be in the picture of a camera at x, y and z, metres."""
    yaw, pitch, tall = radians(lens[0]), radians(lens[1]), tan(radians(lens[2]) / 2)
    x, y, z = body[0] - eye[0], body[1] - eye[1], body[2] - eye[2]
    # In a frame that has turned with the camera, but has not tilted with it.
    right, ahead = x * cos(yaw) - z * sin(yaw), x * sin(yaw) + z * cos(yaw)
    rise, level, wide = sin(pitch), cos(pitch), tall * lens[3]
    # Wholly beyond one of the planes that bound the picture; first the nearer one of the sides.
    beyond = abs(right) - wide * (ahead * level - y * rise)
    if beyond > RADIUS * hypot(1.0, wide * level) + HALF_HEIGHT * wide * abs(rise):
        return False
    for side in (1.0, -1.0):
        up, on = tall * rise + side * level, side * rise - tall * level
        if up * y + on * ahead > RADIUS * abs(on) + HALF_HEIGHT * abs(up):
            return False
    return True


def hidden(
    bodies: tuple[Body, ...], eyes: NDArray[np.float64], points: NDArray[np.float32]
) -> NDArray[np.bool_]:
    """(E, Q) whether a body is between an eye and a point.

    Args:
        eyes: (E, 3) camera positions, metres; one inside a body looks out of it.
        points: (Q, 3) metres.
    """
    found = np.zeros((len(eyes), len(points)), dtype=bool)
    way = points[None].astype(np.float64) - eyes[:, None]
    across = np.maximum((way[..., _FLOOR] ** 2).sum(axis=-1), _TINY)
    rise = np.where(np.abs(way[..., 1]) < _TINY, _TINY, way[..., 1])
    for body in bodies:
        offset = eyes - body
        beside = offset[:, _FLOOR]
        outside = ((beside**2).sum(axis=1) - RADIUS**2)[:, None]
        above = offset[:, 1:2]
        # The shares of the way at which the line enters and leaves the cylinder, and its slab.
        middle = -(way[..., _FLOOR] * beside[:, None]).sum(axis=-1) / across
        square = middle**2 - outside / across
        half = np.sqrt(np.maximum(square, 0.0))
        bottom, top = (-HALF_HEIGHT - above) / rise, (HALF_HEIGHT - above) / rise
        enters = np.maximum(np.maximum(middle - half, np.minimum(bottom, top)), 0.0)
        leaves = np.minimum(np.minimum(middle + half, np.maximum(bottom, top)), 1.0)
        inside = (outside <= 0.0) & (np.abs(above) <= HALF_HEIGHT)
        found |= (square > 0.0) & (enters <= leaves) & ~inside
    return found
