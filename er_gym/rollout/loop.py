"""The loop in which an agent acts in an environment."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from er_gym.envs.info import with_details
from er_gym.rollout.agent import Agent, Decision


class Steppable(Protocol):
    """What the loop needs of an environment."""

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Do an action, as ``gymnasium.Env.step``."""

    @property
    def unwrapped(self) -> Any:
        """What has the :class:`~er_gym.envs.info.Details` of the step as ``details``."""


@dataclass(frozen=True, eq=False)
class Transition:
    """A step of an episode.

    Attributes:
        before: the environment's observation before the step, and ``info_before`` its info.
        decision: what the agent decided.
        reward: what the step earned.
        terminated, truncated: as Gymnasium means them.
        info: the environment's info after the step, with details.
    """

    before: Any
    info_before: Mapping[str, Any]
    decision: Decision
    reward: float
    terminated: bool
    truncated: bool
    info: Mapping[str, Any]


def transitions(
    env: Steppable,
    agent: Agent,
    obs: Any,
    info: Mapping[str, Any],
    *,
    seen: str | None = None,
) -> Iterator[Transition]:
    """Let an agent act until the episode is over.

    Args:
        env: an environment that has been reset.
        agent: an agent that has been reset.
        obs, info: what ``env.reset`` returned, with details.
        seen: a key of ``info``; the agent gets ``info[seen]`` in place of the observation. A
            scripted teacher thus reads text while the learner's arrays are recorded.
    """
    over = False
    while not over:
        decision = agent.act(obs if seen is None else info[seen], info)
        before, info_before = obs, info
        obs, reward, terminated, truncated, told = env.step(decision.action)
        info = with_details(env, told)
        over = terminated or truncated
        yield Transition(before, info_before, decision, float(reward), terminated, truncated, info)
