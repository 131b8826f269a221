"""Long-range tasks: the recipes that come with er-gym, what steps do, and faulty files."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import chain
from pathlib import Path
from typing import Any

import pytest

from er_gym.tasks import Task, TaskFileError, verbs
from er_gym.tasks.generate import Generator
from er_gym.tasks.generate.plan import Plan
from er_gym.tasks.generate.recipes import (
    KINDS,
    LONGEST,
    SHORTEST,
    STEPS,
    Recipe,
    bundled_recipes,
    read_recipes,
    rows,
)
from er_gym.tasks.generate.room import Room, Thing
from er_gym.tasks.generate.script import Impossible
from er_gym.tasks.goal import Condition
from er_gym.thor import OBJECT_TYPES

Objects = list[dict[str, Any]]
RECIPES = {recipe.name: recipe for recipe in bundled_recipes()}


# -- those that come with er-gym -----------------------------------------------------------------


@pytest.mark.parametrize("recipe", RECIPES.values(), ids=RECIPES)
def test_a_bundled_recipe_names_what_there_is(recipe: Recipe) -> None:
    kinds = recipe.roles.values()
    assert set(chain.from_iterable(k for k in kinds if not isinstance(k, str))) <= set(OBJECT_TYPES)
    assert {kind for kind in kinds if isinstance(kind, str)} <= set(KINDS)
    used = {role for step in recipe.steps for roles in step.values() for role in roles}
    assert used == set(recipe.roles)


def test_bundled_recipes_have_names_of_their_own() -> None:
    assert len(RECIPES) == len(bundled_recipes()) > 20


def test_every_step_occurs_in_a_bundled_recipe() -> None:
    assert set(STEPS) == {
        name for recipe in RECIPES.values() for step in recipe.steps for name in step
    }


# Together these rooms have what all recipes ask for: FloorPlan12 is one of the few where a Potato
# can be sliced beside a Pan, FloorPlan204 one of the few with a lamp and a Laptop.
SCENES = ("FloorPlan1", "FloorPlan10", "FloorPlan12", "FloorPlan204", "FloorPlan409")


@pytest.fixture(scope="module")
def made(scene_objects: Callable[[str], Objects]) -> dict[str, list[Task]]:
    """Each recipe's tasks in those rooms."""
    found: dict[str, list[Task]] = {name: [] for name in RECIPES}
    for scene in SCENES:
        generator = Generator(scene, scene_objects(scene), rows=rows(bundled_recipes()))
        for task in generator.tasks():
            found[task.id.split("-")[1].removeprefix("long_range_")].append(task)
    return found


@pytest.mark.parametrize("name", RECIPES)
def test_a_bundled_recipe_can_be_followed_somewhere(name: str, made: dict[str, list[Task]]) -> None:
    assert made[name]
    for task in made[name]:
        assert SHORTEST == 9 <= len(task.key_actions) <= 28 == LONGEST
        assert task.goal
        assert len(task.key_actions) < task.type.max_steps


def test_a_recipe_makes_half_a_dozen_tasks_of_a_room_at_most(made: dict[str, list[Task]]) -> None:
    counts = Counter((task.scene, name) for name, tasks in made.items() for task in tasks)
    assert max(counts.values()) == 6
    every = [task for tasks in made.values() for task in tasks]
    assert len({task.id for task in every}) == len(every)


def test_every_clause_of_an_instruction_is_done(made: dict[str, list[Task]]) -> None:
    for task in chain.from_iterable(made.values()):
        done = {key.object_type for key in task.key_actions if key.verb != verbs.NAVIGATE}
        words = set(task.instruction.replace(",", " ").replace(";", " ").replace(".", " ").split())
        spoken_of = {word.rstrip("?:") for word in words} & set(OBJECT_TYPES)
        assert spoken_of <= done
        assert {name for name in done if name} - spoken_of <= {
            name for name in done if name.endswith("Sliced") or name in _ONLY_OPENED
        }  # fmt: skip


