"""Actions that have no effect here, see docs/fidelity.md. They still refuse bad arguments."""

from __future__ import annotations

from typing import Any

from er_gym.sim.actions.checks import require, within
from er_gym.sim.actions.registry import action, quoted
from er_gym.sim.errors import ActionFailed
from er_gym.sim.scene import SCENE_NUMBERS
from er_gym.sim.world import World

_ROOM_TYPES = {
    "kitchens": "kitchen",
    "living_rooms": "livingroom",
    "bedrooms": "bedroom",
    "bathrooms": "bathroom",
}
_ALL_ROOM_TYPES = frozenset({*_ROOM_TYPES.values(), "robothor"})
_LAST_OF_TRAINING, _LAST_OF_VALIDATION = 20, 25


@action("SetRandomSeed")
def set_random_seed(world: World, *, seed: int) -> None:
    """Accepted: everything random here takes a seed of its own."""


@action("RandomizeColors", "ChangeColorOfMaterials", "ResetMaterials", "ResetColors")
def randomize_colors(world: World) -> None:
    """Accepted: the embedded engine draws the same materials in every run."""


@action("RandomizeMaterials")
def randomize_materials(
    world: World,
    *,
    useTrainMaterials: bool | None = None,
    useValMaterials: bool | None = None,
    useTestMaterials: bool | None = None,
    useExternalMaterials: bool | None = None,
    inRoomTypes: list[str] | None = None,
) -> dict[str, Any]:
    """Accepted: materials do not change. The answer names the splits that AI2-THOR would draw from.

    The default is the scene's own split. Of each kind of room, 20 are for training, 5 for
    validation and 5 for testing.
    """
    number = int(world.scene.name.removeprefix("FloorPlan"))
    if inRoomTypes is not None:
        _check_room_types(number, inRoomTypes)
    place = number % 100
    train = place <= _LAST_OF_TRAINING
    validation = not train and place <= _LAST_OF_VALIDATION
    test = not train and not validation
    chosen = {
        "useTrainMaterials": train if useTrainMaterials is None else useTrainMaterials,
        "useValMaterials": validation if useValMaterials is None else useValMaterials,
        "useTestMaterials": test if useTestMaterials is None else useTestMaterials,
        "useExternalMaterials": train if useExternalMaterials is None else useExternalMaterials,
    }
    own = ("useTrainMaterials", "useValMaterials", "useTestMaterials")
    if not any(chosen[name] for name in own):
        raise ActionFailed(f"At least one of {', '.join(own)} must be true.")
    return chosen


def _check_room_types(number: int, given: list[str]) -> None:
    if not given:
        raise ActionFailed("inRoomTypes must have a non-zero length!")
    for name in given:
        if name.lower() not in _ALL_ROOM_TYPES:
            raise ActionFailed(
                f"inRoomTypes contains unknown room type: {quoted(name)}. Valid room types are "
                "Bedroom, Bathroom, LivingRoom, Kitchen and RoboTHOR."
            )
    here = next(kind for name, kind in _ROOM_TYPES.items() if number in SCENE_NUMBERS[name])
    if here not in map(str.lower, given):
        raise ActionFailed(f"inRoomTypes must include {here!r} inside of a {here} scene.")


@action("RandomizeLighting")
def randomize_lighting(
    world: World,
    *,
    brightness: list[float] | None = None,
    randomizeColor: bool = True,
    hue: list[float] | None = None,
    saturation: list[float] | None = None,
    synchronized: bool = False,
) -> None:
    """Accepted: the light is always the same here. Each range has two numbers."""
    for name, span, most in (
        ("brightness", brightness, 1e6),
        ("hue", hue, 1.0),
        ("saturation", saturation, 1.0),
    ):
        if span is None:
            continue
        if len(span) != 2 or span[0] > span[1]:
            raise ActionFailed(f"{name} must be a lower and an upper bound, not {quoted(span)}.")
        within(name, span[0], 0.0, most)
        within(name, span[1], 0.0, most)


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
