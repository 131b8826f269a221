"""Misuses the Gymnasium interface in some 600 ways, and looks how it answers.

    python -m benchmarks.checks.misuse [WORD …]

Each try whose name holds the given words does something wrong, or something right that is easily
got wrong. A wrong one must end in the error that is named, in one line of no more than 400
characters; a right one must not fail, and must come out as it says. Prints what falls short; the
exit code says whether anything does. Takes half a minute.
"""

from __future__ import annotations

import copy
import itertools
import math
import pickle
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import gymnasium
import numpy as np
from gymnasium import error, spaces
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import FlattenObservation, RecordEpisodeStatistics, TimeLimit

import er_gym  # noqa: F401  (registers the environments)
from benchmarks.checks.tally import Tally
from er_gym.envs.actions import ACTIONS, INDEX, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.errors import ResetNeeded
from er_gym.envs.generated_source import GeneratedSource
from er_gym.envs.sources import TaskList
from er_gym.envs.wrappers import InstructionEmbedding, KeyActionShaping
from er_gym.tasks import load_suite

_LONGEST = 400
_SMALL = {"width": 64, "height": 36}
_TASKS = load_suite("mini").tasks
_ALL = "rgb+state+text"
_NAN = float("nan")


class Try(NamedTuple):
    """A misuse: what it is, how it is done, the error that it must end in (None: it must not), and
    a part of its message."""

    name: str
    do: Callable[[], object]
    raises: type[Exception] | tuple[type[Exception], ...] | None = None
    says: str = ""


def check(words: Sequence[str] = ()) -> Tally:
    """Try all, and print what falls short."""
    warnings.simplefilter("ignore")
    began = time.monotonic()
    count = short = 0
    for group in GROUPS:
        for each in group():
            if all(word in each.name for word in words):
                count += 1
                problem = _problem(each)
                if problem:
                    short += 1
                    print(f"{each.name}: {problem}", flush=True)
    return Tally("misuses", count, short, time.monotonic() - began)


def main(words: Sequence[str]) -> int:
    """Try all, and print what falls short, and how much."""
    tally = check(words)
    print(tally)
    return int(tally.short > 0)


def _problem(each: Try) -> str:
    """What is wrong with how it ends, "" if nothing is."""
    try:
        each.do()
    except Exception as caught:  # whatever it is, it is judged
        said = str(caught)
        if each.raises is None or not isinstance(caught, each.raises):
            return f"{type(caught).__name__}: {said[:300]}"
        if len(said) > _LONGEST or "\n" in said:
            return f"its message is too long, or has several lines: {said[:300]!r}"
        return "" if each.says in said else f"does not say {each.says!r}: {said}"
    return "" if each.raises is None else "no error"


def _require(holds: object, otherwise: str) -> None:
    if not holds:
        raise AssertionError(otherwise)


def _made(**arguments: Any) -> EmbodiedEnv:
    return EmbodiedEnv(**{"obs_mode": "text", **_SMALL, **arguments})


def _begun(**arguments: Any) -> EmbodiedEnv:
    env = _made(**arguments)
    env.reset(seed=3)
    return env


def _same(one: Mapping[str, Any], other: Mapping[str, Any]) -> bool:
    return one.keys() == other.keys() and all(np.array_equal(one[k], other[k]) for k in one)


def _equal(one: tuple[Any, ...], other: tuple[Any, ...]) -> bool:
    """Whether two answers of ``step`` are, but for ``info``."""
    return _same(one[0], other[0]) and one[1:4] == other[1:4]


def _walk(envs: Sequence[Any], steps: int, seed: int = 0) -> None:
    """Do the same in all of some environments: they must answer alike."""
    random = np.random.default_rng(seed)
    for _ in range(steps):
        mask = envs[0].get_wrapper_attr("action_masks")()
        action = int(random.choice(np.flatnonzero(mask)))
        answers = [env.step(action) for env in envs]
        _require(all(_equal(answers[0], each) for each in answers), "they answer differently")
        if answers[0][2] or answers[0][3]:
            began = [env.reset()[0] for env in envs]
            _require(all(_same(began[0], each) for each in began), "they begin differently")


# -- actions -------------------------------------------------------------------------------------

