"""Shortest paths to objects and points, and the next step along them."""

from __future__ import annotations

from typing import Any

import numpy as np

from er_gym.sim.actions.checks import FARTHEST, within
from er_gym.sim.actions.move import step_end
from er_gym.sim.actions.registry import action, quoted
from er_gym.sim.actions.vectors import Vector
from er_gym.sim.errors import ActionFailed
from er_gym.sim.space.interactable_poses import HORIZONS, interactable_poses
from er_gym.sim.space.reachable_positions import reachable_positions
from er_gym.sim.space.shortest_path import shortest_path
from er_gym.sim.space.walkable_floor import floor_of, standing_places
from er_gym.sim.world import World

_ALLOWED_ERROR = 0.0001
"""How far from the floor a start or an end may be, metres; AI2-THOR's value."""
_SNAPS = 0.2
"""If the start or the end is so near to the floor, the other may be this far from it, metres; so it
is in AI2-THOR."""
_YAWS = tuple(range(0, 360, 30))
_FLOOR = [0, 2]


def _target(world: World, object_type: str | None, object_id: str | None) -> int:
    """The row of an object named by its id, or by its type if there is only one of it."""
    if object_id:
        return world.find(object_id)
    if not object_type:
        raise ActionFailed("Give an objectType or an objectId to look for a way to.")
    found = list(world.of_type(object_type))
    if not found:
        raise ActionFailed(f"No object of type {quoted(object_type)} is in {world.scene.name}.")
    if len(found) > 1:
        raise ActionFailed(
            f"Multiple objects of type {object_type} were found, cannot disambiguate: "
            "give an objectId."
        )
    return found[0]


def _views(world: World, i: int, start: np.ndarray) -> np.ndarray:
    """(E, 2) reachable positions on the agent's grid from which an object is visible."""
    step = max(world.settings.grid_size, 0.1)  # more positions add nothing
    if floor_of(world.scene.name).contains(start):
        places = reachable_positions(world.scene.name, start, step)
    else:
        places = standing_places(world.scene.name, step)
    poses = interactable_poses(world, i, places, _YAWS, HORIZONS, (True,))
    return np.unique(poses[:, _FLOOR], axis=0)


def _start(world: World, position: Vector | None) -> np.ndarray:
    if position is None:
        return np.asarray(world.agent.position[_FLOOR])
    return _point(position.x, position.z)


def _point(x: float, z: float) -> np.ndarray:
    within("x", x, -FARTHEST, FARTHEST)
    within("z", z, -FARTHEST, FARTHEST)
    return np.array([x, z])


def _path(
    world: World, start: np.ndarray, ends: np.ndarray, what: str, error: float
) -> dict[str, Any]:
    floor = floor_of(world.scene.name)
    if any(floor.nearest_free(point, error) is not None for point in (start, *ends)):
        error = max(error, _SNAPS)
    found = shortest_path(world.scene.name, start, ends, error)
    if found is None:
        raise ActionFailed(
            f"Path from ({start[0]:.3f}, {start[1]:.3f}) to {what} could not be found: it has to "
            "begin and to end on floor that hangs together."
        )
    ground = world.ground
    return {"corners": [{"x": x, "y": ground, "z": z} for x, z in found[1].tolist()]}


@action("GetShortestPath")
def get_shortest_path(
    world: World,
    *,
    objectType: str | None = None,
    objectId: str | None = None,
    position: Vector | None = None,
    rotation: Vector | None = None,
    allowedError: float = _ALLOWED_ERROR,
) -> dict[str, Any]:
    """The corners of the shortest path to a position from which an object is visible, metres.

    Args:
        position: the start; by default the agent's position.
        rotation: has no effect.
        allowedError: how far from the floor the start may be, metres.
    """
    i = _target(world, objectType, objectId)
    start = _start(world, position)
    return _path(world, start, _views(world, i, start), world.object_ids[i], allowedError)


@action("GetShortestPathToPoint")
def get_shortest_path_to_point(
    world: World,
    *,
    position: Vector | None = None,
    target: Vector | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    allowedError: float = _ALLOWED_ERROR,
) -> dict[str, Any]:
    """The corners of the shortest path to a point, ``target`` or ``x, y, z``; metres."""
    if target is not None:
        x, z = target.x, target.z
    if x is None or z is None:
        raise ActionFailed("Give a target, or its x, y and z, to look for a way to.")
    end = _point(x, z)[None]
    return _path(world, _start(world, position), end, f"({x:.3f}, {z:.3f})", allowedError)


@action("ObjectNavExpertAction")
def object_nav_expert_action(
    world: World,
    *,
    objectType: str | None = None,
    objectId: str | None = None,
    position: Vector | None = None,
) -> str | None:
    """The next action towards a position, or towards a view of an object; None on arrival.

    The action is MoveAhead, RotateLeft or RotateRight, along a shortest path on the agent's grid.
    """
    here = world.agent.position[_FLOOR]
    step = max(world.settings.grid_size, 0.05)  # more positions add nothing
    places = reachable_positions(world.scene.name, here, step)
    if position is not None:
        point = _point(position.x, position.z)
        ends = places[[np.linalg.norm(places - point, axis=1).argmin()]]
        facing = None
    else:
        i = _target(world, objectType, objectId)
        ends = _views(world, i, here)
        facing = ((world.low[i] + world.high[i]) / 2)[_FLOOR]
    found = shortest_path(world.scene.name, here, ends, step)
    if found is None:
        raise ActionFailed("Path to target could not be found.")
    if np.abs(found[1][-1] - here).max() < step / 2:
        return None if facing is None else _turn_towards(world, facing - here)
    return _towards(world, here, found[1][1], step)


def _towards(world: World, here: np.ndarray, corner: np.ndarray, step: float) -> str:
    """The action that brings the agent nearest to a corner: a step, or a turn before it."""
    floor, turn = floor_of(world.scene.name), world.settings.rotate_step
    turns = range(int(360.0 // turn)) if turn < 360.0 else range(1)
    gaps = {}
    for k in sorted(turns, key=lambda k: min(k, len(turns) - k)):  # the smallest turn first
        end = step_end(world, step, k * turn)[_FLOOR]
        if floor.path_is_clear(here, end) and np.abs(end - here).max() > step / 4:
            gaps[k] = round(float(np.linalg.norm(corner - end)), 6)
    best = min(gaps, key=lambda k: gaps[k], default=1)
    if best == 0:
        return "MoveAhead"
    return "RotateRight" if best <= len(turns) / 2 else "RotateLeft"


def _turn_towards(world: World, way: np.ndarray) -> str | None:
    bearing = float(np.degrees(np.arctan2(way[0], way[1])))
    aside = (bearing - world.agent.rotation + 180.0) % 360.0 - 180.0
    if abs(aside) <= world.settings.rotate_step / 2:
        return None
    return "RotateRight" if aside > 0.0 else "RotateLeft"
