"""Tasks are matched with their scenes; tasks that do not fit are set aside by id with a reason."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from math import dist
from typing import Any

import pytest
from support import in_one_test, make_task, with_ids

from er_gym.tasks import AgentPose, Task, TaskFileError, jsonl_format, load_suite, suite_from_file
from er_gym.tasks.arrangement import Arrangement, ObjectPose
from er_gym.tasks.goal import Condition
from er_gym.tasks.paper_format import read_tasks
from er_gym.tasks.resolve import NEAR, ResolvedTasks, resolve_task, resolve_tasks
from er_gym.tasks.suites import comes_with_er_gym
from er_gym.tasks.task import KeyAction
from er_gym.tasks.types import task_type

SAFE = "Safe|+01.62|00.00|+00.45"
SEARCH = task_type("single_search")
POSE = AgentPose(0.0, 0.9, 0.0, 90.0)


@pytest.mark.parametrize(
    "spelled", [SAFE, "Safe|+01.62|+00.00|+00.45", "Safe|+01.62|-00.00|+00.45"]
)
def test_zero_has_three_spellings(spelled: str) -> None:
    task = make_task("single_pickup", ("open", spelled), target_objects=(spelled,))
    fitted, taken, notes = resolve_task(task, [SAFE])
    assert fitted.key_actions[0].object_id == SAFE
    assert fitted.target_objects == (SAFE,)
    assert taken == []
    assert notes == ([] if spelled == SAFE else [f"task test: {spelled} is {SAFE} in FloorPlan1"])


# -- ids that a scene lacks ------------------------------------------------------------------------


def test_the_nearest_of_the_type_is_taken_wherever_the_id_stands() -> None:
    off = "Safe|+01.65|00.00|+00.41"
    task = make_task(
        "single_pickup",
        ("open", off),
        target_objects=(off,),
        related_objects=(off,),
        goal=(Condition("Safe", off, state=(("isOpen", True),)),),
        arrangement=Arrangement(dirty=(off,)),
        poses={off: POSE},
    )
    keys = (replace(task.key_actions[0], related_objects=(off,)), *task.key_actions[1:])
    task = replace(task, key_actions=keys)
    fitted, (taken,), notes = resolve_task(
        task, [SAFE, "Safe|+09.00|00.00|+00.00", "Mug|+01.65|00.00|+00.41"]
    )
    assert off not in repr(fitted)
    assert fitted.named == {SAFE}
    assert fitted.poses == {SAFE: POSE}
    assert fitted.arrangement.dirty == (SAFE,)
    assert fitted.key_actions[0].related_objects == (SAFE,)
    assert (taken.named, taken.taken) == (off, SAFE)
    assert taken.metres == pytest.approx(0.05)
    assert str(taken) == f"FloorPlan1 has no {off}: {SAFE}, 0.05 m off, is used instead"
    assert notes == []


UNICORN = "Unicorn|+01.00|+01.00|+01.00"
NO_SUCH_TYPE: dict[str, tuple[dict[str, Any], str]] = {
    "key action": ({"key_actions": (KeyAction("pickup", "", "Unicorn"),)}, "is no such type"),
    "misspelled": ({"key_actions": (KeyAction("pickup", "", "Aple"),)}, "did you mean Apple"),
    "of another room": ({"key_actions": (KeyAction("open", "", "Bed"),)}, "FloorPlan1 has no Bed$"),
    "goal": ({"goal": (Condition("Unicorn", held=True),)}, "FloorPlan1 has no Unicorn"),
    "place": ({"goal": (Condition("Safe", inside="Bathtub"),)}, "FloorPlan1 has no Bathtub$"),
    "search": ({"type": SEARCH, "related_objects": (UNICORN,)}, "FloorPlan1 has no Unicorn"),
}


@in_one_test("case", NO_SUCH_TYPE)
def test_a_task_about_a_type_that_is_not_there_is_set_aside(case: str) -> None:
    changes, message = NO_SUCH_TYPE[case]
    task = replace(make_task("single_pickup", ("open", SAFE)), **changes)
    with pytest.raises(TaskFileError, match=message):
        resolve_task(task, [SAFE, "Fridge|+00.00|+00.00|+00.00"])


@pytest.mark.parametrize("arrange", [True, False])
def test_a_suites_task_about_a_unicorn_is_set_aside(arrange: bool) -> None:
    good = load_suite("mini").tasks[0]
    bad = replace(good, id="fabulous", goal=(Condition("Unicorn", held=True),))
    found = resolve_tasks([good, bad], arrange=arrange)
    assert [task.id for task in found.tasks] == [good.id]
    assert [one.task for one in found.set_aside] == ["fabulous"]
    assert f"{good.scene} has no Unicorn, and there is no such type" in str(found.set_aside[0])


def test_what_comes_to_be_is_not_missing() -> None:
    apple, egg = "Apple|+01.00|+01.00|+01.00", "Egg|+02.00|+01.00|+01.00"
    goal = (Condition("AppleSliced"), Condition("EggCracked"), Condition("Apple", inside="Safe"))
    task = replace(make_task("single_pickup"), goal=goal, key_actions=(KeyAction("end"),))
    assert resolve_task(task, [SAFE, apple, egg])[0].goal == goal


def test_poses_may_be_of_another_build_than_the_task() -> None:
    off, farther = "Safe|+01.65|00.00|+00.45", "Safe|+01.72|00.00|+00.45"
    task = make_task("single_pickup", ("open", off), poses={SAFE: POSE})
    assert resolve_task(task, [SAFE])[0].poses == {SAFE: POSE}
    assert resolve_task(task, [SAFE])[0].key_actions[0].object_id == SAFE
    task = make_task("single_pickup", ("open", SAFE), poses={farther: POSE})
    assert (
        resolve_task(task, ["Safe|+09.00|00.00|+00.45", SAFE])[0].key_actions[0].object_id == SAFE
    )


@pytest.mark.parametrize(
    ("named", "there"),
    [
        ("Sink|-01.90|+00.97|-01.50|SinkBasin", "Sink|-01.92|+00.97|-01.50|SinkBasin"),
        ("Apple|+01.00|+01.00|+01.00|AppleSliced_2", "Apple|+01.02|+01.00|+01.00"),
    ],
)
def test_parts_are_found_too(named: str, there: str) -> None:
    others = ["Sink|-01.90|+00.97|-01.51", "AppleSliced|+01.00|+01.00|+01.00"]
    fitted, (taken,), _ = resolve_task(
        make_task("single_pickup", ("pickup", named)), [there, *others]
    )
    suffix = "" if "Sink" in named else "|AppleSliced_2"
    assert fitted.key_actions[0].object_id == there + suffix
    assert taken.metres == pytest.approx(0.02)


def test_each_object_is_taken_once() -> None:
    near, far = "Mug|+00.00|+01.00|+00.00", "Mug|+01.00|+01.00|+00.00"
    off = "Mug|+00.03|+01.00|+00.00"
    task = make_task("single_pickup", ("pickup", near), ("pickup", off))
    with pytest.raises(TaskFileError, match=r"no object 'Mug\|\+00.03.*it has no other Mug"):
        resolve_task(task, [near])
    with pytest.raises(TaskFileError, match=r"the nearest Mug is Mug\|\+01.00.*0.97 m off"):
        resolve_task(task, [near, far])
    two = make_task("single_pickup", ("pickup", off), ("pickup", "Mug|+00.96|+01.00|+00.00"))
    fitted, _, _ = resolve_task(two, [near, far])
    assert [key.object_id for key in fitted.key_actions[:2]] == [near, far]


def test_what_could_be_either_of_two_is_neither() -> None:
    task = make_task("single_pickup", ("open", "Drawer|+00.00|+00.10|+00.00"))
    drawers = ["Drawer|+00.00|+00.00|+00.00", "Drawer|+00.00|+00.20|+00.00"]
    with pytest.raises(TaskFileError) as caught:
        resolve_task(task, drawers)
    assert str(caught.value) == (
        "task test: FloorPlan1 has no object 'Drawer|+00.00|+00.10|+00.00'; it could be "
        "Drawer|+00.00|+00.00|+00.00, 0.10 m off or Drawer|+00.00|+00.20|+00.00, 0.10 m off"
    )
    clearer = make_task("single_pickup", ("open", "Drawer|+00.00|+00.09|+00.00"))
    assert resolve_task(clearer, drawers)[0].key_actions[0].object_id == drawers[0]


def test_where_things_are_counts_as_well_as_what_they_are_called() -> None:
    task = make_task("single_pickup", ("pickup", "Mug|+02.00|+01.00|+00.00"))
    fitted, (taken,), _ = resolve_task(task, {"Mug|+00.00|+01.00|+00.00": (2.0, 1.1, 0.0)})
    assert fitted.key_actions[0].object_id == "Mug|+00.00|+01.00|+00.00"
    assert taken.metres == pytest.approx(0.1)


def test_an_object_that_is_not_there_is_named_with_the_nearest() -> None:
    task = make_task("single_pickup", ("open", "Safe|+09.00|+00.00|+00.45"))
    with pytest.raises(
        TaskFileError,
        match=r"task test: FloorPlan1 has no object 'Safe\|\+09.*nearest Safe is Safe.*7\.38 m off",
    ):
        resolve_task(task, [SAFE])
    with pytest.raises(TaskFileError, match="it has no Safe"):
        resolve_task(task, ["Apple|+00.00|+00.00|+00.00"])


@pytest.mark.parametrize("odd", ["Safe", "Safe|a|b|c", "Safe|+1", "|||", "Safe|nan|nan|nan"])
def test_what_is_no_id_is_told_like_any_other(odd: str) -> None:
    with pytest.raises(TaskFileError, match=r"FloorPlan1 has no object '"):
        resolve_task(make_task("single_pickup", ("open", odd)), [SAFE])


def test_what_no_key_action_is_about_may_be_missing() -> None:
    ghost = "Egg|+09.00|+09.00|+09.00"
    task = make_task("single_pickup", ("open", SAFE), related_objects=(ghost,))
    fitted, taken, notes = resolve_task(task, [SAFE])
    assert fitted == task
    assert (taken, notes) == (
        [],
        [f"task test: FloorPlan1 has no {ghost}; no key action is about it"],
    )
    for asks in (
        {"goal": (Condition("Egg", ghost, held=True),)},
        {"arrangement": Arrangement(dirty=(ghost,))},
    ):
        with pytest.raises(TaskFileError, match="no object 'Egg"):
            resolve_task(replace(task, **asks), [SAFE])


@pytest.mark.parametrize(("stated", "said"), [("", "no type"), ("Potato", "Potato")])
def test_a_wrongly_stated_type_is_noted_and_kept(stated: str, said: str) -> None:
    task = make_task("single_pickup", ("open", SAFE))
    wrong = replace(task.key_actions[0], object_type=stated)
    fitted, _, notes = resolve_task(replace(task, key_actions=(wrong,)), [SAFE])
    assert fitted.key_actions[0].object_type == stated
    assert notes == [f"task test: key action 'open' states {said} for {SAFE}, a Safe"]


# -- several tasks ---------------------------------------------------------------------------------


def test_the_paper_tasks_fit_their_scenes(shared_data) -> None:
    fitted = resolve_tasks(read_tasks(shared_data / "paper_tasks_dev.json"))
    assert len(fitted.tasks) == 272
    assert sum("Safe|+01.62" in note for note in fitted.notes) == 2  # FloorPlan302
    assert sum("states no type" in note for note in fitted.notes) == 4
    assert len(fitted.notes) == 10
    assert fitted.substitutions == fitted.set_aside == ()


@pytest.mark.parametrize(
    ("name", "every"), [("mini", 3), ("er-1k", 20), ("houses-1k", 250), ("train", 200)]
)
def test_what_comes_with_er_gym_fits_as_it_is(name: str, every: int) -> None:
    suite = load_suite(name)
    some = replace(suite, tasks=suite.tasks[::every])
    assert comes_with_er_gym(some)
    assert resolve_tasks(some.tasks) == ResolvedTasks(some.tasks)


def test_a_changed_task_and_a_file_of_the_same_name_do_not_come_with_er_gym(tmp_path) -> None:
    suite = load_suite("mini")
    first, *others = suite.tasks
    assert comes_with_er_gym(suite)
    assert comes_with_er_gym(replace(suite, tasks=(replace(first, instruction="?"), *others)))
    assert not comes_with_er_gym(replace(suite, tasks=(replace(first, goal=()), *others)))
    assert not comes_with_er_gym(replace(suite, name="another"))
    jsonl_format.write_tasks(tmp_path / "mini.jsonl", suite.tasks)
    assert not comes_with_er_gym(suite_from_file(tmp_path / "mini.jsonl"))


def shifted(task: Task, metres: float, rng: random.Random) -> Task:
    """The task as another build might have it: each of its objects so much off, some way."""

    def move(found: re.Match[str]) -> str:
        if found[0] not in moved:
            axis = rng.randrange(3)
            numbers = [float(n) for n in found[0].split("|")]
            numbers[axis] += rng.choice((-metres, metres))
            moved[found[0]] = "|".join(f"{n:+06.2f}" for n in numbers)
        return moved[found[0]]

    def at(object_id: str) -> str:
        return re.sub(r"[+-]?\d+\.\d+\|[+-]?\d+\.\d+\|[+-]?\d+\.\d+", move, object_id)

    moved: dict[str, str] = {}
    return with_ids(task, at)


def place(object_id: str) -> tuple[float, ...]:
    return tuple(map(float, object_id.split("|")[1:4]))


@pytest.mark.parametrize(
    ("metres", "at_least"), [(0.01, 272), (0.03, 271), (0.1, 268), (0.2, 260), (0.4, 0)]
)
def test_ids_of_another_build_lead_to_the_same_objects(
    shared_data, metres: float, at_least: int
) -> None:
    there = resolve_tasks(read_tasks(shared_data / "paper_tasks_dev.json")).tasks
    rng = random.Random(0)
    given = {task.id: shifted(task, metres, rng) for task in there}
    fitted = resolve_tasks(given.values())
    assert at_least <= len(fitted.tasks) == len(there) - len(fitted.set_aside)
    own = {task.id: task for task in there}
    wrong = {
        (task.id, asked.object_id, found.object_id)
        for task in fitted.tasks
        for asked, found, right in zip(
            given[task.id].key_actions, task.key_actions, own[task.id].key_actions, strict=True
        )
        if found.object_id != right.object_id
    }
    # None but where another Drawer or Cabinet is nearer to the shifted place than its own.
    assert all(dist(place(a), place(b)) < metres for _, a, b in wrong)
    assert len(wrong) <= 0.04 * len(there)
    if metres > NEAR:
        assert {task.id for task in fitted.tasks} == {task_id for task_id, _, _ in wrong}


def test_what_cannot_be_played_is_set_aside_and_the_rest_is_not() -> None:
    good = load_suite("mini").tasks[0]
    nowhere = replace(good, id="nowhere", scene="FloorPlan999")
    moved = Arrangement("moved", {"Ghost_12ab": ObjectPose(0, 0, 0)})
    fitted = resolve_tasks([nowhere, good, replace(good, id="ghost", arrangement=moved)])
    assert fitted.tasks == (good,)
    assert [one.task for one in fitted.set_aside] == ["nowhere", "ghost"]
    assert "FloorPlan999" in fitted.set_aside[0].reason
    assert "its arrangement moves 'Ghost_12ab'" in fitted.set_aside[1].reason


@pytest.fixture(scope="module")
def arranged() -> Task:
    return next(
        t for t in load_suite("er-1k").tasks if len(t.arrangement.poses) > 3 and t.arrangement.dirty
    )


@pytest.mark.parametrize("arrange", [True, False])
def test_a_start_may_name_things_by_another_build(arranged: Task, arrange: bool) -> None:
    poses = dict(arranged.arrangement.poses)
    stems = [name.rpartition("_")[0] for name in poses]
    name = next(n for n in poses if stems.count(n.rpartition("_")[0]) == 1)
    other = name.rpartition("_")[0] + "_0123abcd"
    renamed = {other if n == name else n: pose for n, pose in poses.items()}
    task = replace(arranged, arrangement=replace(arranged.arrangement, poses=renamed))
    (fitted,) = resolve_tasks([task], arrange=arrange).tasks
    assert fitted == arranged


@pytest.mark.parametrize("arrange", [True, False])
def test_arranged_scenes_are_looked_into_where_it_matters(arranged: Task, arrange: bool) -> None:
    (dirty,) = arranged.arrangement.dirty
    kind, x, *rest = dirty.split("|")
    off = "|".join([kind, f"{float(x) + 0.02:+06.2f}", *rest])
    plain = replace(arranged, key_actions=(), goal=(), target_objects=(), related_objects=())
    task = replace(plain, arrangement=replace(arranged.arrangement, dirty=(off,)))
    fitted = resolve_tasks([arranged, task], arrange=arrange)
    assert fitted.tasks == (arranged, plain)
    assert [(one.named, one.taken) for one in fitted.substitutions] == [(off, dirty)]
