"""Calls in the wrong order, invalid arguments, and copies of environments."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import gymnasium
import numpy as np
import pytest

from er_gym.envs.actions import ACTIONS
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.errors import ResetNeeded
from er_gym.envs.wrappers import InstructionEmbedding, KeyActionShaping
from er_gym.sim import settings
from er_gym.sim.render.panda import DEVICES
from er_gym.thor import LIGHTS, RENDER_DEVICES

ASKED: dict[str, Callable[[Any], object]] = {
    "step": lambda env: env.step(0),
    "render": lambda env: env.render(),
    "action_masks": lambda env: env.action_masks(),
    "task": lambda env: env.task,
    "agent_pose": lambda env: env.agent_pose,
    "objects": lambda env: env.objects,
    "unmet_now": lambda env: env.unmet_now,
}


@pytest.mark.parametrize("asked", ASKED)
def test_out_of_turn(asked: str) -> None:
    env = EmbodiedEnv(obs_mode="text", render_mode="rgb_array", width=64, height=36)
    with pytest.raises(ResetNeeded, match=r"no episode has begun: call reset\(\)"):
        ASKED[asked](env)
    env.reset(seed=0)
    ASKED[asked](env)
    env.close()
    with pytest.raises(ResetNeeded, match=r"the environment is closed: call reset\(\)"):
        ASKED[asked](env)
    env.reset(seed=0)
    ASKED[asked](env)
    env.close()


def test_wrappers_and_vectors_ask_as_well() -> None:
    env = KeyActionShaping(InstructionEmbedding(EmbodiedEnv(obs_mode="state")), gamma=0.9)
    with pytest.raises(ResetNeeded):
        env.action_masks()
    vec = gymnasium.make_vec("ER-SinglePickup-v0", 2, vectorization_mode="sync", obs_mode="state")
    with pytest.raises(ResetNeeded):
        vec.get_attr("task")
    vec.close()


@pytest.mark.parametrize(
    ("name", "value", "allowed"),
    [
        ("max_steps", 0, "max_steps is 0; give a whole number from 1"),
        ("max_steps", True, "max_steps is True; give a whole number from 1"),
        ("step_penalty", float("nan"), "step_penalty is nan; give a number from 0"),
        ("illegal_penalty", "1", "illegal_penalty is '1'; give a number from 0"),
        ("illegal_penalty", 10**400, "illegal_penalty is 1000.*; give a number from 0"),
        ("width", 10**6, "width is 1000000; give a whole number from 1 to 4096"),
        ("field_of_view", 180, "field_of_view is 180; give a number between 0 and 180"),
        ("grid_size", 0, "grid_size is 0; give a number from 0.01 to 5"),
        ("visibility_distance", None, "visibility_distance is None; give a number above 0"),
        ("annotate", 1, "annotate is 1; give True or False"),
        ("render_device", "tpu", "unknown render_device 'tpu'; choose one of: cpu, gpu"),
        ("light", "dim", "unknown light 'dim'; choose one of: soft, flat"),
        ("backend", ["unity"], "unknown backend .*; choose one of: embedded, unity"),
        ("protocol", None, "unknown protocol None; choose one of: default, paper"),
        ("obs_mode", 3, "unknown obs_mode 3; join any of"),
        ("episode_source", np.arange(3), "is not a source of episodes"),
    ],
)
def test_invalid_arguments_of_an_environment(name: str, value: Any, allowed: str) -> None:
    with pytest.raises(ValueError, match=allowed):
        EmbodiedEnv(**{name: value})


def test_the_devices_and_lights_are_those_of_the_engine() -> None:
    assert tuple(DEVICES) == RENDER_DEVICES
    assert settings.LIGHTS == LIGHTS


def test_a_reset_that_is_refused_leaves_the_episode_as_it_was() -> None:
    env, twin = (EmbodiedEnv(obs_mode="text") for _ in range(2))
    for each in (env, twin):
        each.reset(seed=1)
    for options in ("task", {"tasks": 1}, {1: 1, "a": 1}, {"task": "none"}, {"scene": ""}):
        with pytest.raises(ValueError, match=r"option|no task"):
            env.reset(options=options)  # type: ignore[arg-type]
    assert env.step("observe")[0] == twin.step("observe")[0]


def roundtrip(env: Any) -> Any:
    return pickle.loads(pickle.dumps(env))


@pytest.mark.parametrize(
    ("copied", "protocol"),
    [(copy.deepcopy, "default"), (roundtrip, "default"), (roundtrip, "paper")],
)
def test_a_copy_goes_on_with_the_episode_and_into_the_next(
    copied: Callable[[Any], Any], protocol: str
) -> None:
    made = EmbodiedEnv(obs_mode="rgb+state+text", width=64, height=36, protocol=protocol)
    env = InstructionEmbedding(made)
    env.reset(seed=2)
    random = np.random.default_rng(0)

    def legal() -> Any:
        return np.array([random.choice(np.flatnonzero(env.action_masks()))])

    for action in (legal(), "hm", "open Fridge", legal(), "observe"):
        env.step(action)
    twin = copied(env)
    for number in range(12):
        action = "end" if number == 6 else legal()
        one, other = env.step(action), twin.step(action)
        assert one[1:4] == other[1:4]
        if one[2] or one[3]:
            one, other = env.reset(), twin.reset()
        assert all(np.array_equal(one[0][key], other[0][key]) for key in one[0])
    env.close()
    twin.close()


def test_an_episode_of_unity_says_that_it_cannot_be_copied() -> None:
    env = EmbodiedEnv(obs_mode="text", backend="unity")
    copy.deepcopy(env)  # nothing has begun
    env._no_episode = ""  # as if one had; there is no Unity here
    with pytest.raises(gymnasium.error.Error, match=r"'unity' cannot be copied.*before reset\(\)"):
        copy.deepcopy(env)


def test_returned_values_belong_to_the_caller() -> None:
    env, twin = (
        EmbodiedEnv(obs_mode="rgb", width=64, height=36, render_mode="rgb_array") for _ in range(2)
    )
    env.reset(seed=1)
    twin.reset(seed=1)
    for _ in range(2):
        obs, _, _, _, info = env.step("observe")
        twin.step("observe")
        for array in (obs["rgb"], env.render(), *info.values(), *env.details["views"].values()):
            if isinstance(array, np.ndarray):
                array[...] = 0
        for entry in env.objects:
            entry["objectId"] = ""  # type: ignore[index]
        assert (env.render() == twin.render()).all()
        assert list(env.objects) == list(twin.objects)
    one, other = env.step("open Fridge"), twin.step("open Fridge")
    assert (one[0]["rgb"] == other[0]["rgb"]).all()
    env.close()
    twin.close()


def test_threads_that_share_an_environment_wait_for_each_other() -> None:
    env = EmbodiedEnv(obs_mode="state")
    env.reset(seed=0)

    def play(seed: int) -> int:
        done, random = 0, np.random.default_rng(seed)
        for _ in range(40):
            try:
                *_, info = env.step(int(random.integers(len(ACTIONS))))
                done += info["steps"] > 0
            except ResetNeeded:
                env.reset()
        return done

    with ThreadPoolExecutor(4) as pool:
        assert sum(pool.map(play, range(4))) > 100
    env.close()
