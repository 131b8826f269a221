"""The objects and rooms that are kept out of training."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import pytest
from support import make_task

from er_gym.tasks import Task, load_suite
from er_gym.tasks.paper_format import read_tasks
from er_gym.tasks.room_kinds import ROOM_KINDS, room_kind
from er_gym.tasks.splits import (
    EVALUATION_SCENES,
    SCENES,
    TRAINING_SCENES,
    UNSEEN_TYPES,
    split,
    subject_types,
)
from er_gym.thor import OBJECT_TYPES, SCENE_NAMES

BOOK, CLOCK = "Book|+00.00|+00.00|+01.00", "AlarmClock|+00.00|+00.00|+01.00"
DESK = "Desk|+00.00|+00.00|+01.00"


def taking(object_id: str, scene: str) -> Task:
    return make_task("single_pickup", ("navigate to", DESK), ("pickup", object_id), scene=scene)


def test_rooms_are_for_training_or_for_evaluation() -> None:
    assert set(TRAINING_SCENES).isdisjoint(EVALUATION_SCENES)
    assert {*TRAINING_SCENES, *EVALUATION_SCENES} < set(SCENE_NAMES) == set(SCENES["all"])
    assert len(TRAINING_SCENES) == 104
    assert (SCENES["training"], SCENES["evaluation"]) == (TRAINING_SCENES, EVALUATION_SCENES)


def test_three_rooms_of_each_kind_are_for_evaluation() -> None:
    assert len(set(EVALUATION_SCENES)) == len(EVALUATION_SCENES) == 12
    assert Counter(map(room_kind, EVALUATION_SCENES)) == dict.fromkeys(ROOM_KINDS, 3)


def test_the_papers_test_tasks_play_in_no_training_room(shared_data: Path) -> None:
    tasks = read_tasks(shared_data / "paper_tasks_dev.json")
    assert not {task.scene for task in tasks} & set(TRAINING_SCENES)
    short = {task.scene for task in tasks if not task.type.name.startswith("long-range")}
    assert short == set(EVALUATION_SCENES)
    # Some long-range ones play elsewhere; these rooms are for neither.
    assert {task.scene for task in tasks} - short == (
        set(SCENE_NAMES) - set(TRAINING_SCENES) - set(EVALUATION_SCENES) - {"FloorPlan7"}
    )


def test_unseen_types_are_types_that_tasks_may_be_about() -> None:
    assert len(UNSEEN_TYPES) == 8
    for name in UNSEEN_TYPES:
        assert "pickupable" in OBJECT_TYPES[name].properties


SPLITS = {
    "seen": (BOOK, "FloorPlan310"),
    "unseen object": (CLOCK, "FloorPlan310"),
    "unseen room": (BOOK, "FloorPlan301"),
    "unseen room and object": (CLOCK, "FloorPlan301"),
}


@pytest.mark.parametrize("name", SPLITS)
def test_how_new_a_task_is(name: str) -> None:
    assert split(taking(*SPLITS[name])) == name


@pytest.mark.parametrize(
    ("scene", "name"),
    [
        ("FloorPlan22", "unseen room"),
        ("FloorPlan30_physics", "seen"),
        ("FloorPlan1_physics", "unseen room"),
    ],
)
def test_how_new_other_rooms_are(scene: str, name: str) -> None:
    assert split(taking(BOOK, scene)) == name


def test_a_task_is_about_what_is_taken_switched_or_sliced_but_not_where_it_goes() -> None:
    kettle, pan = "Kettle|+00.00|+00.00|+01.00", "Pan|+00.00|+00.00|+01.00"
    task = make_task(
        "pickup_and_put",
        ("navigate to", DESK),
        ("slice", "Apple|+00.00|+00.00|+01.00"),
        ("pickup", "Apple|+00.00|+00.00|+01.00|AppleSliced_0"),
        ("open", "Fridge|+00.00|+00.00|+01.00"),
        ("put in", kettle),
        ("toggle", "Faucet|+00.00|+00.00|+01.00"),
        related_objects=(pan,),
    )
    assert subject_types(task) == {"Apple", "AppleSliced", "Faucet"}
    assert split(task) == "unseen room"


def test_a_search_is_about_what_is_looked_for() -> None:
    task = make_task("single_search", ("navigate to", DESK), related_objects=(CLOCK,))
    assert subject_types(task) == {"AlarmClock"}
    assert split(task) == "unseen room and object"


def test_the_benchmark_plays_in_evaluation_rooms() -> None:
    tasks = load_suite("er-1k").tasks
    assert {task.scene for task in tasks} == set(EVALUATION_SCENES)
    assert {split(task) for task in tasks} == {"unseen room", "unseen room and object"}
