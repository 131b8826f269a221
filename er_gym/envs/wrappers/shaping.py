"""Reward shaping: each key action is rewarded at once, and the best policies stay the same."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
from gymnasium.utils import RecordConstructorArgs

from er_gym.envs.arguments import number
from er_gym.envs.wrappers.base import TaskWrapper, info_entry


def potential(info: Mapping[str, Any]) -> float:
    """Minus the share of the task's key actions that is left, in [-1, 0].

    Raises:
        ValueError: ``info`` does not come from an er-gym environment.
    """
    left, done = (int(info_entry(info, f"key_actions_{state}")) for state in ("left", "done"))
    return -left / max(left + done, 1)


class KeyActionShaping(TaskWrapper, RecordConstructorArgs):
    """Adds potential-based shaping (Ng, Harada and Russell, ICML 1999) to the reward.

    The potential is Φ(s) = -scale × (key actions left / key actions of the task). A step from s to
    s' gets γ Φ(s') − Φ(s) more. Φ is 0 where an episode has terminated, whatever is left. Φ keeps
    its value where an episode is truncated, since the learner bootstraps there. The discounted sum
    of what an episode of T steps gets more is γ^T Φ(s_T) − Φ(s_0). For an episode that terminates,
    this sum does not depend on the actions, so the best policies stay the best. This holds if
    gamma is the learner's own discount, and for truncated episodes if the learner bootstraps there.

    **For training only, never for evaluation.** The shaped reward reveals how many key actions are
    left, which the agent cannot observe. Returns with and without shaping cannot be compared: a
    step that ends an episode early gets back the whole remaining potential.
    ``info["unshaped_reward"]`` keeps the environment's own reward of each step, 0 at ``reset``.
    Evaluate in an environment without this wrapper, or with ``scale=0``.
    """

    looks_after_step = True

    def __init__(self, env: gymnasium.Env[Any, Any], gamma: float, scale: float = 1.0) -> None:
        """Wrap an environment.

        Args:
            env: one of er-gym's, wrapped or not.
            gamma: the learner's own discount γ, from 0 to 1.
            scale: the total that all key actions of a task are worth, 0 or more; 0 leaves the
                reward unchanged.

        Raises:
            ValueError: gamma or scale is out of its range.
        """
        gamma = number("gamma", gamma, 0, 1, allowed="the learner's discount, from 0 to 1")
        scale = number("scale", scale, 0, allowed="a finite number, 0 or more")
        RecordConstructorArgs.__init__(self, gamma=gamma, scale=scale)
        TaskWrapper.__init__(self, env)
        self._gamma, self._scale = gamma, scale
        self._potential = 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Any, dict[str, Any]]:
        """Begin an episode."""
        obs, info = self.env.reset(seed=seed, options=options)
        self._potential = self._scale * potential(info)
        return obs, {**info, "unshaped_reward": 0.0}

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Do an action; ``info["unshaped_reward"]`` is the environment's own reward for it."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        before = self._potential
        self._potential = 0.0 if terminated else self._scale * potential(info)
        shaped = float(reward) + self._gamma * self._potential - before
        return obs, shaped, terminated, truncated, {**info, "unshaped_reward": float(reward)}