_ONLY_OPENED: set[str] = {"Cabinet", "Drawer", "Fridge", "Microwave", "Safe"}
"""Types that one may have to open, which the words need not say."""


def test_dishes_are_dirty_before_and_clean_after_they_are_washed(
    made: dict[str, list[Task]],
) -> None:
    dirty = [task for tasks in made.values() for task in tasks if task.start.dirty]
    assert dirty
    for task in dirty:
        types = {object_id.split("|")[0] for object_id in task.start.dirty}
        clean = {c.object_type for c in task.goal if ("isDirty", False) in c.state}
        assert types == clean
    assert not [task for task in made["clear_three"] if task.start.dirty]


# -- what steps do -------------------------------------------------------------------------------


def thing(object_type: str, *parents: str, number: int = 0, **fields: Any) -> Thing:
    """A thing in or on the first things of some types."""
    plain: dict[str, Any] = {
        **dict.fromkeys(("receptacle", "pickupable", "openable", "closed", "toggleable"), False),
        **dict.fromkeys(("on", "dirtyable", "fillable", "cookable", "sliceable"), False),
        "controlled": (),
        "volume": 1.0,
        "x": 0.0,
        "z": 0.0,
    }
    return Thing(
        f"{object_type}|+00.00|+00.00|+0{number}.00",
        object_type,
        tuple(f"{parent}|+00.00|+00.00|+00.00" for parent in parents),
        **{**plain, **fields},
    )


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


def room_of(*things: Thing, accepts: Callable[[str, str], bool] = lambda what, where: True) -> Room:
    return Room({item.id: item for item in things}, accepts)


def follow(text: str, *cast: Thing, room: Room | None = None) -> Plan:
    """Act out steps such as ``"put Apple Fridge, wash Apple"``; roles go by the names of types."""
    things = cast or KITCHEN
    given = [words.split() for words in text.split(", ")]
    roles = dict.fromkeys(role for _, *named in given for role in named)
    recipe = Recipe(
        name="test",
        roles={role: (role,) for role in roles},
        steps=tuple({name: tuple(named)} for name, *named in given),
    )
    (row,) = rows([recipe])
    who = {item.type: item for item in things}
    return row.plan(room or room_of(*things), *(who[role] for role in roles))


def steps(plan: Plan) -> list[str]:
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


def but(*changed: Thing, without: tuple[Thing, ...] = ()) -> list[Thing]:
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
def test_what_cannot_be_done(text: str, things: list[Thing], message: str) -> None:
    with pytest.raises(Impossible, match=message):
        follow(text, *things)


def test_nothing_is_put_where_its_type_is_not_accepted() -> None:
    room = room_of(*KITCHEN, accepts=lambda what, where: where != "Fridge")
    assert steps(follow("put Apple CounterTop", room=room))
    with pytest.raises(Impossible, match="Fridge does not take Apple"):
        follow("put Apple Fridge", room=room)
    with pytest.raises(Impossible, match="Fridge does not take Apple"):
        follow("chill Apple", room=room)
    blunt = room_of(*KITCHEN, accepts=lambda what, where: what != "Knife")
    with pytest.raises(Impossible, match="no slicing in CounterTop"):
        follow("slice Potato Knife", room=blunt)


# -- who takes part ------------------------------------------------------------------------------


LONG = Recipe(
    name="long",
    roles={"food": ("Apple", "Potato"), "other": "loose", "place": "furniture", "safe": "locker"},
    steps=({"put": ("food", "place")}, {"put": ("other", "safe")}),
)
PLAIN = (COUNTER, TABLE, FRIDGE, APPLE, KNIFE)


def casts(recipe: Recipe, *things: Thing) -> set[tuple[str, ...]]:
    (row,) = rows([recipe])
    return {tuple(item.id for item in cast) for cast in row.choices(room_of(*things))}


