"""Making a house from ProcTHOR's JSON."""

from __future__ import annotations

from typing import Any

from er_gym.sim.actions.agents import set_agents
from er_gym.sim.actions.registry import action
from er_gym.sim.errors import ActionFailed
from er_gym.sim.house.build import house_scene
from er_gym.sim.house.schema import HouseError
from er_gym.sim.world import World


@action("CreateHouse")
def create_house(world: World, *, house: dict[str, Any]) -> None:
    """Replace the scene by a house, and put the agent at the pose that the house gives it.

    If the house gives none, or one where the agent cannot stand, it stands in the middle. As many
    other agents as ``Initialize`` asked for start near it.
    """
    try:
        scene = house_scene(house)
    except HouseError as error:
        raise ActionFailed(f"CreateHouse: {error}.") from None
    count = world.settings.agents
    if count > 1:
        set_agents(World.load(scene, world.settings), count)  # it fails before anything changes
    world.enter(scene)
    if count > 1:
        set_agents(world, count)
