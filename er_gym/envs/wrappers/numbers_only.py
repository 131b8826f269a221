"""A wrapper that leaves texts out of ``info``, for wrappers that accept numbers only."""

from __future__ import annotations

from typing import Any

import gymnasium
from gymnasium.utils import RecordConstructorArgs

from er_gym.envs.wrappers.base import TaskWrapper


class NumbersOnly(TaskWrapper, RecordConstructorArgs):
    """Leaves the texts out of ``info``: feedback, names, reasons.

    Gymnasium's ``NumpyToTorch`` and similar wrappers cannot make a tensor of a text. Around one
    environment they garble the texts of ``info``. Around a vector environment, which gathers texts
    in arrays of objects, they fail. The texts are still available from ``env.unwrapped``.
    """

    def __init__(self, env: gymnasium.Env[Any, Any]) -> None:
        """Wrap an environment; any will do."""
        RecordConstructorArgs.__init__(self)
        TaskWrapper.__init__(self, env)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        obs, info = self.env.reset(seed=seed, options=options)
        return obs, _numbers(info)

    def step(self, action: Any) -> tuple[Any, Any, bool, bool, dict[str, Any]]:
        """Do an action."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        return obs, reward, terminated, truncated, _numbers(info)


def _numbers(info: dict[str, Any]) -> dict[str, Any]:
    return {name: value for name, value in info.items() if not isinstance(value, str)}
