"""Actions on many objects at once, and other forms of actions on one."""

from __future__ import annotations

from collections.abc import Set as AbstractSet

import numpy as np
from pydantic import BaseModel, ConfigDict

from er_gym.sim import consequences
from er_gym.sim.actions.checks import within
from er_gym.sim.actions.looks import draw_by
from er_gym.sim.actions.move import teleport_to
from er_gym.sim.actions.object_action import object_action
from er_gym.sim.actions.open_toggle import ONLY_SHUT, set_openness
from er_gym.sim.actions.pick_place import put_object
from er_gym.sim.actions.place_at_point import teleport_object
from er_gym.sim.actions.push import pull_object, push_object
from er_gym.sim.actions.query import places_of
from er_gym.sim.actions.registry import action, quoted
from er_gym.sim.actions.state_change import change_state
from er_gym.sim.actions.vectors import Vector
from er_gym.sim.errors import ActionFailed
from er_gym.sim.object_metadata import vector
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World


def _openable(world: World, rows: list[int]) -> list[int]:
    """Those of some objects that can be opened or closed now."""
    return [
        i
        for i in rows
        if world.has(i, "openable")
        and not (world.types[i] in ONLY_SHUT and world.state(i, "isToggled"))
    ]


@action("OpenVisibleObjects")
def open_visible_objects(
    world: World, *, simplifyPhysics: bool = False, openness: float = 1.0
) -> None:
    """Open all visible objects that are closed."""
    within("openness", openness, 0.0, 1.0)
    for i in _openable(world, np.flatnonzero(visible(world)).tolist()):
        if not world.state(i, "isOpen"):
            set_openness(world, i, openness)


@action("CloseVisibleObjects")
def close_visible_objects(world: World, *, simplifyPhysics: bool = False) -> None:
    """Close all visible objects that are open."""
    for i in _openable(world, np.flatnonzero(visible(world)).tolist()):
        if world.state(i, "isOpen"):
            set_openness(world, i, 0.0)


@action("RandomlyOpenCloseObjects")
def randomly_open_close_objects(
    world: World,
    *,
    simplifyPhysics: bool = False,
    pOpen: float = 0.5,
    randOpenness: bool = True,
) -> None:
    """Open each openable object with a probability, by a random share or wholly."""
    within("pOpen", pOpen, 0.0, 1.0)
    random = draw_by(world)
    for i in _openable(world, np.flatnonzero(world.exists).tolist()):
        chance, share = random.random(2).tolist()
        if chance < pOpen:
            set_openness(world, i, share if randOpenness else 1.0)


@action("OpenObjectImmediate")
def open_object_immediate(world: World, *, objectId: str, openness: float = 1.0) -> None:
    """Open an object by a share, wherever it is."""
    i = world.find(objectId)
    if not world.has(i, "openable"):
        raise ActionFailed(f"{objectId} is not an Openable object")
    within("openness", openness, 0.0, 1.0)
    set_openness(world, i, openness)


class ObjectStates(BaseModel):
    """What ``SetObjectStates`` sets: of which type, and which state by the property's name."""

    model_config = ConfigDict(extra="ignore")

    objectType: str | None = None
    stateChange: str | None = None
    isToggled: bool = False
    isOpen: bool = False
    isBroken: bool = False
    isFilledWithLiquid: bool = False
    isDirty: bool = False
    isCooked: bool = False
    isSliced: bool = False
    isUsedUp: bool = False


_STATES = {
    "toggleable": "isToggled",
    "openable": "isOpen",
    "breakable": "isBroken",
    "canFillWithLiquid": "isFilledWithLiquid",
    "dirtyable": "isDirty",
    "cookable": "isCooked",
    "sliceable": "isSliced",
    "canBeUsedUp": "isUsedUp",
}


