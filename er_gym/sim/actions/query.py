"""Questions about the scene that change nothing."""

from __future__ import annotations

from typing import Any

import numpy as np

from er_gym.sim.actions.checks import FARTHEST, target
from er_gym.sim.actions.registry import Vector, action
from er_gym.sim.errors import INVALID_ARGUMENT, ActionFailed
from er_gym.sim.render.view import object_at
from er_gym.sim.scene import SCENE_NAMES
from er_gym.sim.space.poses import HORIZONS, interactable_poses
from er_gym.sim.space.standing import floor_of, standing_places
from er_gym.sim.world import World


@action("Pass", "Done", "PausePhysicsAutoSim", "UnpausePhysicsAutoSim")
def do_nothing(world: World) -> None:
    """Answer with the state of the world as it is."""


@action("AdvancePhysicsStep")
def advance_physics_step(
    world: World,
    *,
    timeStep: float | None = None,
    simSeconds: float | None = None,
    allowAutoSimulation: bool = True,
) -> None:
    """Nothing moves by itself here, so that however long one waits nothing changes."""


@action("GetScenesInBuild")
def get_scenes_in_build(world: World) -> list[str]:
    """Names of the scenes, as the Unity build spells them."""
    return [f"{name}_physics" for name in SCENE_NAMES]


def _grid(world: World, step: float | None) -> np.ndarray:
    size = world.settings.grid_size if step is None else step
    if size < 0.01:
        raise ActionFailed(
            f"A grid needs a step of 0.01 m or more, not {size:g}.", INVALID_ARGUMENT
        )
    here = world.agent.position[[0, 2]]
    offset = (here % size).round(5) % size  # of the grid that the agent stands on
    places = standing_places(world.scene.name, float(size), (float(offset[0]), float(offset[1])))
    listed = (np.abs(places - here).max(axis=1, initial=0.0) < 1e-4).any()
    if listed or not floor_of(world.scene.name).contains(here):
        return places
    return np.concatenate([here[None], places])  # free floor that no way over the grid leads to


@action("GetObjectInFrame")
def get_object_in_frame(world: World, *, x: float, y: float, checkVisible: bool = False) -> str:
    """The id of the object at a point of the agent's picture, 0 to 1 from its upper left corner."""
    if not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
        raise ActionFailed(
            f"x and y must be within 0 and 1, not {x:g} and {y:g}.", INVALID_ARGUMENT
        )
    object_id = object_at(world, x, y)
    if object_id is None:
        raise ActionFailed(f"There is no object at ({x:g}, {y:g}), only the room.")
    if checkVisible:
        target(world, object_id, force=False)
    return object_id


@action("GetReachablePositions")
def get_reachable_positions(
    world: World, *, gridSize: float | None = None
) -> list[dict[str, float]]:
    """Every position of the grid where the agent can stand, metres."""
    y = float(world.agent.position[1])
    return [{"x": x, "y": y, "z": z} for x, z in _grid(world, gridSize).tolist()]


def _is_near(point: Vector) -> bool:
    """Whether a point may be in a room at all: of numbers much larger nothing can be worked out."""
    return max(abs(point.x), abs(point.z)) <= FARTHEST


@action("GetInteractablePoses")
def get_interactable_poses(
    world: World,
    *,
    objectId: str,
    positions: list[Vector] | None = None,
    rotations: list[float] | None = None,
    horizons: list[float] | None = None,
    standings: list[bool] | None = None,
    maxPoses: int | None = None,
) -> list[dict[str, Any]]:
    """Every pose from which an object can be interacted with; each filter narrows the search."""
    if maxPoses is not None and maxPoses < 1:
        raise ActionFailed(f"maxPoses must be 1 or more, not {maxPoses}.", INVALID_ARGUMENT)
    i = world.find(objectId)
    places = (
        _grid(world, None)
        if positions is None
        else np.array([(p.x, p.z) for p in positions if _is_near(p)]).reshape(-1, 2)
    )
    places = places[floor_of(world.scene.name).contains(places)]
    if rotations is None:
        step = world.settings.rotate_step
        rotations = [k * step for k in range(int(360 // step))]
    poses = interactable_poses(
        world,
        i,
        places,
        rotations,
        HORIZONS if horizons is None else horizons,
        (True, False) if standings is None else standings,
        maxPoses,
    )
    return [
        {"x": x, "y": y, "z": z, "rotation": yaw, "standing": standing > 0.0, "horizon": tilt}
        for x, y, z, yaw, tilt, standing in poses.tolist()
    ]
