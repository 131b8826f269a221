"""The lower bound of every comparison: an agent that takes random legal actions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from er_gym.envs.actions import Action
from er_gym.rollout.agent import Decision
from er_gym.tasks.task import Task


class RandomAgent:
    """Draws uniformly from the legal actions.

    Args:
        seed: of the agent's own random generator, which makes episodes reproducible.
    """

    obs_mode = "text"

    def __init__(self, seed: int = 0) -> None:
        self._random = np.random.default_rng(seed)

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Do nothing: the agent needs no preparation."""

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """A random legal action."""
        return Decision(int(self._random.choice(np.flatnonzero(info["action_mask"]))))

    def overruled(self, action: Action, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Do nothing: the agent has no memory."""
