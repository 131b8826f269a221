"""The steps of recipes: their effects, and the objects that fit them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import pytest
from things_by_hand import thing

from er_gym.tasks.generate.plan_builder import ImpossiblePlan
from er_gym.tasks.generate.recipes import (
    ROLE_KINDS,
    Recipe,
    bundled_recipes,
    recipe_rules,
)
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject
from er_gym.tasks.generate.task_plan import TaskPlan
from er_gym.tasks.goal import Condition

RECIPES = {recipe.name: recipe for recipe in bundled_recipes()}


# -- what steps do -------------------------------------------------------------------------------


COUNTER = thing("CounterTop", receptacle=True)
TABLE = thing("DiningTable", receptacle=True)
FRIDGE = thing("Fridge", receptacle=True, openable=True, closed=True)
MICROWAVE = thing("Microwave", receptacle=True, openable=True, closed=True, toggleable=True)
BASIN = thing("SinkBasin", receptacle=True)
FAUCET = thing("Faucet", toggleable=True, x=0.5)
BURNER = thing("StoveBurner", receptacle=True)
KNOB = thing("StoveKnob", toggleable=True, controlled=(BURNER.id,))
TOASTER = thing("Toaster", receptacle=True, toggleable=True)
MACHINE = thing("CoffeeMachine", receptacle=True, toggleable=True)
LAMP = thing("DeskLamp", "DiningTable", toggleable=True)
PAN = thing("Pan", "CounterTop", receptacle=True, pickupable=True, dirtyable=True)
PLATE = thing("Plate", "DiningTable", receptacle=True, pickupable=True, dirtyable=True)
MUG = thing("Mug", "CounterTop", receptacle=True, pickupable=True, dirtyable=True, fillable=True)
KNIFE = thing("Knife", "DiningTable", pickupable=True)
POTATO = thing("Potato", "CounterTop", pickupable=True, sliceable=True, cookable=True)
BREAD = thing("Bread", "CounterTop", pickupable=True, sliceable=True)
APPLE = thing("Apple", "DiningTable", pickupable=True, sliceable=True)
FISH = thing("Egg", "Fridge", pickupable=True, sliceable=True)
KITCHEN = (
    COUNTER, TABLE, FRIDGE, MICROWAVE, BASIN, FAUCET, BURNER, KNOB, TOASTER, MACHINE, LAMP, PAN,
    PLATE, MUG, KNIFE, POTATO, BREAD, APPLE, FISH,
)  # fmt: skip


def room_of(
    *things: SceneObject, accepts: Callable[[str, str], bool] = lambda what, where: True
) -> SceneGraph:
    return SceneGraph({item.id: item for item in things}, accepts)


def follow(text: str, *cast: SceneObject, room: SceneGraph | None = None) -> TaskPlan:
    """Act out steps such as ``"put Apple Fridge, wash Apple"``; roles go by the names of types."""
    things = cast or KITCHEN
    given = [words.split() for words in text.split(", ")]
    roles = dict.fromkeys(role for _, *named in given for role in named)
    recipe = Recipe(
        name="test",
        roles={role: (role,) for role in roles},
        steps=tuple({name: tuple(named)} for name, *named in given),
    )
    (rule,) = recipe_rules([recipe])
    who = {item.type: item for item in things}
    return rule.plan(room or room_of(*things), *(who[role] for role in roles))


def steps(plan: TaskPlan) -> list[str]:
    return [f"{key.verb} {key.object_type}" for key in plan.key_actions[:-1]]


def test_put() -> None:
    plan = follow("put Apple Fridge, put Knife Fridge")
    assert steps(plan) == [
        "navigate to DiningTable", "pickup Apple", "navigate to Fridge", "open Fridge",
        "put in Fridge", "close Fridge", "navigate to DiningTable", "pickup Knife",
        "navigate to Fridge", "open Fridge", "put in Fridge",
    ]  # fmt: skip
    assert plan.goal == (Condition("Apple", inside="Fridge"), Condition("Knife", inside="Fridge"))
    assert plan.words == {"clauses": ["put the Apple in the Fridge", "put the Knife in the Fridge"]}
    assert plan.subjects == (APPLE, KNIFE)


def test_wash() -> None:
    plan = follow("wash Mug, put Mug DiningTable")
    assert steps(plan) == [
        "navigate to CounterTop", "pickup Mug", "navigate to SinkBasin", "put in SinkBasin",
        "toggle Faucet", "pickup Mug", "navigate to DiningTable", "put in DiningTable",
    ]  # fmt: skip
    assert plan.dirty == (MUG.id,)
    assert plan.goal == (
        Condition(
            "Mug", inside="DiningTable", state=(("isDirty", False), ("isFilledWithLiquid", True))
        ),
        Condition("Faucet", state=(("isToggled", True),)),
    )
    # The Faucet is not among them: it would draw whoever goes to the CounterTop that it is on.
    assert plan.related == (MUG.id,)
    assert FAUCET.id in plan.key_actions[-1].related_objects


def test_food_is_washed_too_but_is_not_dirty() -> None:
    plan = follow("wash Apple, put Apple CounterTop")
    assert plan.dirty == ()
    assert plan.goal[0] == Condition("Apple", inside="CounterTop")


def test_the_water_keeps_running() -> None:
    plan = follow("wash Apple, put Apple CounterTop, fill Mug, put Mug DiningTable")
    assert steps(plan).count("toggle Faucet") == 1
    assert plan.dirty == ()
    assert (
        Condition("Mug", inside="DiningTable", state=(("isFilledWithLiquid", True),)) in plan.goal
    )


def test_brew() -> None:
    plan = follow("brew Mug, put Mug DiningTable")
    assert steps(plan)[2:] == [
        "navigate to CoffeeMachine", "put in CoffeeMachine", "toggle CoffeeMachine", "pickup Mug",
        "navigate to DiningTable", "put in DiningTable",
    ]  # fmt: skip
    assert plan.goal == (
        Condition("Mug", inside="DiningTable", state=(("isFilledWithLiquid", True),)),
        Condition("CoffeeMachine", state=(("isToggled", True),)),
    )


def test_heat() -> None:
    plan = follow("heat Potato, put Potato Plate")
    assert steps(plan)[2:] == [
        "navigate to Microwave", "open Microwave", "put in Microwave", "close Microwave",
        "toggle Microwave", "toggle Microwave", "open Microwave", "pickup Potato",
        "close Microwave", "navigate to DiningTable", "put in Plate",
    ]  # fmt: skip
    assert plan.goal == (
        Condition("Potato", inside="Plate", state=(("isCooked", True),)),
        Condition("Microwave", state=(("isToggled", False),)),
    )
    assert follow("heat Apple, put Apple Plate").goal[0] == Condition("Apple", inside="Plate")


def test_chill() -> None:
    plan = follow("chill Apple, put Apple CounterTop")
    assert steps(plan)[2:-2] == [
        "navigate to Fridge", "open Fridge", "put in Fridge", "close Fridge", "open Fridge",
        "pickup Apple", "close Fridge",
    ]  # fmt: skip
    assert plan.goal == (Condition("Apple", inside="CounterTop"),)


def test_slice_and_toast() -> None:
    plan = follow("slice Bread Knife, toast Bread, put Bread Plate")
    assert steps(plan) == [
        "navigate to DiningTable", "pickup Knife", "navigate to CounterTop", "slice Bread",
        "put in CounterTop", "pickup BreadSliced", "navigate to Toaster", "put in Toaster",
        "toggle Toaster", "pickup BreadSliced", "navigate to DiningTable", "put in Plate",
    ]  # fmt: skip
    assert plan.goal == (
        Condition("Knife", inside="CounterTop"),
        Condition("BreadSliced", inside="Plate", state=(("isCooked", True),)),
        Condition("Toaster", state=(("isToggled", True),)),
    )
    assert plan.words["clauses"] == [
        "slice the Bread with the Knife and lay the Knife down on the CounterTop",
        "toast the BreadSliced in the Toaster",
        "put the BreadSliced on the Plate",
    ]


def test_what_lies_in_a_pan_on_a_burner_that_is_turned_on_is_cooked() -> None:
    plan = follow("put Pan StoveBurner, put Potato Pan, switch_on StoveBurner")
    assert steps(plan)[-4:] == [
        "pickup Potato", "navigate to StoveBurner", "put in Pan", "toggle StoveBurner",
    ]  # fmt: skip
    assert Condition("Potato", inside="Pan", state=(("isCooked", True),)) in plan.goal


NOT_COOKED = {
    "put in too late": ("put Pan StoveBurner, switch_on StoveBurner, put Potato Pan", "Potato"),
    "not on the burner": ("put Potato Pan, switch_on StoveBurner", "Potato"),
    "not in the pan": ("put Pan StoveBurner, put Potato Plate, switch_on StoveBurner", "Potato"),
    "not to be cooked": ("put Pan StoveBurner, put Apple Pan, switch_on StoveBurner", "Apple"),
}


@pytest.mark.parametrize(("text", "food"), NOT_COOKED.values(), ids=NOT_COOKED)
def test_nothing_else_is_cooked(text: str, food: str) -> None:
    (condition,) = (c for c in follow(text).goal if c.object_type == food)
    assert condition.inside
    assert condition.state == ()


@pytest.mark.parametrize(
    "text",
    [
        "wash Apple", "fill Mug", "brew Mug", "heat Potato", "chill Apple",
        "slice Bread Knife, toast Bread",
    ],
)  # fmt: skip
def test_what_was_treated_is_in_the_hand(text: str) -> None:
    (held,) = (condition for condition in follow(text).goal if condition.held)
    assert held.object_type in text.split()[1] + "Sliced"
    assert held.inside == ""


def test_switch_on_and_off() -> None:
    plan = follow("switch_on DeskLamp, put Apple CounterTop, switch_off DeskLamp")
    assert steps(plan) == [
        "navigate to DiningTable", "toggle DeskLamp", "pickup Apple", "navigate to CounterTop",
        "put in CounterTop", "navigate to DiningTable", "toggle DeskLamp",
    ]  # fmt: skip
    assert Condition("DeskLamp", state=(("isToggled", False),)) in plan.goal
    assert plan.words["clauses"] == [
        "turn on the DeskLamp", "put the Apple on the CounterTop", "turn off the DeskLamp",
    ]  # fmt: skip


def but(*changed: SceneObject, without: tuple[SceneObject, ...] = ()) -> list[SceneObject]:
    """The kitchen with some things in place of those of the same id, and some taken away."""
    by_id = {item.id: item for item in (*KITCHEN, *changed)}
    return [item for item in by_id.values() if item not in without]


IMPOSSIBLE = {
    "there already": ("put Apple DiningTable", KITCHEN, "Apple is there, or has just been there"),
    "just been there": ("chill Apple, put Apple Fridge", KITCHEN, "has just been there"),
    "moved there": ("put Apple Fridge, put Apple Fridge", KITCHEN, "Apple is there, or"),
    "no water": ("wash Apple", but(without=(FAUCET,)), "no water"),
    "no vessel": ("fill Apple", KITCHEN, "Apple holds no water"),
    "two microwaves": ("heat Apple", but(thing("Microwave", number=1)), "2 Microwave objects"),
    "no fridge": ("chill Apple", but(without=(FRIDGE, FISH)), "0 Fridge objects"),
    "machine on": (
        "brew Mug",
        but(thing("CoffeeMachine", receptacle=True, toggleable=True, on=True)),
        "the CoffeeMachine is on already",
    ),
    "machine on from before": (
        "brew Mug, put Mug DiningTable, brew Plate",
        KITCHEN,
        "the CoffeeMachine is on already",
    ),
    "microwave on": (
        "heat Apple",
        but(thing("Microwave", receptacle=True, toggleable=True, on=True)),
        "the Microwave is on already",
    ),
    "toaster on": (
        "toast Bread",
        but(thing("Toaster", receptacle=True, toggleable=True, on=True)),
        "the Toaster is on already",
    ),
    "not to be sliced": ("slice Mug Knife", KITCHEN, "Mug cannot be sliced"),
    "sliced already": (
        "slice Potato Knife, put Potato DiningTable, slice Potato Knife",
        KITCHEN,
        "PotatoSliced cannot be sliced",
    ),
    "no board": ("slice Egg Knife", KITCHEN, "no slicing in Fridge"),
    "no board but a chair": (
        "slice Apple Knife",
        but(
            thing("Chair", receptacle=True),
            thing("Apple", "Chair", pickupable=True, sliceable=True),
        ),
        "no slicing in Chair",
    ),
    "no switch": ("switch_on CounterTop", KITCHEN, "CounterTop has no switch"),
    "on already": (
        "switch_on DeskLamp",
        but(thing("DeskLamp", "DiningTable", toggleable=True, on=True)),
        "DeskLamp is on already",
    ),
    "switched on before": ("switch_on DeskLamp, switch_on DeskLamp", KITCHEN, "is on already"),
    "burner on": (
        "switch_on StoveBurner",
        but(thing("StoveKnob", toggleable=True, on=True, controlled=(BURNER.id,))),
        "StoveBurner is on already",
    ),
    "off already": ("switch_off DeskLamp", KITCHEN, "DeskLamp is off already"),
    "full hand": ("wash Apple, put Mug DiningTable", KITCHEN, "the hand holds Apple already"),
}


@pytest.mark.parametrize(("text", "things", "message"), IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_what_cannot_be_done(text: str, things: list[SceneObject], message: str) -> None:
    with pytest.raises(ImpossiblePlan, match=message):
        follow(text, *things)


def test_nothing_is_put_where_its_type_is_not_accepted() -> None:
    room = room_of(*KITCHEN, accepts=lambda what, where: where != "Fridge")
    assert steps(follow("put Apple CounterTop", room=room))
    with pytest.raises(ImpossiblePlan, match="Fridge does not take Apple"):
        follow("put Apple Fridge", room=room)
    with pytest.raises(ImpossiblePlan, match="Fridge does not take Apple"):
        follow("chill Apple", room=room)
    blunt = room_of(*KITCHEN, accepts=lambda what, where: what != "Knife")
    with pytest.raises(ImpossiblePlan, match="no slicing in CounterTop"):
        follow("slice Potato Knife", room=blunt)


# -- who takes part ------------------------------------------------------------------------------


LONG = Recipe(
    name="long",
    roles={"food": ("Apple", "Potato"), "other": "loose", "place": "furniture", "safe": "locker"},
    steps=({"put": ("food", "place")}, {"put": ("other", "safe")}),
)
PLAIN = (COUNTER, TABLE, FRIDGE, APPLE, KNIFE)


def casts(recipe: Recipe, *things: SceneObject) -> set[tuple[str, ...]]:
    (rule,) = recipe_rules([recipe])
    return {tuple(item.id for item in cast) for cast in rule.choices(room_of(*things))}


OF_A_KIND = {
    "loose": {"Knife", "Apple", "Egg", "CellPhone", "Bowl"},
    "furniture": {"CounterTop", "DiningTable", "SinkBasin"},
    "locker": {"Fridge"},
    "switch": {"DeskLamp", "FloorLamp"},
}


@pytest.mark.parametrize("kind", ROLE_KINDS)
def test_kinds_of_things(kind: str) -> None:
    room = room_of(
        *PLAIN, BASIN, FAUCET, LAMP, FISH,
        thing("Sink", receptacle=True),
        thing("Chair", receptacle=True),
        thing("Toilet", receptacle=True, openable=True, closed=True),
        thing("Box", "Floor", receptacle=True, pickupable=True, openable=True, closed=True),
        thing("Safe", receptacle=True, openable=True),
        thing("Bowl", "CounterTop", receptacle=True, pickupable=True),
        thing("Book", "Floor", pickupable=True),
        thing("Laptop", openable=True, closed=True),
        thing("FloorLamp", "Floor", toggleable=True),
        thing("CellPhone", "Fridge", pickupable=True, toggleable=True),
        thing("Television", "DiningTable"),
    )  # fmt: skip
    assert {item.type for item in ROLE_KINDS[kind](room)} == OF_A_KIND[kind]


def test_roles_are_filled_by_what_fits_them() -> None:
    assert casts(LONG, *PLAIN) == {(APPLE.id, KNIFE.id, COUNTER.id, FRIDGE.id)}
    assert not casts(LONG, COUNTER, TABLE, APPLE, KNIFE)
    assert not casts(LONG, COUNTER, TABLE, FRIDGE, KNIFE)


def test_what_one_carries_is_alone_of_its_type_and_a_place_the_largest_of_its() -> None:
    second = thing("Apple", "CounterTop", number=1, pickupable=True)
    assert not casts(LONG, *PLAIN, second)
    big = thing("CounterTop", number=1, receptacle=True, volume=2.0)
    assert casts(LONG, *PLAIN, big) == {(APPLE.id, KNIFE.id, big.id, FRIDGE.id)}


def test_what_cannot_be_got_at_takes_no_part() -> None:
    on_floor = thing("Apple", "Floor", pickupable=True)
    assert not casts(LONG, COUNTER, TABLE, FRIDGE, on_floor, KNIFE)
    toilet = thing("Toilet", receptacle=True, openable=True, closed=True)
    assert not casts(LONG, COUNTER, TABLE, toilet, APPLE, KNIFE)


def test_what_takes_too_few_key_actions_is_not_chosen() -> None:
    short = LONG.model_copy(update={"steps": ({"put": ("food", "place")},)})
    assert not casts(short, *PLAIN)


def test_switches_take_part_where_they_stand_on_something_or_on_the_floor() -> None:
    recipe = Recipe(
        name="lamps",
        roles={"light": "switch", "food": ("Apple",), "place": ("CounterTop",)},
        steps=(
            {"switch_on": ("light",)},
            {"put": ("food", "place")},
            {"switch_off": ("light",)},
            {"put": ("food", "place")},
        ),
    )
    standing = thing("FloorLamp", "Floor", toggleable=True)
    shut_in = thing("CellPhone", "Fridge", toggleable=True, pickupable=True)
    steps_twice = recipe.model_copy(
        update={"steps": (*recipe.steps[:3], {"switch_on": ("light",)})}
    )
    found = casts(steps_twice, *PLAIN, LAMP, standing, shut_in, FAUCET)
    assert {light for light, *_ in found} == {LAMP.id, standing.id}
    second = thing("FloorLamp", "Floor", number=1, toggleable=True)
    found = casts(steps_twice, *PLAIN, LAMP, standing, second)
    assert {light for light, *_ in found} == {LAMP.id}


def test_what_names_two_places_by_one_type_is_not_chosen() -> None:
    small = thing("CounterTop", number=1, receptacle=True, volume=0.5)
    apple = replace(APPLE, parents=(small.id,))
    # From the small CounterTop to the large one is no way to put it.
    found = casts(LONG, COUNTER, small, TABLE, FRIDGE, apple, KNIFE)
    assert found == {(apple.id, KNIFE.id, TABLE.id, FRIDGE.id)}
    assert not casts(LONG, COUNTER, small, FRIDGE, apple, KNIFE)


def test_casts_are_the_same_for_the_same_room() -> None:
    assert casts(RECIPES["wash_put_away"], *KITCHEN) == casts(RECIPES["wash_put_away"], *KITCHEN)
    assert casts(RECIPES["wash_put_away"], *KITCHEN)
