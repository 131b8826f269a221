"""Invalid values, and unusual valid ones: actions, arguments, seeds and options."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
from gymnasium import error

from benchmarks.checks.misuse.tries import (
    NAN,
    OBSERVE,
    TASKS,
    Try,
    begun_env,
    equal,
    new_env,
    require,
    walk,
)
from er_gym.envs.actions import ACTIONS, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.wrappers import InstructionEmbedding, KeyActionShaping

# -- actions --------------------------------------------------------------------------------------

_NO_ACTIONS: dict[str, Any] = {
    "NaN": NAN, "[NaN]": np.array([NAN]), "array NaN": np.array(NAN), "inf": math.inf,
    "True": True, "numpy True": np.True_, "[True]": np.array([True]), "1.7": 1.7, "3.0": 3.0,
    "float32": np.float32(3), "[3.0]": np.array([3.0]), "None": None, "[3, 4]": [3, 4], "[3]": [3],
    "(3,)": (3,), "array [3, 4]": np.array([3, 4]), "array [[3]]": np.array([[3]]),
    "array []": np.array([], int), "-1": -1, "array [-1]": np.array([-1]), "too many": len(ACTIONS),
    "10**30": 10**30, "bytes": b"observe", "dict": {"action": 3}, "set": {3}, "object": object(),
    "array of text": np.array("observe"), "array of objects": np.array([3], object),
    "complex": 3j, "class": Action, "a million": np.zeros(10**6, int), "date": np.datetime64("now"),
}  # fmt: skip
_SAME_ACTIONS: dict[str, Any] = {
    "int": OBSERVE, "int64": np.int64(OBSERVE), "uint8": np.uint8(OBSERVE),
    "array": np.array(OBSERVE), "[int]": np.array([OBSERVE]),
    "[int32]": np.array([OBSERVE], np.int32), "text": "observe",
    "TEXT": "  OBSERVE ", "numpy text": np.str_("observe"), "Action": Action("observe"),
}  # fmt: skip
_ODD_TEXTS = (
    "", " ", "3", "nan", "\x00", "\ud800", "observe\nend", "x" * 10**6, "navigate to", "🍎" * 99,
)  # fmt: skip


def actions() -> Iterator[Try]:
    """Values that are not actions, and actions in unusual forms."""
    for protocol in ("default", "paper"):
        env, twin = begun_env(protocol=protocol), begun_env(protocol=protocol)

        def goes_on(env: EmbodiedEnv = env, twin: EmbodiedEnv = twin) -> None:
            require(equal(env.step("observe"), twin.step("observe")), "another episode")

        for name, action in _NO_ACTIONS.items():
            does = partial(env.step, action)
            yield Try(f"action {name}, {protocol}", does, error.InvalidAction, "give an index from")
        yield Try(f"a valid action after those, {protocol}", goes_on)
        if protocol == "default":
            for name, action in _SAME_ACTIONS.items():
                yield Try(f"action as {name}", partial(_is_observe, action))
        for text in _ODD_TEXTS:
            yield Try(f"text {text[:12]!r}, {protocol}", partial(_is_answered, text, protocol))
    yield Try("an invalid Action", partial(_is_answered, Action("fly", "Mug"), "default"))


def _is_observe(action: Any) -> None:
    require(equal(begun_env().step(action), begun_env().step("observe")), "another action")


def _is_answered(text: Any, protocol: str) -> None:
    env = begun_env(protocol=protocol, obs_mode="text")
    obs, _, _, _, info = env.step(text)
    require(obs["text"] in env.observation_space["text"], "not in its space")
    require(len(info["feedback"]) < 1000, "a feedback without end")
    require("Within reach" in obs["text"], "the feedback pushes out the rest")


# -- arguments ------------------------------------------------------------------------------------

_WRONG: dict[str, tuple[Any, ...]] = {
    "max_steps": (0, -1, 1.5, 10.0, True, "20", NAN, math.inf, [20], np.float64(3)),
    "step_penalty": (NAN, math.inf, -0.1, "0.1", None, True, [0.1], 10**400, 1j),
    "illegal_penalty": (NAN, -math.inf, -1, "much", None, False),
    "width": (0, -1, 1.5, "64", None, True, NAN, 10**6, 2**63),
    "height": (0, -36, 36.0, "36", None, 10**9),
    "field_of_view": (0, 180, -90, NAN, "90", None, 1e9, True),
    "grid_size": (0, -0.1, 1e-9, 6, NAN, "0.1", None),
    "visibility_distance": (0, -1, NAN, math.inf, "far", None),
    "instances": ("any", "", None, 3, ["target"], {}),
    "protocol": ("Paper", "", None, 3, ["paper"]),
    "obs_mode": ("", "rgb+", "rgb+rgb", "smell", None, 3, ["rgb"], b"rgb"),
    "backend": ("blender", "", None, 3, ["unity"]),
    "task_type": ("cleaning", "", 3, ["cleaning"], [["Search"]], b"single_search"),
    "annotate": (1, "yes", None, 0.0),
    "render_device": ("tpu", "", None, 3, ["cpu"]),
    "light": ("dim", "", None, 3, ["flat"]),
    "render_mode": ("svg", "", 3, ["rgb_array"], True),
    "episode_source": (
        None, 3, "", "no suite", "no/such/file.jsonl", Path("nowhere.json"), {"a": 1}, [1, 2],
        [None], "/tmp", "a/\x00", "x" * 5000, b"mini", object(), np.arange(3),
    ),
}  # fmt: skip

_RIGHT: tuple[tuple[str, Any], ...] = (
    ("max_steps", np.int64(5)), ("max_steps", 1), ("step_penalty", np.float32(0.5)),
    ("width", np.int16(64)), ("annotate", np.False_), ("visibility_distance", 10**6),
    ("task_type", ["single_search", "Composite"]),
)  # fmt: skip


def arguments() -> Iterator[Try]:
    """Invalid and unusual arguments of environments and wrappers."""
    for name, values in _WRONG.items():
        for value in values:
            made = partial(new_env, **{name: value})
            yield Try(f"{name}={str(value)[:20]!r}", made, ValueError)
    for name, value in _RIGHT:
        yield Try(f"{name}={value!r} is right", partial(begun_env, **{name: value}))
    yield Try("an unknown argument", lambda: new_env(max_step=3), TypeError, "max_step")
    yield Try("no tasks", lambda: begun_env(episode_source=[]), ValueError, "has no tasks")
    env = new_env()
    for gamma in (NAN, -0.1, 1.1, "1", None, True, [0.9]):
        yield Try(f"gamma={gamma!r}", partial(KeyActionShaping, env, gamma), ValueError, "discount")
    for scale in (NAN, -1, math.inf, "1", None):
        yield Try(
            f"scale={scale!r}", partial(KeyActionShaping, env, 0.9, scale), ValueError, "0 or"
        )
    for encoder in ("word2vec", "", None, 3, ["hashed"], "sentence-transformers:"):
        made = partial(InstructionEmbedding, env, encoder)
        yield Try(f"encoder={encoder!r}", made, ValueError, "unknown encoder")
    twice = partial(InstructionEmbedding, InstructionEmbedding(env))
    yield Try("the instruction twice", twice, ValueError, "once")
    for wrapper in (InstructionEmbedding, partial(KeyActionShaping, gamma=0.9)):
        yield Try(f"{wrapper} around nothing", partial(wrapper, None), (TypeError, ValueError))
    other = gymnasium.make("CartPole-v1")
    yield Try(
        "another environment's space", lambda: InstructionEmbedding(other), ValueError, "Dict"
    )
    shaped = KeyActionShaping(other, 0.9)
    yield Try("foreign info", shaped.reset, ValueError, "wrap an er-gym environment")
    yield Try("foreign masks", shaped.action_masks, AttributeError, "action_masks")


# -- reset ----------------------------------------------------------------------------------------

_OPTIONS: tuple[Any, ...] = (
    "task", 3, [("task", None)], {"tasks": 1}, {"task": 3}, {"task": "none"}, {"task": ""},
    {"task": [TASKS[0]]}, {"scene": 3}, {"scene": "FloorPlan999"}, {"scene": ""},
    {"scene": ["FloorPlan1"]}, {"suite": 3}, {"suite": "none"}, {"suite": [1]}, {1: 2, "a": 3},
    {"task": TASKS[0], "scene": "FloorPlan430"}, {"Task": TASKS[0]}, {None: None}, True,
    {"suite": "x" * 5000}, {"task": "x" * 5000}, {"scene": "x" * 5000},
)  # fmt: skip

_RIGHT_OPTIONS: tuple[Any, ...] = (
    None, {}, {"task": None}, {"scene": None}, {"task": TASKS[0]}, {"task": TASKS[0].id},
    {"suite": "mini"}, {"suite": list(TASKS)},
)  # fmt: skip


def resets() -> Iterator[Try]:
    """Odd seeds and options. The current episode continues."""
    for seed in (-1, 1.5, "3", NAN, [3], np.float64(3), b"3"):
        yield Try(f"seed={seed!r}", partial(new_env().reset, seed=seed), error.Error, "Seed")
    env, twin = begun_env(), begun_env()
    for options in _OPTIONS:
        name = f"options={str(options)[:40]}"
        yield Try(name, partial(env.reset, options=options), ValueError)
    yield Try("an episode after those", lambda: walk([env, twin], 1))
    for options in _RIGHT_OPTIONS:
        yield Try(
            f"options={str(options)[:30]} is right", partial(new_env().reset, options=options)
        )
    yield Try("two resets", lambda: (twin.reset(seed=1), twin.reset(seed=1)))
    yield Try("a large seed", lambda: new_env().reset(seed=2**100))

    def one_after_the_other() -> None:
        one, other = begun_env(), new_env()
        with np.testing.assert_raises(ValueError):
            other.reset(seed=9, options={"task": "none"})
        other.reset(seed=3)
        walk([one, other], 40)

    yield Try("a seed after a reset that failed", one_after_the_other)
