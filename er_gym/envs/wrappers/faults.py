"""A wrapper that adds faults to an environment that was made without them."""

from __future__ import annotations

from typing import Any

import gymnasium
from gymnasium.utils import RecordConstructorArgs

from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.faults import Faults
from er_gym.envs.wrappers.base import TaskWrapper


class FaultInjection(TaskWrapper, RecordConstructorArgs):
    """Lets actions go wrong, as ``EmbodiedEnv(faults=…)`` does (:mod:`er_gym.envs.faults`).

    The wrapper only sets the environment's fault rates. They replace the rates with which the
    environment was made, from the next ``reset`` on.
    """

    def __init__(self, env: gymnasium.Env[Any, Any], rate: Faults, seed: int | None = None) -> None:
        """Wrap an environment.

        Args:
            env: one of er-gym's, wrapped or not.
            rate: from 0 to 1 for all kinds of faults, or a rate for each kind.
            seed: chooses other faults for the same seeds of ``reset``.

        Raises:
            ValueError: the environment is none of er-gym's, or an argument is out of its range.
        """
        inner = env.unwrapped
        if not isinstance(inner, EmbodiedEnv):
            raise ValueError(
                f"{type(inner).__name__} has no faults; wrap an er-gym environment, such as "
                "gymnasium.make('ER-SinglePickup-v0')"
            )
        inner.set_faults(rate, seed=seed)
        RecordConstructorArgs.__init__(self, rate=rate, seed=seed)
        TaskWrapper.__init__(self, env)