@action("SetObjectStates", server_action=True)
def set_object_states(world: World, *, SetObjectStates: ObjectStates | None = None) -> None:
    """Put all objects of a type, by default of all types, into a state that they can be in."""
    wanted = SetObjectStates
    if wanted is None or wanted.stateChange is None:
        raise ActionFailed(
            "SetObjectStates needs a stateChange, the name of the property whose state it sets."
        )
    state = _STATES.get(wanted.stateChange)
    if state is None:
        raise ActionFailed(f"{quoted(wanted.stateChange)} is not one of {', '.join(_STATES)}.")
    value: bool = getattr(wanted, state)
    for i in np.flatnonzero(world.exists).tolist():
        suits = wanted.objectType in (None, world.types[i])
        if (
            suits
            and world.exists[i]
            and world.has(i, wanted.stateChange)
            and i not in world.carried
        ):
            if state == "isOpen":
                set_openness(world, i, float(value))
            elif world.state(i, state) != value:
                change_state(world, i, state, value)
    consequences.apply(world)


@action("ApplyForceObject", server_action=True)
def apply_force_object(
    world: World,
    *,
    objectId: str | None = None,
    moveMagnitude: float = 0.0,
    z: float = 1.0,
    forceAction: bool = False,
) -> None:
    """PushObject, or PullObject if ``z`` is negative."""
    push = pull_object if z < 0.0 else push_object
    push(world, objectId=objectId or "", moveMagnitude=moveMagnitude, forceAction=forceAction)


@object_action("PlaceHeldObject")
def place_held_object(
    world: World,
    *,
    objectId: str,
    maxDistance: float = 0.0,
    forceAction: bool = False,
    placeStationary: bool = True,
    randomSeed: int = 0,
    putNearXY: bool = False,
) -> None:
    """PutObject by its old name; ``maxDistance`` has no effect."""
    put_object(world, objectId=objectId, forceAction=forceAction)


@action("TeleportObjectToFloor", server_action=True)
def teleport_object_to_floor(
    world: World,
    *,
    objectId: str = "",
    x: float = 0.0,
    z: float = 0.0,
    rotation: Vector | None = None,
) -> None:
    """Let an object fall to the floor at x, z, wherever it is."""
    i = world.find(objectId)
    half = float(world.high[i, 1] - world.low[i, 1]) / 2
    at = Vector(x=x, y=world.ground + half + 0.1, z=z)
    teleport_object(world, objectId=objectId, position=at, rotation=rotation, forceAction=True)


@action("RandomlyMoveAgent")
def randomly_move_agent(world: World, *, randomSeed: int = 0) -> list[dict[str, float]]:
    """Put the agent at a random reachable position and quarter turn; returns the positions."""
    random, agent = np.random.default_rng(randomSeed % 2**64), world.agent
    places = places_of(world, None)
    if not len(places):
        raise ActionFailed("Could not find a position in which the agent fits.")
    x, z = places[random.integers(len(places))].tolist()
    yaw = 90.0 * float(random.integers(4))
    y = float(agent.position[1])
    teleport_to(world, (x, y, z), yaw, None, agent.standing, force=True)
    return [vector(np.array([px, y, pz])) for px, pz in places.tolist()]


def _rows(world: World, object_id: str, with_contents: bool) -> set[int]:
    i = world.find(object_id)
    return {i, *(world.inside(i) if with_contents else ())}


def _show(world: World, unshown: AbstractSet[int]) -> None:
    world.unshown = frozenset(i for i in unshown if world.types[i] != "Floor")
    world.state_changed()


@action("HideObject")
def hide_object(world: World, *, objectId: str, hideContained: bool = True) -> None:
    """Leave an object out of pictures, with its contents; nothing else changes."""
    _show(world, world.unshown | _rows(world, objectId, hideContained))


@action("UnhideObject")
def unhide_object(world: World, *, objectId: str, unhideContained: bool = True) -> None:
    """Show an object in pictures again, with its contents."""
    _show(world, world.unshown - _rows(world, objectId, unhideContained))


@action("HideAllObjects", server_action=True)
def hide_all_objects(world: World) -> None:
    """Leave all objects but the floor out of pictures; the room stays."""
    _show(world, set(range(len(world))))


@action("HideAllObjectsExcept", server_action=True)
def hide_all_objects_except(world: World, *, objectId: str = "") -> None:
    """HideAllObjects, but for one object."""
    i = world.find(objectId)
    hide_all_objects(world)
    _show(world, world.unshown - {i})


@action("UnhideAllObjects", server_action=True)
def unhide_all_objects(world: World) -> None:
    """Show all objects in pictures again."""
    _show(world, set())
