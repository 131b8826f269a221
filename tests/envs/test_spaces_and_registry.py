"""Every registered id is a well-behaved Gymnasium environment, in every observation mode."""

from __future__ import annotations

import pickle
import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from support import run_python

import er_gym
from er_gym.envs.actions import ACTIONS
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks.types import TASK_TYPES

IDS = [task_type.env_id for task_type in TASK_TYPES]
SMALL = {"width": 96, "height": 64}


@pytest.mark.parametrize("obs_mode", ["rgb", "state", "text", "rgb+state+text"])
@pytest.mark.parametrize("env_id", IDS)
def test_check_env_finds_no_problem(env_id: str, obs_mode: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(env_id, obs_mode=obs_mode, **SMALL)
        check_env(env.unwrapped, skip_render_check=True)
        env.close()


def test_check_env_has_nothing_to_say_of_depth_and_instances() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        env = gymnasium.make(IDS[0], obs_mode="rgb+depth+instance", **SMALL)
        check_env(env.unwrapped, skip_render_check=True)
        env.close()


def test_render_returns_the_frame() -> None:
    env = gymnasium.make(IDS[0], obs_mode="state", render_mode="rgb_array", **SMALL)
    env.reset(seed=0)
    frame = env.render()
    assert frame.shape == (64, 96, 3)
    assert frame.std() > 0
    env.close()


def test_module_prefixed_id_registers_by_itself() -> None:
    code = (
        "import gymnasium; env = gymnasium.make('er_gym:ER-SingleSearch-v0', obs_mode='text');"
        "print(env.reset(seed=0)[0]['text'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.startswith("Task: ")


def test_importing_er_gym_does_not_import_the_heavy_client() -> None:
    code = "import sys, er_gym; print('ai2thor.controller' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize("mode", ["sync", "async", "vector_entry_point"])
def test_make_vec(mode: str) -> None:
    vec = gymnasium.make_vec(
        "er_gym:ER-SinglePickup-v0", num_envs=2, vectorization_mode=mode, obs_mode="state"
    )
    obs, info = vec.reset(seed=3)
    assert obs["state"].shape == (2, *vec.single_observation_space["state"].shape)
    assert info["action_mask"].shape == (2, len(ACTIONS))
    legal = [int(np.flatnonzero(mask)[0]) for mask in info["action_mask"]]
    obs, *_ = vec.step(np.array(legal))
    assert obs["state"].dtype == np.float32
    vec.close()


def test_env_pickles() -> None:
    env = EmbodiedEnv(task_type="single_toggle", obs_mode="text")
    first, _ = env.reset(seed=5)
    again, _ = pickle.loads(pickle.dumps(env)).reset(seed=5)
    assert first == again


ROLLOUT = """
import gymnasium, er_gym, hashlib, numpy as np
env = gymnasium.make("ER-PickupAndPut-v0", obs_mode="rgb+state+text", width=96, height=64)
digest = hashlib.sha256()
random = np.random.default_rng(1)
for seed in (0, 1):
    obs, info = env.reset(seed=seed)
    over = False
    while not over:
        digest.update(obs["rgb"].tobytes() + obs["state"].tobytes() + obs["text"].encode())
        action = int(random.choice(np.flatnonzero(info["action_mask"])))
        obs, reward, ended, cut, info = env.step(action)
        over = ended or cut
print(digest.hexdigest())
"""


def test_a_seed_gives_the_same_bytes_in_any_process() -> None:
    runs = [run_python(ROLLOUT, PYTHONHASHSEED=hashseed).stdout for hashseed in ("1", "2")]
    assert runs[0] == runs[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            {"obs_mode": "rgb+smell"},
            "unknown obs_mode 'rgb\\+smell'.*rgb, depth, instance, objects, state, text",
        ),
        ({"instances": "any"}, "unknown instances 'any'.*target, explore"),
        ({"render_mode": "film"}, r"unknown render_mode 'film'.*ansi, human"),
        ({"task_type": "cleaning"}, "unknown task type 'cleaning'.*single_search"),
    ],
)
def test_bad_arguments_say_what_is_allowed(arguments: dict[str, str], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        EmbodiedEnv(**arguments)


def test_unknown_backend_says_what_is_allowed() -> None:
    with pytest.raises(ValueError, match=r"unknown backend 'blender'.*embedded, unity"):
        EmbodiedEnv(task_type="single_search", backend="blender").reset()


def test_lazy_attributes() -> None:
    assert er_gym.EmbodiedEnv is EmbodiedEnv
    with pytest.raises(AttributeError):
        _ = er_gym.nonsense
