"""Changes of an object's state: slice, break, cook, clean, fill, use up."""

from __future__ import annotations

import numpy as np

from er_gym.sim import consequences
from er_gym.sim.actions.checks import require, target
from er_gym.sim.actions.object_action import object_action
from er_gym.sim.actions.registry import quoted
from er_gym.sim.errors import ActionFailed
from er_gym.sim.world import World

LIQUIDS = ("coffee", "water", "wine")
_SLICES = {"Apple": 6, "Bread": 6, "Lettuce": 6, "Potato": 6, "Tomato": 6}
"""The number of slices of a whole object (an egg cracks into one part)."""
_COOKABLE_PARTS = frozenset({"BreadSliced", "PotatoSliced", "EggCracked"})


def parts_of(kind: str) -> tuple[str, bool]:
    """The type of an object's parts, and whether they can be cooked."""
    part = "EggCracked" if kind == "Egg" else f"{kind}Sliced"
    return part, part in _COOKABLE_PARTS


@object_action("SliceObject", server_action=True)
def slice_object(world: World, *, objectId: str, forceAction: bool = False) -> None:
    """Slice an object: its slices replace it. An egg cracks open."""
    i = target(world, objectId, forceAction)
    require(world, i, "sliceable", "something that can be sliced")
    if i == world.held:
        raise ActionFailed(f"{objectId} is in the agent's hand; put it down before slicing it.")
    _cut_up(world, i, "isSliced")


def _cut_up(world: World, i: int, state: str) -> None:
    """Replace object i by its parts, side by side along its longer side.

    Args:
        state: the new state of the whole.
    """
    kind, cookable = parts_of(world.types[i])
    whole = world.object_ids[i]
    count = _SLICES.get(world.types[i], 1)
    ids = [f"{whole}|{kind}_{k}" for k in range(count)]
    size = world.high[i] - world.low[i]
    axis = 0 if size[0] >= size[2] else 2
    share = np.ones(3)
    share[axis] = 1.0 / count
    for k, object_id in enumerate(ids):
        part = world.add_object(i, object_id, kind, f"{world.names[i]}_{kind}_{k}")
        world.set_property(part, "sliceable", False)
        world.set_property(part, "cookable", cookable)
        if count > 1:
            # The oriented box no longer fits the part, so an axis-aligned one replaces it.
            low, extent = world.low[part], world.high[part] - world.low[part]
            corner = low - world.position[part]
            corner[axis] += k * extent[axis] / count
            world.rotation[part] = 0.0
            world.obb[part] = [corner, *np.diag(extent * share)]
            world.turn(part, 0.0)
            centre = (world.low[part] + world.high[part]) / 2
            world.obb[part, 0] += world.position[part] - centre
            world.position[part] = centre
    world.cut_up(i, state)
    consequences.apply(world)


@object_action("BreakObject", server_action=True)
def break_object(world: World, *, objectId: str, forceAction: bool = False) -> None:
    """Break an object; an egg cracks open."""
    i = target(world, objectId, forceAction)
    require(world, i, "breakable", "something that can be broken")
    if world.state(i, "isBroken"):
        raise ActionFailed(f"{objectId} is broken already.")
    if world.types[i] == "Egg":
        if i == world.held:
            raise ActionFailed(
                f"{objectId} is in the agent's hand; put it down before breaking it."
            )
        _cut_up(world, i, "isBroken")
        return
    world.set_state(i, "isBroken", True)


@object_action("CookObject", server_action=True)
def cook_object(world: World, *, objectId: str, forceAction: bool = False) -> None:
    """Cook an object at once, without a source of heat."""
    i = target(world, objectId, forceAction)
    require(world, i, "cookable", "something that can be cooked")
    if world.state(i, "isCooked"):
        raise ActionFailed(f"{objectId} is cooked already.")
    consequences.cook(world, i)


@object_action("DirtyObject", server_action=True)
def dirty_object(world: World, *, objectId: str, forceAction: bool = False) -> None:
    """Make an object dirty."""
    i = target(world, objectId, forceAction)
    require(world, i, "dirtyable", "something that can be dirty")
    if world.state(i, "isDirty"):
        raise ActionFailed(f"{objectId} is dirty already.")
    world.set_state(i, "isDirty", True)
    consequences.apply(world)


@object_action("CleanObject", server_action=True)
def clean_object(world: World, *, objectId: str, forceAction: bool = False) -> None:
    """Clean an object."""
    i = target(world, objectId, forceAction)
    require(world, i, "dirtyable", "something that can be dirty")
    if not world.state(i, "isDirty"):
        raise ActionFailed(f"{objectId} is clean already.")
    world.set_state(i, "isDirty", False)


@object_action("FillObjectWithLiquid", server_action=True)
def fill_object(
    world: World, *, objectId: str, fillLiquid: str = "water", forceAction: bool = False
) -> None:
    """Fill an object with one of :data:`LIQUIDS`; case does not matter."""
    if fillLiquid.lower() not in LIQUIDS:
        raise ActionFailed(
            f"{quoted(fillLiquid)} is not a valid Liquid Type; fillLiquid is one of "
            f"{', '.join(LIQUIDS)}."
        )
    i = target(world, objectId, forceAction)
    require(world, i, "canFillWithLiquid", "something that can be filled")
    if world.state(i, "isFilledWithLiquid"):
        raise ActionFailed(f"{objectId} is filled already.")
    consequences.fill(world, i, fillLiquid.lower())


@object_action("EmptyLiquidFromObject", server_action=True)
def empty_object(world: World, *, objectId: str, forceAction: bool = False) -> None:
    """Empty an object."""
    i = target(world, objectId, forceAction)
    require(world, i, "canFillWithLiquid", "something that can be filled")
    if not world.state(i, "isFilledWithLiquid"):
        raise ActionFailed(f"{objectId} is empty already.")
    world.fill_liquid[i] = None
    world.set_state(i, "isFilledWithLiquid", False)
    consequences.apply(world)


@object_action("UseUpObject", server_action=True)
def use_up_object(world: World, *, objectId: str, forceAction: bool = False) -> None:
    """Use an object up, such as a roll of paper."""
    i = target(world, objectId, forceAction)
    require(world, i, "canBeUsedUp", "something that can be used up")
    if world.state(i, "isUsedUp"):
        raise ActionFailed(f"{objectId} is used up already.")
    world.set_state(i, "isUsedUp", True)
