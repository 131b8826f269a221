"""A run directory of er-gym train-rl whose policy has random weights: made in no time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch

from agents.rl.config import TrainConfig
from agents.rl.model_file import placeholder_env, save
from agents.rl.policy_file import LEARNERS
from agents.rl.policy_observation import PolicyObservation
from agents.rl.train import ALGORITHMS, TRAINING
from er_gym.envs.actions import ACTIONS


def write_untrained_run(config: TrainConfig, run: Path, *, steps: int | None = None) -> Any:
    """Write the run directory, and return its learner.

    Args:
        config: of the run.
        run: the directory.
        steps: that the learner claims to have learnt; None for all that the run asks for.
    """
    algorithm = config.algorithm
    space = PolicyObservation(config.env, LEARNERS[algorithm.name].needs_mask).space
    env = placeholder_env(space, len(ACTIONS), config.vec.envs)
    model = ALGORITHMS[algorithm.name](config, algorithm, env)
    for weights in model.policy.parameters():  # so that no two actions are alike
        torch.nn.init.normal_(weights, std=0.3)
    model.num_timesteps = config.total_steps if steps is None else steps
    TRAINING.begin(run, config)
    save(model, run)
    return model
