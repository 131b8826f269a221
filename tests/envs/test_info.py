"""``info`` is as documented, and agrees with the observation and the simulator."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from typing import Any, get_type_hints

import numpy as np
import pytest

from er_gym.envs.actions import ACTIONS, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import Info, LegalActions
from er_gym.envs.solver import Solver
from er_gym.tasks import load_suite
from er_gym.tasks.task import Task
from er_gym.tasks.types import TASK_TYPES

MINI = load_suite("mini").tasks
TASKS = [next(task for task in MINI if task.type is kind) for kind in TASK_TYPES[2:9:2]]


def infos(env: EmbodiedEnv, task: Task) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Observation and info of each step of a good episode."""
    obs, info = env.reset(seed=0, options={"task": task})
    solver, over = Solver(), False
    yield obs, info
    while not over:
        obs, _, ended, cut, info = env.step(solver.next(info)[0])
        over = ended or cut
        yield obs, info


def test_info_has_the_documented_entries_and_no_others(env: EmbodiedEnv) -> None:
    always = Info.__required_keys__
    assert set(get_type_hints(Info)) == always | {
        *("end_appended", "fault", "views"),
        *("object_views", "object_views_around", "instance_ids"),
    }
    _, info = env.reset(seed=0, options={"task": TASKS[0]})
    assert info.keys() == always
    assert env.step("dance")[-1].keys() == always | {"end_appended"}
    assert env.step("observe")[-1].keys() == always | {"end_appended", "views"}
    assert env.step("end")[-1].keys() == always | {"end_appended"}


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.type.name)
def test_info_says_what_the_text_and_the_simulator_say(env: EmbodiedEnv, task: Task) -> None:
    hands = set()
    for obs, info in infos(env, task):
        lines = obs["text"].splitlines()
        assert f"You see: {', '.join(info['visible']) or 'nothing'}." in lines
        assert f"You hold: {info['held'] or 'nothing'}." in lines
        assert any(f"Step {info['steps']} of {info['max_steps']}." in line for line in lines)
        seen = {entry["objectType"] for entry in env.objects if entry["visible"]}
        held = [entry["objectType"] for entry in env.objects if entry["isPickedUp"]]
        assert info["visible"] == tuple(sorted(seen))
        assert info["held"] == "".join(held)
        hands.add(info["held"])
    assert info["success"]
    assert len(hands) == 1 + (task.type.name != "single_toggle")


def test_legal_is_the_mask_in_words(env: EmbodiedEnv) -> None:
    for _, info in infos(env, TASKS[-1]):
        legal, mask = info["legal"], info["action_mask"]
        expected = [ACTIONS[k] for k in np.flatnonzero(mask)]
        assert list(legal) == expected
        assert len(legal) == len(expected)
        assert (legal[0], legal[-1], legal[1:3]) == (
            *(expected[0], expected[-1]),
            tuple(expected[1:3]),
        )
        for k in range(0, len(ACTIONS), 7):
            assert (ACTIONS[k] in legal) == (str(ACTIONS[k]) in legal) == bool(mask[k])
    assert Action("open", "Mug") not in legal  # there is no such action
    assert "dance" not in legal
    assert 0 not in legal


def test_legal_goes_to_another_process_and_back() -> None:
    mask = np.zeros(len(ACTIONS), np.int8)
    mask[[0, 5]] = 1
    again = pickle.loads(pickle.dumps(LegalActions(mask)))
    assert again == LegalActions(mask)
    assert again != LegalActions(1 - mask)
    assert repr(again) == f"LegalActions({ACTIONS[0]}, {ACTIONS[5]})"


def test_max_steps_is_the_limit_of_the_episode() -> None:
    env = EmbodiedEnv([], obs_mode="state", max_steps=3)
    _, info = env.reset(seed=0, options={"task": TASKS[0]})
    assert (info["steps"], info["max_steps"]) == (1, 3)
    env.close()
    env = EmbodiedEnv([], obs_mode="state")
    _, info = env.reset(seed=0, options={"task": TASKS[0]})
    assert info["max_steps"] == TASKS[0].max_steps
    env.close()
