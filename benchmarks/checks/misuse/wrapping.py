"""Wrappers in all orders, names for ``gymnasium.make``, and vectors of environments."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import gymnasium
import numpy as np
from gymnasium import error
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FlattenObservation, RecordEpisodeStatistics, TimeLimit

from benchmarks.checks.misuse.tries import (
    ENV_ID,
    OBSERVE,
    SMALL,
    Try,
    begun_env,
    new_env,
    require,
    same,
)
from er_gym.envs.actions import INDEX, Action
from er_gym.envs.wrappers import InstructionEmbedding, KeyActionShaping

# -- wrappers and the registry --------------------------------------------------------------------

_LIMIT = 4
VECTORS = ("sync", "async", "vector_entry_point")
"""Gymnasium's ways to make a vector environment."""
_WRAPPERS: dict[str, Callable[[Any], Any]] = {
    "shaping": lambda env: KeyActionShaping(env, 0.9),
    "instruction": InstructionEmbedding,
    "limit": lambda env: TimeLimit(env, _LIMIT),
    "statistics": RecordEpisodeStatistics,
    "flat": FlattenObservation,
}


def _form(info: Mapping[str, Any]) -> dict[str, object]:
    """The types of plain values, and the shapes of arrays."""
    for name, value in info.items():
        plain = isinstance(value, bool | int | float | str | np.ndarray | dict)
        require(plain, f"info[{name!r}] is no plain data")
    return {
        name: (value.dtype, value.shape) if isinstance(value, np.ndarray) else type(value)
        for name, value in info.items()
    }


def _in_order(names: Sequence[str]) -> None:
    env: Any = new_env(obs_mode="state")
    for name in names:
        env = _WRAPPERS[name](env)
    obs, info = env.reset(seed=2)
    form = _form(info)
    if "limit" in names:
        require(info["max_steps"] == _LIMIT + 1, f"a limit of {info['max_steps']} steps is told")
    for _ in range(6):
        require(obs in env.observation_space, "not in its space")
        require(form.items() <= _form(info).items(), "info has another form")
        mask = env.get_wrapper_attr("action_masks")()
        require((mask == info["action_mask"]).all(), "another mask")
        obs, _, ended, cut, info = env.step(int(np.flatnonzero(mask)[-1]))
        if ended or cut:
            obs, info = env.reset()
    env.close()


def orders() -> Iterator[Try]:
    """Wrappers in all orders."""
    for count in (2, 3, 4):
        for names in itertools.permutations(
            ("shaping", "instruction", "limit", "statistics"), count
        ):
            yield Try(" around ".join(reversed(names)), partial(_in_order, names))
    yield Try("flat around instruction", partial(_in_order, ("shaping", "instruction", "flat")))
    yield Try("instruction around flat", partial(_in_order, ("flat", "instruction")), ValueError)


_NO_IDS = (
    "ER-SinglePickup-v1", "ER-SinglePickup-v99", "ER-singlepickup-v0", "ER-Nothing-v0",
    "ER-SinglePickup-v", "ER-SinglePickup-vv0", "ER-SinglePickup--v0", "", "er_gym:",
    "er_gym:ER-Nothing-v0", "no_gym:ER-SinglePickup-v0", "ER-SinglePickup-v0 ",
)  # fmt: skip


def registry() -> Iterator[Try]:
    """Names, versions and arguments of ``gymnasium.make``."""
    for name in _NO_IDS:
        yield Try(f"make({name!r})", partial(gymnasium.make, name), (error.Error, ImportError))
    wrong: tuple[dict[str, Any], ...] = (
        {"width": "x"}, {"obs_mode": 3}, {"max_steps": 0}, {"task_type": 7}, {"colour": 3},
    )  # fmt: skip
    for arguments in wrong:
        raises = (ValueError, TypeError)  # TypeError is Python's, for unknown names
        yield Try(f"make(**{arguments})", partial(gymnasium.make, ENV_ID, **arguments), raises)
    for name in ("ER-SinglePickup-v0", f"er_gym:{ENV_ID}", "ER-SinglePickup"):
        yield Try(f"make({name!r}) is right", partial(gymnasium.make, name, obs_mode="text"))
    for mode in ("state", "text", "rgb"):
        env = gymnasium.make(ENV_ID, obs_mode=mode, render_mode="rgb_array", **SMALL)
        yield Try(f"check_env, {mode}", partial(check_env, env.unwrapped))