_NO_ACTIONS: dict[str, Any] = {
    "NaN": _NAN, "[NaN]": np.array([_NAN]), "array NaN": np.array(_NAN), "inf": math.inf,
    "True": True, "numpy True": np.True_, "[True]": np.array([True]), "1.7": 1.7, "3.0": 3.0,
    "float32": np.float32(3), "[3.0]": np.array([3.0]), "None": None, "[3, 4]": [3, 4], "[3]": [3],
    "(3,)": (3,), "array [3, 4]": np.array([3, 4]), "array [[3]]": np.array([[3]]),
    "array []": np.array([], int), "-1": -1, "array [-1]": np.array([-1]), "too many": len(ACTIONS),
    "10**30": 10**30, "bytes": b"observe", "dict": {"action": 3}, "set": {3}, "object": object(),
    "array of text": np.array("observe"), "array of objects": np.array([3], object),
    "complex": 3j, "class": Action, "a million": np.zeros(10**6, int), "date": np.datetime64("now"),
}  # fmt: skip
_INDEX, _FORWARD = INDEX[Action("observe")], INDEX[Action("move forward")]
_SAME_ACTIONS: dict[str, Any] = {
    "int": _INDEX, "int64": np.int64(_INDEX), "uint8": np.uint8(_INDEX), "array": np.array(_INDEX),
    "[int]": np.array([_INDEX]), "[int32]": np.array([_INDEX], np.int32), "text": "observe",
    "TEXT": "  OBSERVE ", "numpy text": np.str_("observe"), "Action": Action("observe"),
}  # fmt: skip
_ODD_TEXTS = (
    "", " ", "3", "nan", "\x00", "\ud800", "observe\nend", "x" * 10**6, "navigate to", "🍎" * 99,
)  # fmt: skip


def actions() -> Iterator[Try]:
    """What is no action, and what is one in disguise."""
    for protocol in ("default", "paper"):
        env, twin = _begun(protocol=protocol), _begun(protocol=protocol)

        def goes_on(env: EmbodiedEnv = env, twin: EmbodiedEnv = twin) -> None:
            _require(_equal(env.step("observe"), twin.step("observe")), "another episode")

        for name, action in _NO_ACTIONS.items():
            does = partial(env.step, action)
            yield Try(f"action {name}, {protocol}", does, error.InvalidAction, "give an index from")
        yield Try(f"action after all that, {protocol}", goes_on)
        if protocol == "default":
            for name, action in _SAME_ACTIONS.items():
                yield Try(f"action as {name}", partial(_is_observe, action))
        for text in _ODD_TEXTS:
            yield Try(f"text {text[:12]!r}, {protocol}", partial(_is_answered, text, protocol))
    yield Try("an Action that is none", partial(_is_answered, Action("fly", "Mug"), "default"))


def _is_observe(action: Any) -> None:
    _require(_equal(_begun().step(action), _begun().step("observe")), "another action")


def _is_answered(text: Any, protocol: str) -> None:
    env = _begun(protocol=protocol, obs_mode="text")
    obs, _, _, _, info = env.step(text)
    _require(obs["text"] in env.observation_space["text"], "not in its space")
    _require(len(info["feedback"]) < 1000, "a feedback without end")
    _require("Within reach" in obs["text"], "the feedback pushes out the rest")


# -- arguments -----------------------------------------------------------------------------------

_WRONG: dict[str, tuple[Any, ...]] = {
    "max_steps": (0, -1, 1.5, 10.0, True, "20", _NAN, math.inf, [20], np.float64(3)),
    "step_penalty": (_NAN, math.inf, -0.1, "0.1", None, True, [0.1], 10**400, 1j),
    "illegal_penalty": (_NAN, -math.inf, -1, "much", None, False),
    "width": (0, -1, 1.5, "64", None, True, _NAN, 10**6, 2**63),
    "height": (0, -36, 36.0, "36", None, 10**9),
    "field_of_view": (0, 180, -90, _NAN, "90", None, 1e9, True),
    "grid_size": (0, -0.1, 1e-9, 6, _NAN, "0.1", None),
    "visibility_distance": (0, -1, _NAN, math.inf, "far", None),
    "instances": ("any", "", None, 3, ["target"], {}),
    "protocol": ("Paper", "", None, 3, ["paper"]),
    "obs_mode": ("", "rgb+", "rgb+rgb", "smell", None, 3, ["rgb"], b"rgb"),
    "backend": ("blender", "", None, 3, ["unity"]),
    "task_type": ("cleaning", "", 3, ["single_search"], b"single_search"),
    "annotate": (1, "yes", None, 0.0),
    "render_device": ("tpu", "", None, 3, ["cpu"]),
    "render_mode": ("human", "", 3, ["rgb_array"], True),
    "episode_source": (
        None, 3, "", "no suite", "no/such/file.jsonl", Path("nowhere.json"), {"a": 1}, [1, 2],
        [None], "/tmp", "a/\x00", "x" * 5000, b"mini", object(), np.arange(3),
    ),
}  # fmt: skip

