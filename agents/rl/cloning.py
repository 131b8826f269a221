"""Behaviour cloning: a policy imitates a scripted agent before reinforcement learning.

The value network is fitted to the returns of the same episodes: an untrained one would undo the
policy in the first updates.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import torch
from sb3_contrib import MaskablePPO
from torch.nn import functional

from agents.rl.config import TrainConfig
from agents.rl.demonstrations import Demonstrations, concatenate
from agents.rl.envs import make_env
from agents.rl.guidance import WarmStart
from agents.rl.policy import outputs
from agents.rl.vec_env import WorkerVecEnv


def collect_demonstrations(config: TrainConfig, warm_start: WarmStart, seed: int) -> Demonstrations:
    """Let the teacher play in as many processes as training uses.

    Raises:
        ValueError: no step of the teacher can be used.
    """
    make = partial(make_env, config.env, config.algorithm.gamma, with_text=True)
    env = WorkerVecEnv([make] * config.vec.workers, config.vec.workers)
    try:
        env.seed(seed)
        env.reset()
        share = -(-warm_start.episodes // config.vec.workers)
        parts = env.env_method(
            "demonstrate",
            warm_start.teacher,
            share,
            config.algorithm.gamma,
            warm_start.successes_only,
        )
    finally:
        env.close()
    demonstrations = concatenate(parts)
    if not len(demonstrations):
        raise ValueError(
            f"{warm_start.teacher} showed nothing to learn in {demonstrations.episodes} episodes "
            f"({demonstrations.successes} succeeded, {demonstrations.refused} illegal actions, "
            f"{demonstrations.unread} texts that name no action); "
            "choose another teacher or easier tasks"
        )
    return demonstrations


def clone_behaviour(
    model: MaskablePPO,
    demonstrations: Demonstrations,
    warm_start: WarmStart,
    seed: int,
    rates: Sequence[float] | None = None,
) -> float:
    """Fit policy and value network to demonstrations.

    Args:
        model: the learner.
        demonstrations: what it learns.
        warm_start: the settings.
        seed: of the order of the steps.
        rates: the learning rate of each epoch; None for ``warm_start.epochs`` at the first rate.

    Returns:
        The share of the teacher's actions in the last epoch that were the policy's best action.
    """
    policy = model.policy
    optimizer = torch.optim.Adam(policy.parameters(), lr=warm_start.learning_rate)
    random = np.random.default_rng(seed)
    policy.set_training_mode(True)
    agreed = 0
    for rate in rates or [warm_start.learning_rate] * warm_start.epochs:
        agreed = 0
        optimizer.param_groups[0]["lr"] = rate
        for rows in np.array_split(
            random.permutation(len(demonstrations)),
            max(1, len(demonstrations) // warm_start.batch_size),
        ):
            # The policy takes dictionaries, though its annotation asks for one Tensor.
            obs: Any = policy.obs_to_tensor(
                {key: all_[rows] for key, all_ in demonstrations.obs.items()}
            )[0]
            actions = torch.as_tensor(demonstrations.actions[rows])
            distribution, values = outputs(policy, obs, demonstrations.masks[rows])
            worth = torch.as_tensor(demonstrations.returns[rows])
            log_prob = distribution.log_prob(actions)
            loss = 0.5 * functional.mse_loss(values.flatten(), worth) - log_prob.mean()
            optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(policy.parameters(), model.max_grad_norm)
            optimizer.step()
            agreed += int((distribution.mode() == actions).sum())
    return agreed / len(demonstrations)
