"""Episodes of a scripted agent with the learner's observations. Imports no torch."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from agents.rl.packed import Column, PackedRows, concatenated, packed
from agents.rl.policy_observation import Obs
from agents.scripted.oracle import OracleAgent
from agents.scripted.searcher import SearcherAgent
from er_gym.envs.actions import ACTIONS, INDEX, Action, parse_action
from er_gym.envs.info import with_details
from er_gym.rollout.agent import Agent
from er_gym.rollout.loop import transitions

TEACHERS: Mapping[str, Callable[[], Agent]] = {"searcher": SearcherAgent, "oracle": OracleAgent}
"""The agents that can be imitated, by name."""


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """N steps from episodes of a teacher: those with a legal action.

    Attributes:
        obs: by the observation's keys, (N, …); vectors are packed.
        masks: (N, A), the legal actions, packed: 1 for each.
        actions: (N,) the teacher's actions.
        returns: (N,) float32, the discounted return from each step on.
        episodes, successes: the numbers of episodes played and of successes.
        refused, unread: the numbers of steps left out because the action was illegal, or was text
            that names no action.
    """

    obs: dict[str, Column]
    masks: PackedRows
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
    """Let an agent play in an environment whose ``info["seen"]`` holds the agent's observation.

    Args:
        env: the learner's environment.
        teacher: one of :data:`TEACHERS`.
        episodes: the number of episodes.
        gamma: the discount of ``returns``.
        successes_only: whether the steps of failed episodes are left out.
    """
    kept = [_of(env, [], gamma)]
    successes = 0
    for _ in range(episodes):
        agent = TEACHERS[teacher]()
        obs, told = env.reset()
        last: Mapping[str, Any] = (info := with_details(env, told))
        agent.reset(info["task"], info["seen"], info)
        steps = []
        for each in transitions(env, agent, obs, info, seen="seen"):
            mask, action = each.info_before["action_mask"], parse_action(each.decision.action)[0]
            steps.append(_Step(each.before, mask, action, each.reward))
            last = each.info
        successes += last["success"]
        if last["success"] or not successes_only:
            kept.append(_of(env, steps, gamma))
    return replace(concatenate(kept), episodes=episodes, successes=successes)


def concatenate(parts: Sequence[Demonstrations]) -> Demonstrations:
    """Concatenate demonstrations along the steps."""
    return Demonstrations(
        obs={key: concatenated([part.obs[key] for part in parts]) for key in parts[0].obs},
        masks=PackedRows.concatenate([part.masks for part in parts]),
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
    def action_index(self) -> int:
        """The index of the action; -1 for an action outside of the action space."""
        return -1 if self.action is None else INDEX.get(self.action, -1)


def _of(env: gymnasium.Env[Obs, Any], steps: Sequence[_Step], gamma: float) -> Demonstrations:
    """The demonstrations of an episode. Steps that are left out still count in the returns of
    earlier steps."""
    returns = np.zeros(len(steps), np.float32)
    ahead = 0.0
    for number in reversed(range(len(steps))):
        returns[number] = ahead = steps[number].reward + gamma * ahead
    rows = [
        n for n, step in enumerate(steps) if step.action_index >= 0 and step.mask[step.action_index]
    ]
    unread = sum(step.action_index < 0 for step in steps)
    boxes: dict[str, Any] = dict(cast(spaces.Dict, env.observation_space).spaces)
    return Demonstrations(
        obs={
            key: packed(
                np.array([steps[n].obs[key] for n in rows], box.dtype).reshape((-1, *box.shape))
            )
            for key, box in boxes.items()
        },
        masks=PackedRows.of(
            np.array([steps[n].mask for n in rows], np.float32).reshape(-1, len(ACTIONS))
        ),
        actions=np.array([steps[n].action_index for n in rows], np.intp),
        returns=returns[rows] if rows else returns[:0],
        episodes=0,
        successes=0,
        refused=len(steps) - len(rows) - unread,
        unread=unread,
    )
