"""Queries about objects: where they are, what they hold, and what lies between them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from er_gym.sim.actions.checks import FARTHEST, target, within
from er_gym.sim.actions.registry import action, quoted
from er_gym.sim.actions.vectors import Vector, array
from er_gym.sim.errors import ActionFailed
from er_gym.sim.look import FINISHES, SPLITS
from er_gym.sim.object_metadata import objects, vector
from er_gym.sim.space.outlines import Outlines
from er_gym.sim.space.room_bounds import room_bounds
from er_gym.sim.space.solid_rays import entry, first_hit
from er_gym.sim.space.solids import solid_of
from er_gym.sim.world import World

_AGENT_RADIUS = 0.2
_MINIMAL = ("name", "objectType", "objectId", "assetId")
_FLOOR = [0, 2]


@action("ObjectTypeToObjectIds")
def object_type_to_object_ids(world: World, *, objectType: str) -> list[str]:
    """The ids of all objects of a type; case and spaces do not matter."""
    wanted = (objectType or "").replace(" ", "").lower()
    kinds = {kind for kind in world.types if kind.lower() == wanted}
    return [world.object_ids[i] for i in world.of_type(*sorted(kinds))]


@action("DistanceToObject")
def distance_to_object(world: World, *, objectId: str) -> float:
    """The distance along the floor from the agent to the nearest part of an object, metres."""
    i = world.find(objectId)
    return float(Outlines.of([solid_of(world, i)]).gaps(world.agent.position[_FLOOR][None])[0, 0])


@action("GetSceneBounds")
def get_scene_bounds(world: World) -> list[dict[str, float]]:
    """The lower and the upper corner of the room, metres."""
    return [vector(corner) for corner in room_bounds(world.scene.name)]


@action("GetObjectMetadata")
def get_object_metadata(
    world: World, *, objectIds: list[str] | None = None
) -> list[dict[str, Any]]:
    """The metadata of some objects, by default of all; ids that there are not are left out."""
    wanted = None if objectIds is None else set(objectIds)
    return [
        dict(entry) for entry in objects(world) if wanted is None or entry["objectId"] in wanted
    ]


@action("GetMinimalObjectMetadata")
def get_minimal_object_metadata(
    world: World, *, objectIds: list[str] | None = None
) -> list[dict[str, Any]]:
    """The names, types and ids of some objects, by default of all."""
    found = get_object_metadata(world, objectIds=objectIds)
    return [{name: entry[name] for name in _MINIMAL} for entry in found]


@action("Contains", server_action=True)
def contains(world: World, *, objectId: str | None = None, forceAction: bool = False) -> list[str]:
    """The ids of everything in or on an object."""
    return [world.object_ids[k] for k in world.inside(target(world, objectId, forceAction))]


@action("CheckWhatObjectOn")
def check_what_object_on(
    world: World, *, objectId: str, divisions: int = 3, belowDistance: float = 0.01
) -> list[str]:
    """The ids of the receptacles that an object is in or on; the other arguments have no effect."""
    return [world.object_ids[k] for k in world.parents[world.find(objectId)]]


@action("CheckWhatObjectsOn")
def check_what_objects_on(
    world: World, *, objectIds: list[str], divisions: int = 3, belowDistance: float = 0.01
) -> dict[str, list[str]]:
    """CheckWhatObjectOn of several objects, by their ids."""
    return {each: check_what_object_on(world, objectId=each) for each in objectIds}


@action("BBoxDistance")
def bbox_distance(world: World, *, objectId0: str, objectId1: str, divisions: int = 3) -> float:
    """The distance between the axis-aligned boxes of two objects, metres; 0 if they overlap."""
    one, other = world.find(objectId0), world.find(objectId1)
    apart = np.maximum(world.low[one] - world.high[other], world.low[other] - world.high[one])
    return float(np.linalg.norm(np.maximum(apart, 0.0)))


@action("CheckUnobstructedPathBetweenObjectCenters")
def check_unobstructed_path(world: World, *, objectId0: str, objectId1: str) -> dict[str, Any]:
    """Whether any other object is on the line between the middles of two, and which."""
    one, other = world.find(objectId0), world.find(objectId1)
    start, end = ((world.low[k] + world.high[k]) / 2 for k in (one, other))
    between = [k for k in _solid(world) if k not in (one, other)]
    met = [world.object_ids[k] for k in between if entry(world, k, start, end - start) <= 1.0]
    return {"adjacent": not met, "objectInWay": met}


@action("Get2DSemanticHull")
def get_semantic_hull(world: World, *, objectId: str) -> list[list[float]]:
    """The corners x, z of an object's box seen from above, metres."""
    return _hull(world, world.find(objectId))


