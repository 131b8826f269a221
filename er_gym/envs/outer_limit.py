"""Reads the step limit of a ``TimeLimit`` that Gymnasium has wrapped around an environment.

``gymnasium.make(ID, max_episode_steps=5)`` and a spec with a limit wrap the environment in a
``TimeLimit``, as a user can. The environment does not know its wrappers, so it would report more
steps left than there are. But the wrapper's ``reset`` calls the environment's ``reset``, so the
limit is found by searching the call stack for it.
"""

from __future__ import annotations

import sys
from typing import Any

import gymnasium
from gymnasium.wrappers import TimeLimit

_RESET = TimeLimit.reset.__code__


def outer_step_limit(env: gymnasium.Env[Any, Any]) -> int | None:
    """The number of steps after which a ``TimeLimit`` around ``env`` will cut the episode that is
    being begun now; None without one.

    To be called from ``env.reset``.
    """
    limits = []
    frame = sys._getframe(1)
    while frame.f_back is not None:
        frame = frame.f_back
        if frame.f_code is _RESET:
            limit = frame.f_locals["self"]
            # Another environment may be playing in the reset of a limited one.
            if limit.unwrapped is env:
                limits.append(int(limit._max_episode_steps))
    return min(limits, default=None)
