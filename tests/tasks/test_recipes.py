"""Long-range tasks: the recipes that come with er-gym, and files of recipes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from typing import Any

import pytest

from er_gym.envs.asked_goal import goal
from er_gym.tasks import Task, TaskFileError, verbs
from er_gym.tasks.generate import Generator
from er_gym.tasks.generate.recipe_steps import STEPS
from er_gym.tasks.generate.recipes import (
    LONGEST,
    ROLE_KINDS,
    SHORTEST,
    Recipe,
    bundled_recipes,
    read_recipes,
    recipe_rules,
)
from er_gym.thor import OBJECT_TYPES

Objects = list[dict[str, Any]]
RECIPES = {recipe.name: recipe for recipe in bundled_recipes()}


# -- those that come with er-gym -----------------------------------------------------------------


@pytest.mark.parametrize("recipe", RECIPES.values(), ids=RECIPES)
def test_a_bundled_recipe_names_what_there_is(recipe: Recipe) -> None:
    kinds = recipe.roles.values()
    assert set(chain.from_iterable(k for k in kinds if not isinstance(k, str))) <= set(OBJECT_TYPES)
    assert {kind for kind in kinds if isinstance(kind, str)} <= set(ROLE_KINDS)
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
        generator = Generator(scene, scene_objects(scene), rules=recipe_rules(bundled_recipes()))
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
        spoken_of = {name for name, _ in goal(task.instruction)[1]}
        assert spoken_of <= done
        assert {name for name in done if name} - spoken_of <= {
            name for name in done if name.endswith("Sliced") or name in _ONLY_OPENED
        }  # fmt: skip


_ONLY_OPENED: set[str] = {"Cabinet", "Drawer", "Fridge", "Microwave", "Safe"}
"""Types that one may have to open, which the words need not say."""


def test_dishes_are_dirty_before_and_clean_after_they_are_washed(
    made: dict[str, list[Task]],
) -> None:
    dirty = [task for tasks in made.values() for task in tasks if task.arrangement.dirty]
    assert dirty
    for task in dirty:
        types = {object_id.split("|")[0] for object_id in task.arrangement.dirty}
        clean = {c.object_type for c in task.goal if ("isDirty", False) in c.state}
        assert types == clean
    assert not [task for task in made["clear_three"] if task.arrangement.dirty]


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
    "more": (f"{GOOD}  cast: 3", "recipe 1 has a wrong field 'cast'"),
    "kind": (
        GOOD.replace("loose", "lost"),
        "recipe 'tidy': role 'thing' is of unknown kind 'lost'; give a list of object types or "
        "one of: loose, furniture, locker, switch",
    ),
    "one name twice": (f"{GOOD}{GOOD}", "two recipes are named 'tidy'"),
}
"""Faulty files, and how the message begins."""
ONE_STEP, TWO_IN_ONE = "- put: [thing, place]", "- {put: [thing, place], wash: [thing]}"
KNOWN_STEPS = "it must be one of: put, wash, "
MISTAKES = {
    "misspelled": ("roles", "rolls", " 1 lacks field 'roles'"),
    "name": ("tidy", "tidy up", " 1 has a wrong field 'name'"),
    "step": ("put", "throw", f" 'tidy': a step is ['throw']; {KNOWN_STEPS}"),
    "no step": (ONE_STEP, "[]", " 'tidy': it has no steps"),
    "too few roles": (", place]", "]", " 'tidy': the step 'put' is about 1 roles; it takes 2"),
    "type": ("loose", "[Potatoe]", " 'tidy': role 'thing' has unknown object type 'Potatoe'"),
    "two in one": (ONE_STEP, TWO_IN_ONE, f" 'tidy': a step is ['put', 'wash']; {KNOWN_STEPS}"),
    "role": (", place]", ", spot]", " 'tidy': a step names 'spot'; its roles are: thing, place"),
    "roles of a step": ("[thing, place]", "thing", " 1 has a wrong field"),
}
"""What is written in a good file instead of what, and the message behind ``recipe``."""
FAULTS |= {
    fault: (GOOD.replace(right, wrong), f"recipe{message}")
    for fault, (right, wrong, message) in MISTAKES.items()
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
