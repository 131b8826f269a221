from __future__ import annotations

import gzip
import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest
from floor_plan_1 import EGG, FRIDGE, MUG
from support import make_task

from er_gym.tasks import GROUPS, TASK_TYPES, load_suite, suites, verbs
from er_gym.tasks.arrangement import Arrangement, ObjectPose
from er_gym.tasks.room_kinds import room_kind
from er_gym.tasks.suite_card import card, receptacle_types, subject_type, summarise
from er_gym.tasks.task import KeyAction, type_of_id

COUNTER = "CounterTop|-00.08|+01.15|00.00"
LAMP = "FloorLamp|-01.00|+00.00|-01.00"
MOVED = {"Egg_1": ObjectPose(0.0, 1.0, 0.0)}

SEARCH = make_task(
    "single_search_from_closerep",
    (verbs.NAVIGATE, FRIDGE),
    (verbs.OPEN, FRIDGE),
    scene="FloorPlan10",
    related_objects=(EGG,),
)
MOVE = make_task(
    "pickup_and_put",
    (verbs.NAVIGATE, COUNTER),
    (verbs.PICKUP, MUG),
    (verbs.NAVIGATE, FRIDGE),
    (verbs.PUT, FRIDGE),
    scene="FloorPlan2",
    arrangement=Arrangement("FloorPlan2-7", MOVED),
)
TOGGLE = make_task(
    "single_toggle", (verbs.NAVIGATE, LAMP), (verbs.TOGGLE, LAMP), scene="FloorPlan201"
)
TASKS = [
    replace(SEARCH, id="a"),
    replace(TOGGLE, id="b"),
    replace(MOVE, id="c"),
    replace(MOVE, id="d"),
]


def test_counts_of_a_small_example() -> None:
    summary = summarise(TASKS)
    assert summary.tasks == 4
    assert list(summary.groups.items()) == [("Search", 1), ("Manipulate", 1), ("Transport", 2)]
    assert list(summary.types.items()) == [
        ("single_search_from_closerep", 1),
        ("single_toggle", 1),
        ("pickup_and_put", 2),
    ]
    assert list(summary.room_kinds.items()) == [("kitchen", 3), ("living room", 1)]
    assert list(summary.scenes.items()) == [
        ("FloorPlan2", 2),
        ("FloorPlan10", 1),
        ("FloorPlan201", 1),
    ]
    assert list(summary.subjects.items()) == [("Mug", 2), ("Egg", 1), ("FloorLamp", 1)]
    assert list(summary.receptacles.items()) == [("Fridge", 3), ("CounterTop", 2)]
    assert list(summary.lengths.items()) == [(3, 2), (5, 2)]
    assert list(summary.depths.items()) == [(0, 3), (1, 1)]
    assert (summary.rearranged, summary.layouts) == (2, 1)


def test_what_a_task_is_about() -> None:
    assert subject_type(SEARCH) == "Egg"
    assert subject_type(MOVE) == "Mug"
    assert subject_type(replace(MOVE, related_objects=(EGG, MUG))) == "Egg"
    assert subject_type(TOGGLE) == "FloorLamp"
    untyped = (KeyAction(verbs.PICKUP, "", "Apple"),)
    assert subject_type(replace(MOVE, key_actions=untyped)) == "Apple"
    assert subject_type(make_task("single_search", (verbs.NAVIGATE, FRIDGE))) == ""


def test_a_lamp_is_no_receptacle_and_each_type_counts_once() -> None:
    assert receptacle_types(TOGGLE) == ()
    assert receptacle_types(MOVE) == ("CounterTop", "Fridge")
    twice = make_task("pickup_and_put", (verbs.NAVIGATE, FRIDGE), (verbs.NAVIGATE, FRIDGE))
    assert receptacle_types(twice) == ("Fridge",)
    basin = make_task("pickup_and_put", (verbs.NAVIGATE, "Sink|-01.90|+00.97|-01.50|SinkBasin"))
    assert receptacle_types(basin) == ("SinkBasin",)


