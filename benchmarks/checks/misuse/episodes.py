"""Calls outside of an episode, copies of environments, and sharing of results and environments."""

from __future__ import annotations

import copy
import itertools
import pickle
import threading
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np
from gymnasium import error, spaces

from benchmarks.checks.misuse.tries import (
    ALL_OBS,
    TASKS,
    Try,
    begun_env,
    env_kinds,
    new_env,
    require,
    same,
    walk,
)
from er_gym.envs.actions import ACTIONS
from er_gym.envs.errors import ResetNeeded
from er_gym.envs.generated_source import GeneratedSource
from er_gym.envs.sources import TaskList

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


def out_of_turn() -> Iterator[Try]:
    """Calls without an episode."""
    for (kind, make), (when, bring) in itertools.product(env_kinds().items(), _STATES.items()):
        env = make()
        bring(env)
        for name, ask in _ASKED.items():
            # Gymnasium's own wrapper, where there is one, raises the same error first.
            raises = error.ResetNeeded if "made" in kind or kind == "wrapped" else ResetNeeded
            yield Try(f"{name} {when}, {kind}", partial(ask, env), raises, "reset()")
        yield Try(f"reset {when}, {kind}", partial(env.reset, seed=1))
    for ending in ("end", "move forward"):
        env = begun_env()
        while not any(env.step(ending)[2:4]):
            pass
        yield Try(f"step after {ending!r}", partial(env.step, 0), ResetNeeded, "is over")
        yield Try(f"masks after {ending!r}", env.action_masks)
    env = begun_env(max_steps=1)
    env.step("observe")
    yield Try("step after the step limit", partial(env.step, 0), ResetNeeded, "step limit")


# -- copies ---------------------------------------------------------------------------------------


def _roundtrip(env: Any) -> Any:
    return pickle.loads(pickle.dumps(env))


def _copies_go_on(make: Callable[[], Any], copied: Callable[[Any], Any], steps: int) -> None:
    env = make()
    env.reset(seed=5)
    walk([env], steps)
    twin = copied(env)
    walk([env, twin], 30)


def copies() -> Iterator[Try]:
    """Copies continue the episode."""
    kinds = {
        **{f"bare {mode}": partial(new_env, obs_mode=mode) for mode in ("state", "text", ALL_OBS)},
        "paper": partial(new_env, protocol="paper"),
        "explore": partial(new_env, obs_mode=ALL_OBS, instances="explore", annotate=True),
        "a list of tasks": partial(new_env, episode_source=list(TASKS)),
        "a TaskList": partial(new_env, episode_source=TaskList(TASKS)),
        **{name: make for name, make in env_kinds().items() if "without render" not in name},
    }
    for (kind, make), copied in itertools.product(kinds.items(), (copy.deepcopy, _roundtrip)):
        for steps in (0, 7):
            does = partial(_copies_go_on, make, copied, steps)
            yield Try(f"{copied.__name__} after {steps} steps, {kind}", does)
    for copied in (copy.deepcopy, _roundtrip):
        before = copied(new_env())
        yield Try(f"{copied.__name__} before reset", partial(before.step, 0), ResetNeeded, "begun")
        closed = begun_env()
        closed.close()
        closed = copied(closed)
        yield Try(f"{copied.__name__} after close", partial(closed.step, 0), ResetNeeded, "closed")
        over = begun_env()
        over.step("end")
        yield Try(f"{copied.__name__} after the end", partial(copied(over).step, 0), ResetNeeded)
        live = partial(_copies_go_on, partial(new_env, episode_source="generate"), copied, 0)
        yield Try(f"{copied.__name__} of the generator", live)
        source = partial(_source_copied, copied)
        yield Try(f"{copied.__name__} of GeneratedSource", source)
    unity = begun_env()
    unity._backend = "unity"  # Unity is not needed: the copy is refused before any call
    yield Try("deepcopy of Unity's", partial(copy.deepcopy, unity), error.Error, "before reset()")


def _source_copied(copied: Callable[[Any], Any]) -> None:
    source = GeneratedSource(new_env())
    twin = copied(source)
    source.close()
    twin.close()


# -- returned values and threads ------------------------------------------------------------------


def _wreck(env: Any, obs: Mapping[str, Any], info: Mapping[str, Any]) -> None:
    for array in (*obs.values(), *info.values(), *env.details["views"].values()):
        if isinstance(array, np.ndarray):
            array[...] = 1


def _wrecked(by: str) -> None:
    """Compare an environment whose results are overwritten with an untouched one."""
    one, other = (new_env(obs_mode=ALL_OBS, render_mode="rgb_array") for _ in range(2))
    (obs, info), (kept, _) = one.reset(seed=4), other.reset(seed=4)
    names = [f"navigate to {name}" for name in one.details["navigable"][:4]]
    for action in ("observe", "open Fridge", *names, "open Fridge", "observe", "pickup Mug", "end"):
        if by == "answers":
            _wreck(one, obs, info)
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
        require(same(obs, kept) and mine == others, f"another answer to {action!r}")
        require((one.render() == other.render()).all(), f"another picture after {action!r}")


def _shared() -> None:
    """Four threads share an environment: each call is atomic."""
    env = begun_env(obs_mode=ALL_OBS)

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
    walk([env, begun_env(obs_mode=ALL_OBS)], 20)


def _own_threads() -> None:
    """Four threads with an environment each: none affects another."""
    found: dict[int, list[Any]] = {}

    def play(thread: int) -> None:
        env = begun_env(obs_mode=ALL_OBS)
        found[thread] = [env.step(action)[0] for action in ("observe", "move forward", "observe")]

    threads = [threading.Thread(target=play, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    play(4)
    for thread in range(4):
        pairs = zip(found[thread], found[4], strict=True)
        require(all(same(one, other) for one, other in pairs), "they see different things")


def handed_out() -> Iterator[Try]:
    """Writing into returned values, and sharing an environment."""
    for by in ("answers", "render", "objects", "info", "spaces"):
        yield Try(f"writing into {by}", partial(_wrecked, by))
    yield Try("an environment shared by threads", _shared)
    yield Try("an environment in each thread", _own_threads)