_RIGHT: tuple[tuple[str, Any], ...] = (
    ("max_steps", np.int64(5)), ("max_steps", 1), ("step_penalty", np.float32(0.5)),
    ("width", np.int16(64)), ("annotate", np.False_), ("visibility_distance", 10**6),
)  # fmt: skip


def arguments() -> Iterator[Try]:
    """What environments and wrappers cannot be made with."""
    for name, values in _WRONG.items():
        for value in values:
            made = partial(_made, **{name: value})
            yield Try(f"{name}={str(value)[:20]!r}", made, ValueError)
    for name, value in _RIGHT:
        yield Try(f"{name}={value!r} is right", partial(_begun, **{name: value}))
    yield Try("an argument that is none", lambda: _made(max_step=3), TypeError, "max_step")
    yield Try("no tasks", lambda: _begun(episode_source=[]), ValueError, "has no tasks")
    env = _made()
    for gamma in (_NAN, -0.1, 1.1, "1", None, True, [0.9]):
        yield Try(f"gamma={gamma!r}", partial(KeyActionShaping, env, gamma), ValueError, "discount")
    for scale in (_NAN, -1, math.inf, "1", None):
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
    yield Try("another's space", lambda: InstructionEmbedding(other), ValueError, "Dict")
    shaped = KeyActionShaping(other, 0.9)
    yield Try("another's info", shaped.reset, ValueError, "wrap an er-gym environment")
    yield Try("another's masks", shaped.action_masks, AttributeError, "action_masks")


# -- before reset, after close, after the end -----------------------------------------------------

_ASKED: dict[str, Callable[[Any], object]] = {
    "step": lambda env: env.step(0),
    "render": lambda env: env.render(),
    "action_masks": lambda env: env.get_wrapper_attr("action_masks")(),
    "agent_pose": lambda env: env.get_wrapper_attr("agent_pose"),
    "objects": lambda env: env.get_wrapper_attr("objects"),
    "task": lambda env: env.get_wrapper_attr("task"),
}
_STATES: dict[str, Callable[[Any], object]] = {
    "before reset": lambda env: None,
    "after close": lambda env: (env.reset(seed=0), env.close()),
    "after close without reset": lambda env: env.close(),
    "after two closes": lambda env: (env.reset(seed=0), env.close(), env.close()),
}
_ID = "ER-SinglePickup-v0"


def _kinds() -> dict[str, Callable[[], Any]]:
    make = partial(gymnasium.make, _ID, obs_mode="state", render_mode="rgb_array", **_SMALL)
    return {
        "bare": lambda: _made(render_mode="rgb_array"),
        "without render_mode": _made,
        "made": make,
        "made without checks": lambda: make(disable_env_checker=True),
        "wrapped": lambda: KeyActionShaping(InstructionEmbedding(make()), 0.9),
        "wrapped, bare": lambda: InstructionEmbedding(KeyActionShaping(_made(), 0.9)),
    }


def out_of_turn() -> Iterator[Try]:
    """What is asked when there is no episode."""
    for (kind, make), (when, bring) in itertools.product(_kinds().items(), _STATES.items()):
        env = make()
        bring(env)
        for name, ask in _ASKED.items():
            # Gymnasium's own wrapper asks for the same error first where there is one.
            raises = error.ResetNeeded if "made" in kind or kind == "wrapped" else ResetNeeded
            yield Try(f"{name} {when}, {kind}", partial(ask, env), raises, "reset()")
        yield Try(f"reset {when}, {kind}", partial(env.reset, seed=1))
    for ending in ("end", "move forward"):
        env = _begun()
        while not any(env.step(ending)[2:4]):
            pass
        yield Try(f"step after {ending!r}", partial(env.step, 0), ResetNeeded, "is over")
        yield Try(f"masks after {ending!r}", env.action_masks)
    env = _begun(max_steps=1)
    env.step("observe")
    yield Try("step after the step limit", partial(env.step, 0), ResetNeeded, "step limit")


