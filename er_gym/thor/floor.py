"""The positions where the agent can stand, on all of a scene's floor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from er_gym.sim.space.walkable_floor import standing_places
from er_gym.sim.world import World


def floor_of(controller: Any) -> Sequence[Mapping[str, float]]:
    """The positions where the agent can stand in a controller's scene, metres.

    AI2-THOR's GetReachablePositions lists only the piece of floor that the agent is on. The
    embedded engine also knows the other pieces. They are included, since an episode may begin on
    any piece and the positions are asked for only once.
    """
    world = getattr(controller, "world", None)
    if isinstance(world, World):
        y = float(world.agent.position[1])
        size = float(world.settings.grid_size)
        x, z = ((world.agent.position[[0, 2]] % size).round(5) % size).tolist()
        places = standing_places(world.scene.name, size, (x, z))
        return [{"x": x, "y": y, "z": z} for x, z in places.tolist()]
    event = controller.step(action="GetReachablePositions", renderImage=False)
    positions: Sequence[Mapping[str, float]] = event.metadata["actionReturn"]
    return positions
