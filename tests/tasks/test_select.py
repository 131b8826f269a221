"""A suite's tasks are chosen evenly."""

from __future__ import annotations

import random
from collections import Counter
from dataclasses import replace

import pytest
from support import make_task

from er_gym.tasks import TASK_TYPES, Task
from er_gym.tasks.generate import select_balanced
from er_gym.tasks.generate.select import shares
from er_gym.tasks.room_kinds import room_kind

NAMES = ("Apple", "Mug", "Bread", "Egg", "Fork")


def a_task(scene: str, name: str, kind: str = "single_pickup") -> Task:
    """A task about a thing of a type that lies on a CounterTop."""
    task = make_task(
        kind,
        ("navigate to", "CounterTop|+00.00|+00.00|+00.00"),
        ("pickup", f"{name}|+00.00|+00.00|+00.00"),
        scene=scene,
    )
    return replace(task, id=f"{scene}-{kind}-{name}")


def pool_of(**scenes: int) -> list[Task]:
    """So many tasks of each scene."""
    return [a_task(scene, name) for scene, number in scenes.items() for name in NAMES[:number]]


def names(tasks: list[Task]) -> Counter[str]:
    return Counter(task.key_actions[1].object_type for task in tasks)


def test_selection_is_even_over_rooms_and_scenes() -> None:
    pool = pool_of(FloorPlan1=5, FloorPlan2=5, FloorPlan201=5, FloorPlan202=5, FloorPlan301=1)
    chosen = select_balanced(pool, 9, random.Random(0))
    assert Counter(room_kind(task.scene) for task in chosen) == {
        "kitchen": 4, "living room": 4, "bedroom": 1,
    }  # fmt: skip
    assert Counter(task.scene for task in chosen) == {
        "FloorPlan1": 2, "FloorPlan2": 2, "FloorPlan201": 2, "FloorPlan202": 2, "FloorPlan301": 1,
    }  # fmt: skip


@pytest.mark.parametrize("seed", range(5))
def test_selection_takes_other_objects_as_long_as_there_are_some(seed: int) -> None:
    pool = pool_of(FloorPlan1=5, FloorPlan2=5, FloorPlan3=5)
    assert names(select_balanced(pool, 5, random.Random(seed))) == dict.fromkeys(NAMES, 1)


def test_selection_is_even_over_types_and_scenes_of_all_types() -> None:
    kinds = ("single_search", "single_pickup")
    scenes = [f"FloorPlan{number}" for number in range(1, 5)]
    pool = [a_task(scene, name, kind) for kind in kinds for scene in scenes for name in NAMES]
    chosen = select_balanced(pool, 4, random.Random(3))
    assert Counter(task.type.name for task in chosen) == {"single_search": 2, "single_pickup": 2}
    # The second type takes the scenes that the first has left.
    assert {task.scene for task in chosen} == set(scenes)


def test_what_is_chosen_comes_by_type_and_scene() -> None:
    scenes = ("FloorPlan10", "FloorPlan301", "FloorPlan2")
    pool = [a_task(s, "Mug", kind) for s in scenes for kind in ("single_pickup", "single_search")]
    chosen = select_balanced(pool, 6, random.Random(0))
    assert [(task.type.name, task.scene) for task in chosen] == [
        (kind, scene)
        for kind in ("single_search", "single_pickup")
        for scene in ("FloorPlan2", "FloorPlan10", "FloorPlan301")
    ]


def test_selection_repeats_for_a_seed_and_takes_what_there_is() -> None:
    pool = pool_of(FloorPlan1=5, FloorPlan2=5)
    chosen = select_balanced(pool, 4, random.Random(7))
    assert chosen == select_balanced(pool, 4, random.Random(7))
    assert any(chosen != select_balanced(pool, 4, random.Random(seed)) for seed in range(8, 12))
    everything = select_balanced(pool, 99, random.Random(7))
    assert sorted(task.id for task in everything) == sorted(task.id for task in pool)
    assert select_balanced([], 3, random.Random(7)) == []


SEARCH, PICKUP, TOGGLE = (TASK_TYPES[k] for k in (0, 2, 4))
SHARES = {
    "equal": (6, (9, 9, 9), (2, 2, 2)),
    "one has fewer": (9, (9, 1, 9), (4, 1, 4)),
    "two have fewer": (9, (9, 1, 2), (6, 1, 2)),
    "one has none": (4, (2, 0, 9), (2, 0, 2)),
    "some left over": (8, (9, 9, 9), (3, 3, 2)),
    "fewer than types": (2, (9, 9, 9), (1, 1, 0)),
    "not enough": (99, (3, 1, 2), (3, 1, 2)),
    "nothing asked": (0, (3, 1, 2), (0, 0, 0)),
    "nothing there": (5, (0, 0, 0), (0, 0, 0)),
}


@pytest.mark.parametrize(("total", "sizes", "expected"), SHARES.values(), ids=SHARES)
def test_types_share_equally_what_they_have(
    total: int, sizes: tuple[int, ...], expected: tuple[int, ...]
) -> None:
    kinds = (SEARCH, PICKUP, TOGGLE)
    found = shares(total, dict(zip(kinds, sizes, strict=True)))
    assert found == dict(zip(kinds, expected, strict=True))
