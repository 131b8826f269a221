"""A trained policy plays suites like any other agent."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from click.testing import CliRunner
from gymnasium import spaces

from agents import make_agent
from agents.rl.agent import RLAgent
from agents.rl.config import EnvConfig, TrainConfig
from agents.rl.network import TypeNetwork
from agents.rl.policy_observation import PolicyObservation
from agents.rl.train import train
from benchmarks.cli.main import cli
from er_gym.envs.actions import INDEX
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks import load_suite

Make = Callable[..., TrainConfig]
MINI = load_suite("mini").tasks


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, make_config: Make) -> Path:
    path = tmp_path_factory.mktemp("rl") / "run"
    train(make_config(total_steps=256), path)
    return path


def played(agent: Any, env: EmbodiedEnv, task: Any) -> list[str]:
    obs, info = env.reset(options={"task": task})
    agent.reset(task, obs, info)
    actions, done = [], False
    while not done:
        action = agent.act(obs, info).action
        assert info["action_mask"][INDEX[action]]
        actions.append(str(action))
        obs, _, terminated, truncated, info = env.step(action)
        done = terminated or truncated
    return actions


def test_it_plays_legally_and_the_same_again(run: Path) -> None:
    agent = make_agent(f"rl:{run}")
    assert agent.obs_mode == "state"
    env = EmbodiedEnv((), obs_mode="state", instances="explore")
    assert played(agent, env, MINI[0]) == played(RLAgent(run / "model.npz"), env, MINI[0])


def test_the_benchmark_runner_takes_it(run: Path, tmp_path: Path) -> None:
    out = tmp_path / "bench"
    result = CliRunner().invoke(
        cli,
        ["bench", "--suite", "mini", "--agent", f"rl:{run}", "--instances", "explore",
         "--limit", "3", "--workers", "2", "--out", str(out)],
    )  # fmt: skip
    assert result.exit_code == 0, result.output
    assert len(list((out / "episodes").iterdir())) == 3


def test_a_run_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"there is no trained model .*; give rl: and a directory"):
        make_agent(f"rl:{tmp_path}")


def test_depths_are_made_small_and_stacked() -> None:
    options = EnvConfig(obs_mode="rgb+depth+state", width=64, height=36, frames=2)
    env = EmbodiedEnv((), obs_mode=options.obs_mode, width=128, height=72)
    obs, info = env.reset(options={"task": MINI[0]})
    perception = PolicyObservation(options)
    made = perception.reset(obs, info, MINI[0].instruction)
    assert made in perception.space
    assert made["depth"].shape == (36, 64, 2)
    near = obs["depth"][:2, :2].mean()  # four pixels become one
    assert made["depth"][0, 0] == pytest.approx(255 * min(near / 10, 1), abs=1)
    network = TypeNetwork(turned(perception.space), width=16, kind=4)
    seen = {name: torch.as_tensor(array)[None].float() for name, array in made.items()}
    for name in ("rgb", "depth"):
        seen[name] = seen[name].permute(0, 3, 1, 2) / 255
    numbers, _ = network(seen)
    other, _ = network({**seen, "depth": 1 - seen["depth"]})
    assert not torch.equal(numbers, other)
    env.close()


def turned(space: spaces.Dict) -> spaces.Dict:
    """With channels first, as Stable-Baselines3 has them."""
    boxes = dict(space.spaces)
    for name in ("rgb", "depth"):
        height, width, channels = boxes[name].shape
        boxes[name] = spaces.Box(0, 255, (channels, height, width), np.uint8)
    return spaces.Dict(boxes)


def test_pictures_are_made_small_and_stacked() -> None:
    options = EnvConfig(obs_mode="rgb+state", width=64, height=36, frames=2, instruction="hashed")
    policy_observation = PolicyObservation(options, with_mask=True)
    env = EmbodiedEnv((), obs_mode="rgb+state", width=64, height=36)
    obs, info = env.reset(options={"task": MINI[0]})
    first = policy_observation.reset(obs, info, MINI[0].instruction)
    assert first in policy_observation.space
    assert (first["rgb"][..., :3] == first["rgb"][..., 3:]).all()
    action = f"navigate to {env.details['navigable'][0]}"
    obs, _, _, _, info = env.step(action)
    second = policy_observation.observe(obs, info)
    assert second in policy_observation.space
    assert (second["rgb"][..., :3] == first["rgb"][..., 3:]).all()
    assert (second["instruction"] == first["instruction"]).all()
    assert np.abs(second["rgb"][..., 3:].mean() - obs["rgb"].mean()) < 2
    env.close()