# -- reset ---------------------------------------------------------------------------------------

_OPTIONS: tuple[Any, ...] = (
    "task", 3, [("task", None)], {"tasks": 1}, {"task": 3}, {"task": "none"}, {"task": ""},
    {"task": [_TASKS[0]]}, {"scene": 3}, {"scene": "FloorPlan999"}, {"scene": ""},
    {"scene": ["FloorPlan1"]}, {"suite": 3}, {"suite": "none"}, {"suite": [1]}, {1: 2, "a": 3},
    {"task": _TASKS[0], "scene": "FloorPlan430"}, {"Task": _TASKS[0]}, {None: None}, True,
    {"suite": "x" * 5000}, {"task": "x" * 5000}, {"scene": "x" * 5000},
)  # fmt: skip

_RIGHT_OPTIONS: tuple[Any, ...] = (
    None, {}, {"task": None}, {"scene": None}, {"task": _TASKS[0]}, {"task": _TASKS[0].id},
    {"suite": "mini"}, {"suite": list(_TASKS)},
)  # fmt: skip


def resets() -> Iterator[Try]:
    """Odd seeds and options; what was under way goes on."""
    for seed in (-1, 1.5, "3", _NAN, [3], np.float64(3), b"3"):
        yield Try(f"seed={seed!r}", partial(_made().reset, seed=seed), error.Error, "Seed")
    env, twin = _begun(), _begun()
    for options in _OPTIONS:
        name = f"options={str(options)[:40]}"
        yield Try(name, partial(env.reset, options=options), ValueError)
    yield Try("going on after those", lambda: _walk([env, twin], 1))
    for options in _RIGHT_OPTIONS:
        yield Try(f"options={str(options)[:30]} is right", partial(_made().reset, options=options))
    yield Try("two resets", lambda: (twin.reset(seed=1), twin.reset(seed=1)))
    yield Try("a large seed", lambda: _made().reset(seed=2**100))

    def one_after_the_other() -> None:
        one, other = _begun(), _made()
        with np.testing.assert_raises(ValueError):
            other.reset(seed=9, options={"task": "none"})
        other.reset(seed=3)
        _walk([one, other], 40)

    yield Try("a seed after a reset that failed", one_after_the_other)


# -- copies --------------------------------------------------------------------------------------


def _roundtrip(env: Any) -> Any:
    return pickle.loads(pickle.dumps(env))


def _copies_go_on(make: Callable[[], Any], copied: Callable[[Any], Any], steps: int) -> None:
    env = make()
    env.reset(seed=5)
    _walk([env], steps)
    twin = copied(env)
    _walk([env, twin], 30)


def copies() -> Iterator[Try]:
    """Copies go on with the episode."""
    kinds = {
        **{f"bare {mode}": partial(_made, obs_mode=mode) for mode in ("state", "text", _ALL)},
        "paper": partial(_made, protocol="paper"),
        "explore": partial(_made, obs_mode=_ALL, instances="explore", annotate=True),
        "a list of tasks": partial(_made, episode_source=list(_TASKS)),
        "a TaskList": partial(_made, episode_source=TaskList(_TASKS)),
        **{name: make for name, make in _kinds().items() if "without render" not in name},
    }
    for (kind, make), copied in itertools.product(kinds.items(), (copy.deepcopy, _roundtrip)):
        for steps in (0, 7):
            does = partial(_copies_go_on, make, copied, steps)
            yield Try(f"{copied.__name__} after {steps} steps, {kind}", does)
    for copied in (copy.deepcopy, _roundtrip):
        before = copied(_made())
        yield Try(f"{copied.__name__} before reset", partial(before.step, 0), ResetNeeded, "begun")
        closed = _begun()
        closed.close()
        closed = copied(closed)
        yield Try(f"{copied.__name__} after close", partial(closed.step, 0), ResetNeeded, "closed")
        over = _begun()
        over.step("end")
        yield Try(f"{copied.__name__} after the end", partial(copied(over).step, 0), ResetNeeded)
        live = partial(_copies_go_on, partial(_made, episode_source="generate"), copied, 0)
        yield Try(f"{copied.__name__} of the generator", live)
        source = partial(_source_copied, copied)
        yield Try(f"{copied.__name__} of GeneratedSource", source)
    unity = _begun()
    unity._backend = "unity"  # there is none here, and to refuse needs none
    yield Try("deepcopy of Unity's", partial(copy.deepcopy, unity), error.Error, "before reset()")


