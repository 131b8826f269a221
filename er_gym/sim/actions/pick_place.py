"""Taking things into the hand and putting them down."""

from __future__ import annotations

import numpy as np

from er_gym.sim import consequences
from er_gym.sim.actions.checks import require, target
from er_gym.sim.actions.registry import action
from er_gym.sim.compatibility import accepts
from er_gym.sim.errors import ActionFailed
from er_gym.sim.space.placement import free_spots, surface_height
from er_gym.sim.world import AGENT_HEIGHT, World


def _held(world: World) -> int:
    if world.held < 0:
        raise ActionFailed("The agent's hand is empty: pick something up first.")
    return world.held


@action("PickupObject")
def pickup_object(
    world: World, *, objectId: str, forceAction: bool = False, manualInteract: bool = False
) -> None:
    """Take an object, with all that lies in it, into the empty hand."""
    i = target(world, objectId, forceAction)
    require(world, i, "pickupable", "something that can be picked up")
    if world.held >= 0:
        raise ActionFailed(
            f"The agent's hand holds {world.object_ids[world.held]} already; put it down first."
        )
    world.relocate(i, ())
    world.held = i
    world.changed()
    world.carry()


def _put_down(world: World, i: int, yaw: float, foot: np.ndarray, parents: list[int]) -> None:
    """Stand object i at a heading with the middle of its underside at a (3,) point."""
    world.turn(i, yaw)
    underside = (world.low[i] + world.high[i]) / 2
    underside[1] = world.low[i, 1]
    world.move_by(i, foot - underside)
    world.held = -1
    world.relocate(i, parents)
    consequences.apply(world)


@action("PutObject")
def put_object(
    world: World, *, objectId: str, forceAction: bool = False, placeStationary: bool = True
) -> None:
    """Put what is held in or on a receptacle, where it is seen and nearest to the agent.

    ``forceAction`` waives the receptacle's restrictions on types, as in AI2-THOR, besides
    visibility.
    """
    i = _held(world)
    receptacle = target(world, objectId, forceAction)
    require(world, receptacle, "receptacle", "a receptacle")
    if receptacle in world.in_hand:
        raise ActionFailed(f"{objectId} is in the agent's own hand.")
    shut = next((r for r in (receptacle, *world.ancestors(receptacle)) if world.is_shut(r)), None)
    if shut is not None:
        raise ActionFailed(
            f"{world.object_ids[shut]} is closed; open it before putting something into it."
        )
    held, kind = world.types[i], world.types[receptacle]
    if not forceAction and not accepts(held, kind):
        raise ActionFailed(f"A {kind} does not take a {held}.")
    near = world.agent.position[[0, 2]]
    spot = next(free_spots(world, i, receptacle, near), None)
    if spot is None:
        raise ActionFailed(f"No valid positions to place {held}: {objectId} has no free space.")
    yaw, foot = spot
    # What is on a plate on a table is on the table too; what is in the fridge is not on the floor.
    around = world.parents[receptacle] if world.has(receptacle, "pickupable") else ()
    _put_down(world, i, yaw, foot, [receptacle, *around])


@action("DropHandObject")
def drop_hand_object(
    world: World, *, forceAction: bool = False, autoSimulation: bool = True
) -> None:
    """Let go of what is held: it falls onto whatever is under the hand."""
    i = _held(world)
    centre = (world.low[i] + world.high[i]) / 2
    agent = world.agent.position
    if not world.floor.contains(centre[[0, 2]]):
        # Over furniture: it lands on the highest surface there; over a wall it slides to the feet.
        under = [
            r
            for r in np.flatnonzero(~world.hidden)
            if world.has(int(r), "receptacle")
            and not world.has(int(r), "openable")
            and r not in world.in_hand
            and world.types[r] != "Floor"
            and (world.low[r, [0, 2]] <= centre[[0, 2]]).all()
            and (world.high[r, [0, 2]] >= centre[[0, 2]]).all()
            and surface_height(world, int(r)) <= centre[1]
        ]
        if under:
            best = max(under, key=lambda r: surface_height(world, int(r)))
            foot = np.array([centre[0], surface_height(world, int(best)), centre[2]])
            _put_down(world, i, world.rotation[i, 1], foot, [int(best)])
            return
        centre = agent + (centre - agent) * 0.5
    floors = list(world.of_type("Floor"))
    foot = np.array([centre[0], agent[1] - AGENT_HEIGHT, centre[2]])
    _put_down(world, i, world.rotation[i, 1], foot, floors[:1])
