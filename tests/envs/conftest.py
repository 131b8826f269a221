"""Fixtures: an environment, and a function that plays a list of actions."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import pytest

from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.info import with_details
from er_gym.tasks.task import Task


@pytest.fixture(scope="session")
def env() -> Iterator[EmbodiedEnv]:
    env = EmbodiedEnv([], obs_mode="text")
    yield env
    env.close()


@pytest.fixture
def play(env: EmbodiedEnv) -> Callable[..., list[dict[str, Any]]]:
    """Play texts in a task; the infos of reset and of each step, with reward, ended and cut."""

    def run(task: Task, *actions: str) -> list[dict[str, Any]]:
        _, info = env.reset(seed=0, options={"task": task})
        infos = [with_details(env, info)]
        for action in actions:
            _, reward, ended, cut, info = env.step(action)
            infos.append({**with_details(env, info), "reward": reward, "ended": ended, "cut": cut})
        return infos

    return run
