"""Queries about what is seen from where."""

from __future__ import annotations

from math import radians, tan

import numpy as np

from er_gym.sim.actions.checks import within
from er_gym.sim.actions.object_action import shown_at
from er_gym.sim.actions.query import get_interactable_poses, places_of
from er_gym.sim.actions.registry import action, quoted
from er_gym.sim.actions.vectors import Vector, array
from er_gym.sim.agent import Agent
from er_gym.sim.carrying import camera_rotation
from er_gym.sim.errors import ActionFailed
from er_gym.sim.object_metadata import vector
from er_gym.sim.space.bodies import hidden, hiding
from er_gym.sim.space.line_of_sight_builder import lines_of_sight
from er_gym.sim.space.solids.sample_points import sample_points
from er_gym.sim.space.visibility import Sight, seen_by, visible
from er_gym.sim.world import World

_SCHEMES = ("distance", "collider")
_QUARTERS = (0.0, 90.0, 180.0, 270.0)
_ANYWHERE = 1e5
_RANGE = 5
"""VisibleRange looks at so many points across and down."""


@action("GetVisibleObjects")
def get_visible_objects(
    world: World,
    *,
    maxDistance: float | None = None,
    visibilityScheme: str | None = None,
    thirdPartyCameraIndex: int | None = None,
    objectIds: list[str] | None = None,
) -> list[str]:
    """The ids of the objects that the agent, or a third-party camera, sees.

    Args:
        maxDistance: replaces the visibility distance, metres.
        visibilityScheme: "distance" or "collider"; both are one here.
        objectIds: look for these only.
    """
    if visibilityScheme is not None and visibilityScheme.lower() not in _SCHEMES:
        raise ActionFailed(
            f"Visibility scheme {quoted(visibilityScheme)} is not implemented. Must be 'distance' "
            "or 'collider'."
        )
    settings = world.settings
    position, camera, angles = _camera(world, thirdPartyCameraIndex)
    distance = settings.visibility_distance if maxDistance is None else maxDistance
    within("maxDistance", distance, 0.0, np.inf)
    bodies = hiding(world, own=thirdPartyCameraIndex is not None)
    lens = (*angles, settings.width / settings.height)
    found = seen_by(world, Sight(position, camera, lens, distance, bodies))
    found[[i for i in world.in_hand if not world.hidden[i]]] = True
    rows = None if objectIds is None else {world.find(each) for each in objectIds}
    seen = np.flatnonzero(found).tolist()
    return [world.object_ids[i] for i in seen if rows is None or i in rows]


def _camera(
    world: World, number: int | None
) -> tuple[np.ndarray, np.ndarray, tuple[float, float, float]]:
    """(3,) from where distances count, (3,) where the camera is, and its rotation, horizon and
    field of view."""
    if number is None:
        agent = world.agent
        return agent.position, agent.camera, (
            agent.rotation, agent.horizon, world.settings.field_of_view
        )  # fmt: skip
    if not 0 <= number < len(world.cameras):
        raise ActionFailed(f"There is no third-party camera {number}.")
    camera = world.cameras[number]
    pitch, yaw, roll = camera.rotation
    if roll or camera.orthographic_size is not None:
        raise ActionFailed(
            "The embedded engine tells what a third-party camera sees if it is upright and in "
            "perspective."
        )
    at = np.array(camera.position)
    return at, at, (yaw, pitch, camera.field_of_view)


@action("ObjectsVisibleFromThirdPartyCamera")
def objects_visible_from_camera(
    world: World,
    *,
    thirdPartyCameraIndex: int,
    maxDistance: float | None = None,
    visibilityScheme: str | None = None,
) -> list[str]:
    """The old name of GetVisibleObjects of a third-party camera."""
    seen: list[str] = get_visible_objects(
        world,
        maxDistance=maxDistance,
        visibilityScheme=visibilityScheme,
        thirdPartyCameraIndex=thirdPartyCameraIndex,
    )
    return seen


@action("PositionsFromWhichItemIsInteractable")
def positions_interactable(
    world: World, *, objectId: str, horizon: float = 30.0, positions: list[Vector] | None = None
) -> dict[str, list[float]]:
    """The old form of GetInteractablePoses: each part of the poses as a list."""
    within("horizon", horizon, 1.0, 90.0)
    poses = get_interactable_poses(
        world,
        objectId=objectId,
        positions=positions,
        horizons=np.arange(-30.0, 60.0 + 1e-6, horizon).tolist(),
    )
    names = ("x", "y", "z", "rotation", "standing", "horizon")
    return {name: [float(pose[name]) for pose in poses] for name in names}


