"""Queries, which change nothing."""

from __future__ import annotations

from typing import Any

import numpy as np

from er_gym.sim.actions.checks import FARTHEST, target
from er_gym.sim.actions.object_action import pointed_at, shown_at
from er_gym.sim.actions.registry import action
from er_gym.sim.actions.vectors import Vector
from er_gym.sim.errors import ActionFailed
from er_gym.sim.object_metadata import vector
from er_gym.sim.scene import SCENE_NAMES
from er_gym.sim.space.interactable_poses import HORIZONS, interactable_poses
from er_gym.sim.space.reachable_positions import reachable_positions
from er_gym.sim.space.walkable_floor import floor_of, standing_places
from er_gym.sim.world import World

_SMALLEST_STEP = 0.01
"""The smallest step of a grid of positions, metres; a smaller one would fill the memory."""
_SAME_PLACE = 1e-5
"""Positions nearer to each other than this are one, metres."""


@action("Pass", "Done", "PausePhysicsAutoSim", "UnpausePhysicsAutoSim")
def do_nothing(world: World) -> None:
    """Do nothing and return the event."""


@action("AdvancePhysicsStep")
def advance_physics_step(
    world: World,
    *,
    timeStep: float | None = None,
    simSeconds: float | None = None,
    allowAutoSimulation: bool = True,
) -> None:
    """Do nothing: nothing moves by itself here, however long a program waits."""


@action("GetScenesInBuild")
def get_scenes_in_build(world: World) -> list[str]:
    """The names of the scenes, as the Unity build spells them."""
    return [*(f"{name}_physics" for name in SCENE_NAMES), "Procedural"]


def _grid(world: World, step: float | None, ahead: bool = False) -> np.ndarray:
    """(P, 2) positions that the agent reaches by steps; the whole floor if it does not stand on it.

    Args:
        ahead: take the steps along the agent's heading, not along the world's axes.
    """
    size = world.settings.grid_size if step is None else step
    if size < _SMALLEST_STEP:
        raise ActionFailed(f"A grid needs a step of {_SMALLEST_STEP:g} m or more, not {size:g}.")
    here = world.agent.position[[0, 2]]
    if size > FARTHEST:
        return here[None]
    if floor_of(world.scene.name).contains(here):
        yaw = world.agent.rotation if ahead else 0.0
        return reachable_positions(world.scene.name, here, float(size), yaw)
    offset = (here % size).round(5) % size  # any node of the grid that the agent is on
    return standing_places(world.scene.name, float(size), (float(offset[0]), float(offset[1])))


@action("GetObjectInFrame")
def get_object_in_frame(world: World, *, x: float, y: float, checkVisible: bool = False) -> str:
    """The id of the object at a point of the agent's picture, 0 to 1 from its upper left corner.

    If there is none, the error message is also the answer, as in AI2-THOR.
    """
    try:
        object_id = pointed_at(world, x, y)
        if checkVisible:
            target(world, object_id, force=False)
    except ActionFailed as failure:
        raise ActionFailed(str(failure), reply=str(failure)) from None
    return object_id


@action("GetCoordinateFromRaycast")
def get_coordinate_from_raycast(world: World, *, x: float, y: float) -> dict[str, float]:
    """The point of the room at a point of the agent's picture, metres.

    Args:
        x, y: 0 to 1, from the left and from the top.
    """
    if not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
        raise ActionFailed(f"x and y must be in [0:1] not (x={x:g}, y={y:g}).")
    return vector(shown_at(world, x, y))


@action("GetReachablePositions")
def get_reachable_positions(
    world: World,
    *,
    maxStepCount: int | None = None,
    directionsRelativeAgent: bool = False,
    gridSize: float | None = None,
) -> list[dict[str, float]]:
    """Every position that the agent reaches by steps of the grid, and its own; metres.

    If the agent was forced into furniture, the answer is the whole floor.

    Args:
        maxStepCount: fail if the grid has more positions than this divided by its squared step.
        directionsRelativeAgent: take the steps along the agent's heading.
    """
    places = _grid(world, gridSize, directionsRelativeAgent)
    step = world.settings.grid_size if gridSize is None else gridSize
    if maxStepCount is not None and len(places) > maxStepCount // (step * step):
        raise ActionFailed("Too many steps taken in GetReachablePositions.")
    # Programs look the agent's position up among these, so it must be equal to the last digit.
    own = world.agent.position[[0, 2]]
    is_own = np.abs(places - own).max(axis=1, initial=0.0) < _SAME_PLACE
    places = np.where(is_own[:, None], own, places)
    y = float(world.agent.position[1])
    return [{"x": x, "y": y, "z": z} for x, z in places.tolist()]


def _is_near(point: Vector) -> bool:
    """Whether coordinates can be in a room; computing with much larger numbers would fail."""
    return max(abs(point.x), abs(point.z)) <= FARTHEST


def on_floor(world: World, places: np.ndarray) -> np.ndarray:
    """Those of (P, 2) x and z where the agent can stand."""
    return np.asarray(places[floor_of(world.scene.name).contains(places)])


def places_of(world: World, positions: list[Vector] | None) -> np.ndarray:
    """(P, 2) x and z of given positions, by default those that the agent reaches, where it can
    stand."""
    if positions is None:
        return on_floor(world, _grid(world, None))
    return on_floor(world, np.array([(p.x, p.z) for p in positions if _is_near(p)]).reshape(-1, 2))


@action("GetInteractablePoses")
def get_interactable_poses(
    world: World,
    *,
    objectId: str,
    positions: list[Vector] | None = None,
    rotations: list[float] | None = None,
    horizons: list[float] | None = None,
    standings: list[bool] | None = None,
    maxDistance: float | None = None,
    maxPoses: int | None = None,
) -> list[dict[str, Any]]:
    """Every pose from which the agent can interact with an object; each filter narrows the search.

    ``maxDistance``, in metres, replaces the visibility distance.
    """
    if maxPoses is not None and maxPoses <= 0:
        raise ActionFailed(f"maxPoses must be > 0, not {maxPoses}.")
    if maxDistance is not None and maxDistance <= 0.0:
        raise ActionFailed(f"maxDistance must be > 0 meters, not {maxDistance:g}.")
    i = world.find(objectId)
    places = places_of(world, positions)
    if rotations is None:
        step = world.settings.rotate_step
        rotations = [k * step for k in range(max(1, int(360 // step)))]
    poses = interactable_poses(
        world,
        i,
        places,
        rotations,
        HORIZONS if horizons is None else horizons,
        (True, False) if standings is None else standings,
        maxPoses,
        maxDistance,
    )
    return [
        {"x": x, "y": y, "z": z, "rotation": yaw, "standing": standing > 0.0, "horizon": tilt}
        for x, y, z, yaw, tilt, standing in poses.tolist()
    ]
