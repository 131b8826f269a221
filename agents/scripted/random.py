"""The floor of every comparison: an agent that does any legal thing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from er_gym.rollout.agent import Decision
from er_gym.tasks.task import Task


class RandomAgent:
    """Draws uniformly from the legal actions.

    Args:
        seed: of its own random generator, so that episodes can be replayed.
    """

    obs_mode = "text"

    def __init__(self, seed: int = 0) -> None:
        self._random = np.random.default_rng(seed)

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Nothing to prepare."""

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """Any legal action."""
        return Decision(int(self._random.choice(np.flatnonzero(info["action_mask"]))))
