"""The body of an agent, as the others see it: a figure of the size of the agent's capsule.

Each has a colour of its own, AI2-THOR's. It is drawn in flat light and throws no shadow.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from er_gym.sim.agent import Agent
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.panda import geometry
from er_gym.sim.render.pieces import pieces_of
from er_gym.sim.space.bodies import HALF_HEIGHT
from er_gym.sim.space.footprints import RADIUS

_COLOURS = ((0.16, 0.3, 0.85), (0.9, 0.8, 0.15), (0.2, 0.65, 0.25), (0.85, 0.2, 0.18))
_DARK, _PALE = (0.12, 0.13, 0.15), (0.86, 0.85, 0.82)
_TORSO = (
    *((0.0, -HALF_HEIGHT), (0.75, -HALF_HEIGHT), (0.95, -0.75), (0.85, -0.1), (0.92, 0.35)),
    *((0.6, 0.5), (0.3, 0.54), (0.0, 0.55)),
)
"""Shares of the radius, and metres from the agent's centre; nothing sticks out of the cylinder
that hides things."""
_SEGMENTS = 16
_HEAD, _EYES = 0.71, 0.75
"""Height of the middle of the head, and of the band that shows where it looks, metres."""


@lru_cache(maxsize=8)
def _node(number: int) -> Any:
    mesh = Mesh()
    turn = np.arange(_SEGMENTS + 1) / _SEGMENTS * 2 * np.pi
    shade = np.tile(0.85 + 0.15 * np.cos(turn - np.pi / 4), 2)[:, None]
    torso = [(share * RADIUS, height) for share, height in _TORSO]
    mesh.lathe(torso, shade * _COLOURS[number], segments=_SEGMENTS)
    mesh.ball((0.0, _HEAD, 0.0), (0.28, 0.36, 0.28), _PALE)
    mesh.box((0.0, _EYES, 0.1), (0.18, 0.07, 0.1), _DARK)
    mesh.box((0.0, 0.2, 0.17), (0.12, 0.2, 0.03), _PALE)
    return geometry(pieces_of(mesh.patches()), 0, f"agent {number}")


def body_node(number: int) -> Any:
    """A node that draws the body of an agent about its centre, facing +z."""
    return _node(number).makeCopy()


def put_body(path: Any, agent: Agent) -> None:
    """Put a node at an agent's pose."""
    x, y, z = agent.position.tolist()
    path.setPosHpr(x, z, y, -agent.rotation, 0.0, 0.0)
