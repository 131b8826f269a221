"""Behaviour cloning: a policy learns to do what a scripted agent did, before it learns by itself.

The value network learns from the same episodes what they were worth: one that knows nothing would
undo the policy in the first updates that follow.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import torch
from sb3_contrib import MaskablePPO
from torch.nn import functional

from agents.rl.config import TrainConfig, WarmStart
from agents.rl.demonstrations import Demonstrations, joined
from agents.rl.envs import make_env
from agents.rl.vec_env import WorkerVecEnv


def watch(config: TrainConfig, how: WarmStart, seed: int) -> Demonstrations:
    """Let the teacher play, in as many processes as training has.

    Raises:
        ValueError: nothing that it did can be learnt.
    """
    make = partial(make_env, config.env, config.algorithm.gamma, with_text=True)
    env = WorkerVecEnv([make] * config.vec.workers, config.vec.workers)
    try:
        env.seed(seed)
        env.reset()
        share = -(-how.episodes // config.vec.workers)
        parts = env.env_method(
            "demonstrate", how.teacher, share, config.algorithm.gamma, how.successes_only
        )
    finally:
        env.close()
    seen = joined(parts)
    if not len(seen):
        raise ValueError(
            f"{how.teacher} showed nothing to learn in {seen.episodes} episodes ({seen.successes} "
            f"succeeded, {seen.refused} illegal actions, {seen.unread} texts that name no action); "
            "choose another teacher or easier tasks"
        )
    return seen


def clone(model: MaskablePPO, seen: Demonstrations, how: WarmStart, seed: int) -> float:
    """Fit policy and value to demonstrations.

    Returns:
        The share of the teacher's actions, in the last epoch, that the policy thought best.
    """
    policy = model.policy
    optimizer = torch.optim.Adam(policy.parameters(), lr=how.learning_rate)
    random = np.random.default_rng(seed)
    policy.set_training_mode(True)
    agreed = 0
    for _ in range(how.epochs):
        agreed = 0
        for rows in np.array_split(
            random.permutation(len(seen)), max(1, len(seen) // how.batch_size)
        ):
            # The policy takes dictionaries, though its annotation asks for one Tensor.
            obs: Any = policy.obs_to_tensor({key: all_[rows] for key, all_ in seen.obs.items()})[0]
            actions = torch.as_tensor(seen.actions[rows])
            masks = torch.as_tensor(seen.masks[rows])
            values, log_prob, _ = policy.evaluate_actions(obs, actions, action_masks=masks)
            worth = torch.as_tensor(seen.returns[rows])
            loss = 0.5 * functional.mse_loss(values.flatten(), worth) - log_prob.mean()
            optimizer.zero_grad()
            loss.backward()
            torch.nn.utils.clip_grad_norm_(policy.parameters(), model.max_grad_norm)
            optimizer.step()
            with torch.no_grad():
                best = policy.get_distribution(obs, seen.masks[rows]).mode()
            agreed += int((best == actions).sum())
    return agreed / len(seen)