OF_A_KIND = {
    "loose": {"Knife", "Apple", "Egg", "CellPhone", "Bowl"},
    "furniture": {"CounterTop", "DiningTable", "SinkBasin"},
    "locker": {"Fridge"},
    "switch": {"DeskLamp", "FloorLamp"},
}


@pytest.mark.parametrize("kind", KINDS)
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
    assert {item.type for item in KINDS[kind](room)} == OF_A_KIND[kind]


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


# -- faulty files --------------------------------------------------------------------------------


GOOD = """
- name: tidy
  roles: {thing: loose, place: [Desk, Shelf]}
  steps:
    - put: [thing, place]
"""


def test_a_file_of_recipes_is_read(tmp_path: Path) -> None:
    path = tmp_path / "recipes.yaml"
    path.write_text(GOOD)
    assert read_recipes(path) == (
        Recipe(
            name="tidy",
            roles={"thing": "loose", "place": ("Desk", "Shelf")},
            steps=({"put": ("thing", "place")},),
        ),
    )


FAULTS = {
    "no YAML": ("- [", "not YAML: "),
    "not a list": ("name: tidy", "not a list of recipes"),
    "nothing": ("", "not a list of recipes"),
    "no recipe": ("- tidy", "recipe 1 is 'tidy'"),
    "no steps": ("- name: tidy\n  roles: {}", "recipe 1 lacks field 'steps'"),
    "second has no name": (f"{GOOD}- roles: {{}}\n  steps: []", "recipe 2 lacks field 'name'"),
    "misspelled": (GOOD.replace("roles", "rolls"), "recipe 1 lacks field 'roles'"),
    "more": (f"{GOOD}  cast: 3", "recipe 1 has a wrong field 'cast'"),
    "name": (GOOD.replace("tidy", "tidy up"), "recipe 1 has a wrong field 'name'"),
    "kind": (
        GOOD.replace("loose", "lost"),
        "recipe 'tidy': role 'thing' is of unknown kind 'lost'; give a list of object types or "
        "one of: loose, furniture, locker, switch",
    ),
    "step": (
        GOOD.replace("put", "throw"),
        "recipe 'tidy': a step is ['throw']; it must be one of: put, wash, ",
    ),
    "no step": (
        GOOD.replace("- put: [thing, place]", "[]"),
        "recipe 'tidy': it has no steps",
    ),
    "too few roles": (
        GOOD.replace("[thing, place]", "[thing]"),
        "recipe 'tidy': the step 'put' is about 1 roles; it takes 2",
    ),
    "no such type": (
        GOOD.replace("loose", "[Potatoe]"),
        "recipe 'tidy': role 'thing' has unknown object type 'Potatoe'",
    ),
    "one name twice": (f"{GOOD}{GOOD}", "two recipes are named 'tidy'"),
    "two in one": (
        GOOD.replace("- put: [thing, place]", "- {put: [thing, place], wash: [thing]}"),
        "recipe 'tidy': a step is ['put', 'wash']; it must be one of: put, wash, ",
    ),
    "role": (
        GOOD.replace("[thing, place]", "[thing, spot]"),
        "recipe 'tidy': a step names 'spot'; its roles are: thing, place",
    ),
    "roles of a step": (GOOD.replace("[thing, place]", "thing"), "recipe 1 has a wrong field"),
}


@pytest.mark.parametrize(("text", "message"), FAULTS.values(), ids=FAULTS)
def test_a_faulty_file_gets_one_clear_line(text: str, message: str, tmp_path: Path) -> None:
    path = tmp_path / "recipes.yaml"
    path.write_text(text)
    with pytest.raises(TaskFileError) as caught:
        read_recipes(path)
    assert str(caught.value).startswith(f"{path}: {message}")
    assert "\n" not in str(caught.value)


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(TaskFileError, match=r"gone\.yaml"):
        read_recipes(tmp_path / "gone.yaml")
