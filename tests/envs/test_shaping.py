"""Shaping rewards progress in a task, and its sum cannot be exploited."""

from __future__ import annotations

from typing import Any

import gymnasium
import pytest
from floor_plan_1 import EGG, FRIDGE
from support import make_task

from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import with_details
from er_gym.envs.solver import Solver
from er_gym.envs.wrappers import KeyActionShaping
from er_gym.envs.wrappers.shaping import potential
from er_gym.tasks.suites import load_suite
from er_gym.tasks.task import Task

FETCH = make_task("single_pickup_from_closerep", ("open", FRIDGE), ("pickup", EGG))
GAMMA = 0.9
FULL = ("navigate to Fridge", "open Fridge", "pickup Egg", "end")
GIVEN_UP = ("navigate to Fridge", "open Fridge", "end")
STUCK = ("move forward",) * 4
DUMB = ("hmm", "dance", "sing")


def play(
    env: gymnasium.Env[Any, Any], task: Task, actions: tuple[str, ...]
) -> tuple[list[dict[str, Any]], list[float], bool]:
    """The infos of reset and of each step, the rewards, and whether the episode terminated."""
    _, info = env.reset(options={"task": task})
    infos, rewards, terminated = [info], [], False
    for action in actions:
        _, reward, terminated, _, info = env.step(action)
        infos.append(info)
        rewards.append(float(reward))
    return infos, rewards, terminated


def added(infos: list[dict[str, Any]], rewards: list[float]) -> list[float]:
    """What shaping has added to each reward."""
    return [
        reward - info["unshaped_reward"] for info, reward in zip(infos[1:], rewards, strict=True)
    ]


def discounted(terms: list[float]) -> float:
    return sum(GAMMA**t * term for t, term in enumerate(terms))


@pytest.mark.parametrize("scale", [0.0, 1.0, 2.5])
@pytest.mark.parametrize(
    ("actions", "terminates"),
    [(FULL, True), (GIVEN_UP, True), (STUCK, True), (DUMB, True), (FULL[:3], False)],
)
def test_the_sum_telescopes(
    env: EmbodiedEnv, actions: tuple[str, ...], terminates: bool, scale: float
) -> None:
    shaped = KeyActionShaping(env, GAMMA, scale)
    infos, rewards, terminated = play(shaped, FETCH, actions)
    assert terminated is terminates
    last = 0.0 if terminated else scale * potential(infos[-1])
    expected = GAMMA ** len(actions) * last - scale * potential(infos[0])
    assert discounted(added(infos, rewards)) == pytest.approx(expected)


def test_every_way_to_end_is_worth_the_same(env: EmbodiedEnv) -> None:
    """Φ is 0 at the end whatever is left; so shaping cannot make one policy better than another."""
    shaped = KeyActionShaping(env, GAMMA)
    sums = {
        round(discounted(added(*play(shaped, FETCH, actions)[:2])), 9)
        for actions in (FULL, GIVEN_UP, STUCK, DUMB, ("end",))
    }
    assert sums == {1.0}


def test_a_key_action_is_told_at_once(env: EmbodiedEnv) -> None:
    shaped = KeyActionShaping(env, gamma=1.0, scale=3.0)
    infos, rewards, _ = play(shaped, FETCH, FULL)
    assert [info["unshaped_reward"] for info in infos[1:]] == [0.0, 1.0, 1.0, 1.0]
    assert rewards == pytest.approx([0.0, 2.0, 2.0, 2.0])


def test_truncation_is_no_end() -> None:
    limited = EmbodiedEnv([FETCH], obs_mode="text", max_steps=3, step_penalty=0.5)
    env = KeyActionShaping(limited, GAMMA)
    env.reset()
    env.step("navigate to Fridge")
    _, reward, terminated, truncated, info = env.step("open Fridge")
    assert (terminated, truncated) == (False, True)
    assert info["unshaped_reward"] == 0.5
    assert reward == pytest.approx(0.5 + GAMMA * (-2 / 3) + 1.0)
    env.close()


def test_evaluation_sees_the_environments_own_reward(env: EmbodiedEnv) -> None:
    bare = play(env, FETCH, FULL)[1]
    infos, _, _ = play(KeyActionShaping(env, GAMMA), FETCH, FULL)
    assert [info["unshaped_reward"] for info in infos[1:]] == bare
    assert play(KeyActionShaping(env, GAMMA, scale=0.0), FETCH, FULL)[1] == bare


def test_an_episode_of_the_oracle() -> None:
    tasks = load_suite("mini").tasks
    by_type = {task.type.name: task for task in tasks}
    env = KeyActionShaping(EmbodiedEnv(list(by_type.values()), obs_mode="text"), GAMMA)
    for task in by_type.values():
        _, info = env.reset(options={"task": task})
        start, terms, solver, over = potential(info), [], Solver(), False
        while not over:
            left = info["key_actions_left"]
            action, _ = solver.next(with_details(env, info))
            _, reward, terminated, truncated, info = env.step(str(action))
            terms.append(float(reward) - info["unshaped_reward"])
            if info["key_actions_left"] < left:
                assert terms[-1] > 0.0
            over = terminated or truncated
        assert info["success"]
        assert start == -1.0
        assert discounted(terms) == pytest.approx(1.0)
    env.close()


def test_a_task_without_key_actions_has_nothing_left() -> None:
    assert potential({"key_actions_left": 0, "key_actions_done": 0}) == 0.0


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"gamma": 1.01}, r"gamma is 1\.01; give the learner's discount, from 0 to 1"),
        ({"gamma": -0.5}, "gamma is -0.5"),
        ({"gamma": float("nan")}, "gamma is nan"),
        ({"gamma": 0.9, "scale": -1.0}, r"scale is -1\.0; give a finite number, 0 or more"),
        ({"gamma": 0.9, "scale": float("inf")}, "scale is inf"),
    ],
)
def test_bad_arguments(env: EmbodiedEnv, arguments: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        KeyActionShaping(env, **arguments)


def test_an_environment_that_is_none_of_ours() -> None:
    env = KeyActionShaping(gymnasium.make("CartPole-v1"), GAMMA)
    with pytest.raises(ValueError, match=r"info has no 'key_actions_left'; wrap an er-gym"):
        env.reset()
