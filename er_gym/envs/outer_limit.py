"""The step limit that Gymnasium has put around an environment, as the environment learns it.

``gymnasium.make(ID, max_episode_steps=5)``, a spec with a limit and a ``TimeLimit`` by hand wrap
the environment, and tell it nothing: it would promise the agent more steps than there are. A
wrapper cannot be asked from inside. But each ``reset`` comes through it, so the callers are looked
through.
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
