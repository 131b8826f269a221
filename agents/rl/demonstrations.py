"""Episodes of a scripted agent, as a learner would have seen them. Imports no torch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from agents import make_agent
from agents.rl.policy_observation import Obs
from er_gym.envs.actions import ACTIONS, INDEX, Action, understand
from er_gym.rollout.loop import transitions


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """N steps of some episodes: those in which the teacher did something legal.

    Attributes:
        obs: by the observation's keys, (N, …).
        masks: (N, A) int8, what was legal.
        actions: (N,) what was done.
        returns: (N,) float32, the discounted rewards from there to the end of the episode.
        episodes, successes: how many were played, and how many of them succeeded.
        refused, unread: how many steps are left out because what the teacher did was illegal, or
            was text that names no action.
    """

    obs: Obs
    masks: NDArray[np.int8]
    actions: NDArray[np.intp]
    returns: NDArray[np.float32]
    episodes: int
    successes: int
    refused: int = 0
    unread: int = 0

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
    """
    kept = [_of(env, [], gamma)]
    successes = 0
    for _ in range(episodes):
        agent = make_agent(teacher)
        obs, info = env.reset()
        agent.reset(info["task"], info["seen"], info)
        steps = []
        for each in transitions(env, agent, obs, info, seen="seen"):
            mask, action = each.info_before["action_mask"], understand(each.decision.action)[0]
            steps.append(_Step(each.before, mask, action, each.reward))
            info = each.info
        successes += info["success"]
        if info["success"] or not successes_only:
            kept.append(_of(env, steps, gamma))
    return replace(concatenate(kept), episodes=episodes, successes=successes)


def concatenate(parts: Sequence[Demonstrations]) -> Demonstrations:
    """All in one."""
    return Demonstrations(
        obs={key: np.concatenate([part.obs[key] for part in parts]) for key in parts[0].obs},
        masks=np.concatenate([part.masks for part in parts]),
        actions=np.concatenate([part.actions for part in parts]),
        returns=np.concatenate([part.returns for part in parts]),
        episodes=sum(part.episodes for part in parts),
        successes=sum(part.successes for part in parts),
        refused=sum(part.refused for part in parts),
        unread=sum(part.unread for part in parts),
    )


class _Step(NamedTuple):
    obs: Obs
    mask: NDArray[np.int8]
    action: Action | None
    reward: float

    @property
    def index(self) -> int:
        """Of the action; -1 for one that is not in the action space."""
        return -1 if self.action is None else INDEX.get(self.action, -1)


def _of(env: gymnasium.Env[Obs, Any], steps: Sequence[_Step], gamma: float) -> Demonstrations:
    """An episode. What is left out of it is nothing to learn, but its reward and the time that it
    took count in the returns of the steps before."""
    returns = np.zeros(len(steps), np.float32)
    ahead = 0.0
    for number in reversed(range(len(steps))):
        returns[number] = ahead = steps[number].reward + gamma * ahead
    rows = [n for n, step in enumerate(steps) if step.index >= 0 and step.mask[step.index]]
    unread = sum(step.index < 0 for step in steps)
    space = env.observation_space
    assert isinstance(space, spaces.Dict)
    return Demonstrations(
        obs={
            key: np.array([steps[n].obs[key] for n in rows], box.dtype).reshape(-1, *box.shape)
            for key, box in space.spaces.items()
        },
        masks=np.array([steps[n].mask for n in rows], np.int8).reshape(-1, len(ACTIONS)),
        actions=np.array([steps[n].index for n in rows], np.intp),
        returns=returns[rows] if rows else returns[:0],
        episodes=0,
        successes=0,
        refused=len(steps) - len(rows) - unread,
        unread=unread,
    )
