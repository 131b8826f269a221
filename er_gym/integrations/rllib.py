"""Ray RLlib: a household environment with numbers for observations and a mask of legal actions.

``register()`` makes it known to RLlib by :data:`NAME`. The observations are what RLlib's action
masking modules read: ``{"observations": …, "action_mask": …}``.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from ray.tune.registry import register_env

from er_gym.envs.actions import ACTIONS
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.wrappers import KeyActionShaping
from er_gym.integrations.scaffold import DEFAULT, Scaffold

NAME = "er-gym"
Observed = dict[str, NDArray[np.float32]]


class MaskedEnv(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment whose observation is ``observations``, a vector, and ``action_mask``.

    Args:
        env: one that observes one array, such as ``obs_mode="state"``.

    Raises:
        ValueError: it observes something else.
    """

    def __init__(self, env: gymnasium.Env[dict[str, Any], Any]) -> None:
        super().__init__(env)
        space = env.observation_space
        if not isinstance(space, spaces.Dict) or len(space) != 1:
            raise ValueError(
                f"give an environment with one observation, such as state; not {space}"
            )
        ((self._name, seen),) = space.items()
        mask = spaces.Box(0.0, 1.0, (len(ACTIONS),), np.float32)
        self.observation_space = spaces.Dict({"action_mask": mask, "observations": seen})

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observed, dict[str, Any]]:
        """Begin an episode."""
        obs, info = self.env.reset(seed=seed, options=options)
        return self._masked(obs, info), info

    def step(self, action: Any) -> tuple[Observed, float, bool, bool, dict[str, Any]]:
        """Do an action: an index, or its text."""
        obs, reward, terminated, truncated, info = self.env.step(action)
        return self._masked(obs, info), float(reward), terminated, truncated, info

    def _masked(self, obs: Mapping[str, Any], info: Mapping[str, Any]) -> Observed:
        mask = info["action_mask"].astype(np.float32)
        return {"action_mask": mask, "observations": obs[self._name]}


def make(config: Mapping[str, Any] | None = None) -> MaskedEnv:
    """The environment of a worker.

    Args:
        config: the arguments of ``EmbodiedEnv``, with ``obs_mode="state"`` unless it says
            otherwise; and ``scaffold``, of which only the reward counts here, with ``gamma`` for
            its ``shaping``.
    """
    given: dict[str, Any] = {"obs_mode": "state", **(config or {})}
    reward = Scaffold.named(given.pop("scaffold", DEFAULT)).reward
    gamma = given.pop("gamma", 1.0)
    env: gymnasium.Env[dict[str, Any], Any] = EmbodiedEnv(**given)
    if reward == "shaping":
        env = KeyActionShaping(env, gamma)
    if reward == "success":
        env = _SuccessOnly(env)
    return MaskedEnv(env)


class _SuccessOnly(gymnasium.Wrapper[Any, Any, Any, Any]):
    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        obs, _, terminated, truncated, info = self.env.step(action)
        return obs, float(info["success"]), terminated, truncated, info


def register(name: str = NAME) -> None:
    """Make the environment known to RLlib in this process and its workers."""
    register_env(name, make)
