"""Placing an object at a point, wherever the agent is."""

from __future__ import annotations

import numpy as np

from er_gym.sim import consequences
from er_gym.sim.actions.checks import FARTHEST, within
from er_gym.sim.actions.pick_place import fall, shift
from er_gym.sim.actions.registry import action
from er_gym.sim.actions.vectors import Vector, array
from er_gym.sim.errors import ActionFailed
from er_gym.sim.space.clearance import Clearance
from er_gym.sim.space.placement import spawn_points
from er_gym.sim.space.receptacles import receptacles_of
from er_gym.sim.world import World

_LIFT = 0.01
"""Height of GetSpawnCoordinatesAboveReceptacle's points above the surface, metres."""


@action("GetSpawnCoordinatesAboveReceptacle")
def get_spawn_coordinates(
    world: World, *, objectId: str, anywhere: bool = True
) -> list[dict[str, float]]:
    """Points a little above the surface of a receptacle, 5 cm apart, metres.

    Args:
        anywhere: False for only those in the agent's picture.
    """
    i = world.find(objectId)
    if not world.has(i, "receptacle"):
        raise ActionFailed(f"{objectId} is not a receptacle.")
    points = spawn_points(world, i, None if anywhere else world.agent)
    return [{"x": x, "y": y + _LIFT, "z": z} for x, y, z in points.tolist()]


def _loose(world: World, object_id: str) -> int:
    i = world.find(object_id)
    if not (world.has(i, "pickupable") or world.has(i, "moveable")):
        raise ActionFailed(f"{object_id} can neither be picked up nor moved.")
    return i


def _sane(*vectors: Vector | None) -> None:
    for vector in vectors:
        for axis in "xyz" if vector is not None else "":
            within(axis, getattr(vector, axis), -FARTHEST, FARTHEST)


def _settle(world: World, i: int, stays: bool) -> None:
    """Update the receptacles of object i. If it is in none, it falls, unless it ``stays``."""
    world.release(i)
    parents = receptacles_of(world, i)
    if parents or stays:
        world.relocate(i, parents)
        consequences.apply(world)
    else:
        fall(world, i, (world.low[i] + world.high[i]) / 2)


def _around(world: World, point: np.ndarray) -> tuple[int, ...]:
    """The furniture whose box contains a (3,) point: the box has air in it, like a cabinet's."""
    within = ((world.low <= point) & (point <= world.high)).all(axis=1)
    return tuple(
        k
        for k in np.flatnonzero(within).tolist()
        if world.has(k, "receptacle") and not world.has(k, "pickupable")
    )


def _moved(
    world: World,
    i: int,
    rotation: Vector | None,
    position: np.ndarray,
    forced: bool,
    standing: bool = False,
) -> str | None:
    """Put object i at a position. If something is in the way and this is not forced, nothing moves.

    Args:
        standing: the position is for the middle of its underside.

    Returns:
        The obstacle, None if the object has moved.
    """
    rows = [i, *world.inside(i)]
    kept = (world.position, world.rotation, world.low, world.high)
    were = [each[rows].copy() for each in kept]
    if rotation is not None:
        world.set_pose(i, world.position[i].copy(), array(rotation))
    if standing:
        foot = (world.low[i] + world.high[i]) / 2
        foot[1] = world.low[i, 1]
        position = world.position[i] + position - foot
    offset = position - world.position[i]
    foot = (world.low[i] + world.high[i]) / 2 + offset
    foot[1] = world.low[i, 1] + offset[1]
    clearance = Clearance(world, i, _around(world, foot))
    obstacle = None if forced else clearance.obstacle(offset, placing=True)
    if obstacle is None:
        shift(world, i, offset)
        return None
    for each, was in zip(kept, were, strict=True):
        each[rows] = was
    world.move_by(i, np.zeros(3))
    return obstacle


@action("PlaceObjectAtPoint")
def place_object_at_point(
    world: World,
    *,
    objectId: str,
    position: Vector,
    rotation: Vector | None = None,
    forceKinematic: bool = False,
) -> None:
    """Put an object with its underside on a point, if the place is free; metres.

    If it is then in no receptacle, it falls, unless ``forceKinematic`` holds it.
    """
    _sane(position, rotation)
    i = _loose(world, objectId)
    obstacle = _moved(world, i, rotation, array(position), forced=False, standing=True)
    if obstacle is not None:
        raise ActionFailed(f"spawn area not clear ({obstacle}), can't place object at that point")
    _settle(world, i, forceKinematic)


@action("TeleportObject")
def teleport_object(
    world: World,
    *,
    objectId: str,
    position: Vector | None = None,
    positions: list[Vector] | None = None,
    x: float | None = None,
    y: float | None = None,
    z: float | None = None,
    rotation: Vector | None = None,
    forceAction: bool = False,
    allowTeleportOutOfHand: bool = False,
    forceKinematic: bool = False,
    makeUnbreakable: bool = False,
    includeErrorMessage: bool = False,
) -> None:
    """Move an object to a point, or to the first free one of several; metres.

    ``forceAction`` requires no free space. If the object is then in no receptacle, it falls, unless
    ``forceKinematic`` holds it. ``makeUnbreakable`` and ``includeErrorMessage`` have no effect.
    """
    if x is not None and y is not None and z is not None:
        position = Vector(x=x, y=y, z=z)
    wanted = [position] if position is not None else list(positions or ())
    if not wanted:
        raise ActionFailed("Give a position, or positions, to teleport the object to.")
    _sane(rotation, *wanted)
    i = _loose(world, objectId)
    if world.is_held(i) and not allowTeleportOutOfHand:
        raise ActionFailed("Cannot teleport object while it is being held.")
    obstacle = None
    for each in wanted:
        obstacle = _moved(world, i, rotation, array(each), forceAction)
        if obstacle is None:
            _settle(world, i, forceKinematic)
            return
    raise ActionFailed(f"{objectId} would collide with {obstacle} there.")
