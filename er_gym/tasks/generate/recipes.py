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
from er_gym.tasks.generate.plan_builder import ImpossiblePlan, PlanBuilder
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject, largest, may_put_into
from er_gym.tasks.generate.task_plan import TaskPlan, TaskRule, plan_from
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


def _loose(graph: SceneGraph) -> list[SceneObject]:
    return [*graph.pickupable_objects(hidden=False), *graph.pickupable_objects(hidden=True)]


def _furniture(graph: SceneGraph) -> list[SceneObject]:
    return [
        obj
        for obj in graph.objects.values()
        if obj.receptacle and not obj.pickupable and not obj.openable and may_put_into(obj)
    ]


def _lockers(graph: SceneGraph) -> list[SceneObject]:
    return [
        obj
        for obj in graph.objects.values()
        if obj.receptacle and not obj.pickupable and obj.closed and may_put_into(obj)
    ]


def _switches(graph: SceneGraph) -> list[SceneObject]:
    free = (t for t in graph.objects.values() if graph.is_exposed(t) or graph.stands_free(t))
    return [obj for obj in free if obj.toggleable and obj.type in SWITCHED]


SWITCHED = frozenset(
    {"Candle", "CellPhone", "CoffeeMachine", "DeskLamp", "FloorLamp", "Laptop", "Television"}
)
"""What one switches for its own sake."""
KINDS: Mapping[str, Callable[[SceneGraph], list[SceneObject]]] = {
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

    graph: SceneGraph
    builder: PlanBuilder
    cast: dict[str, SceneObject]
    dirty: list[str]

    def only(self, object_type: str) -> SceneObject:
        """The one thing of a type."""
        found = self.graph.of_type(object_type)
        if len(found) != 1:
            raise ImpossiblePlan(f"{len(found)} {object_type} objects")
        return found[0]


STEPS: dict[str, Callable[..., str]] = {}
"""By name: what a step does, given the recipe being acted out and its roles, and says of it."""


def _step(function: Callable[..., str]) -> Callable[..., str]:
    STEPS[function.__name__.removeprefix("_")] = function
    return function


def _carry(cooking: Cooking, obj: SceneObject, target: SceneObject) -> None:
    if cooking.builder.lies_in(obj, target) or cooking.builder.taken_from(obj) == target:
        raise ImpossiblePlan(f"{obj.type} is there, or has just been there")
    if not cooking.graph.accepts(obj.type, target.type):
        raise ImpossiblePlan(f"{target.type} does not take {obj.type}")
    cooking.builder.fetch(obj)
    cooking.builder.put(target)


@_step
def _put(cooking: Cooking, what: str, where: str) -> str:
    """Put a thing into or onto another."""
    obj, target = cooking.cast[what], cooking.cast[where]
    _carry(cooking, obj, target)
    return f"put the {obj.type} {in_the(target.type)}"


def _under_water(cooking: Cooking, obj: SceneObject) -> None:
    water = cooking.graph.sink_and_faucet()
    if water is None:
        raise ImpossiblePlan("no water")
    basin, faucet = water
    _carry(cooking, obj, basin)
    if not cooking.builder.is_on(faucet):
        cooking.builder.toggle(faucet)
    cooking.builder.pickup(obj)
    if obj.fillable:
        cooking.builder.set_state(obj, isFilledWithLiquid=True)


@_step
def _wash(cooking: Cooking, what: str) -> str:
    """Lay a thing in the sink, turn on the water, and take it up again."""
    obj = cooking.cast[what]
    if obj.dirtyable:
        cooking.dirty.append(obj.id)
        cooking.builder.set_state(obj, isDirty=False)
    _under_water(cooking, obj)
    return f"wash the {obj.type} in the SinkBasin with water from the Faucet"


@_step
def _fill(cooking: Cooking, what: str) -> str:
    """Fill a thing with water, and take it up again."""
    obj = cooking.cast[what]
    if not obj.fillable:
        raise ImpossiblePlan(f"{obj.type} holds no water")
    _under_water(cooking, obj)
    return f"fill the {obj.type} in the SinkBasin with water from the Faucet"


@_step
def _brew(cooking: Cooking, what: str) -> str:
    """Make coffee into a mug, and take it up again."""
    obj, machine = cooking.cast[what], cooking.only("CoffeeMachine")
    _carry(cooking, obj, machine)
    if cooking.builder.is_on(machine):
        raise ImpossiblePlan("the CoffeeMachine is on already")
    cooking.builder.toggle(machine)
    cooking.builder.pickup(obj)
    cooking.builder.set_state(obj, isFilledWithLiquid=True)
    return f"fill the {obj.type} with coffee from the CoffeeMachine"


@_step
def _heat(cooking: Cooking, what: str) -> str:
    """Heat a thing in the microwave, and take it out again."""
    obj, microwave = cooking.cast[what], cooking.only("Microwave")
    if microwave.on:
        raise ImpossiblePlan("the Microwave is on already")
    _carry(cooking, obj, microwave)
    cooking.builder.close(microwave)
    cooking.builder.toggle(microwave)
    cooking.builder.toggle(microwave)
    cooking.builder.fetch(obj)
    if obj.cookable:
        cooking.builder.set_state(obj, isCooked=True)
    return f"heat the {obj.type} in the Microwave, turning it on and off again"


@_step
def _chill(cooking: Cooking, what: str) -> str:
    """Cool a thing in the shut fridge, and take it out again."""
    obj, fridge = cooking.cast[what], cooking.only("Fridge")
    _carry(cooking, obj, fridge)
    cooking.builder.close(fridge)
    cooking.builder.fetch(obj)
    return f"cool the {obj.type} in the closed Fridge"


@_step
def _toast(cooking: Cooking, what: str) -> str:
    """Toast a slice, and take it out again."""
    obj, toaster = cooking.cast[what], cooking.only("Toaster")
    if toaster.on:
        raise ImpossiblePlan("the Toaster is on already")
    _carry(cooking, obj, toaster)
    cooking.builder.toggle(toaster)
    cooking.builder.pickup(obj)
    cooking.builder.set_state(obj, isCooked=True)
    return f"toast the {obj.type} in the Toaster"


@_step
def _slice(cooking: Cooking, what: str, knife: str) -> str:
    """Cut up what lies on something, lay the knife down there, and go on with a slice."""
    builder, blade, obj = cooking.builder, cooking.cast[knife], cooking.cast[what]
    if not obj.sliceable:
        raise ImpossiblePlan(f"{obj.type} cannot be sliced")
    board = builder.place_of(obj)
    if (
        board.openable
        or not may_put_into(board)
        or not cooking.graph.accepts(blade.type, board.type)
    ):
        raise ImpossiblePlan(f"no slicing in {board.type}")
    builder.fetch(blade)
    builder.go_to(board, obj)
    cooking.cast[what] = builder.slice(obj)
    builder.put(board)
    return (
        f"slice the {obj.type} with the {blade.type} and lay the {blade.type} down "
        f"{in_the(board.type)}"
    )


@_step
def _switch_on(cooking: Cooking, what: str) -> str:
    """Switch a thing on; a burner by its knob."""
    obj = cooking.cast[what]
    knobs = [k for k in cooking.graph.objects.values() if obj.id in k.controlled]
    if not obj.toggleable and not knobs:
        raise ImpossiblePlan(f"{obj.type} has no switch")
    if cooking.builder.is_on(obj) or any(knob.on for knob in knobs):
        raise ImpossiblePlan(f"{obj.type} is on already")
    cooking.builder.go_and_toggle(obj)
    for food, pan in permutations(cooking.cast.values(), 2):
        lies_there = cooking.builder.lies_in(food, pan) and cooking.builder.lies_in(pan, obj)
        if food.cookable and lies_there:
            cooking.builder.set_state(food, isCooked=True)
    return f"turn on the {obj.type}"


@_step
def _switch_off(cooking: Cooking, what: str) -> str:
    """Switch a thing off."""
    obj = cooking.cast[what]
    if not obj.toggleable or not cooking.builder.is_on(obj):
        raise ImpossiblePlan(f"{obj.type} is off already")
    cooking.builder.go_and_toggle(obj)
    return f"turn off the {obj.type}"


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
    obj, builder = cooking.cast[what], cooking.builder
    if not verb.takes(obj.type):
        raise ImpossiblePlan(f"one cannot {verb.name} {obj.type}")
    if builder.held is not None and verb.hand == verbs.EMPTY:
        raise ImpossiblePlan(f"the hand holds {builder.held.type}")
    if builder.held is None and verb.hand == verbs.FULL:
        raise ImpossiblePlan("the hand is empty")
    if builder.held == obj and not verb.in_hand:
        raise ImpossiblePlan(f"one cannot {verb.name} what is in the hand")
    if verb.object_state == ("isDirty", True):
        cooking.dirty.append(obj.id)
    builder.do(verb, obj)
    return f"{verb.name} the {obj.type}"


def _do_with(verb: Verb, cooking: Cooking, what: str, tool: str) -> str:
    """Fetch a tool, do a verb with it to a thing where that is, and lay the tool down there."""
    obj, instrument, builder = cooking.cast[what], cooking.cast[tool], cooking.builder
    place = builder.place_of(obj)
    if instrument.type not in verb.hand:
        raise ImpossiblePlan(f"one cannot {verb.name} with {instrument.type}")
    if not may_put_into(place) or not cooking.graph.accepts(instrument.type, place.type):
        raise ImpossiblePlan(f"{place.type} does not take {instrument.type}")
    builder.fetch(instrument)
    said = _do(verb, cooking, what)
    builder.put(place)
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


def recipe_rules(recipes: Sequence[Recipe]) -> tuple[TaskRule, ...]:
    """A row of the table of what is generated for each recipe."""
    return tuple(
        TaskRule(
            "long-range tasks with dependency relationships",
            choices=partial(_choices, recipe),
            plan=partial(_plan, recipe),
            instructions=_instructions,
            slug=f"long_range_{recipe.name}",
            may_name_places=False,
        )
        for recipe in recipes
    )


def _instructions(words: Mapping[str, str | Sequence[str]]) -> list[str]:
    clauses = words["clauses"]
    assert not isinstance(clauses, str)
    return [in_order(clauses, style) for style in range(STYLES)]


def _plan(recipe: Recipe, graph: SceneGraph, *cast: SceneObject) -> TaskPlan:
    """Act a recipe out."""
    roles = dict(zip(recipe.roles, cast, strict=True))
    cooking = Cooking(graph, PlanBuilder(graph, merge_visits=True), roles, [])
    do = steps()
    clauses = [do[name](cooking, *args) for step in recipe.steps for name, args in step.items()]
    moved = [obj for obj in cast if obj.pickupable]
    return plan_from(cooking.builder, *moved, dirty=cooking.dirty, clauses=clauses)


def _choices(recipe: Recipe, graph: SceneGraph) -> Iterator[tuple[SceneObject, ...]]:
    """Some of the ways to fill a recipe's roles, at random but the same for the same room."""
    candidates = [_candidates(graph, kind) for kind in recipe.roles.values()]
    if not all(candidates):
        return
    rng = random.Random(zlib.crc32("".join((recipe.name, *graph.objects)).encode()))
    tried: set[tuple[str, ...]] = set()
    found = 0
    for _ in range(_MOST_TRIES):
        cast = tuple(rng.choice(objects) for objects in candidates)
        ids = tuple(obj.id for obj in cast)
        if ids in tried or len({obj.type for obj in cast}) < len(cast):
            continue
        tried.add(ids)
        try:
            plan = _plan(recipe, graph, *cast)
        except ImpossiblePlan:
            continue
        if SHORTEST <= len(plan.key_actions) <= LONGEST and plan.one_object_per_type:
            yield cast
            found += 1
            if found == _MOST_CHOICES:
                return


def _candidates(graph: SceneGraph, kind: tuple[str, ...] | str) -> list[SceneObject]:
    """Who may play a role: things that are alone of their type, or the largest of several.

    What is carried or switched has to be alone, for the words name it by its type.
    """
    objects = KINDS[kind](graph) if isinstance(kind, str) else _of_types(graph, kind)
    groups: dict[str, list[SceneObject]] = {}
    for obj in objects:
        groups.setdefault(obj.type, []).append(obj)
    return [
        largest(group)
        for group in groups.values()
        if not graph.others_of_type(group[0]) or not (group[0].pickupable or group[0].toggleable)
    ]


def _of_types(graph: SceneGraph, types: Sequence[str]) -> list[SceneObject]:
    """Those of some types that one can get at."""
    return [
        obj
        for obj in graph.of_type(*types)
        if not obj.pickupable or graph.is_exposed(obj) or graph.is_enclosed(obj)
    ]
