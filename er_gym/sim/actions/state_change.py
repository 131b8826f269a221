"""Changes of an object's state: slice, break, cook, clean, fill, use up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from er_gym.sim import consequences
from er_gym.sim.actions.checks import require, target
from er_gym.sim.actions.object_action import object_action
from er_gym.sim.actions.registry import quoted
from er_gym.sim.crew import whose_hand
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
    if world.is_held(i):
        raise ActionFailed(
            f"{objectId} is in {whose_hand(world, i)}; put it down before slicing it."
        )
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


def _break(world: World, i: int) -> None:
    """Break object i; an egg cracks open."""
    if world.types[i] != "Egg":
        world.set_state(i, "isBroken", True)
    elif world.is_held(i):
        raise ActionFailed(
            f"{world.object_ids[i]} is in {whose_hand(world, i)}; put it down before breaking it."
        )
    else:
        _cut_up(world, i, "isBroken")


def _dirty(world: World, i: int) -> None:
    world.set_state(i, "isDirty", True)
    consequences.apply(world)


def _empty(world: World, i: int) -> None:
    world.fill_liquid[i] = None
    world.set_state(i, "isFilledWithLiquid", False)
    consequences.apply(world)


@dataclass(frozen=True)
class Change:
    """A change of one state of an object.

    Attributes:
        prop: the property that the object must have.
        what: an object with this property, in words.
        state: the state that changes.
        becomes: its value afterwards.
        already: an object with this value, in words.
    """

    prop: str
    what: str
    state: str
    becomes: bool
    already: str

    def target(self, world: World, object_id: str, force: bool) -> int:
        """The row of the object that an action names.

        Raises:
            ActionFailed: it cannot change so, or is so already; see :func:`.checks.target` too.
        """
        i = target(world, object_id, force)
        require(world, i, self.prop, self.what)
        if world.state(i, self.state) == self.becomes:
            raise ActionFailed(f"{object_id} is {self.already} already.")
        return i


_DIRTY = partial(Change, "dirtyable", "something that can be dirty", "isDirty")
_FILLED = partial(Change, "canFillWithLiquid", "something that can be filled", "isFilledWithLiquid")
_FILLS = _FILLED(True, "filled")
_CHANGES: dict[str, tuple[Change, Callable[[World, int], None]]] = {
    "BreakObject": (
        Change("breakable", "something that can be broken", "isBroken", True, "broken"),
        _break,
    ),
    # Cooked at once, without a source of heat.
    "CookObject": (
        Change("cookable", "something that can be cooked", "isCooked", True, "cooked"),
        consequences.cook,
    ),
    "DirtyObject": (_DIRTY(True, "dirty"), _dirty),
    "CleanObject": (
        _DIRTY(False, "clean"),
        lambda world, i: world.set_state(i, "isDirty", False),
    ),
    "EmptyLiquidFromObject": (_FILLED(False, "empty"), _empty),
    # Such as a roll of paper.
    "UseUpObject": (
        Change("canBeUsedUp", "something that can be used up", "isUsedUp", True, "used up"),
        lambda world, i: world.set_state(i, "isUsedUp", True),
    ),
}


def _changer(change: Change, do: Callable[[World, int], None]) -> Callable[..., None]:
    def change_it(world: World, *, objectId: str, forceAction: bool = False) -> None:
        do(world, change.target(world, objectId, forceAction))

    return change_it


def change_state(world: World, i: int, state: str, value: bool) -> None:
    """Put object i into a state, or out of it if that can be undone, wherever it is."""
    if state == "isToggled":
        world.set_state(i, state, value)
    elif state == "isFilledWithLiquid" and value:
        consequences.fill(world, i, "water")
    elif state == "isSliced" and value:
        _cut_up(world, i, state)
    else:
        for change, do in _CHANGES.values():
            if (change.state, change.becomes) == (state, value):
                do(world, i)


for _name, _row in _CHANGES.items():
    object_action(_name, server_action=True)(_changer(*_row))


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
    i = _FILLS.target(world, objectId, forceAction)
    consequences.fill(world, i, fillLiquid.lower())
