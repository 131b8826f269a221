"""Agents that cannot think: what they score is what a suite gives away (docs/validity.md)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from er_gym.envs.actions import ACTIONS, INDEX, Action
from er_gym.rollout.agent import Decision
from er_gym.tasks import verbs
from er_gym.tasks.task import Task

_LONG_ENOUGH = 3
"""The fourth same action in a row ends an episode."""


class _Thoughtless:
    """The base of these agents.

    Args:
        seed: of the agent's own random generator.
    """

    obs_mode = "text"

    def __init__(self, seed: int = 0) -> None:
        self._random = np.random.default_rng(seed)

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode; what is asked is not read."""

    def overruled(self, action: Action, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Do nothing: a person's step changes no plan."""


class DoNothingAgent(_Thoughtless):
    """Looks about and does nothing, until the episode is over."""

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """Observe."""
        return Decision(Action(verbs.OBSERVE))


class AlwaysEndAgent(_Thoughtless):
    """Says at once that the task is done."""

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """End."""
        return Decision(Action(verbs.END))


class RepeatLastAgent(_Thoughtless):
    """Draws a legal action, does it three times, and draws another."""

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._last, self._left = -1, 0

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The last action once more, legal or not."""
        if not self._left:
            legal = np.flatnonzero(info["action_mask"])
            others = legal[legal != self._last]
            self._last, self._left = int(self._random.choice(others)), _LONG_ENOUGH
        self._left -= 1
        return Decision(self._last)


class TakesAllAgent(_Thoughtless):
    """Toggles, takes and puts whatever it may, goes on to what it has not been at, and ends."""

    _EAGER = (verbs.TOGGLE, verbs.PICKUP, verbs.PUT, verbs.OPEN)

    def reset(self, task: Task, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
        """Begin an episode."""
        self._done: set[int] = set()

    def act(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Decision:
        """The first legal action in the order of its verbs that it has not done yet."""
        fresh = [k for k in np.flatnonzero(info["action_mask"]).tolist() if k not in self._done]
        for verb in (*self._EAGER, verbs.NAVIGATE):
            for number in fresh:
                if ACTIONS[number].verb == verb and info["steps"] < info["max_steps"] - 1:
                    self._done.add(number)
                    return Decision(number)
        return Decision(INDEX[Action(verbs.END)])
