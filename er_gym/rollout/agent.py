"""The protocol that every agent follows, whatever is inside it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

from er_gym.envs.actions import Action
from er_gym.tasks.task import Task


@dataclass(frozen=True)
class Decision:
    """What an agent does next, and why.

    Attributes:
        action: anything that ``EmbodiedEnv.step`` takes: an :class:`~er_gym.envs.actions.Action`,
            its text, or its index.
        thought: what the agent said to itself; kept in the episode's record, never read by the env.
    """

    action: Action | str | int
    thought: str = ""


class CannotGoOn(Exception):
    """No further episode can be played, this one included: a budget is spent, a key is refused.

    The run stops, and says the message; what has been played is kept.
    """


class Agent(Protocol):
    """Plays episodes: ``reset`` once for each, then ``act`` until the episode is over."""

    obs_mode: str
    """The observations it needs, as ``EmbodiedEnv(obs_mode=…)`` names them."""

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode; ``obs`` and ``info`` are what ``env.reset`` returned."""

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """Decide, given what the last ``env.reset`` or ``env.step`` returned."""