@action("NumberOfPositionsFromWhichItemIsVisible")
def number_of_positions_visible(
    world: World, *, objectId: str, positions: list[Vector] | None = None
) -> int:
    """How many poses see an object from any distance, with the camera's present horizon."""
    return len(
        get_interactable_poses(
            world,
            objectId=objectId,
            positions=positions,
            horizons=[world.agent.horizon],
            maxDistance=_ANYWHERE,
        )
    )


@action("NumberOfPositionsObjectsOfTypeAreVisibleFrom")
def number_of_positions_of_type(
    world: World, *, objectType: str, positions: list[Vector] | None = None
) -> dict[str, int]:
    """NumberOfPositionsFromWhichItemIsVisible of each object of a type; case does not matter."""
    kinds = {kind for kind in world.types if kind.lower() == (objectType or "").lower()}
    return {
        world.object_ids[i]: number_of_positions_visible(
            world, objectId=world.object_ids[i], positions=positions
        )
        for i in world.of_type(*sorted(kinds))
    }


@action("ObjectsVisibleFromPositions", server_action=True)
def objects_visible_from_positions(
    world: World, *, positions: list[Vector] | None = None
) -> dict[str, list[list[float]]]:
    """For each object seen from a position and a quarter turn: x, y, z and rotation of each."""
    agent = world.agent
    found: dict[str, list[list[float]]] = {}
    y = float(agent.position[1])
    for x, z in places_of(world, positions or None).tolist():
        for yaw in _QUARTERS:
            pose = Agent(np.array([x, y, z]), yaw, agent.horizon, agent.standing)
            for i in np.flatnonzero(visible(world, pose)).tolist():
                found.setdefault(world.object_ids[i], []).append([x, y, z, yaw])
    return found


@action("GetVisibilityPoints")
def get_visibility_points(world: World, *, objectId: str) -> list[dict[str, float]]:
    """The points of an object that make it visible, metres."""
    return [vector(point) for point in sample_points(world, world.find(objectId))]


@action("GetVisibilityPointsOfObjects")
def get_visibility_points_of_objects(world: World) -> dict[str, list[dict[str, float]]]:
    """GetVisibilityPoints of all objects."""
    rows = np.flatnonzero(world.exists).tolist()
    return {world.object_ids[i]: [vector(p) for p in sample_points(world, i)] for i in rows}


def _in_viewport(world: World, points: np.ndarray) -> np.ndarray:
    """(P, 3) where (P, 3) points are in the agent's picture: 0 to 1 from its upper left corner, and
    metres along the view."""
    settings, agent = world.settings, world.agent
    right, up, ahead = ((points - agent.camera) @ camera_rotation(agent)).T
    half = tan(radians(settings.field_of_view / 2))
    safe = np.where(np.abs(ahead) < 1e-9, 1e-9, ahead)
    aspect = settings.width / settings.height
    with np.errstate(all="ignore"):  # a narrow picture may be infinitely many pictures away
        x = 0.5 + right / (2 * half * safe * aspect)
        y = 0.5 - up / (2 * half * safe)
    return np.column_stack([x, y, ahead])


@action("WorldToViewportPoint")
def world_to_viewport_point(world: World, *, position: Vector) -> dict[str, float]:
    """Where a point is in the agent's picture: 0 to 1 from its upper left corner, and metres along
    the view."""
    at = _in_viewport(world, array(position)[None])[0]
    if at[2] <= 0.0 or not ((at[:2] >= 0.0) & (at[:2] <= 1.0)).all():
        raise ActionFailed("Point not in viewport.")
    return vector(at)


@action("ApproxPercentScreenObjectOccupies")
def approx_percent_of_screen(world: World, *, objectId: str) -> float:
    """The share of the picture that the rectangle around an object's seen points takes."""
    i = world.find(objectId)
    points = sample_points(world, i)
    eye, targets = world.agent.camera[None], points.astype(np.float32)
    clear = lines_of_sight(world).unobstructed(eye, targets, i)[0]
    clear &= ~hidden(hiding(world), eye, targets)[0]
    at = _in_viewport(world, points)
    inside = clear & (at[:, 2] > 0.0) & ((at[:, :2] > 0.0) & (at[:, :2] < 1.0)).all(axis=1)
    if world.hidden[i] or not inside.any():
        return 0.0
    return float(np.prod(np.ptp(at[inside, :2], axis=0)))


@action("VisibleRange")
def visible_range(world: World) -> list[dict[str, float]]:
    """The agent's position, and the points of the room at 25 points of its picture, metres."""
    at = [(k + 0.5) / _RANGE for k in range(_RANGE)]
    seen = [vector(shown_at(world, x, y)) for x in at for y in at]
    return [vector(world.agent.position), *seen]
