"""``info`` is as documented, and agrees with the observation and the simulator."""

from __future__ import annotations

import pickle
from collections.abc import Iterator
from typing import Any, get_type_hints

import gymnasium
import numpy as np
import pytest

from er_gym.envs.actions import ACTIONS, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import Details, Info, LegalActions, action_of, names, with_details
from er_gym.envs.solver import Solver
from er_gym.tasks import load_suite
from er_gym.tasks.task import Task
from er_gym.tasks.types import TASK_TYPES

MINI = load_suite("mini").tasks
TASKS = [next(task for task in MINI if task.type is kind) for kind in TASK_TYPES[2:9:2]]


def infos(env: EmbodiedEnv, task: Task) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
    """Observation and info, with details, of each step of a good episode."""
    obs, info = env.reset(seed=0, options={"task": task})
    solver, over = Solver(), False
    yield obs, (all_ := with_details(env, info))
    while not over:
        obs, _, ended, cut, info = env.step(solver.next(all_)[0])
        over = ended or cut
        yield obs, (all_ := with_details(env, info))


def form(value: object) -> object:
    """The type of a plain value, and the shape of an array; anything else is an error."""
    if isinstance(value, np.ndarray):
        assert value.dtype.kind in "biuf"
        return value.dtype, value.shape, value.flags.writeable
    assert type(value) in (bool, int, float, str), value
    return type(value)


EVERYTHING: tuple[dict[str, Any], ...] = (
    {"obs_mode": "rgb+depth+instance+objects+state+text", "width": 48, "height": 32},
    {"obs_mode": "state", "faults": 0.5},
    {"obs_mode": "text", "protocol": "paper"},
)


@pytest.mark.parametrize("made", EVERYTHING, ids=lambda made: made["obs_mode"])
def test_info_is_plain_data_of_one_form_from_reset_to_the_end(made: dict[str, Any]) -> None:
    env = EmbodiedEnv(MINI, **made)
    forms: list[dict[str, object]] = []
    ends = [["observe", "dance", "hm", "no"], ["observe"] * 4, ["open Fridge", "end"]]
    for task, actions in zip(TASKS, [*ends, ends[0]], strict=False):
        forms.append({key: form(one) for key, one in env.reset(options={"task": task})[1].items()})
        place = env.details["navigable"][0]
        for action in (f"navigate to {place}", "move forward", 0, *actions):
            *_, info = env.step(action)
            forms.append({key: form(one) for key, one in info.items()})
            if info["end_reason"]:
                break
        assert info["end_reason"]
    assert all(one == forms[0] for one in forms)
    assert forms[0].keys() == get_type_hints(Info).keys() == Info.__required_keys__
    env.close()


def test_details_are_as_documented_and_share_no_name_with_info(env: EmbodiedEnv) -> None:
    documented = get_type_hints(Details).keys()
    env.reset(seed=0, options={"task": TASKS[0]})
    assert env.details.keys() == documented
    for action in ("dance", "observe", "end"):
        env.step(action)
        assert env.details.keys() == documented
        assert bool(env.details["views"]) == (action == "observe")
    assert not documented & get_type_hints(Info).keys()
    env.details.clear()  # type: ignore[attr-defined]
    assert env.details["task"] is env.task


def test_what_has_no_details_is_told_apart(env: EmbodiedEnv) -> None:
    other = gymnasium.make("CartPole-v1")
    with pytest.raises(ValueError, match="CartPoleEnv has no details; give an er-gym environment"):
        with_details(other, {})
    _, info = env.reset(seed=0, options={"task": TASKS[0]})
    with pytest.raises(ValueError, match=r"this agent needs 'keys_left'.*with_details\(env, info"):
        Solver().next(info)


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.type.name)
def test_info_says_what_the_text_and_the_simulator_say(env: EmbodiedEnv, task: Task) -> None:
    hands = set()
    for obs, info in infos(env, task):
        lines = obs["text"].splitlines()
        assert f"You see: {', '.join(names(info['visible_mask'])) or 'nothing'}." in lines
        assert f"You hold: {info['held'] or 'nothing'}." in lines
        there = ", ".join(names(info["navigable_mask"]))
        assert f"You can navigate to: {there or 'nothing'}." in lines
        reach = ", ".join(names(info["interactable_mask"]))
        assert f"Within reach: {reach or 'nothing'}." in lines
        for name in ("visible", "navigable", "interactable"):
            assert info[name] == names(info[f"{name}_mask"])
        assert any(f"Step {info['steps']} of {info['max_steps']}." in line for line in lines)
        assert lines[0] == f"Task: {info['instruction']}"
        assert (info["task_id"], info["task_type"]) == (task.id, task.type.name)
        assert (info["action"] == "") == (action_of(info) is None)
        assert info["action"] == str(action_of(info) or "")
        assert info["key_actions_done"] == len(info["keys_done"])
        assert info["key_actions_left"] == len(info["keys_left"])
        seen = {entry["objectType"] for entry in env.objects if entry["visible"]}
        held = [entry["objectType"] for entry in env.objects if entry["isPickedUp"]]
        assert info["visible"] == tuple(sorted(seen))
        assert info["held"] == "".join(held)
        hands.add(info["held"])
    assert info["success"]
    assert len(hands) == 1 + (task.type.name != "single_toggle")


def test_what_does_not_hold_at_the_end_is_told_in_words(env: EmbodiedEnv) -> None:
    task = next(task for task in load_suite("er-1k").tasks if task.goal)
    env.reset(seed=0, options={"task": task})
    info = env.step("end")[4]
    assert info["goal_unmet"] == "; ".join(map(str, env.details["unmet"])) != ""


def test_masks_of_an_earlier_step_stay_as_they_were(env: EmbodiedEnv) -> None:
    kept = [
        (info, {key: value.copy() for key, value in info.items() if key.endswith("_mask")})
        for _, info in infos(env, TASKS[-1])
    ]
    for info, masks in kept:
        assert all((info[key] == mask).all() for key, mask in masks.items())
    assert len({info["navigable_mask"].tobytes() for info, _ in kept}) > 1


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
