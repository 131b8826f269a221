"""What a try is, and the environments and comparisons that tries share."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import gymnasium
import numpy as np

import er_gym  # noqa: F401  (registers the environments)
from er_gym.envs.actions import INDEX, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.wrappers import InstructionEmbedding, KeyActionShaping
from er_gym.tasks import load_suite

ENV_ID = "ER-SinglePickup-v0"
SMALL = {"width": 64, "height": 36}
TASKS = load_suite("mini").tasks
ALL_OBS = "rgb+state+text"
OBSERVE = INDEX[Action("observe")]
NAN = float("nan")


class Try(NamedTuple):
    """A misuse: its name, its function, the error that it must raise (None: no error), and a part
    of the message.
    """

    name: str
    do: Callable[[], object]
    raises: type[Exception] | tuple[type[Exception], ...] | None = None
    says: str = ""


def require(holds: object, otherwise: str) -> None:
    if not holds:
        raise AssertionError(otherwise)


def new_env(**arguments: Any) -> EmbodiedEnv:
    return EmbodiedEnv(**{"obs_mode": "text", **SMALL, **arguments})


def begun_env(**arguments: Any) -> EmbodiedEnv:
    env = new_env(**arguments)
    env.reset(seed=3)
    return env


def same(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[k], other[k]) for k in one)


def equal(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    """Whether two results of ``step`` are equal, except for ``info``."""
    return same(one[0], other[0]) and one[1:4] == other[1:4]


def walk(envs: Sequence[Any], steps: int, seed: int = 0) -> None:
    """Do the same random actions in some environments, which must answer alike."""
    random = np.random.default_rng(seed)
    for _ in range(steps):
        mask = envs[0].get_wrapper_attr("action_masks")()
        action = int(random.choice(np.flatnonzero(mask)))
        answers = [env.step(action) for env in envs]
        require(all(equal(answers[0], each) for each in answers), "they answer differently")
        if answers[0][2] or answers[0][3]:
            began = [env.reset()[0] for env in envs]
            require(all(same(began[0], each) for each in began), "they begin differently")


def env_kinds() -> dict[str, Callable[[], Any]]:
    make = partial(gymnasium.make, ENV_ID, obs_mode="state", render_mode="rgb_array", **SMALL)
    return {
        "bare": lambda: new_env(render_mode="rgb_array"),
        "without render_mode": new_env,
        "made": make,
        "made without checks": lambda: make(disable_env_checker=True),
        "wrapped": lambda: KeyActionShaping(InstructionEmbedding(make()), 0.9),
        "wrapped, bare": lambda: InstructionEmbedding(KeyActionShaping(new_env(), 0.9)),
    }
