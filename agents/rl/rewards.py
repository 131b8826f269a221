"""Rewards of other packages for training: wrappers of the environment, by name."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium

from er_gym.plugins import PluginError, Registry, error_line

Env = gymnasium.Env[Any, Any]
REWARDS: Registry[Callable[[Env], Env]] = Registry(
    kind="reward wrapper",
    group="er_gym.rewards",
    own={},
    expected="a wrapper's class, or a function, that takes an environment and returns it with "
    "another reward",
    fits=callable,
)
"""The reward wrappers by name. Each is called with the environment alone."""


def with_reward(env: Env, name: str) -> Env:
    """An environment with the reward of a wrapper.

    Args:
        env: one of er-gym's.
        name: of :data:`REWARDS`, or ``package.module:Name``; ``""`` for the environment as it is.

    Raises:
        PluginError: the wrapper cannot be imported or made, or changes more than the reward.
    """
    if not name:
        return env
    make = REWARDS.get(name)
    try:
        wrapped = make(env)
    except Exception as error:  # other people's code can raise anything
        raise PluginError(
            f"reward wrapper {name!r} cannot be put around the environment ({error_line(error)}); "
            f"give {REWARDS.expected}"
        ) from error
    if not isinstance(wrapped, gymnasium.Env) or wrapped.unwrapped is not env.unwrapped:
        raise PluginError(
            f"reward wrapper {name!r} returns {type(wrapped).__name__}, which is not around the "
            f"environment; give {REWARDS.expected}"
        )
    for kind in ("observation_space", "action_space"):
        if getattr(wrapped, kind) != getattr(env, kind):
            raise PluginError(
                f"reward wrapper {name!r} changes the {kind.replace('_', ' ')}; give a wrapper "
                "that changes the reward alone"
            )
    return wrapped
