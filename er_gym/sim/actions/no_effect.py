"""Actions that have no effect here, see docs/fidelity.md. They still refuse bad arguments."""

from __future__ import annotations

from er_gym.sim.actions.checks import require, within
from er_gym.sim.actions.registry import action
from er_gym.sim.errors import ActionFailed
from er_gym.sim.world import World

_LONGEST = 1e9
"""Seconds."""


@action(
    *("NoOp", "PhysicsSyncTransforms", "TogglePhysics"),
    *("EnableTemperatureDecay", "DisableTemperatureDecay"),
    *("MakeAllObjectsMoveable", "MakeObjectsStaticKinematicMassThreshold"),
    *("MakeAllObjectsBreakable", "MakeAllObjectsUnbreakable"),
    *("ChangeAgentFaceToNeutral", "ChangeAgentFaceToHappy"),
    *("ChangeAgentFaceToMad", "ChangeAgentFaceToSuperMad"),
)
def do_nothing(world: World) -> None:
    """Accepted: no time passes here, everything loose can be moved, nothing breaks by itself, and
    agents have no face."""


@action("Sleep")
def sleep(world: World, *, seconds: int) -> None:
    """Accepted: nothing happens in the meantime, so none is spent; seconds, 0 or more."""
    within("seconds", seconds, 0, _LONGEST)


@action("ChangeTimeScale", server_action=True)
def change_time_scale(world: World, *, timeScale: float = 1.0) -> None:
    """Accepted: no time passes here."""
    if timeScale <= 0.0:
        raise ActionFailed(f"Time scale must be >0, not {timeScale:g}.")


@action("ChangeOpenSpeed", server_action=True)
def change_open_speed(world: World, *, x: float = 0.0) -> None:
    """Accepted: doors open at once here."""


@action("SetTopLevelView")
def set_top_level_view(world: World, *, topView: bool = False) -> None:
    """Accepted: ToggleMapView shows the room from above."""


@action("ChangeAgentColor")
def change_agent_color(world: World, *, x: float, y: float, z: float) -> None:
    """Accepted: each agent has a colour of its own here."""


@action("RandomizeSmoothness")
def randomize_smoothness(world: World, *, objectId: str) -> None:
    """Accepted: nothing shines here."""
    world.find(objectId)


@action("RandomizeSmoothness")
def randomize_smoothness_of(world: World, *, objectIds: list[str]) -> None:
    """Accepted: nothing shines here."""
    for each in objectIds:
        world.find(each)


@action("SetDecayTemperatureBool")
def set_decay_temperature(world: World, *, allowDecayTemperature: bool) -> None:
    """Accepted: temperatures do not decay here."""


@action("SetTemperatureDecayTime")
def set_decay_time(world: World, *, decayTime: float) -> None:
    """Accepted: temperatures do not decay here; seconds, 0 or more."""
    within("decayTime", decayTime, 0.0, _LONGEST)


@action("SetTemperatureDecayTime")
def set_decay_time_of(world: World, *, objectId: str, decayTime: float) -> None:
    """Accepted: temperatures do not decay here; seconds, 0 or more."""
    world.find(objectId)
    set_decay_time(world, decayTime=decayTime)


@action("SetGlobalRoomTempDecayTime")
def set_global_decay_time(world: World, *, TimeUntilRoomTemp: float = 0.0) -> None:
    """Accepted: temperatures do not decay here; seconds, 0 or more."""
    within("TimeUntilRoomTemp", TimeUntilRoomTemp, 0.0, _LONGEST)


@action("SetRoomTempDecayTimeForType")
def set_decay_time_of_type(
    world: World, *, objectType: str, TimeUntilRoomTemp: float = 0.0
) -> None:
    """Accepted: temperatures do not decay here; seconds, 0 or more."""
    within("TimeUntilRoomTemp", TimeUntilRoomTemp, 0.0, _LONGEST)


@action("MakeObjectBreakable", "MakeObjectUnbreakable")
def make_object_breakable(world: World, *, objectId: str) -> None:
    """Accepted: only BreakObject breaks objects here, and it breaks every breakable one."""
    require(world, world.find(objectId), "breakable", "something that can be broken")


@action("MakeObjectsOfTypeUnbreakable")
def make_objects_of_type_unbreakable(world: World, *, objectType: str) -> None:
    """Accepted: only BreakObject breaks objects here."""


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
