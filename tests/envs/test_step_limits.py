"""The step limit is one: what cuts the episode is what the agent, ``info`` and records are told."""

from __future__ import annotations

import copy
import pickle
import re
from collections.abc import Callable
from typing import Any

import gymnasium
import pytest
from gymnasium.wrappers import OrderEnforcing, TimeLimit

import er_gym  # noqa: F401  (registers the environments)
from agents import make_agent
from er_gym.envs.actions import INDEX, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.play import play_episode
from er_gym.tasks import load_suite
from tests.support import in_one_test

ID = "ER-SingleSearch-v0"
MINI = load_suite("mini").tasks
TASK = next(task for task in MINI if task.type.env_id == ID)
OTHER = ("navigate to Fridge", "move forward", "observe", "move forward")
"""Actions that never end an episode by themselves; an illegal one costs a step, too."""


def made(limit: int | None = None, **arguments: Any) -> gymnasium.Env[Any, Any]:
    return gymnasium.make(ID, max_episode_steps=limit, obs_mode="text", **arguments)


WAYS: dict[str, tuple[Callable[[], gymnasium.Env[Any, Any]], int]] = {
    "make": (lambda: made(5), 6),
    "make, and a lower limit of the environment": (lambda: made(5, max_steps=3), 3),
    "make, and a higher limit of the environment": (lambda: made(5, max_steps=50), 6),
    "make, a limit far off": (lambda: made(500), TASK.max_steps),
    "a limit of one": (lambda: made(1), 2),
    "the environment's own": (lambda: made(max_steps=6), 6),
    "no limit asked for": (lambda: made(-1), TASK.max_steps),
    "a spec": (lambda: gymnasium.make(made(5).spec), 6),
    "a spec from JSON": (lambda: gymnasium.make(type(s := made(5).spec).from_json(s.to_json())), 6),
    "by hand": (lambda: TimeLimit(EmbodiedEnv(obs_mode="text"), 5), 6),
    "by hand, around others": (lambda: TimeLimit(OrderEnforcing(made(9)), 5), 6),
    "by hand, within others": (lambda: OrderEnforcing(TimeLimit(made(), 5)), 6),
    "two by hand": (lambda: TimeLimit(TimeLimit(made(), 5), 8), 6),
    "live tasks": (lambda: made(5, episode_source="generate"), 6),
}


@in_one_test("way", WAYS)
def test_every_limit_is_told(way: str) -> None:
    make, limit = WAYS[way]
    env = make()
    options = {} if way == "live tasks" else {"task": TASK.id}
    obs, info = env.reset(seed=0, options=options)
    over, steps = False, 1
    while not over:
        assert (info["steps"], info["max_steps"], info["end_reason"]) == (steps, limit, "")
        assert f"Step {steps} of {limit}." in obs["text"]
        obs, _, terminated, truncated, info = env.step(OTHER[steps % 4])
        steps += 1
        over = terminated or truncated
    assert (terminated, truncated, steps) == (False, True, limit)
    assert (info["steps"], info["max_steps"], info["end_reason"]) == (limit, limit, "step limit")
    assert f"Step {limit} of {limit}." in obs["text"]
    env.close()


def test_a_reply_that_costs_no_step_lowers_what_is_left() -> None:
    env = made(4)
    env.reset(seed=0)
    told = []
    for said in ("observe", "hm", "observe", "what"):
        obs, _, terminated, truncated, info = env.step(said)
        told.append(re.findall(r"Step (\d+) of (\d+)\.", obs["text"])[0])
    assert told == [("2", "5"), ("2", "4"), ("3", "4"), ("3", "3")]
    assert (terminated, truncated, info["end_reason"]) == (False, True, "step limit")
    env.close()


@pytest.mark.parametrize("mode", ["sync", "async", "vector_entry_point"])
def test_vector_environments_have_one_limit(mode: str) -> None:
    vec = gymnasium.make_vec(
        ID, num_envs=2, vectorization_mode=mode, max_episode_steps=3, obs_mode="text"
    )
    vec.reset(seed=[0, 1])
    for steps, action in enumerate(("observe", "move forward", "observe"), start=2):
        index = [INDEX[Action(action)]] * 2
        obs, _, _, truncated, info = vec.step(index)
        assert all(f"Step {steps} of 4." in text for text in obs["text"])
        assert info["max_steps"].tolist() == [4, 4]
        assert truncated.tolist() == [steps == 4] * 2
    assert list(info["end_reason"]) == ["step limit"] * 2
    vec.close()


def test_the_record_and_the_events_have_the_limit() -> None:
    env = made(5)
    begun: list[Any] = []
    record = play_episode(env, make_agent("random", 1), TASK, 0, emit=begun.append)
    assert (record.max_steps, begun[0].max_steps) == (6, 6)
    assert len(record.steps) == 6
    assert record.end_reason == "step limit"
    env.close()


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda env: pickle.loads(pickle.dumps(env))])
def test_a_copy_keeps_the_limit(copied: Callable[[Any], Any]) -> None:
    env = made(3)
    env.reset(seed=0)
    env.step("observe")
    twin = copied(env)
    for each in (env, twin):
        assert each.step("move forward")[4]["max_steps"] == 4
        assert each.step("observe")[3]
        each.close()


def test_a_limit_ends_with_its_wrapper() -> None:
    inner = EmbodiedEnv(obs_mode="text")
    assert TimeLimit(inner, 5).reset(seed=0)[1]["max_steps"] == 6
    assert inner.reset(seed=0)[1]["max_steps"] == inner.task.max_steps
    inner.close()
