"""DAgger (Ross et al. 2011): the policy plays, and the searcher labels each step.

A cloned policy drifts into situations that its teacher never showed. Here the policy plays by
itself, every situation that it gets into is kept with the searcher's action there, and the policy
is fitted to all that has been gathered.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sb3_contrib import MaskablePPO
from stable_baselines3.common.vec_env import VecEnv

from agents.rl.config import TrainConfig
from agents.rl.demonstrations import Demonstrations, concatenate
from agents.rl.envs import ADVICE, make_env
from agents.rl.guidance import Practice
from agents.rl.packed import PackedRows, packed, taken
from agents.rl.vec_env import WorkerVecEnv


def advised_envs(config: TrainConfig, seed: int) -> VecEnv:
    """The environments of a run, with advice in their observations."""
    make = partial(make_env, config.env, config.algorithm.gamma, advised=True)
    env = WorkerVecEnv([make] * config.vec.envs, config.vec.workers)
    env.seed(seed)
    return env


def play_with_advice(
    model: MaskablePPO, env: VecEnv, how: Practice, gamma: float
) -> Demonstrations:
    """Let the policy play, and record the searcher's action for every step.

    Args:
        model: chooses the actions, by their probabilities.
        env: what :func:`advised_envs` returned.
        how: says for how many steps.
        gamma: the discount of the returns.

    Returns:
        The steps of the episodes that ended, with the advice as actions. The returns are those of
        the policy's own play.
    """
    model.policy.set_training_mode(False)
    parts, rewards, dones = [], [], []
    episodes = successes = refused = 0
    obs: Any = env.reset()
    everyone = np.arange(env.num_envs)
    for _ in range(-(-how.steps // env.num_envs)):
        advice: NDArray[np.intp] = obs.pop(ADVICE)
        masks = np.stack(env.env_method("action_masks"))
        parts.append(_advised(obs, masks, advice))
        refused += int((masks[everyone, advice] == 0).sum())
        actions, _ = model.predict(obs, action_masks=masks)
        obs, earned, done, infos = env.step(actions)
        rewards.append(earned)
        dones.append(done)
        episodes += int(done.sum())
        successes += sum(bool(info.get("is_success")) for info in infos)
    returns, ended = _returns(np.stack(rewards), np.stack(dones), gamma)
    gathered = concatenate(parts)
    legal = gathered.masks[np.arange(len(gathered))][np.arange(len(gathered)), gathered.actions] > 0
    kept = (ended.ravel() & legal).nonzero()[0]
    return Demonstrations(
        obs={key: taken(rows, kept) for key, rows in gathered.obs.items()},
        masks=gathered.masks.take(kept),
        actions=gathered.actions[kept],
        returns=returns.ravel()[kept],
        episodes=episodes,
        successes=successes,
        refused=refused,
    )


def _advised(obs: Any, masks: NDArray[np.int8], advice: NDArray[np.intp]) -> Demonstrations:
    """The steps of all environments at one time."""
    return Demonstrations(
        obs={key: packed(rows) for key, rows in obs.items()},
        masks=PackedRows.of(masks.astype(np.float32)),
        actions=advice,
        returns=np.zeros(len(advice), np.float32),
        episodes=0,
        successes=0,
    )


def _returns(
    rewards: NDArray[np.float32], dones: NDArray[np.bool_], gamma: float
) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
    """(steps, envs): the discounted returns, and whether the step's episode ended in time."""
    returns, ended = np.zeros_like(rewards), np.zeros_like(dones)
    ahead, over = np.zeros_like(rewards[0]), np.zeros_like(dones[0])
    for step in reversed(range(len(rewards))):
        ahead = rewards[step] + gamma * np.where(dones[step], 0.0, ahead)
        over = over | dones[step]
        returns[step], ended[step] = ahead, over
    return returns, ended
