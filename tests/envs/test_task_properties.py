"""Properties that hold for every task, tested in the benchmark's own rooms."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from er_gym.envs.actions import ACTIONS, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import names, with_details
from er_gym.envs.solver import Solver
from er_gym.tasks import TASK_TYPES, Task, TaskType, load_suite, verbs
from er_gym.tasks.equivalence import BASIN_OF
from er_gym.tasks.generate import Generator
from er_gym.tasks.goal import unmet_conditions
from er_gym.tasks.judge import Criteria, Progress
from er_gym.tasks.types import SEARCH

PER_TYPE = 8
KINDS = pytest.mark.parametrize("kind", TASK_TYPES, ids=lambda kind: kind.env_id)


def sample(kind: TaskType) -> list[Task]:
    """Some tasks of a type, the same each time."""
    tasks = [task for task in load_suite("er-1k").tasks if task.type is kind]
    return random.Random(f"properties of {kind.name}").sample(tasks, PER_TYPE)


@dataclass(frozen=True)
class Deed:
    """An action that succeeded."""

    action: Action
    object_id: str
    reward: float


def begin(env: EmbodiedEnv, task: Task) -> dict[str, Any]:
    _, info = env.reset(seed=0, options={"task": task})
    return info


def goal_holds(env: EmbodiedEnv, task: Task, info: Mapping[str, Any]) -> bool:
    return not unmet_conditions(task.goal, env.objects, names(info["interactable_mask"]))


def strive(env: EmbodiedEnv, task: Task, other: Task) -> list[Deed]:
    """In a task's episode, do what another task of the same room asks for, but for the end.

    Nothing if that cannot be done: what the names of types stand for is the task's affair.
    """
    info = begin(env, task)
    solver, progress, over = Solver(), Progress.start(Criteria.of(other)), False
    deeds: list[Deed] = []
    while not over:
        action, key = solver.next({**with_details(env, info), "keys_left": progress.left})
        if key is None:
            break
        _, reward, ended, cut, info = env.step(action)
        over = ended or cut
        if info["action_success"]:
            progress, _ = progress.after(action.verb, action.object_type, info["object_id"])
            deeds.append(Deed(action, info["object_id"], float(reward)))
    return deeds if progress.only_end_left and not over else []


def room_of(env: EmbodiedEnv, task: Task) -> Generator:
    """What can be asked for in the room in which a task begins."""
    begin(env, task)
    return Generator(task.scene, env.objects, task.arrangement)


def empty(scene: str) -> Task:
    """A task to be in a room as it was recorded."""
    return Task("nothing", TASK_TYPES[0], scene, "Look.", ())


# -- playing as one should -----------------------------------------------------------------------


@KINDS
def test_who_does_the_key_actions_earns_all_and_succeeds(env: EmbodiedEnv, kind: TaskType) -> None:
    for task in sample(kind):
        info = begin(env, task)
        solver, earned, over = Solver(), 0.0, False
        while not over:
            action, _ = solver.next(with_details(env, info))
            _, reward, ended, cut, info = env.step(action)
            earned += float(reward)
            over = ended or cut
        assert info["success"], f"{task.id}: {info['feedback']}"
        assert earned == pytest.approx(task.total_reward), task.id
        assert info["steps"] <= task.max_steps
        assert goal_holds(env, task, info), task.id


@KINDS
def test_who_ends_at_once_earns_nothing(env: EmbodiedEnv, kind: TaskType) -> None:
    for task in sample(kind):
        info = begin(env, task)
        assert not goal_holds(env, task, info), task.id
        _, reward, ended, _, info = env.step("end")
        assert ended
        assert reward == 0.0, task.id
        assert not info["success"], task.id


# -- playing somehow -----------------------------------------------------------------------------


def alike(verb: str, object_type: str) -> tuple[str, str]:
    """A verb and a type, a Sink and its basin being one."""
    return verb, BASIN_OF.get(object_type, object_type)


@KINDS
def test_who_stops_on_the_way_has_earned_what_was_done(env: EmbodiedEnv, kind: TaskType) -> None:
    """Some actions as the key actions ask, some at random; then no more."""
    some = False
    for task in sample(kind):
        rng = random.Random(task.id)
        info = begin(env, task)
        solver, deeds = Solver(), []
        for _ in range(rng.randrange(4, 20)):
            action, key = solver.next(with_details(env, info))
            if key is None or rng.random() < 0.4:
                legal = np.flatnonzero(info["action_mask"]).tolist()
                action = rng.choice([a for k in legal if (a := ACTIONS[k]).verb != verbs.END])
            done = info["key_actions_done"]
            _, reward, ended, cut, info = env.step(action)
            if info["action_success"]:
                deeds.append(Deed(action, info["object_id"], float(reward)))
            new = env.details["keys_done"][done:]
            assert float(reward) == sum(key.reward for key in new), task.id
            for key in new:
                assert info["action_success"]
                assert alike(key.verb, key.actual_type) == alike(action.verb, action.object_type)
            if ended or cut:
                break
        earned = sum(deed.reward for deed in deeds)
        did = Counter(alike(deed.action.verb, deed.action.object_type) for deed in deeds)
        asked = Counter(alike(key.verb, key.actual_type) for key in task.key_actions)
        worth = {alike(key.verb, key.actual_type): key.reward for key in task.key_actions}
        assert earned <= sum(worth[what] * n for what, n in (did & asked).items()), task.id
        assert earned <= task.total_reward - task.key_actions[-1].reward < task.total_reward
        assert not info["success"]
        some = some or earned > 0
    assert some


# -- the wrong thing -----------------------------------------------------------------------------


def of_another_type(env: EmbodiedEnv, task: Task, kind: str, verb: str) -> Deed | None:
    """Take or switch something of a type that the task does not name, in its episode."""
    named = {key.actual_type for key in task.key_actions}
    for other in room_of(env, task).tasks([kind]):
        if named.isdisjoint(key.actual_type for key in other.key_actions if key.verb == verb):
            for deed in strive(env, task, other):
                if deed.action.verb == verb:
                    return deed
    return None


@pytest.mark.parametrize(
    ("kind", "verb"), [("single_pickup", verbs.PICKUP), ("single_toggle", verbs.TOGGLE)]
)
def test_a_thing_of_another_type_earns_nothing(env: EmbodiedEnv, kind: str, verb: str) -> None:
    """Whatever the task, one does to another thing what tasks of this kind ask for."""
    tried = 0
    for task in (task for each in TASK_TYPES for task in sample(each)[:3]):
        deed = of_another_type(env, task, kind, verb)
        if deed is not None:
            tried += 1
            assert deed.reward == 0.0, f"{deed.action} in {task.id}"
            _, reward, _, _, info = env.step("end")
            if task.type.group != SEARCH:  # of which one may have seen the target by the way
                assert (reward, info["success"]) == (0.0, False), task.id
    assert tried > 10


@pytest.fixture(scope="module")
def nearest() -> Iterator[EmbodiedEnv]:
    """An environment in which the name of a type stands for the nearest, whatever the task."""
    env = EmbodiedEnv([], obs_mode="text", instances="explore")
    yield env
    env.close()


def wrong_ones_taken(env: EmbodiedEnv, task: Task) -> int:
    """Take others of the type of which a task names one, as many as one can."""
    room = room_of(env, task)
    (named,) = (room.scene_graph.objects[object_id] for object_id in task.named)
    taken = 0
    for other in room.scene_graph.others_of_type(named):
        for deed in strive(env, task, room.request("single_pickup", other.id)):
            if deed.action.verb == verbs.PICKUP and deed.object_id not in task.named:
                taken += 1
                assert deed.reward == 0.0, f"{deed.object_id} in {task.id}"
                _, reward, _, _, info = env.step("end")
                assert (reward, info["success"]) == (0.0, False), task.id
                break
    return taken


SINGLED_OUT = (
    ("FloorPlan206", "pickup_and_put"),
    ("FloorPlan406", "single_pickup"),
    ("FloorPlan409", "single_pickup_from_closerep"),
    ("FloorPlan417", "pickup_from_closerep_and_put"),
    ("FloorPlan420", "pickup_and_put_in_closerep"),
)


@pytest.mark.parametrize(("scene", "kind"), SINGLED_OUT)
def test_another_of_the_type_earns_nothing_where_the_words_single_one_out(
    nearest: EmbodiedEnv, scene: str, kind: str
) -> None:
    tasks = [task for task in room_of(nearest, empty(scene)).tasks([kind]) if task.named]
    assert tasks
    assert sum(wrong_ones_taken(nearest, task) for task in tasks) > 0


def test_another_of_the_type_earns_nothing_in_the_benchmark(nearest: EmbodiedEnv) -> None:
    tasks = [task for task in load_suite("er-1k").tasks if task.named]
    assert sum(wrong_ones_taken(nearest, task) for task in tasks) > 0


ANY_WILL_DO = (
    ("FloorPlan208", "single_pickup", "Statue"),
    ("FloorPlan230", "single_toggle", "Candle"),
    ("FloorPlan403", "single_pickup", "ToiletPaper"),
)


@pytest.mark.parametrize(("scene", "kind", "object_type"), ANY_WILL_DO)
def test_where_the_words_single_none_out_any_is_as_good(
    nearest: EmbodiedEnv, scene: str, kind: str, object_type: str
) -> None:
    room = room_of(nearest, empty(scene))
    (task,) = (task for task in room.tasks([kind]) if task.id.endswith(f"-{object_type}"))
    assert not task.named
    done_to = set()
    for other in room.scene_graph.of_type(object_type):
        deeds = strive(nearest, task, room.request(kind, other.id))
        if deeds:
            done_to.add(deeds[-1].object_id)
            assert deeds[-1].reward == 1.0
            _, reward, _, _, info = nearest.step("end")
            assert (reward, info["success"]) == (1.0, True)
    assert len(done_to) > 1
