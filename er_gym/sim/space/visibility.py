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
    lens = (
        agent.rotation,
        agent.horizon,
        settings.field_of_view,
        settings.width / settings.height,
    )
    found = known.look(agent.camera, lens)
    near = known.within_distance(agent.position, settings.visibility_distance)
    return found if near is None else found & near
