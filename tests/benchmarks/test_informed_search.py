"""What a search can reach that knows where things are in training."""

from __future__ import annotations

import random
from dataclasses import replace

import pytest

from benchmarks.checks.informed_search import (
    Hidden,
    fruitless_steps,
    habits,
    hidden_things,
    room_places,
    share_in_time,
)
from er_gym.tasks import load_suite
from er_gym.tasks.task import Task

ROOM = {"Fridge": 1, "Drawer": 4, "CounterTop": 1}
"""Two that are opened, and one whose things are in view."""


@pytest.fixture(scope="module")
def tasks() -> dict[str, Task]:
    """One task of each type."""
    return {task.type.name: task for task in load_suite("mini").tasks}


def steps(place: str, known: dict[str, dict[str, int]]) -> set[int]:
    rng = random.Random(0)
    return {fruitless_steps(Hidden("Apple", place), ROOM, known, rng) for _ in range(60)}


def test_likely_places_come_first_by_what_they_cost() -> None:
    known = {"Apple": {"Fridge": 30, "CounterTop": 20, "Drawer": 10}}
    # 20 for a step; 30 for two; four drawers share 10, two steps each.
    assert steps("CounterTop", known) == {0}
    assert steps("Fridge", known) == {1}
    assert steps("Drawer", known) == {3, 5, 7, 9}


def test_a_thing_that_training_lacks_may_be_anywhere() -> None:
    assert steps("CounterTop", {}) == {0}  # half the cost, and no other of its type
    assert steps("Fridge", {}) == {1}
    assert steps("Drawer", {}) == {3, 5, 7, 9}


def test_things_are_where_the_key_actions_fetch_them(tasks: dict[str, Task]) -> None:
    two = tasks["ordered_pickup_two_object_and_put"]
    picked = [each.actual_type for each in two.key_actions if each.verb == "pickup"]
    assert [each.thing for each in hidden_things(two)] == list(dict.fromkeys(picked))
    search = tasks["single_search_from_closerep"]
    place = next(each.actual_type for each in search.key_actions if each.verb == "open")
    assert hidden_things(search) == [Hidden(search.goal[0].object_type, place)]
    assert hidden_things(tasks["single_toggle"]) == []
    known = habits([search, search])
    assert known == {search.goal[0].object_type: {place: 2}}


def test_time_runs_out(tasks: dict[str, Task]) -> None:
    task = tasks["single_search_from_closerep"]
    places = room_places(task.scene)
    (hidden,) = hidden_things(task)
    rng = random.Random(0)
    assert places[hidden.place] >= 1
    assert share_in_time(task, {hidden.place: 1}, {}, 20, rng) == 1.0
    crowded = {hidden.place: 1000}
    share = share_in_time(task, crowded, {}, 2000, rng)
    spare = task.type.max_steps - len(task.key_actions)
    assert share == pytest.approx((spare // 2 + 1) / 1000, abs=0.01)
    hurried = replace(task, type=replace(task.type, max_steps=len(task.key_actions)))
    assert share_in_time(hurried, {hidden.place: 2}, {}, 400, rng) == pytest.approx(0.5, abs=0.1)
