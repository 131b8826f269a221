"""Episodes of a scripted agent, as a learner would have seen them. Imports no torch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import NDArray

from agents import make_agent
from agents.rl.perception import Obs
from er_gym.envs.actions import INDEX, Action, parse


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """N steps of some episodes.

    Attributes:
        obs: by the observation's keys, (N, …).
        masks: (N, A) int8, what was legal.
        actions: (N,) what was done.
        returns: (N,) float32, the discounted rewards from there to the end of the episode.
        episodes, successes: how many were played, and how many of them succeeded.
    """

    obs: Obs
    masks: NDArray[np.int8]
    actions: NDArray[np.intp]
    returns: NDArray[np.float32]
    episodes: int
    successes: int

    def __len__(self) -> int:
        return len(self.actions)


def demonstrate(
    env: gymnasium.Env[Obs, Any], teacher: str, episodes: int, gamma: float, successes_only: bool
) -> Demonstrations:
    """Let an agent play in an environment whose ``info["seen"]`` has what the agent sees.

    Args:
        teacher: its name.
        gamma: the discount of ``returns``.
        successes_only: whether the steps of episodes that fail are left out.

    Raises:
        ValueError: it never succeeded.
    """
    kept: list[Demonstrations] = []
    successes = 0
    for _ in range(episodes):
        agent = make_agent(teacher)
        obs, info = env.reset()
        agent.reset(info["task"], info["seen"], info)
        steps, done = [], False
        while not done:
            action = _index(agent.act(info["seen"], info).action)
            mask = info["action_mask"]
            before = obs
            obs, reward, terminated, truncated, info = env.step(action)
            done = terminated or truncated
            if mask[action]:  # what was refused is nothing to learn
                steps.append((before, mask, action, reward))
        successes += info["success"]
        if steps and (info["success"] or not successes_only):
            kept.append(_of(steps, gamma))
    if not kept:
        raise ValueError(
            f"{teacher} succeeded in none of {episodes} episodes; choose another teacher or "
            "easier tasks"
        )
    return replace(joined(kept), episodes=episodes, successes=successes)


def joined(parts: Sequence[Demonstrations]) -> Demonstrations:
    """All in one."""
    return Demonstrations(
        obs={key: np.concatenate([part.obs[key] for part in parts]) for key in parts[0].obs},
        masks=np.concatenate([part.masks for part in parts]),
        actions=np.concatenate([part.actions for part in parts]),
        returns=np.concatenate([part.returns for part in parts]),
        episodes=sum(part.episodes for part in parts),
        successes=sum(part.successes for part in parts),
    )


def _of(steps: Sequence[tuple[Obs, NDArray[np.int8], int, float]], gamma: float) -> Demonstrations:
    all_obs, masks, actions, rewards = zip(*steps, strict=True)
    returns = np.zeros(len(steps), np.float32)
    ahead = 0.0
    for number in reversed(range(len(steps))):
        returns[number] = ahead = rewards[number] + gamma * ahead
    return Demonstrations(
        obs={key: np.stack([each[key] for each in all_obs]) for key in all_obs[0]},
        masks=np.stack(masks),
        actions=np.array(actions),
        returns=returns,
        episodes=0,
        successes=0,
    )


def _index(action: Action | str | int) -> int:
    understood = parse(action) if isinstance(action, str) else action
    return INDEX[understood] if isinstance(understood, Action) else int(understood or 0)
