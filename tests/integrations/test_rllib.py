"""RLlib's environment: numbers, and a mask of legal actions."""

from __future__ import annotations

import numpy as np
import pytest
from conformance import SETTINGS, Answer, Course, differences

from er_gym.envs.actions import ACTIONS

pytest.importorskip("ray.tune", reason="needs Ray")
plug = pytest.importorskip("er_gym.integrations.rllib")


class OfRLlib:
    def __init__(self) -> None:
        self.env = plug.make({**SETTINGS, "obs_mode": "text"})

    def reset(self, task_id: str) -> Answer:
        obs, info = self.env.reset(options={"task": task_id})
        return Answer(obs["observations"], 0.0, False, info["success"])

    def step(self, text: str) -> Answer:
        obs, reward, terminated, truncated, info = self.env.step(text)
        return Answer(obs["observations"], reward, terminated or truncated, info["success"])


def test_it_answers_as_gymnasium_make(courses: tuple[Course, ...]) -> None:
    assert differences(OfRLlib(), courses) == []


def test_the_mask_is_in_the_observation() -> None:
    env = plug.make({"scaffold": "success", "max_steps": 3})
    obs, info = env.reset(seed=0)
    assert env.observation_space.contains(obs)
    assert np.array_equal(obs["action_mask"], info["action_mask"])
    assert obs["action_mask"].shape == (len(ACTIONS),)
    rewards = []
    terminated = truncated = False
    while not (terminated or truncated):
        obs, reward, terminated, truncated, info = env.step(int(obs["action_mask"].argmax()))
        assert env.observation_space.contains(obs)
        rewards.append(reward)
    assert sum(rewards) == float(info["success"])
    env.close()


def test_one_observation_is_wanted() -> None:
    with pytest.raises(ValueError, match="give an environment with one observation"):
        plug.make({"obs_mode": "state+text"})


def test_ppo_trains_with_masks() -> None:
    masking = pytest.importorskip(
        "ray.rllib.examples.rl_modules.classes.action_masking_rlm", reason="needs ray[rllib]"
    )
    from ray.rllib.algorithms.ppo import PPOConfig
    from ray.rllib.core.rl_module.rl_module import RLModuleSpec

    plug.register()
    config = (
        PPOConfig()
        .environment(plug.NAME, env_config={"task_type": "single_search", "max_steps": 8})
        .env_runners(num_env_runners=0)
        .rl_module(
            rl_module_spec=RLModuleSpec(
                module_class=masking.ActionMaskingTorchRLModule,
                model_config={"head_fcnet_hiddens": [16], "head_fcnet_activation": "relu"},
            )
        )
        .training(train_batch_size_per_learner=64, minibatch_size=32, num_epochs=1)
    )
    algorithm = config.build_algo()
    told = algorithm.train()
    algorithm.stop()
    assert np.isfinite(told["env_runners"]["episode_return_mean"])
