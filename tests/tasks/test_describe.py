from __future__ import annotations

from dataclasses import replace

import pytest
from floor_plan_1 import EGG, FRIDGE
from support import make_task

from er_gym.tasks import load_suite, verbs
from er_gym.tasks.arrangement import Arrangement, ObjectPose
from er_gym.tasks.describe import describe
from er_gym.tasks.difficulty import Difficulty
from er_gym.tasks.goal import Condition
from er_gym.tasks.task import KeyAction

CABINETS = ("Cabinet|+00.68|+02.02|-02.46", "Cabinet|-01.85|+02.02|+00.38")
DONE = "all steps of the plan, except navigation, have been done"


def claims(*goal: Condition) -> list[str]:
    """What counts in the end of a task with this goal, beside the plan."""
    text = describe(make_task("single_pickup", (verbs.PICKUP, EGG), goal=goal))
    return [line[4:] for line in text.splitlines() if line.startswith("  - ")][1:]


def plan(*key_actions: tuple[str, str], kind: str = "pickup_and_put") -> list[str]:
    text = describe(make_task(kind, *key_actions))
    steps = text.partition("Plan\n")[2].partition("\n\n")[0].splitlines()
    return [step.partition(". ")[2] for step in steps]


def test_a_whole_task() -> None:
    task = make_task("single_pickup_from_closerep", instruction="Please fetch the Egg.")
    task = replace(
        task,
        id="FloorPlan1-egg",
        key_actions=(
            KeyAction(verbs.NAVIGATE, FRIDGE, "Fridge", (FRIDGE, EGG)),
            KeyAction(verbs.OPEN, FRIDGE, "Fridge", (FRIDGE,)),
            KeyAction(verbs.PICKUP, EGG, "Egg", (EGG,), reward=1.5),
            KeyAction(verbs.CLOSE, FRIDGE, "Fridge", (FRIDGE,)),
            KeyAction(verbs.END),
        ),
        goal=(Condition("Egg", EGG, held=True),),
        arrangement=Arrangement(
            "FloorPlan1-9", {"Egg_1": ObjectPose(0.0, 1.0, 0.0)}, dirty=(FRIDGE,)
        ),
    )
    assert describe(task, Difficulty(1, 2, 3.26, 5)) == (
        "FloorPlan1-egg\n"
        "Enclosed Object Grasping (Manipulate), kitchen FloorPlan1, rearranged as FloorPlan1-9\n"
        "dirty when it begins: the Fridge\n"
        "\n"
        '"Please fetch the Egg."\n'
        "\n"
        "Plan\n"
        "   1. go to the Fridge (for the Egg)\n"
        "   2. open it\n"
        "   3. pick up the Egg\n"
        "   4. close the Fridge\n"
        "   5. say that it is done\n"
        "\n"
        "What counts in the end\n"
        f"  - {DONE} in any order\n"
        "  - the Egg is in the hand\n"
        "\n"
        "Reward 5.5 in all, at most 24 steps\n"
        "Difficulty: hidden depth 1, distractors 2, distance 3.3 m, length 5\n"
    )


@pytest.mark.parametrize(
    ("condition", "words"),
    [
        (Condition("Egg", EGG, inside="Microwave"), "the Egg lies in the Microwave"),
        (Condition("Egg", inside="DiningTable"), "an Egg lies on the DiningTable"),
        (Condition("Lettuce", held=True), "some Lettuce is in the hand"),
        (Condition("Mug", in_reach=True), "a Mug is in sight and within reach"),
        (Condition("Boots", inside="Floor"), "some Boots lie on the Floor"),
        (
            Condition("DeskLamp", "DeskLamp|1.00|1.00|1.00", state=(("isToggled", False),)),
            "the DeskLamp is off",
        ),
        (
            Condition("Potato", inside="Plate", state=(("isCooked", True), ("temperature", "Hot"))),
            "a Potato lies on the Plate, is cooked and is hot",
        ),
        (
            Condition("Sofa", state=(("fillLiquid", "wine"),)),
            "a Sofa is such that fillLiquid says wine",
        ),
        (Condition("Vase"), "a Vase is there"),
    ],
)
def test_conditions_in_words(condition: Condition, words: str) -> None:
    assert claims(condition) == [words]


def test_what_is_put_somewhere_is_what_was_picked_up() -> None:
    assert plan((verbs.PICKUP, EGG), (verbs.PUT, FRIDGE), (verbs.PUT, FRIDGE)) == [
        "pick up the Egg",
        "put the Egg in the Fridge",
        "put what is held in the Fridge",
        "say that it is done",
    ]


def test_every_verb_has_words_and_another_is_given_as_it_is() -> None:
    object_verbs = [(verb, EGG if n % 2 else FRIDGE) for n, verb in enumerate(verbs.OBJECT_VERBS)]
    steps = plan(*object_verbs, *((verb, "") for verb in verbs.BARE_VERBS), ("paint", EGG))
    assert steps[-2:] == ["paint the Egg", "say that it is done"]
    assert "switch the Egg on or off" in steps
    assert "look around" in steps
    assert not any("{" in step for step in steps)


def test_the_order_is_said_where_it_counts() -> None:
    assert f"  - {DONE} in this order\n" in describe(make_task("ordered_pickup_two_object_and_put"))


def test_objects_of_one_type_are_told_apart() -> None:
    first, second = CABINETS
    assert plan((verbs.OPEN, first), (verbs.CLOSE, first), (verbs.PUT, second))[:3] == [
        "open the Cabinet at +00.68|+02.02|-02.46",
        "close it",
        "put what is held in the Cabinet at -01.85|+02.02|+00.38",
    ]
    task = make_task("single_search_from_closerep", (verbs.OPEN, first))
    assert "open the Cabinet\n" in describe(task)
    assert "open the Cabinet at +00.68|+02.02|-02.46\n" in describe(task, scene_ids=CABINETS)


def test_what_a_search_looks_for_counts_once() -> None:
    task = make_task("single_search", related_objects=(EGG,))
    seen = "  - an Egg is in sight and within reach\n"
    assert describe(task).count(seen) == 1
    assert describe(replace(task, goal=(Condition("Egg", in_reach=True),))).count(seen) == 1
    ended = KeyAction(verbs.END, related_objects=(FRIDGE, EGG))
    assert seen in describe(replace(task, related_objects=(), key_actions=(ended,)))


def test_the_bundled_tasks_fit_a_terminal_and_are_told_whole() -> None:
    for task in load_suite("mini").tasks:
        text = describe(task)
        assert all(len(line) <= 100 for line in text.splitlines()[1:])
        assert text.endswith("steps\n")
        assert f"{len(task.key_actions):4}. say that it is done\n" in text
        assert " ".join(task.instruction.split()) in " ".join(text.split())
        assert task.scene in text
