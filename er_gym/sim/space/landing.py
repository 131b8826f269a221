"""The surface on which a falling object comes to rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.placement import surface_height
from er_gym.sim.space.walkable_floor import floor_of
from er_gym.sim.world import World

_FLOOR = [0, 2]


def landing(world: World, i: int, point: NDArray[np.float64]) -> tuple[float, list[int]] | None:
    """Where object i comes to rest when it is released at a (3,) point: on the floor or on
    furniture.

    Returns:
        The height of its underside and the receptacles that it is then in; None inside a wall.
    """
    if floor_of(world.scene.name).contains(point[_FLOOR]):
        return world.ground, list(world.of_type("Floor"))[:1]
    falling = {i, *world.inside(i)}
    under = [
        (surface_height(world, r), r)
        for r in np.flatnonzero(~world.hidden).tolist()
        if world.has(r, "receptacle")
        and not world.has(r, "openable")
        and r not in falling
        and world.types[r] != "Floor"
        and (world.low[r] <= point)[_FLOOR].all()
        and (world.high[r] >= point)[_FLOOR].all()
    ]
    reached = [found for found in under if found[0] <= point[1]]
    if not reached:
        return None
    height, receptacle = max(reached)
    return height, [receptacle]
