"""Actions that have no effect here, see docs/fidelity.md. They still refuse bad arguments."""

from __future__ import annotations

from er_gym.sim.actions.checks import require, within
from er_gym.sim.actions.registry import action
from er_gym.sim.world import World


@action("SetDecayTemperatureBool")
def set_decay_temperature(world: World, *, allowDecayTemperature: bool) -> None:
    """Accepted: temperatures do not decay here."""


@action("SetGlobalRoomTempDecayTime")
def set_global_decay_time(world: World, *, TimeUntilRoomTemp: float = 0.0) -> None:
    """Accepted: temperatures do not decay here; seconds, 0 or more."""
    within("TimeUntilRoomTemp", TimeUntilRoomTemp, 0.0, 1e9)


@action("SetRoomTempDecayTimeForType")
def set_decay_time_of_type(
    world: World, *, objectType: str, TimeUntilRoomTemp: float = 0.0
) -> None:
    """Accepted: temperatures do not decay here; seconds, 0 or more."""
    within("TimeUntilRoomTemp", TimeUntilRoomTemp, 0.0, 1e9)


@action("MakeObjectBreakable", "MakeObjectUnbreakable")
def make_object_breakable(world: World, *, objectId: str) -> None:
    """Accepted: only BreakObject breaks objects here, and it breaks every breakable one."""
    require(world, world.find(objectId), "breakable", "something that can be broken")


@action("SetMassProperties")
def set_mass_properties(
    world: World, *, objectId: str, mass: float, drag: float, angularDrag: float
) -> None:
    """Set the mass of a pickupable or moveable object, kilograms; drag has no effect."""
    i = world.find(objectId)
    if not world.has(i, "moveable"):
        require(world, i, "pickupable", "Moveable or Pickupable, and its mass cannot be changed")
    within("mass", mass, 0.0, 1e6)
    world.set_mass(i, mass)
