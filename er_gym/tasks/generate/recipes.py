"""Long-range tasks: recipes, which are data, and the steps that they may consist of."""

from __future__ import annotations

import random
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib.resources import files
from inspect import signature
from itertools import permutations
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from er_gym.tasks import verbs
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.files import validated
from er_gym.tasks.generate.scene_graph import Room, Thing, largest, may_fill
from er_gym.tasks.generate.script import Impossible, Script
from er_gym.tasks.generate.task_plan import Plan, Row, plan_of
from er_gym.tasks.generate.templates import STYLES, in_order
from er_gym.tasks.generate.words import in_the
from er_gym.tasks.reading import read_yaml
from er_gym.tasks.verbs import Verb
from er_gym.thor import OBJECT_TYPES

SHORTEST, LONGEST = 9, 28
"""How many key actions a long-range task has, ``end`` among them."""
_MOST_CHOICES = 6
"""How many tasks one recipe makes of one room at most."""
_MOST_TRIES = 150
"""How many ways to fill its roles are looked at for that."""


class Recipe(BaseModel):
    """What is done, in which order, to whom.

    Attributes:
        name: a part of task ids: letters, digits and underscores.
        roles: who takes part: a list of object types, or one of :data:`KINDS`.
        steps: one of :func:`steps` each, with the roles that it is about.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(pattern=r"^\w+$")
    roles: dict[str, tuple[str, ...] | str]
    steps: tuple[dict[str, tuple[str, ...]], ...]


# -- who may take part ---------------------------------------------------------------------------


def _loose(room: Room) -> list[Thing]:
    return [*room.carried(hidden=False), *room.carried(hidden=True)]


def _furniture(room: Room) -> list[Thing]:
    return [
        thing
        for thing in room.things.values()
        if thing.receptacle and not thing.pickupable and not thing.openable and may_fill(thing)
    ]


def _lockers(room: Room) -> list[Thing]:
    return [
        thing
        for thing in room.things.values()
        if thing.receptacle and not thing.pickupable and thing.closed and may_fill(thing)
    ]


def _switches(room: Room) -> list[Thing]:
    free = (t for t in room.things.values() if room.is_exposed(t) or room.stands_free(t))
    return [thing for thing in free if thing.toggleable and thing.type in SWITCHED]


SWITCHED = frozenset(
    {"Candle", "CellPhone", "CoffeeMachine", "DeskLamp", "FloorLamp", "Laptop", "Television"}
)
"""What one switches for its own sake."""
KINDS: Mapping[str, Callable[[Room], list[Thing]]] = {
    "loose": _loose,
    "furniture": _furniture,
    "locker": _lockers,
    "switch": _switches,
}
"""Kinds of things that a role may ask for: what can be carried and be got at, receptacles without a
door, receptacles that are shut, and what one switches for its own sake."""


# -- what may be done ----------------------------------------------------------------------------


@dataclass
class Cooking:
    """A recipe being acted out.

    Attributes:
        cast: role to who plays it now: slicing turns a Potato into a PotatoSliced.
        dirty: ids of what has to be dirty before.
    """

    room: Room
    script: Script
    cast: dict[str, Thing]
    dirty: list[str]

    def only(self, object_type: str) -> Thing:
        """The one thing of a type."""
        found = self.room.of_type(object_type)
        if len(found) != 1:
            raise Impossible(f"{len(found)} {object_type} objects")
        return found[0]


STEPS: dict[str, Callable[..., str]] = {}
"""By name: what a step does, given the recipe being acted out and its roles, and says of it."""


def _step(function: Callable[..., str]) -> Callable[..., str]:
    STEPS[function.__name__.removeprefix("_")] = function
    return function


def _carry(cooking: Cooking, thing: Thing, target: Thing) -> None:
    if cooking.script.lies_in(thing, target) or cooking.script.comes_from(thing) == target:
        raise Impossible(f"{thing.type} is there, or has just been there")
    if not cooking.room.accepts(thing.type, target.type):
        raise Impossible(f"{target.type} does not take {thing.type}")
    cooking.script.fetch(thing)
    cooking.script.put(target)


@_step
def _put(cooking: Cooking, what: str, where: str) -> str:
    """Put a thing into or onto another."""
    thing, target = cooking.cast[what], cooking.cast[where]
    _carry(cooking, thing, target)
    return f"put the {thing.type} {in_the(target.type)}"


def _under_water(cooking: Cooking, thing: Thing) -> None:
    water = cooking.room.washing_place()
    if water is None:
        raise Impossible("no water")
    basin, faucet = water
    _carry(cooking, thing, basin)
    if not cooking.script.is_on(faucet):
        cooking.script.toggle(faucet)
    cooking.script.pickup(thing)
    if thing.fillable:
        cooking.script.becomes(thing, isFilledWithLiquid=True)


@_step
def _wash(cooking: Cooking, what: str) -> str:
    """Lay a thing in the sink, turn on the water, and take it up again."""
    thing = cooking.cast[what]
    if thing.dirtyable:
        cooking.dirty.append(thing.id)
        cooking.script.becomes(thing, isDirty=False)
    _under_water(cooking, thing)
    return f"wash the {thing.type} in the SinkBasin with water from the Faucet"


@_step
def _fill(cooking: Cooking, what: str) -> str:
    """Fill a thing with water, and take it up again."""
    thing = cooking.cast[what]
    if not thing.fillable:
        raise Impossible(f"{thing.type} holds no water")
    _under_water(cooking, thing)
    return f"fill the {thing.type} in the SinkBasin with water from the Faucet"


@_step
def _brew(cooking: Cooking, what: str) -> str:
    """Make coffee into a mug, and take it up again."""
    thing, machine = cooking.cast[what], cooking.only("CoffeeMachine")
    _carry(cooking, thing, machine)
    if cooking.script.is_on(machine):
        raise Impossible("the CoffeeMachine is on already")
    cooking.script.toggle(machine)
    cooking.script.pickup(thing)
    cooking.script.becomes(thing, isFilledWithLiquid=True)
    return f"fill the {thing.type} with coffee from the CoffeeMachine"


@_step
def _heat(cooking: Cooking, what: str) -> str:
    """Heat a thing in the microwave, and take it out again."""
    thing, microwave = cooking.cast[what], cooking.only("Microwave")
    if microwave.on:
        raise Impossible("the Microwave is on already")
    _carry(cooking, thing, microwave)
    cooking.script.close(microwave)
    cooking.script.toggle(microwave)
    cooking.script.toggle(microwave)
    cooking.script.fetch(thing)
    if thing.cookable:
        cooking.script.becomes(thing, isCooked=True)
    return f"heat the {thing.type} in the Microwave, turning it on and off again"


@_step
def _chill(cooking: Cooking, what: str) -> str:
    """Cool a thing in the shut fridge, and take it out again."""
    thing, fridge = cooking.cast[what], cooking.only("Fridge")
    _carry(cooking, thing, fridge)
    cooking.script.close(fridge)
    cooking.script.fetch(thing)
    return f"cool the {thing.type} in the closed Fridge"


@_step
def _toast(cooking: Cooking, what: str) -> str:
    """Toast a slice, and take it out again."""
    thing, toaster = cooking.cast[what], cooking.only("Toaster")
    if toaster.on:
        raise Impossible("the Toaster is on already")
    _carry(cooking, thing, toaster)
    cooking.script.toggle(toaster)
    cooking.script.pickup(thing)
    cooking.script.becomes(thing, isCooked=True)
    return f"toast the {thing.type} in the Toaster"


@_step
def _slice(cooking: Cooking, what: str, knife: str) -> str:
    """Cut up what lies on something, lay the knife down there, and go on with a slice."""
    script, blade, thing = cooking.script, cooking.cast[knife], cooking.cast[what]
    if not thing.sliceable:
        raise Impossible(f"{thing.type} cannot be sliced")
    board = script.place_of(thing)
    if board.openable or not may_fill(board) or not cooking.room.accepts(blade.type, board.type):
        raise Impossible(f"no slicing in {board.type}")
    script.fetch(blade)
    script.go(board, thing)
    cooking.cast[what] = script.slice(thing)
    script.put(board)
    return (
        f"slice the {thing.type} with the {blade.type} and lay the {blade.type} down "
        f"{in_the(board.type)}"
    )


@_step
def _switch_on(cooking: Cooking, what: str) -> str:
    """Switch a thing on; a burner by its knob."""
    thing = cooking.cast[what]
    knobs = [k for k in cooking.room.things.values() if thing.id in k.controlled]
    if not thing.toggleable and not knobs:
        raise Impossible(f"{thing.type} has no switch")
    if cooking.script.is_on(thing) or any(knob.on for knob in knobs):
        raise Impossible(f"{thing.type} is on already")
    cooking.script.switch(thing)
    for food, pan in permutations(cooking.cast.values(), 2):
        lies_there = cooking.script.lies_in(food, pan) and cooking.script.lies_in(pan, thing)
        if food.cookable and lies_there:
            cooking.script.becomes(food, isCooked=True)
    return f"turn on the {thing.type}"


@_step
def _switch_off(cooking: Cooking, what: str) -> str:
    """Switch a thing off."""
    thing = cooking.cast[what]
    if not thing.toggleable or not cooking.script.is_on(thing):
        raise Impossible(f"{thing.type} is off already")
    cooking.script.switch(thing)
    return f"turn off the {thing.type}"


def steps() -> Mapping[str, Callable[..., str]]:
    """:data:`STEPS`, and ``do VERB`` for each verb that another package adds and that goes with an
    object: its roles are the object and, where the verb needs certain types in the hand, one of
    these."""
    added = {f"do {verb.name}": _doing(verb) for verb in verbs.ADDED if not verb.alone}
    return {**STEPS, **added}


def _doing(verb: Verb) -> Callable[..., str]:
    if isinstance(verb.hand, str):
        return partial(_do, verb)
    return partial(_do_with, verb)


def _do(verb: Verb, cooking: Cooking, what: str) -> str:
    """Do a verb to a thing where it is, or in the hand."""
    thing, script = cooking.cast[what], cooking.script
    if not verb.takes(thing.type):
        raise Impossible(f"one cannot {verb.name} {thing.type}")
    if script.held is not None and verb.hand == verbs.EMPTY:
        raise Impossible(f"the hand holds {script.held.type}")
    if script.held is None and verb.hand == verbs.FULL:
        raise Impossible("the hand is empty")
    if script.held == thing and not verb.in_hand:
        raise Impossible(f"one cannot {verb.name} what is in the hand")
    if verb.object_state == ("isDirty", True):
        cooking.dirty.append(thing.id)
    script.do(verb, thing)
    return f"{verb.name} the {thing.type}"


def _do_with(verb: Verb, cooking: Cooking, what: str, tool: str) -> str:
    """Fetch a tool, do a verb with it to a thing where that is, and lay the tool down there."""
    thing, instrument, script = cooking.cast[what], cooking.cast[tool], cooking.script
    place = script.place_of(thing)
    if instrument.type not in verb.hand:
        raise Impossible(f"one cannot {verb.name} with {instrument.type}")
    if not may_fill(place) or not cooking.room.accepts(instrument.type, place.type):
        raise Impossible(f"{place.type} does not take {instrument.type}")
    script.fetch(instrument)
    said = _do(verb, cooking, what)
    script.put(place)
    return f"{said} with the {instrument.type} and leave that {in_the(place.type)}"


# -- recipes as rows -----------------------------------------------------------------------------


def read_recipes(path: Path) -> tuple[Recipe, ...]:
    """Read recipes from a YAML file, which is a list of them.

    Raises:
        TaskFileError: the file cannot be used; one line says where and why.
    """
    data = read_yaml(path)
    if not isinstance(data, list):
        raise TaskFileError(f"{path}: not a list of recipes")
    recipes = tuple(
        validated(Recipe, item, f"{path}: recipe {number}") for number, item in enumerate(data, 1)
    )
    for number, recipe in enumerate(recipes):
        if recipe.name in {other.name for other in recipes[:number]}:
            raise TaskFileError(f"{path}: two recipes are named {recipe.name!r}")
        _check(recipe, f"{path}: recipe {recipe.name!r}")
    return recipes


def _check(recipe: Recipe, where: str) -> None:
    for role, kind in recipe.roles.items():
        if isinstance(kind, str) and kind not in KINDS:
            raise TaskFileError(
                f"{where}: role {role!r} is of unknown kind {kind!r}; "
                f"give a list of object types or one of: {', '.join(KINDS)}"
            )
        unknown = (
            [] if isinstance(kind, str) else [name for name in kind if name not in OBJECT_TYPES]
        )
        if unknown:
            raise TaskFileError(f"{where}: role {role!r} has unknown object type {unknown[0]!r}")
    if not recipe.steps:
        raise TaskFileError(f"{where}: it has no steps")
    known = steps()
    for step in recipe.steps:
        if len(step) != 1 or not set(step) <= set(known):
            raise TaskFileError(
                f"{where}: a step is {list(step)}; it must be one of: {', '.join(known)}"
            )
        ((name, roles),) = step.items()
        strange = [role for role in roles if role not in recipe.roles]
        if strange:
            raise TaskFileError(
                f"{where}: a step names {strange[0]!r}; its roles are: {', '.join(recipe.roles)}"
            )
        takes = len(signature(known[name]).parameters) - 1
        if len(roles) != takes:
            raise TaskFileError(
                f"{where}: the step {name!r} is about {len(roles)} roles; it takes {takes}"
            )


@lru_cache(maxsize=1)
def bundled_recipes() -> tuple[Recipe, ...]:
    """The recipes that come with er-gym."""
    return read_recipes(Path(str(files("er_gym.tasks.generate").joinpath("recipes.yaml"))))


def rows(recipes: Sequence[Recipe]) -> tuple[Row, ...]:
    """A row of the table of what is generated for each recipe."""
    return tuple(
        Row(
            "long-range tasks with dependency relationships",
            choices=partial(_choices, recipe),
            plan=partial(_plan, recipe),
            sayings=_sayings,
            slug=f"long_range_{recipe.name}",
            names_places=False,
        )
        for recipe in recipes
    )


def _sayings(words: Mapping[str, str | Sequence[str]]) -> list[str]:
    clauses = words["clauses"]
    assert not isinstance(clauses, str)
    return [in_order(clauses, style) for style in range(STYLES)]


def _plan(recipe: Recipe, room: Room, *cast: Thing) -> Plan:
    """Act a recipe out."""
    roles = dict(zip(recipe.roles, cast, strict=True))
    cooking = Cooking(room, Script(room, stays=True), roles, [])
    do = steps()
    clauses = [do[name](cooking, *args) for step in recipe.steps for name, args in step.items()]
    moved = [thing for thing in cast if thing.pickupable]
    return plan_of(cooking.script, *moved, dirty=cooking.dirty, clauses=clauses)


def _choices(recipe: Recipe, room: Room) -> Iterator[tuple[Thing, ...]]:
    """Some of the ways to fill a recipe's roles, at random but the same for the same room."""
    candidates = [_candidates(room, kind) for kind in recipe.roles.values()]
    if not all(candidates):
        return
    rng = random.Random(zlib.crc32("".join((recipe.name, *room.things)).encode()))
    tried: set[tuple[str, ...]] = set()
    found = 0
    for _ in range(_MOST_TRIES):
        cast = tuple(rng.choice(things) for things in candidates)
        ids = tuple(thing.id for thing in cast)
        if ids in tried or len({thing.type for thing in cast}) < len(cast):
            continue
        tried.add(ids)
        try:
            plan = _plan(recipe, room, *cast)
        except Impossible:
            continue
        if SHORTEST <= len(plan.key_actions) <= LONGEST and plan.names_one_place_each:
            yield cast
            found += 1
            if found == _MOST_CHOICES:
                return


def _candidates(room: Room, kind: tuple[str, ...] | str) -> list[Thing]:
    """Who may play a role: things that are alone of their type, or the largest of several.

    What is carried or switched has to be alone, for the words name it by its type.
    """
    things = KINDS[kind](room) if isinstance(kind, str) else _of_types(room, kind)
    groups: dict[str, list[Thing]] = {}
    for thing in things:
        groups.setdefault(thing.type, []).append(thing)
    return [
        largest(group)
        for group in groups.values()
        if not room.others(group[0]) or not (group[0].pickupable or group[0].toggleable)
    ]


def _of_types(room: Room, types: Sequence[str]) -> list[Thing]:
    """Those of some types that one can get at."""
    return [
        thing
        for thing in room.of_type(*types)
        if not thing.pickupable or room.is_exposed(thing) or room.is_enclosed(thing)
    ]
