"""Opening and closing, switching on and off."""

from __future__ import annotations

import numpy as np

from er_gym.sim import consequences
from er_gym.sim.actions.checks import require, target
from er_gym.sim.actions.object_action import object_action
from er_gym.sim.errors import ActionFailed
from er_gym.sim.space.solids import solid_of
from er_gym.sim.world import World, reversible_offset

ONLY_SHUT = frozenset({"Microwave"})
"""Types that switch on only while closed and open only while off."""


def _slide(world: World, i: int, openness: float) -> None:
    """Slide a drawer and its contents to an openness; at 1 it is out by its depth."""
    if world.types[i] != "Drawer":
        return
    solid = solid_of(world, i)
    depth = np.ptp(solid.upright[:, :, 2])
    heading = np.radians(solid.yaw)
    ahead = np.array([np.sin(heading), 0.0, np.cos(heading)])
    before, after = (
        reversible_offset(ahead * depth * share) for share in (world.openness[i], openness)
    )
    world.move_by(i, after - before)


def set_openness(world: World, i: int, openness: float) -> None:
    """Open object i by a fraction of its full opening, or close it with 0."""
    _slide(world, i, openness)
    world.openness[i] = openness
    world.set_state(i, "isOpen", openness > 0.0)


@object_action("OpenObject")
def open_object(
    world: World,
    *,
    objectId: str,
    openness: float = 1.0,
    forceAction: bool = False,
    moveMagnitude: float | None = None,
) -> None:
    """Open an object by a fraction of its full opening, in (0, 1].

    ``moveMagnitude`` is the old name of ``openness``; with that name 0 means the full opening.
    """
    if moveMagnitude is not None:
        openness = moveMagnitude or 1.0
    i = target(world, objectId, forceAction)
    require(world, i, "openable", "an openable object")
    if not 0.0 <= openness <= 1.0:
        raise ActionFailed(f"openness must be in [0:1], not {openness:g}.")
    if world.state(i, "isOpen") and world.openness[i] == openness:
        raise ActionFailed(f"{objectId} is open already.")
    if world.types[i] in ONLY_SHUT and world.state(i, "isToggled"):
        raise ActionFailed(f"{objectId} is on; switch it off before opening it.")
    set_openness(world, i, openness)


@object_action("CloseObject")
def close_object(world: World, *, objectId: str, forceAction: bool = False) -> None:
    """Close an object."""
    i = target(world, objectId, forceAction)
    require(world, i, "openable", "an openable object")
    if not world.state(i, "isOpen"):
        raise ActionFailed(f"{objectId} is closed already.")
    set_openness(world, i, 0.0)


def _toggle(world: World, object_id: str, force: bool, on: bool) -> None:
    i = target(world, object_id, force)
    if world.types[i] == "StoveBurner":
        knobs = [k for k in world.of_type("StoveKnob") if i in (world.controlled[k] or ())]
        which = " or ".join(world.object_ids[k] for k in knobs) or "a StoveKnob"
        raise ActionFailed(f"{object_id} is not toggled itself: turn {which}, which controls it.")
    require(world, i, "toggleable", "a toggleable object")
    if world.state(i, "isToggled") is on:
        raise ActionFailed(f"{object_id} is {'on' if on else 'off'} already.")
    if on and world.types[i] in ONLY_SHUT and world.state(i, "isOpen"):
        raise ActionFailed(f"{object_id} must be closed before it is switched on.")
    world.set_state(i, "isToggled", on)
    consequences.apply(world)


@object_action("ToggleObjectOn")
def toggle_on(world: World, *, objectId: str, forceAction: bool = False) -> None:
    """Switch an object on."""
    _toggle(world, objectId, forceAction, on=True)


@object_action("ToggleObjectOff")
def toggle_off(world: World, *, objectId: str, forceAction: bool = False) -> None:
    """Switch an object off."""
    _toggle(world, objectId, forceAction, on=False)
