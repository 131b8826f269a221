"""Environments in worker processes."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest
from sb3_contrib.common.maskable.utils import get_action_masks, is_masking_supported
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from agents.rl.config import EnvConfig
from agents.rl.envs import evaluation_config, make_env
from agents.rl.vec_env import WorkerVecEnv
from er_gym.envs.actions import ACTIONS
from er_gym.envs.info import with_details
from er_gym.envs.solver import Solver
from er_gym.tasks import load_suite
from er_gym.tasks.splits import TRAINING_SCENES
from er_gym.tasks.types import BY_NAME

OPTIONS = EnvConfig(episodes="mini", types=("single_pickup", "single_toggle"))
PICKUP = next(task for task in load_suite("mini").tasks if task.type.name == "single_pickup")


@pytest.fixture
def vec() -> Iterator[WorkerVecEnv]:
    env = WorkerVecEnv([partial(make_env, OPTIONS)] * 3, workers=2)
    yield env
    env.close()


def first_legal(env: VecEnv) -> np.ndarray:
    """An action for each that is legal and does not end the episode."""
    masks = np.stack(get_action_masks(env)).copy()
    masks[:, :3] = 0
    return masks.argmax(axis=1)


def play(env: VecEnv, steps: int) -> list[np.ndarray]:
    env.seed(5)
    seen = [env.reset()["state"]]
    for _ in range(steps):
        obs, *_ = env.step(first_legal(env))
        seen.append(obs["state"])
    return seen


def test_it_plays_what_stable_baselines_own_plays(vec: WorkerVecEnv) -> None:
    shares = [(0, 2), (0, 2), (1, 2)]  # two environments in the first process, one in the second
    # In this process, which has torch; each of SubprocVecEnv's three would import it anew.
    other = DummyVecEnv([partial(make_env, OPTIONS, share=share) for share in shares])
    try:
        assert is_masking_supported(other)
        assert is_masking_supported(vec)
        for one, two in zip(play(vec, 30), play(other, 30), strict=True):
            assert (one == two).all()
        assert (get_action_masks(vec) == get_action_masks(other)).all()
    finally:
        other.close()


def test_masks_are_int8_and_come_with_the_observations(vec: WorkerVecEnv) -> None:
    vec.reset()
    masks = vec.action_masks()
    assert masks.shape == (3, len(ACTIONS))
    assert masks.dtype == np.int8
    vec.step(first_legal(vec))
    assert (
        np.stack(vec.env_method("action_masks", indices=[2, 0])) == vec.action_masks()[[2, 0]]
    ).all()


def test_an_episode_that_ends_tells_how_and_the_next_begins(vec: WorkerVecEnv) -> None:
    vec.reset()
    end = np.full(3, 2)
    obs, rewards, dones, infos = vec.step(end)
    assert dones.all()
    assert rewards.dtype == np.float32
    for row, info in enumerate(infos):
        assert not info["is_success"]
        assert info["end_reason"] == "end"
        assert info["task_type"] in BY_NAME
        assert not (info["terminal_observation"]["state"] == obs["state"][row]).all()
        assert not info["TimeLimit.truncated"]


def test_attributes_and_methods_go_to_the_environments_asked(vec: WorkerVecEnv) -> None:
    vec.reset()
    vec.env_method("set_types", ["single_toggle"], indices=[1])
    types = [each[0].name for each in vec.get_attr("_types")]
    assert types[1] == "single_toggle"
    assert types[0] == types[2] == "single_pickup"
    assert not vec.has_attr("nothing_of_the_sort")


def test_running_out_of_steps_ends_the_episode() -> None:
    env = make_env(OPTIONS.model_copy(update={"max_steps": 3}))
    env.reset(seed=0)
    terminated = False
    for _ in range(2):
        _, _, terminated, truncated, info = env.step("observe")
        assert not truncated
    assert terminated
    assert info["end_reason"] == "step limit"
    env.close()


def scene_drawn(env: Any, seed: int) -> str:
    env.reset(seed=seed)
    return env.unwrapped.task.scene


def test_goals_come_from_the_live_generator_too() -> None:
    env = make_env(OPTIONS.model_copy(update={"episodes": "generate"}))
    scenes = {scene_drawn(env, seed) for seed in (0, 1)}
    again = {scene_drawn(env, seed) for seed in (0, 1)}
    assert scenes == again
    assert scenes <= {*TRAINING_SCENES}
    env.close()


def test_success_is_worth_a_bonus_in_training_and_none_in_evaluation() -> None:
    returns = []
    for options in (OPTIONS, evaluation_config(OPTIONS, "mini")):
        env = make_env(options)
        _, info = env.reset(options={"task": PICKUP})
        solver, total, done = Solver(), 0.0, False
        while not done:
            _, reward, done, _, info = env.step(solver.next(with_details(env, info))[0])
            total += float(reward)
        assert info["success"]
        returns.append(total)
        steps = info["steps"]
        env.close()
    assert returns[1] == PICKUP.total_reward
    assert returns[0] == pytest.approx(returns[1] + 1.0 - 0.01 * (steps - 1))


def test_a_worker_that_dies_is_reported(vec: WorkerVecEnv) -> None:
    vec.reset()
    os.kill(vec._processes[1].pid or 0, signal.SIGKILL)
    vec._processes[1].join(60)
    with pytest.raises(RuntimeError, match="worker process 2 of 2 died with exit code -9"):
        vec.step(first_legal(vec))


def test_an_environment_that_cannot_be_made_says_why() -> None:
    options = OPTIONS.model_copy(update={"episodes": "nowhere"})
    with pytest.raises(ValueError, match="unknown suite 'nowhere'") as caught:
        WorkerVecEnv([partial(make_env, options)], workers=1)
    where = str(caught.value.__cause__)  # a pickle of an error does not hold its traceback
    assert "in worker process 1" in where
    assert ", in make_env\n" in where
