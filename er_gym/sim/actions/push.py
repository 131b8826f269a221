"""Pushing and pulling: objects slide along the surface that they stand on."""

from __future__ import annotations

from typing import Any

import numpy as np

from er_gym.sim import consequences
from er_gym.sim.actions.checks import target, within
from er_gym.sim.actions.object_action import object_action, pointed_at
from er_gym.sim.actions.pick_place import fall, shift
from er_gym.sim.actions.registry import action
from er_gym.sim.actions.vectors import Vector
from er_gym.sim.errors import ActionFailed
from er_gym.sim.space.clearance import Clearance
from er_gym.sim.space.receptacles import receptacles_of
from er_gym.sim.world import World

_NEWTONS_PER_METRE = 100.0
_FARTHEST = 2.0
"""An object slides 1 m for every 100 N, and at most this far, metres."""
_MOST_NEWTONS = 1e6
_FLOOR = [0, 2]


def _slide(world: World, i: int, heading: float, newtons: float) -> None:
    """Slide object i on its level until something is in its way. Beyond an edge it falls.

    Args:
        heading: degrees clockwise from +z.
        newtons: the force.
    """
    if world.is_held(i):
        raise ActionFailed("Please use Throw for an item in the Agent's Hand.")
    if not (world.has(i, "pickupable") or world.has(i, "moveable")):
        raise ActionFailed("Target Primary Property type incompatible with push/pull.")
    angle = np.radians(heading)
    ahead = np.array([np.sin(angle), 0.0, np.cos(angle)])
    far = Clearance(world, i).slide_distance(ahead, min(newtons / _NEWTONS_PER_METRE, _FARTHEST))
    if far <= 0.0:
        return
    under = next(iter(world.parents[i]), None)
    shift(world, i, far * ahead)
    centre = (world.low[i] + world.high[i]) / 2
    if under is None or world.types[under] == "Floor" or _is_over(world, under, centre):
        world.relocate(i, receptacles_of(world, i))
        consequences.apply(world)
    else:
        fall(world, i, centre)


def _is_over(world: World, receptacle: int, point: np.ndarray) -> bool:
    low, high = world.low[receptacle], world.high[receptacle]
    return bool((low <= point)[_FLOOR].all() and (point <= high)[_FLOOR].all())


def _newtons(magnitude: float) -> float:
    within("moveMagnitude", magnitude, 0.0, _MOST_NEWTONS)
    return magnitude


@object_action("DirectionalPush")
def directional_push(
    world: World,
    *,
    objectId: str,
    moveMagnitude: float,
    pushAngle: float,
    forceAction: bool = False,
) -> None:
    """Push an object with a force in newtons, at an angle clockwise from the agent's heading."""
    i = target(world, objectId, forceAction)
    _slide(world, i, world.agent.rotation + pushAngle, _newtons(moveMagnitude))


@object_action("PushObject")
def push_object(
    world: World, *, objectId: str, moveMagnitude: float = 0.0, forceAction: bool = False
) -> None:
    """Push an object away from the agent with a force in newtons."""
    i = target(world, objectId, forceAction)
    _slide(world, i, world.agent.rotation, _newtons(moveMagnitude))


@object_action("PullObject")
def pull_object(
    world: World, *, objectId: str, moveMagnitude: float = 0.0, forceAction: bool = False
) -> None:
    """Pull an object towards the agent with a force in newtons."""
    i = target(world, objectId, forceAction)
    _slide(world, i, world.agent.rotation + 180.0, _newtons(moveMagnitude))


@action("TouchThenApplyForce")
def touch_then_apply_force(
    world: World,
    *,
    x: float,
    y: float,
    direction: Vector,
    handDistance: float,
    moveMagnitude: float = 0.0,
) -> dict[str, Any]:
    """Reach for a point of the picture and push the object there.

    Args:
        direction: of the push, in the agent's frame; its upward part has no effect.
        handDistance: how far the hand reaches, metres.
        moveMagnitude: the force, newtons.

    Returns:
        Whether the hand touched an object, its id, and how far the hand went, metres.
    """
    newtons = _newtons(moveMagnitude)
    try:
        object_id = pointed_at(world, x, y)
    except ActionFailed:
        if not (0.0 <= x <= 1.0 and 0.0 <= y <= 1.0):
            raise
        return _touch("", handDistance)
    i = world.find(object_id)
    camera = world.agent.camera
    away = float(np.linalg.norm(np.clip(camera, world.low[i], world.high[i]) - camera))
    if away > handDistance:
        return _touch("", handDistance)
    pushed = not world.is_held(i) and (world.has(i, "pickupable") or world.has(i, "moveable"))
    if pushed and np.hypot(direction.x, direction.z) > 0.0:
        heading = float(np.degrees(np.arctan2(direction.x, direction.z)))
        _slide(world, i, world.agent.rotation + heading, newtons)
    return _touch(object_id, away)


def _touch(object_id: str, distance: float) -> dict[str, Any]:
    return {
        "didHandTouchSomething": bool(object_id),
        "objectId": object_id,
        "armsLength": float(distance),
    }
