"""How many agents there are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from er_gym.sim.actions.pick_place import fall
from er_gym.sim.crew import act_as
from er_gym.sim.errors import ActionFailed
from er_gym.sim.space.start_places import start_places
from er_gym.sim.waiting import Waiting
from er_gym.sim.world import World


def set_agents(world: World, count: int) -> None:
    """Let there be ``count`` agents; the first one stays, and all others begin anew.

    What those held falls to the ground.

    Raises:
        ActionFailed: there is no room for them. Nothing has changed.
    """
    act_as(world, 0)
    agent, grid = world.agent, world.settings.grid_size
    x, y, z = agent.position.tolist()
    places = start_places(world.scene.name, (x, z), grid, count - 1)
    if len(places) < count - 1:
        raise ActionFailed(f"There is no room in {world.scene.name} for {count} agents.")
    for number in sorted(world.others):
        act_as(world, number)
        if world.held >= 0:
            fall(world, world.held, (world.low[world.held] + world.high[world.held]) / 2)
    act_as(world, 0)
    fov = world.settings.field_of_view
    world.wait(
        {
            number: Waiting(replace(agent, position=np.array([x, y, z])), fov)
            for number, (x, z) in enumerate(places, start=1)
        }
    )