# -- vectors --------------------------------------------------------------------------------------


def _sb3(kind: str) -> Any:
    from stable_baselines3.common import vec_env

    make = partial(gymnasium.make, ENV_ID, obs_mode="state")
    if kind == "DummyVecEnv":
        return vec_env.DummyVecEnv([make] * 2)
    return vec_env.SubprocVecEnv([make] * 2, start_method="fork")


def _vector_plays(make: Callable[[], Any]) -> None:
    vec = make()
    try:
        vec.reset(seed=1) if isinstance(vec, gymnasium.vector.VectorEnv) else vec.reset()
        for _ in range(30):
            vec.step(np.full(2, OBSERVE))
    finally:
        vec.close()


def _vector_tells(mode: str) -> None:
    """Texts and the step limit are those of the environments."""
    vec = gymnasium.make_vec(
        ENV_ID, 2, vectorization_mode=mode, obs_mode="text", max_episode_steps=3
    )
    try:
        obs, info = vec.reset(seed=[1, 2])
        for steps in (1, 2, 3):
            for text, feedback in zip(obs["text"], info["feedback"], strict=True):
                require(f"Step {steps} of 4. {feedback}" in text, f"the text is {text[:80]!r}")
            obs, _, _, cut, info = vec.step(np.full(2, OBSERVE))
        require(cut.all(), "the limit does not hold")
    finally:
        vec.close()


def _vector_before(make: Callable[[], Any], ask: Callable[[Any], object]) -> None:
    vec = make()
    try:
        ask(vec)
    finally:
        vec.close()


def vectors() -> Iterator[Try]:
    """Vector environments of Gymnasium and Stable-Baselines3."""
    kinds: dict[str, Callable[[], Any]] = {
        mode: partial(gymnasium.make_vec, ENV_ID, 2, vectorization_mode=mode, obs_mode="state")
        for mode in VECTORS
    }
    kinds |= {kind: partial(_sb3, kind) for kind in ("DummyVecEnv", "SubprocVecEnv")}
    for name, make in kinds.items():
        yield Try(f"{name} plays", partial(_vector_plays, make))
    for mode in VECTORS:
        yield Try(f"{mode} tells what its environments tell", partial(_vector_tells, mode))
    asked: dict[str, Callable[[Any], object]] = {
        **{f"get_attr {name}": lambda vec, n=name: vec.get_attr(n) for name in ("task", "objects")},
        "masks": lambda vec: getattr(vec, "env_method", getattr(vec, "call", None))("action_masks"),
        "step": lambda vec: vec.step(np.full(2, OBSERVE)),
    }
    for name in (*VECTORS, "DummyVecEnv"):  # SubprocVecEnv's workers end at any error
        for what, ask in asked.items():
            if name == "async" and what == "step":
                continue  # Gymnasium's own AsyncVectorEnv has no observation to step from
            does = partial(_vector_before, kinds[name], ask)
            yield Try(f"{what} before reset, {name}", does, error.ResetNeeded, "reset()")
    made = partial(gymnasium.make_vec, ENV_ID, 2, vectorization_mode="async", **SMALL)
    yield Try("async with pictures and text", partial(_vector_plays, made))

    def vector_copy() -> None:
        vec = kinds["sync"]()
        vec.reset(seed=2)
        vec.step(np.full(2, OBSERVE))
        twin = copy.deepcopy(vec)
        for _ in range(5):
            mine, its = (
                each.step(np.full(2, INDEX[Action("move forward")])) for each in (vec, twin)
            )
            require(same(mine[0], its[0]), "the copy sees something else")

    yield Try("deepcopy of a vector", vector_copy)

    def predicted() -> None:
        from sb3_contrib import MaskablePPO
        from stable_baselines3.common.vec_env import DummyVecEnv

        vec = DummyVecEnv([partial(gymnasium.make, ENV_ID, obs_mode="state")])
        model = MaskablePPO("MultiInputPolicy", vec, n_steps=2, batch_size=2, device="cpu")
        env = begun_env(obs_mode="state")
        obs, _ = env.reset(seed=1)
        masks = env.action_masks()
        env.step(model.predict(obs, action_masks=masks)[0])
        env.reset(seed=1)  # it may have been "end"
        batch = {name: value[None] for name, value in obs.items()}
        env.step(model.predict(batch, action_masks=masks[None])[0])

    yield Try("what predict gives", predicted)
