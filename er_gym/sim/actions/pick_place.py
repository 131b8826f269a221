"""Picking objects up and putting them down."""

from __future__ import annotations

import numpy as np

from er_gym.sim import consequences
from er_gym.sim.actions.checks import require, target, within
from er_gym.sim.actions.object_action import object_action
from er_gym.sim.actions.registry import action
from er_gym.sim.crew import whose_hand
from er_gym.sim.errors import ActionFailed
from er_gym.sim.placement_restrictions import accepts
from er_gym.sim.space.landing import landing
from er_gym.sim.space.placement import free_spots
from er_gym.sim.world import World

_NEWTONS_PER_METRE = 100.0
_FARTHEST_THROW = 2.0
_FLIGHT_STEP = 0.05


def _held(world: World) -> int:
    if world.held < 0:
        raise ActionFailed("The agent's hand is empty: pick something up first.")
    return world.held


@object_action("PickupObject")
def pickup_object(
    world: World, *, objectId: str, forceAction: bool = False, manualInteract: bool = False
) -> None:
    """Take an object and all its contents into the empty hand."""
    i = target(world, objectId, forceAction)
    require(world, i, "pickupable", "something that can be picked up")
    if world.held_elsewhere and i in world.carried and i not in world.in_hand:
        raise ActionFailed(f"{objectId} is in {whose_hand(world, i)}.")
    if world.held >= 0:
        raise ActionFailed(
            f"The agent's hand holds {world.object_ids[world.held]} already; put it down first."
        )
    world.relocate(i, ())
    world.held = i
    world.arrangement_changed()
    world.carry()


def put_down(world: World, i: int, yaw: float, foot: np.ndarray, parents: list[int]) -> None:
    """Put object i at a heading, with the middle of its underside at a (3,) point."""
    world.turn(i, yaw)
    underside = (world.low[i] + world.high[i]) / 2
    underside[1] = world.low[i, 1]
    world.move_by(i, foot - underside)
    world.release(i)
    world.relocate(i, parents)
    consequences.apply(world)


def shift(world: World, i: int, offset: np.ndarray) -> None:
    """Shift object i by (3,) metres with its pickupable contents; all other contents leave it.

    In the record a table may be inside the chairs around it. It stays where it is.
    """
    inside = world.inside(i)
    loose = [k for k in inside if world.has(k, "pickupable")]
    for k in (i, *loose):
        world.set_pose(k, world.position[k] + offset, world.rotation[k].copy())
    for k in sorted(set(inside) - set(loose)):
        world.relocate_alone(k, tuple(p for p in world.parents[k] if p not in (i, *loose)))


@object_action("PutObject")
def put_object(
    world: World,
    *,
    objectId: str,
    forceAction: bool = False,
    placeStationary: bool = True,
    randomSeed: int = 0,
    putNearXY: bool = False,
) -> None:
    """Put the held object in or on a receptacle, at a visible spot near the agent.

    As in AI2-THOR, ``forceAction`` waives visibility and the placement restrictions.
    ``placeStationary``, ``randomSeed`` and ``putNearXY`` have no effect.
    """
    i = _held(world)
    receptacle = target(world, objectId, forceAction)
    require(world, receptacle, "receptacle", "a receptacle")
    if receptacle in world.in_hand:
        raise ActionFailed(f"{objectId} is in the agent's own hand.")
    if receptacle in world.carried:
        raise ActionFailed(f"{objectId} is in {whose_hand(world, receptacle)}.")
    shut = next((r for r in (receptacle, *world.ancestors(receptacle)) if world.is_shut(r)), None)
    if shut is not None:
        raise ActionFailed(
            f"{world.object_ids[shut]} is closed; open it before putting something into it."
        )
    held, kind = world.types[i], world.types[receptacle]
    if not forceAction and not accepts(held, kind):
        raise ActionFailed(f"A {kind} does not take a {held}.")
    near = world.agent.position[[0, 2]]
    hand = world.hand
    if hand is not None:  # what is tilted is set upright
        rows, arrays = world.in_hand, (world.position, world.rotation, world.low, world.high)
        tilted = [array[rows] for array in arrays]
        world.pose_hand(None)
    spot = next(free_spots(world, i, receptacle, near, seen_by=world.agent), None)
    if spot is None:
        if hand is not None:
            world.pose_hand(hand)
            for array, values in zip(arrays, tilted, strict=True):
                array[rows] = values  # to the last digit
        raise ActionFailed(f"No valid positions to place {held}: {objectId} has no free space.")
    yaw, foot = spot
    # An object on a plate on a table is on the table too, but one in a fridge is not on the floor.
    around = world.parents[receptacle] if world.has(receptacle, "pickupable") else ()
    put_down(world, i, yaw, foot, [receptacle, *around])


@action("DropHandObject", "DropHeldObject")
def drop_hand_object(
    world: World, *, forceAction: bool = False, autoSimulation: bool = True
) -> None:
    """Drop the held object: it falls onto the surface below the hand."""
    i = _held(world)
    fall(world, i, (world.low[i] + world.high[i]) / 2)


@action("ThrowObject")
def throw_object(
    world: World,
    *,
    moveMagnitude: float = 0.0,
    forceAction: bool = False,
    autoSimulation: bool = True,
) -> None:
    """Throw the held object. It falls ahead of the hand: 1 m for every 100 N, at most 2 m.

    It flies level until something is in its way. It neither breaks nor rolls.
    """
    within("moveMagnitude", moveMagnitude, 0.0, 1e6)
    i = _held(world)
    heading = np.radians(world.agent.rotation)
    ahead = np.array([np.sin(heading), 0.0, np.cos(heading)])
    reach = min(moveMagnitude / _NEWTONS_PER_METRE, _FARTHEST_THROW)
    point = start = (world.low[i] + world.high[i]) / 2
    for way in np.arange(_FLIGHT_STEP, reach + _FLIGHT_STEP / 2, _FLIGHT_STEP):
        farther = start + way * ahead
        if landing(world, i, farther) is None:
            break
        point = farther
    fall(world, i, point)


def fall(world: World, i: int, centre: np.ndarray) -> None:
    """Let object i fall from a (3,) position of its middle; inside a wall, to the agent's feet."""
    found = landing(world, i, centre)
    if found is None:
        agent = world.agent.position
        centre = agent + (centre - agent) * 0.5
        found = world.ground, list(world.of_type("Floor"))[:1]
    height, receptacles = found
    foot = np.array([centre[0], height, centre[2]])
    put_down(world, i, world.rotation[i, 1], foot, receptacles)