def test_counts_of_the_bundled_suite_add_up() -> None:
    tasks = load_suite("mini").tasks
    summary = summarise(tasks)
    assert summary.tasks == len(tasks)
    for counts in (
        summary.groups,
        summary.types,
        summary.room_kinds,
        summary.scenes,
        summary.subjects,
        summary.lengths,
        summary.depths,
    ):
        assert sum(counts.values()) == len(tasks)
        assert all(counts.values())
    assert list(summary.groups) == [name for name in GROUPS if name in summary.groups]
    present = {task.type for task in tasks}
    assert list(summary.types) == [row.name for row in TASK_TYPES if row in present]
    assert summary.scenes == Counter(task.scene for task in tasks)
    subjects = Counter(type_of_id(task.related_objects[0]) for task in tasks)
    assert summary.subjects == subjects
    assert list(summary.subjects.values()) == sorted(subjects.values(), reverse=True)


def test_the_card_of_a_small_example() -> None:
    text = card(
        "small", "Four tasks.", TASKS, {"seed": 3, "by": "hand | eye", "of": [1]}, "make it"
    )
    assert text.startswith(
        "<!-- Written by er-gym -->\n# small\n\nFour tasks.\n\n"
        "4 tasks in 3 scenes. Rearranged at the start: 2 of them, in 1 layout.\n\n"
        "Licence: Apache-2.0."
    )
    assert "```sh\nmake it\n```" in text
    assert "| seed | 3 |\n| by | hand \\| eye |\n| of | [1] |\n" in text
    assert "| Transport (2) | Exposed-to-Exposed Object Transfer | `pickup_and_put` | 2 |\n" in text
    assert "- kitchen (2 scenes): FloorPlan2 2, FloorPlan10 1\n" in text
    assert "- living room (1 scene): FloorPlan201 1\n" in text
    assert "\nMug 2, Egg 1, FloorLamp 1\n" in text
    assert "\nFridge 3, CounterTop 2\n" in text
    assert "| Key actions | 3 | 5 |\n| --- | ---: | ---: |\n| Tasks | 2 | 2 |\n" in text
    assert text.endswith("| Opened | 0 | 1 |\n| --- | ---: | ---: |\n| Tasks | 3 | 1 |\n")


def test_the_card_of_the_bundled_suite() -> None:
    suite = load_suite("mini")
    file = Path(suites.__file__).parent / "data" / "mini.jsonl.gz"
    made = json.loads(gzip.decompress(file.read_bytes()).splitlines()[0])

    def make() -> str:
        return card(suite.name, suite.description, suite.tasks, made, "python -m x")

    text = make()
    assert text == make()
    assert text.endswith("|\n")
    assert suite.digest in text
    assert f"| format | {made['format']} |\n" in text
    assert all(f"| {name} | " in text for name in made)
    assert all(len(line) <= 100 for line in text.splitlines() if not line.startswith("|")), (
        "prose is wrapped"
    )
    # No name is parted from its count, whatever the line breaks.
    assert all(f"{scene} {n}" in text for scene, n in summarise(suite.tasks).scenes.items())
    for kind, n in summarise(suite.tasks).room_kinds.items():
        scenes = {task.scene for task in suite.tasks if room_kind(task.scene) == kind}
        assert f"- {kind} ({len(scenes)} scenes): " in text
        assert n >= len(scenes)
    for row in _tables(text):
        assert row == row[:1] * len(row)


def _tables(text: str) -> list[list[int]]:
    """How many cells each line of each table has."""
    found: list[list[int]] = [[]]
    for line in text.splitlines():
        if line.startswith("|"):
            found[-1].append(line.replace("\\|", "").count("|"))
        elif found[-1]:
            found.append([])
    return [table for table in found if table]


@pytest.mark.parametrize("made", [{}, {"seed": 0}])
def test_the_card_of_no_tasks(made: dict[str, object]) -> None:
    text = card("empty", "None yet.", [], made, "true")
    assert "0 tasks in 0 scenes. Rearranged at the start: none.\n" in text
    assert text.endswith("`\n")
    assert "## Types" not in text
