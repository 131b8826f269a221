"""er-gym: household search, manipulation, transport and composite tasks in AI2-THOR rooms.

Importing it registers the environments::

    import gymnasium, er_gym
    env = gymnasium.make("ER-SingleSearch-v0")
"""

from typing import Any

from er_gym.envs.registration import register_all

__all__ = ["EmbodiedEnv", "make_controller", "thor_executable"]
__version__ = "0.1.0"

_LAZY = {
    "EmbodiedEnv": "er_gym.envs.embodied_env",
    "make_controller": "er_gym.thor",
    "thor_executable": "er_gym.thor",
}

register_all()


def __getattr__(name: str) -> Any:
    # The AI2-THOR client takes half a second to import; registering environments needs none of it.
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_LAZY[name]), name)
