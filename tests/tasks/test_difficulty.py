from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import pytest
from support import make_task

from er_gym.tasks import TASK_TYPES, KeyAction, TaskType, load_suite, verbs
from er_gym.tasks.difficulty import Difficulty, difficulty, hidden_depth, length
from er_gym.tasks.task import type_of_id

FRIDGE = "Fridge|+03.00|+00.00|+04.00"
EGG = "Egg|+03.10|+01.00|+04.00"
DRAWERS = tuple(f"Drawer|+0{x}.00|+00.50|+08.00" for x in (3, 4, 5))
SINK = "Sink|+00.00|+00.90|+08.00"
BASIN = f"{SINK}|SinkBasin"
APPLE = "Apple|+03.00|+01.00|+05.00"
TAKE = (
    (verbs.NAVIGATE, FRIDGE),
    (verbs.OPEN, FRIDGE),
    (verbs.PICKUP, EGG),
    (verbs.CLOSE, FRIDGE),
    (verbs.NAVIGATE, DRAWERS[0]),
    (verbs.OPEN, DRAWERS[0]),
    (verbs.PUT, DRAWERS[0]),
)


def entry(object_id: str, x: float, z: float) -> dict[str, Any]:
    box = {"center": {"x": x, "y": 1.0, "z": z}}
    return {
        "objectId": object_id,
        "objectType": type_of_id(object_id),
        "axisAlignedBoundingBox": box,
    }


ROOM = [
    entry(FRIDGE, 3.0, 4.0),
    entry(EGG, 3.1, 4.0),
    *(entry(object_id, 3.0 + i, 8.0) for i, object_id in enumerate(DRAWERS)),
    entry(SINK, 0.0, 8.0),
    entry(BASIN, 0.0, 8.0),
    entry(APPLE, 3.0, 5.0),
]


def test_all_figures_of_a_small_example() -> None:
    task = make_task("pickup_from_closerep_and_put_in_closerep", *TAKE)
    # From the origin 5 m to the fridge, from there 4 m to the drawer; two more drawers.
    assert difficulty(task, ROOM, (0.0, 0.0)) == Difficulty(2, 2, 9.0, 8)
    assert (hidden_depth(task), length(task)) == (2, 8)


def test_other_things_of_the_types_acted_on_distract_and_nothing_else_does() -> None:
    task = make_task("single_pickup", (verbs.NAVIGATE, FRIDGE), (verbs.PICKUP, EGG))
    second = entry("Egg|+01.00|+01.00|+01.00", 1.0, 1.0)
    assert difficulty(task, ROOM, (0.0, 0.0)).distractors == 0
    assert difficulty(task, [*ROOM, second], (0.0, 0.0)).distractors == 1


def test_a_sink_is_no_distractor_of_its_basin() -> None:
    task = make_task("pickup_and_put", (verbs.NAVIGATE, BASIN), (verbs.PUT, BASIN))
    assert difficulty(task, ROOM, (0.0, 0.0)) == Difficulty(0, 0, 8.0, 3)


def test_a_slice_stands_where_its_whole_stands() -> None:
    task = make_task(
        "pickup_and_put",
        (verbs.SLICE, APPLE),
        (verbs.NAVIGATE, f"{APPLE}|AppleSliced_0"),
        (verbs.PICKUP, f"{APPLE}|AppleSliced_0"),
        (verbs.NAVIGATE, FRIDGE),
    )
    assert difficulty(task, ROOM, (3.0, 7.0)) == Difficulty(0, 0, 3.0, 5)


def test_what_is_not_there_is_passed_over() -> None:
    nowhere = "Safe|+09.00|+00.00|+09.00"
    task = make_task("single_search", (verbs.NAVIGATE, nowhere), (verbs.NAVIGATE, FRIDGE))
    assert difficulty(task, ROOM, (3.0, 3.0)).distance == 1.0
    assert difficulty(task, [], (3.0, 3.0)) == Difficulty(0, 0, 0.0, 3)


def test_a_type_without_an_id_finds_no_object() -> None:
    untyped = (KeyAction(verbs.NAVIGATE, "", "Fridge"), KeyAction(verbs.END))
    task = replace(make_task("single_pickup"), key_actions=untyped)
    assert difficulty(task, ROOM, (0.0, 0.0)).distance == 0.0


@pytest.mark.parametrize("kind", TASK_TYPES, ids=lambda row: row.env_id)
def test_the_bundled_tasks_in_their_scenes(kind: TaskType, scene_objects) -> None:
    task = next(
        (
            task
            for task in load_suite("mini").tasks
            if task.type == kind and not task.arrangement.poses
        ),
        None,
    )
    if task is None:
        pytest.skip(f"mini has no {kind.title} in a scene as recorded")
    objects = scene_objects(task.scene)
    boxes = {item["objectId"]: item["axisAlignedBoundingBox"]["center"] for item in objects}
    keys = [key for key in task.key_actions if key.object_id in boxes]
    found = difficulty(task, objects, (0.0, 0.0))
    stops = [(0.0, 0.0)] + [
        (boxes[key.object_id]["x"], boxes[key.object_id]["z"])
        for key in keys
        if key.verb == verbs.NAVIGATE
    ]
    walked = sum(math.dist(stops[i], stops[i + 1]) for i in range(len(stops) - 1))
    assert found.distance == pytest.approx(walked)
    assert found.distance > 0.0
    assert found.hidden_depth == hidden_depth(task)
    assert found.length == len(task.key_actions)
    kinds = [type_of_id(object_id) for object_id in {key.object_id for key in keys}]
    there = [item["objectType"] for item in objects]
    assert found.distractors == sum(there.count(kind) for kind in set(kinds)) - len(kinds)
