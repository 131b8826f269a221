"""Long-range tasks: recipes, which are data (``recipes.yaml``), and the rules made from them."""

from __future__ import annotations

import random
import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import lru_cache, partial
from importlib.resources import files
from inspect import signature
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.files import validated
from er_gym.tasks.generate.plan_builder import ImpossiblePlan, PlanBuilder
from er_gym.tasks.generate.recipe_steps import RecipeRun, steps
from er_gym.tasks.generate.scene_graph import SceneGraph, SceneObject, largest, may_put_into
from er_gym.tasks.generate.task_plan import Filled, TaskPlan, TaskRule, plan_from
from er_gym.tasks.reading import read_yaml
from er_gym.tasks.wordings.english import ENGLISH, in_order
from er_gym.thor import OBJECT_TYPES

SHORTEST, LONGEST = 9, 28
"""The smallest and the largest number of key actions of a long-range task, ``end`` included."""
_MOST_CHOICES = 6
"""The most tasks that one recipe makes of one scene."""
_MOST_TRIES = 150
"""The most ways to fill a recipe's roles that are tried in one scene."""


class Recipe(BaseModel):
    """A sequence of steps with roles instead of objects.

    Attributes:
        name: a part of task ids: letters, digits and underscores.
        roles: role to the objects that can fill it: a list of object types, or one of
            :data:`ROLE_KINDS`.
        steps: each names one of :func:`~er_gym.tasks.generate.recipe_steps.steps` and the roles
            that it is about.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(pattern=r"^\w+$")
    roles: dict[str, tuple[str, ...] | str]
    steps: tuple[dict[str, tuple[str, ...]], ...]


# -- the kinds of objects that fill roles --------------------------------------------------------

SWITCHED = frozenset(
    {"Candle", "CellPhone", "CoffeeMachine", "DeskLamp", "FloorLamp", "Laptop", "Television"}
)
"""Types that a task may switch on for no further purpose."""


def _loose(graph: SceneGraph) -> list[SceneObject]:
    return [*graph.pickupable_objects(hidden=False), *graph.pickupable_objects(hidden=True)]


def _furniture(graph: SceneGraph) -> list[SceneObject]:
    return [obj for obj in _fixed_receptacles(graph) if not obj.openable]


def _lockers(graph: SceneGraph) -> list[SceneObject]:
    return [obj for obj in _fixed_receptacles(graph) if obj.closed]


def _fixed_receptacles(graph: SceneGraph) -> list[SceneObject]:
    return [
        obj
        for obj in graph.objects.values()
        if obj.receptacle and not obj.pickupable and may_put_into(obj)
    ]


def _switches(graph: SceneGraph) -> list[SceneObject]:
    free = (o for o in graph.objects.values() if graph.is_exposed(o) or graph.stands_free(o))
    return [obj for obj in free if obj.toggleable and obj.type in SWITCHED]


ROLE_KINDS: Mapping[str, Callable[[SceneGraph], list[SceneObject]]] = {
    "loose": _loose,
    "furniture": _furniture,
    "locker": _lockers,
    "switch": _switches,
}
"""Kind of role to the objects that can fill it:

- ``loose``: exposed and enclosed objects that can be picked up;
- ``furniture``: receptacles that do not open;
- ``locker``: receptacles that are closed;
- ``switch``: objects of the types :data:`SWITCHED`.
"""


# -- files and rules -----------------------------------------------------------------------------


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
        if isinstance(kind, str) and kind not in ROLE_KINDS:
            raise TaskFileError(
                f"{where}: role {role!r} is of unknown kind {kind!r}; "
                f"give a list of object types or one of: {', '.join(ROLE_KINDS)}"
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
    """The recipes of er-gym."""
    return read_recipes(Path(str(files("er_gym.tasks.generate").joinpath("recipes.yaml"))))


def recipe_rules(recipes: Sequence[Recipe]) -> tuple[TaskRule, ...]:
    """A rule for each recipe."""
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


def _instructions(words: Mapping[str, str | Sequence[str]]) -> Sequence[str]:
    clauses = words["clauses"]
    assert not isinstance(clauses, str)
    return Filled(ENGLISH.orders.seen, partial(in_order, clauses))


def _plan(recipe: Recipe, graph: SceneGraph, *chosen: SceneObject) -> TaskPlan:
    """The plan of a recipe for the objects in its roles."""
    roles = dict(zip(recipe.roles, chosen, strict=True))
    run = RecipeRun(graph, PlanBuilder(graph, merge_visits=True), roles, [])
    do = steps()
    clauses = [do[name](run, *args) for step in recipe.steps for name, args in step.items()]
    moved = [obj for obj in chosen if obj.pickupable]
    return plan_from(run.builder, *moved, dirty=run.dirty, clauses=clauses)


def _choices(recipe: Recipe, graph: SceneGraph) -> Iterator[tuple[SceneObject, ...]]:
    """Random choices of objects for a recipe's roles; the same for the same scene."""
    candidates = [_candidates(graph, kind) for kind in recipe.roles.values()]
    if not all(candidates):
        return
    rng = random.Random(zlib.crc32("".join((recipe.name, *graph.objects)).encode()))
    tried: set[tuple[str, ...]] = set()
    found = 0
    for _ in range(_MOST_TRIES):
        chosen = tuple(rng.choice(objects) for objects in candidates)
        ids = tuple(obj.id for obj in chosen)
        if ids in tried or len({obj.type for obj in chosen}) < len(chosen):
            continue
        tried.add(ids)
        try:
            plan = _plan(recipe, graph, *chosen)
        except ImpossiblePlan:
            continue
        if SHORTEST <= len(plan.key_actions) <= LONGEST and plan.one_object_per_type:
            yield chosen
            found += 1
            if found == _MOST_CHOICES:
                return


def _candidates(graph: SceneGraph, kind: tuple[str, ...] | str) -> list[SceneObject]:
    """The objects that can fill a role: one of each type, the largest.

    A pickupable or toggleable object must be the only one of its type, because the instruction
    names it by its type.
    """
    objects = ROLE_KINDS[kind](graph) if isinstance(kind, str) else _of_types(graph, kind)
    groups: dict[str, list[SceneObject]] = {}
    for obj in objects:
        groups.setdefault(obj.type, []).append(obj)
    return [
        largest(group)
        for group in groups.values()
        if not graph.others_of_type(group[0]) or not (group[0].pickupable or group[0].toggleable)
    ]


def _of_types(graph: SceneGraph, types: Sequence[str]) -> list[SceneObject]:
    """The objects of some types, without pickupable ones that are neither exposed nor enclosed."""
    return [
        obj
        for obj in graph.of_type(*types)
        if not obj.pickupable or graph.is_exposed(obj) or graph.is_enclosed(obj)
    ]
