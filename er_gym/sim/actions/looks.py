"""Random materials, colours and lights, and what they are drawn by.

They change the colours and textures of pictures and nothing else. ``SetRandomSeed`` seeds them, the
actions that begin with Reset undo them, and so does a reset of the room.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from er_gym.sim.actions.checks import within
from er_gym.sim.actions.registry import action, quoted
from er_gym.sim.errors import ActionFailed
from er_gym.sim.look import FINISHES, OWN, SPLITS, Chance
from er_gym.sim.scene import scene_category
from er_gym.sim.world import World

_ROOM_TYPES = {
    "kitchens": "kitchen",
    "living_rooms": "livingroom",
    "bedrooms": "bedroom",
    "bathrooms": "bathroom",
}
_ALL_ROOM_TYPES = (*_ROOM_TYPES.values(), "robothor")
_LAST_OF_TRAINING, _LAST_OF_VALIDATION = 20, 25
_LIGHTS = ("Window", "FloorLamp", "DeskLamp", "Candle")
_FLAGS = ("useTrainMaterials", "useValMaterials", "useTestMaterials", "useExternalMaterials")


def draw_by(world: World) -> np.random.Generator:
    """The generator of one random action."""
    random, world.chance = world.chance.draw()
    return random


@action("SetRandomSeed")
def set_random_seed(world: World, *, seed: int) -> None:
    """Seed all random actions that have no seed of their own; it outlives a reset of the room."""
    world.chance = Chance(seed)


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
    """Give the room and every type of object other colours and textures.

    They are drawn from the chosen sets. By default these are the scene's own, and the external one
    in a scene for training. Of each kind of room, 20 are for training, 5 for validation and 5 for
    testing. ``inRoomTypes`` is checked and has no effect: every set suits every room.
    """
    if inRoomTypes is not None:
        _check_room_types(world.scene.name, inRoomTypes)
    own = _own_split(world)
    given = (useTrainMaterials, useValMaterials, useTestMaterials, useExternalMaterials)
    if given[own] is False:
        kind = SPLITS[own]
        raise ActionFailed(
            f"Inside of RandomizeMaterials, cannot set {_FLAGS[own]}=false inside of a {kind} "
            "scene."
        )
    default = [k == own or (k == 3 and own == 0) for k in range(4)]
    used = [
        by_default if flag is None else flag
        for flag, by_default in zip(given, default, strict=True)
    ]
    splits = tuple(name for name, flag in zip(SPLITS, used, strict=True) if flag)
    seed = int(draw_by(world).integers(2**32))
    _look(world, materials=seed, splits=splits)
    return {
        "chosenRoomTypes": sorted({name.lower() for name in inRoomTypes or _ALL_ROOM_TYPES}),
        **dict(zip(_FLAGS, used, strict=True)),
        "totalMaterialsConsidered": FINISHES * len(splits),
    }


def _own_split(world: World) -> int:
    """The number of the split that the scene belongs to; a house is for training."""
    if world.scene.shell is not None:
        return 0
    place = int(world.scene.name.removeprefix("FloorPlan")) % 100
    return 0 if place <= _LAST_OF_TRAINING else 1 if place <= _LAST_OF_VALIDATION else 2


def _check_room_types(scene_name: str, given: list[str]) -> None:
    if not given:
        raise ActionFailed("inRoomTypes must have a non-zero length!")
    for name in given:
        if name.lower() not in _ALL_ROOM_TYPES:
            raise ActionFailed(
                f"inRoomTypes contains unknown room type: {quoted(name)}. Valid room types are "
                "Bedroom, Bathroom, LivingRoom, Kitchen and RoboTHOR."
            )
    here = _ROOM_TYPES[scene_category(scene_name)]
    if here not in map(str.lower, given):
        raise ActionFailed(f"inRoomTypes must include {here!r} inside of a {here} scene.")


@action("RandomizeColors", "ChangeColorOfMaterials")
def randomize_colors(world: World) -> None:
    """Give every type of object another colour, and keep its textures."""
    _look(world, colors=int(draw_by(world).integers(2**32)))


@action("ResetMaterials")
def reset_materials(world: World) -> None:
    """Give the room and its objects their own materials and colours again."""
    _look(world, materials=None, splits=(), colors=None)


@action("ResetColors")
def reset_colors(world: World) -> None:
    """Give the objects the colours of their materials again."""
    _look(world, colors=None)


@action("RandomizeLighting")
def randomize_lighting(
    world: World,
    *,
    synchronized: bool = False,
    brightness: list[float] | None = None,
    randomizeColor: bool = True,
    hue: list[float] | None = None,
    saturation: list[float] | None = None,
) -> None:
    """Give the room's lights random brightness and colours.

    The room's own light, its windows and its lamps each draw theirs, or the same if
    ``synchronized``; pictures are in the mean of them. Each range has two numbers: ``brightness``
    multiplies (by default 0.5 to 1.5), ``hue`` and ``saturation`` are within 0 and 1.
    """
    if not randomizeColor:
        for name, span in (("hue", hue), ("saturation", saturation)):
            if span is not None:
                raise ActionFailed(
                    "Cannot pass in randomizeColor=False while also providing "
                    f"{name}={quoted(span)}."
                )
    bright = _span("brightness", brightness, (0.5, 1.5), 1e6)
    hues = _span("hue", hue, (0.0, 1.0), 1.0)
    saturations = _span("saturation", saturation, (0.5, 1.0), 1.0)
    random = draw_by(world)
    count = 1 if synchronized else 1 + sum(1 for _ in world.of_type(*_LIGHTS))
    lights = random.uniform(*bright, size=(count, 1))
    if randomizeColor:
        own = zip(
            random.uniform(*hues, size=count), random.uniform(*saturations, size=count), strict=True
        )
        lights = lights * np.array([_rgb(each, deep) for each, deep in own])
    red, green, blue = np.broadcast_to(lights.mean(axis=0), 3).tolist()
    _look(world, light=(red, green, blue))


@action("ResetLighting")
def reset_lighting(world: World) -> None:
    """Give the room its own light again."""
    _look(world, light=OWN.light)


def _span(
    name: str, given: Sequence[float] | None, otherwise: tuple[float, float], most: float
) -> tuple[float, float]:
    if given is None:
        return otherwise
    if len(given) != 2:
        raise ActionFailed(f"{name} must be a lower and an upper bound, not {quoted(given)}.")
    for each in given:
        within(name, each, 0.0, most)
    return min(given), max(given)


def _rgb(hue: float, saturation: float) -> list[float]:
    """A colour of full value, from a hue and a saturation within 0 and 1."""
    wheel = np.clip(np.abs((hue * 6.0 + np.array([0.0, 4.0, 2.0])) % 6.0 - 3.0) - 1.0, 0.0, 1.0)
    found: list[float] = (1.0 - saturation * (1.0 - wheel)).tolist()
    return found


def _look(world: World, **changes: Any) -> None:
    world.look = replace(world.look, **changes)
    world.state_changed()