def _source_copied(copied: Callable[[Any], Any]) -> None:
    source = GeneratedSource(_made())
    twin = copied(source)
    source.close()
    twin.close()


# -- what is handed out --------------------------------------------------------------------------


def _wreck(obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
    for array in (*obs.values(), info["action_mask"], *info.get("views", {}).values()):
        if isinstance(array, np.ndarray):
            array[...] = 1


def _wrecked(by: str) -> None:
    """An environment whose answers are written into, beside one whose are not."""
    one, other = (_made(obs_mode=_ALL, render_mode="rgb_array") for _ in range(2))
    (obs, info), (kept, _) = one.reset(seed=4), other.reset(seed=4)
    names = [f"navigate to {name}" for name in info["navigable"][:4]]
    for action in ("observe", "open Fridge", *names, "open Fridge", "observe", "pickup Mug", "end"):
        if by == "answers":
            _wreck(obs, info)
        elif by == "render":
            one.render()[...] = 0  # type: ignore[index]
        elif by == "objects":
            for entry in one.objects:
                entry.update(isOpen=True, isPickedUp=True, visible=True)  # type: ignore[attr-defined]
        elif by == "info":
            info.clear()
        elif by == "spaces":
            one.action_space, one.observation_space = spaces.Discrete(2), spaces.Dict({})
        (obs, *mine, info), (kept, *others, _) = one.step(action), other.step(action)
        _require(_same(obs, kept) and mine == others, f"another answer to {action!r}")
        _require((one.render() == other.render()).all(), f"another picture after {action!r}")


def _shared() -> None:
    """Four threads in one environment: each call is done as a whole."""
    env = _begun(obs_mode=_ALL)

    def play(seed: int) -> None:
        random = np.random.default_rng(seed)
        for _ in range(30):
            try:
                env.step(int(random.integers(len(ACTIONS))))
                env.action_masks()
            except ResetNeeded:
                env.reset(seed=seed)

    with ThreadPoolExecutor(4) as pool:
        list(pool.map(play, range(4)))
    env.reset(seed=3)
    _walk([env, _begun(obs_mode=_ALL)], 20)


def _own_threads() -> None:
    """An environment in each of four threads: all answer as if they were alone."""
    found: dict[int, list[Any]] = {}

    def play(thread: int) -> None:
        env = _begun(obs_mode=_ALL)
        found[thread] = [env.step(action)[0] for action in ("observe", "move forward", "observe")]

    threads = [threading.Thread(target=play, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    play(4)
    for thread in range(4):
        pairs = zip(found[thread], found[4], strict=True)
        _require(all(_same(one, other) for one, other in pairs), "they see different things")


def handed_out() -> Iterator[Try]:
    """Writing into what was handed out; sharing an environment."""
    for by in ("answers", "render", "objects", "info", "spaces"):
        yield Try(f"writing into {by}", partial(_wrecked, by))
    yield Try("an environment shared by threads", _shared)
    yield Try("an environment in each thread", _own_threads)


# -- wrappers in all orders, and the registry ------------------------------------------------------

_WRAPPERS: dict[str, Callable[[Any], Any]] = {
    "shaping": lambda env: KeyActionShaping(env, 0.9),
    "instruction": InstructionEmbedding,
    "limit": lambda env: TimeLimit(env, 4),
    "statistics": RecordEpisodeStatistics,
    "flat": FlattenObservation,
}


def _in_order(names: Sequence[str]) -> None:
    env: Any = _made(obs_mode="state")
    for name in names:
        env = _WRAPPERS[name](env)
    obs, info = env.reset(seed=2)
    for _ in range(6):
        _require(obs in env.observation_space, "not in its space")
        mask = env.get_wrapper_attr("action_masks")()
        _require((mask == info["action_mask"]).all(), "another mask")
        obs, _, ended, cut, info = env.step(int(np.flatnonzero(mask)[-1]))
        if ended or cut:
            obs, info = env.reset()
    env.close()


def orders() -> Iterator[Try]:
    """Wrappers around each other."""
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
        raises = (ValueError, TypeError)  # the latter is Python's, for names that there are not
        yield Try(f"make(**{arguments})", partial(gymnasium.make, _ID, **arguments), raises)
    for name in ("ER-SinglePickup-v0", f"er_gym:{_ID}", "ER-SinglePickup"):
        yield Try(f"make({name!r}) is right", partial(gymnasium.make, name, obs_mode="text"))
    for mode in ("state", "text", "rgb"):
        env = gymnasium.make(_ID, obs_mode=mode, render_mode="rgb_array", **_SMALL)
        yield Try(f"check_env, {mode}", partial(check_env, env.unwrapped))


# -- vectors -------------------------------------------------------------------------------------


def _sb3(kind: str) -> Any:
    from stable_baselines3.common import vec_env

    make = partial(gymnasium.make, _ID, obs_mode="state")
    if kind == "DummyVecEnv":
        return vec_env.DummyVecEnv([make] * 2)
    return vec_env.SubprocVecEnv([make] * 2, start_method="fork")


def _vector_plays(make: Callable[[], Any]) -> None:
    vec = make()
    try:
        vec.reset(seed=1) if isinstance(vec, gymnasium.vector.VectorEnv) else vec.reset()
        for _ in range(30):
            vec.step(np.full(2, _INDEX))
    finally:
        vec.close()


def _vector_before(make: Callable[[], Any], ask: Callable[[Any], object]) -> None:
    vec = make()
    try:
        ask(vec)
    finally:
        vec.close()


def vectors() -> Iterator[Try]:
    """Gymnasium's vectors and Stable-Baselines3's."""
    kinds: dict[str, Callable[[], Any]] = {
        mode: partial(gymnasium.make_vec, _ID, 2, vectorization_mode=mode, obs_mode="state")
        for mode in ("sync", "async")
    }
    kinds |= {kind: partial(_sb3, kind) for kind in ("DummyVecEnv", "SubprocVecEnv")}
    for name, make in kinds.items():
        yield Try(f"{name} plays", partial(_vector_plays, make))
    asked: dict[str, Callable[[Any], object]] = {
        **{f"get_attr {name}": lambda vec, n=name: vec.get_attr(n) for name in ("task", "objects")},
        "masks": lambda vec: getattr(vec, "env_method", getattr(vec, "call", None))("action_masks"),
        "step": lambda vec: vec.step(np.full(2, _INDEX)),
    }
    for name in ("sync", "async", "DummyVecEnv"):  # SubprocVecEnv's workers end at any error
        for what, ask in asked.items():
            if name == "async" and what == "step":
                continue  # Gymnasium's own: it has no observation to step from
            does = partial(_vector_before, kinds[name], ask)
            yield Try(f"{what} before reset, {name}", does, error.ResetNeeded, "reset()")
    made = partial(gymnasium.make_vec, _ID, 2, vectorization_mode="async", **_SMALL)
    yield Try("async with pictures and text", partial(_vector_plays, made))

    def vector_copy() -> None:
        vec = kinds["sync"]()
        vec.reset(seed=2)
        vec.step(np.full(2, _INDEX))
        twin = copy.deepcopy(vec)
        for _ in range(5):
            mine, its = (
                each.step(np.full(2, INDEX[Action("move forward")])) for each in (vec, twin)
            )
            _require(_same(mine[0], its[0]), "the copy sees something else")

    yield Try("deepcopy of a vector", vector_copy)

    def predicted() -> None:
        from sb3_contrib import MaskablePPO
        from stable_baselines3.common.vec_env import DummyVecEnv

        vec = DummyVecEnv([partial(gymnasium.make, _ID, obs_mode="state")])
        model = MaskablePPO("MultiInputPolicy", vec, n_steps=2, batch_size=2, device="cpu")
        env = _begun(obs_mode="state")
        obs, _ = env.reset(seed=1)
        masks = env.action_masks()
        env.step(model.predict(obs, action_masks=masks)[0])
        env.reset(seed=1)  # it may have been "end"
        batch = {name: value[None] for name, value in obs.items()}
        env.step(model.predict(batch, action_masks=masks[None])[0])

    yield Try("what predict gives", predicted)


GROUPS = (actions, arguments, out_of_turn, resets, copies, handed_out, orders, registry, vectors)

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