@action("Get2DSemanticHulls")
def get_semantic_hulls(
    world: World, *, objectIds: list[str] | None = None, objectTypes: list[str] | None = None
) -> dict[str, list[list[float]]]:
    """Get2DSemanticHull of some objects by their ids or types, by default of all."""
    if objectIds is not None and objectTypes is not None:
        raise ActionFailed("Only one of objectIds and objectTypes can have a non-null value.")
    if objectIds is not None:
        rows: Iterable[int] = [world.find(each) for each in objectIds]
    else:
        rows = np.flatnonzero(world.exists).tolist()
    return {
        world.object_ids[k]: _hull(world, k)
        for k in rows
        if objectTypes is None or world.types[k] in objectTypes
    }


def _hull(world: World, i: int) -> list[list[float]]:
    solid = solid_of(world, i)
    low, high = solid.upright[:, 0].min(axis=0), solid.upright[:, 1].max(axis=0)
    turn = np.radians(solid.yaw)
    cos, sin = np.cos(turn), np.sin(turn)
    corners = np.array([(x, z) for x in (low[0], high[0]) for z in (low[2], high[2])])[[0, 1, 3, 2]]
    turned = corners @ np.array([[cos, -sin], [sin, cos]]) + solid.middle[_FLOOR]
    hull: list[list[float]] = turned.tolist()
    return hull


@action("PerformRaycast")
def perform_raycast(world: World, *, origin: Vector, destination: Vector) -> dict[str, Any]:
    """The first object on a line from one point through another: its id, where it is met, and how
    far from the origin, metres."""
    start, way = array(origin), array(destination) - array(origin)
    for axis in range(3):
        within("origin", float(start[axis]), -FARTHEST, FARTHEST)
        within("destination", float(start[axis] + way[axis]), -FARTHEST, FARTHEST)
    row, far = first_hit(world, _solid(world), start, way)
    if row is None or not way.any():
        raise ActionFailed(
            f"Raycast from {_said(start)} to {_said(start + way)} failed to hit any target object!"
        )
    return {
        "objectId": world.object_ids[row],
        "hitPoint": vector(start + way * far),
        "hitDistance": float(np.linalg.norm(way * far)),
    }


@action("GetObjectHitFromRaycast")
def get_object_hit(world: World, *, origin: Vector, destination: Vector) -> str:
    """The id of the first object on a line from one point through another."""
    found: str = perform_raycast(world, origin=origin, destination=destination)["objectId"]
    return found


def _solid(world: World) -> list[int]:
    """The rows that stop a ray: what is there and in nothing closed."""
    found: list[int] = np.flatnonzero(~world.hidden).tolist()
    return found


def _said(point: np.ndarray) -> str:
    return f"({', '.join(f'{part:g}' for part in point.tolist())})"


@action("ApproximateAgentRadius")
def approximate_agent_radius(world: World, *, n: int = 12) -> float:
    """The radius of the agent's body, metres."""
    return _AGENT_RADIUS


@action("GetMaterials")
def get_materials(world: World) -> dict[str, list[str]]:
    """The finishes that RandomizeMaterials draws from, by their sets."""
    return {split: [f"{split}{k}" for k in range(FINISHES)] for split in SPLITS}


@action("SetObjectFilterForType")
def set_object_filter_for_type(world: World, *, objectTypes: list[str]) -> None:
    """List only objects of these types in the metadata until ResetObjectFilter."""
    unknown = [kind for kind in objectTypes if not isinstance(kind, str)]
    if unknown:
        raise ActionFailed(f"objectTypes are texts, not {quoted(unknown[0])}.")
    world.listed = frozenset(world.of_type(*set(objectTypes)))
