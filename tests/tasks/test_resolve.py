"""Tasks are fitted to their scenes, and what cannot be is named."""

from __future__ import annotations

from dataclasses import replace

import pytest
from support import make_task

from er_gym.tasks import TaskFileError
from er_gym.tasks.paper_format import read_tasks
from er_gym.tasks.resolve import resolve_task, resolve_tasks

SAFE = "Safe|+01.62|00.00|+00.45"


@pytest.mark.parametrize(
    "spelled", [SAFE, "Safe|+01.62|+00.00|+00.45", "Safe|+01.62|-00.00|+00.45"]
)
def test_zero_has_three_spellings(spelled: str) -> None:
    task = make_task("single_pickup", ("open", spelled), target_objects=(spelled,))
    fitted, notes = resolve_task(task, [SAFE])
    assert fitted.key_actions[0].object_id == SAFE
    assert fitted.target_objects == (SAFE,)
    assert notes == ([] if spelled == SAFE else [f"task test: {spelled} is {SAFE} in FloorPlan1"])


def test_an_object_that_is_not_there_is_named_with_those_that_are() -> None:
    task = make_task("single_pickup", ("open", "Safe|+09.00|+00.00|+00.00"))
    with pytest.raises(
        TaskFileError, match=r"task test: FloorPlan1 has no object 'Safe\|\+09.*Safe"
    ):
        resolve_task(task, [SAFE])
    with pytest.raises(TaskFileError, match="it has no Safe"):
        resolve_task(task, ["Apple|+00.00|+00.00|+00.00"])


@pytest.mark.parametrize(("stated", "said"), [("", "no type"), ("Potato", "Potato")])
def test_a_wrongly_stated_type_is_noted_and_kept(stated: str, said: str) -> None:
    task = make_task("single_pickup", ("open", SAFE))
    wrong = replace(task.key_actions[0], object_type=stated)
    fitted, notes = resolve_task(replace(task, key_actions=(wrong,)), [SAFE])
    assert fitted.key_actions[0].object_type == stated
    assert notes == [f"task test: key action 'open' states {said} for {SAFE}, a Safe"]


def test_the_paper_tasks_fit_their_scenes(shared_data) -> None:
    tasks = read_tasks(shared_data / "paper_tasks_dev.json")
    fitted, notes = resolve_tasks(tasks)
    assert len(fitted) == 272
    assert sum("Safe|+01.62" in note for note in notes) == 2  # FloorPlan302
    assert sum("states no type" in note for note in notes) == 4
    assert len(notes) == 10


def test_an_unknown_scene_is_an_error() -> None:
    with pytest.raises(ValueError, match="FloorPlan999"):
        resolve_tasks([make_task("single_pickup", scene="FloorPlan999")])
