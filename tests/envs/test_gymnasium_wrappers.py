"""Every wrapper of Gymnasium's, around one environment and around several."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import gymnasium
import imageio_ffmpeg
import numpy as np
import pytest
import torch
from gymnasium import wrappers
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.wrappers import vector

import er_gym  # noqa: F401  (registers the environments)
from er_gym.envs.actions import ACTIONS, INDEX, Action
from er_gym.envs.wrappers import NumbersOnly
from tests.support import in_one_test

ID = "ER-SinglePickup-v0"
SMALL = {"width": 48, "height": 32}
END = INDEX[Action("end")]
STEPS = 4
NOT_CONTINUOUS = "the actions are Discrete, and this wrapper is about continuous ones"
NOT_JAX = "the environment is made of NumPy's arrays, and takes no action of JAX"
Env = gymnasium.Env[Any, Any]


def everything(**arguments: Any) -> Env:
    return gymnasium.make(
        ID, **{"obs_mode": "rgb+depth+instance+objects+state+text", **SMALL, **arguments}
    )


def state(**arguments: Any) -> Env:
    return gymnasium.make(ID, **{"obs_mode": "state", **arguments})


def drawn(**arguments: Any) -> Env:
    return everything(render_mode="rgb_array", **arguments)


def picture(**arguments: Any) -> Env:
    """The observation is the picture alone."""
    env = gymnasium.make(ID, obs_mode="rgb", **SMALL, **arguments)
    space = env.observation_space["rgb"]  # type: ignore[index]
    return wrappers.TransformObservation(env, lambda obs: obs["rgb"], space)


def floats() -> Env:
    return wrappers.DtypeObservation(picture(), np.float32)


SINGLE: dict[str, Callable[[Path], Env] | str] = {
    "AtariPreprocessing": "it is about Atari games",
    "DelayObservation": lambda _: wrappers.DelayObservation(picture(), 2),
    "DtypeObservation": lambda _: wrappers.DtypeObservation(picture(), np.float32),
    "DiscretizeObservation": lambda _: wrappers.DiscretizeObservation(
        wrappers.ResizeObservation(wrappers.GrayscaleObservation(picture()), (1, 2)), 3
    ),
    "FilterObservation": lambda _: wrappers.FilterObservation(everything(), ["state", "text"]),
    "FlattenObservation": lambda _: wrappers.FlattenObservation(everything()),
    "FrameStackObservation": lambda _: wrappers.FrameStackObservation(everything(), 3),
    "GrayscaleObservation": lambda _: wrappers.GrayscaleObservation(picture()),
    "TransformObservation": lambda _: picture(),
    "MaxAndSkipObservation": lambda _: wrappers.MaxAndSkipObservation(picture(), 2),
    "NormalizeObservation": lambda _: wrappers.NormalizeObservation(picture()),
    "AddRenderObservation": lambda _: wrappers.AddRenderObservation(
        drawn(obs_mode="state"), render_only=False, obs_key="state"
    ),
    "ResizeObservation": lambda _: wrappers.ResizeObservation(picture(), (16, 24)),
    "ReshapeObservation": lambda _: wrappers.ReshapeObservation(picture(), (32 * 48, 3)),
    "RescaleObservation": lambda _: wrappers.RescaleObservation(
        floats(), np.float32(-1), np.float32(1)
    ),
    "TimeAwareObservation": lambda _: wrappers.TimeAwareObservation(
        state(max_episode_steps=9), flatten=False
    ),
    "ClipAction": NOT_CONTINUOUS,
    "DiscretizeAction": NOT_CONTINUOUS,
    "RescaleAction": NOT_CONTINUOUS,
    "TransformAction": lambda _: wrappers.TransformAction(everything(), int, None),
    "StickyAction": lambda _: wrappers.StickyAction(everything(), 0.5),
    "RepeatAction": lambda _: wrappers.RepeatAction(everything(), 2),
    "ClipReward": lambda _: wrappers.ClipReward(everything(), 0.0, 1.0),
    "TransformReward": lambda _: wrappers.TransformReward(everything(), lambda reward: -reward),
    "NormalizeReward": lambda _: wrappers.NormalizeReward(everything()),
    "TimeLimit": lambda _: wrappers.TimeLimit(everything(), STEPS),
    "Autoreset": lambda _: wrappers.Autoreset(everything()),
    "PassiveEnvChecker": lambda _: wrappers.PassiveEnvChecker(drawn()),
    "OrderEnforcing": lambda _: wrappers.OrderEnforcing(everything()),
    "RecordEpisodeStatistics": lambda _: wrappers.RecordEpisodeStatistics(everything()),
    "AddWhiteNoise": lambda _: wrappers.AddWhiteNoise(drawn(), 0.5),
    "ObstructView": lambda _: wrappers.ObstructView(drawn(), 0.5, 4),
    "RenderCollection": lambda _: wrappers.RenderCollection(drawn()),
    "RecordVideo": lambda folder: wrappers.RecordVideo(drawn(), str(folder)),
    "HumanRendering": lambda _: wrappers.HumanRendering(drawn()),
    "ArrayConversion": lambda _: wrappers.ArrayConversion(everything(), np, torch),
    "JaxToNumpy": NOT_JAX,
    "JaxToTorch": NOT_JAX,
    "NumpyToTorch": lambda _: wrappers.NumpyToTorch(everything()),
}
"""By name: around an environment; or why it does not apply."""


def vectors(**arguments: Any) -> VectorEnv[Any, Any, Any]:
    return gymnasium.make_vec(
        ID, num_envs=2, **{"obs_mode": "rgb+state+text", **SMALL, **arguments}
    )


def pictures() -> VectorEnv[Any, Any, Any]:
    return gymnasium.make_vec(ID, 2, "sync", obs_mode="rgb", wrappers=[only_rgb], **SMALL)


def only_rgb(env: Env) -> Env:
    space = env.observation_space["rgb"]  # type: ignore[index]
    return wrappers.TransformObservation(env, lambda obs: obs["rgb"], space)


def numbers() -> VectorEnv[Any, Any, Any]:
    return gymnasium.make_vec(ID, 2, "sync", obs_mode="rgb+state", wrappers=[NumbersOnly], **SMALL)


VECTOR: dict[str, Callable[[Path], VectorEnv[Any, Any, Any]] | str] = {
    "VectorizeTransformObservation": lambda _: vector.VectorizeTransformObservation(
        pictures(), wrappers.GrayscaleObservation
    ),
    "VectorizeTransformAction": lambda _: vector.VectorizeTransformAction(
        vectors(),
        wrappers.TransformAction,
        func=lambda action: action,
        action_space=gymnasium.spaces.Discrete(len(ACTIONS)),
    ),
    "VectorizeTransformReward": lambda _: vector.VectorizeTransformReward(
        vectors(), wrappers.ClipReward, min_reward=0.0, max_reward=1.0
    ),
    "DictInfoToList": lambda _: vector.DictInfoToList(vectors()),
    "TransformObservation": lambda _: vector.TransformObservation(pictures(), lambda obs: obs),
    "FilterObservation": lambda _: vector.FilterObservation(vectors(), ["state"]),
    "FlattenObservation": lambda _: vector.FlattenObservation(
        gymnasium.make_vec(ID, num_envs=2, obs_mode="rgb+state", **SMALL)
    ),
    "GrayscaleObservation": lambda _: vector.GrayscaleObservation(pictures()),
    "ResizeObservation": lambda _: vector.ResizeObservation(pictures(), (16, 24)),
    "ReshapeObservation": lambda _: vector.ReshapeObservation(pictures(), (32 * 48, 3)),
    "RescaleObservation": lambda _: vector.RescaleObservation(
        vector.DtypeObservation(pictures(), np.float32), np.float32(-1), np.float32(1)
    ),
    "DtypeObservation": lambda _: vector.DtypeObservation(pictures(), np.float32),
    "NormalizeObservation": lambda _: vector.NormalizeObservation(pictures()),
    "TransformAction": lambda _: vector.TransformAction(vectors(), lambda actions: actions),
    "ClipAction": NOT_CONTINUOUS,
    "RescaleAction": NOT_CONTINUOUS,
    "TransformReward": lambda _: vector.TransformReward(vectors(), lambda rewards: -rewards),
    "ClipReward": lambda _: vector.ClipReward(vectors(), 0.0, 1.0),
    "NormalizeReward": lambda _: vector.NormalizeReward(vectors()),
    "RecordEpisodeStatistics": lambda _: vector.RecordEpisodeStatistics(vectors()),
    "RecordVideo": lambda folder: vector.RecordVideo(vectors(render_mode="rgb_array"), str(folder)),
    "HumanRendering": lambda _: vector.HumanRendering(vectors(render_mode="rgb_array")),
    "ArrayConversion": lambda _: vector.ArrayConversion(numbers(), np, torch),
    "JaxToNumpy": NOT_JAX,
    "JaxToTorch": NOT_JAX,
    "NumpyToTorch": lambda _: vector.NumpyToTorch(numbers()),
}


APPLY = [name for name, make in SINGLE.items() if not isinstance(make, str)]
APPLY_TO_VECTORS = [name for name, make in VECTOR.items() if not isinstance(make, str)]


@pytest.fixture(autouse=True)
def _no_display(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


def own(module: ModuleType) -> set[str]:
    """The names of the wrappers of a module of Gymnasium's."""
    return {
        name
        for name in module.__all__
        if name.startswith("Jax") or isinstance(getattr(module, name), type)  # JAX may be missing
    }


def test_every_wrapper_of_this_gymnasium_is_here() -> None:
    assert own(wrappers) == SINGLE.keys()
    assert own(vector) == VECTOR.keys()


def legal(mask: Any, turn: int) -> int:
    """A legal action, another one each turn, but not the end."""
    return int([k for k in np.flatnonzero(np.asarray(mask)) if k != END][turn])


@in_one_test("name", APPLY)
def test_a_wrapper_goes_around_an_environment(name: str, tmp_path: Path) -> None:
    make = SINGLE[name]
    assert not isinstance(make, str)
    env = make(tmp_path)
    obs, info = env.reset(seed=0)
    tensors = isinstance(info["action_mask"], torch.Tensor)
    for turn in range(STEPS):
        if not tensors:
            assert env.observation_space.contains(obs), f"{obs} is not in the space"
        action = legal(info["action_mask"], turn)
        before = info
        obs, _, _, _, info = env.step(torch.tensor(action) if tensors else action)
        assert not before.keys() - info.keys()
        assert [type(info[key]) for key in before] == [type(each) for each in before.values()]
    assert info["steps"] > 1
    env.close()


@in_one_test("name", APPLY_TO_VECTORS)
def test_a_wrapper_goes_around_a_vector_environment(name: str, tmp_path: Path) -> None:
    make = VECTOR[name]
    assert not isinstance(make, str)
    envs = make(tmp_path)
    obs, info = envs.reset(seed=[0, 1])
    for turn in range(2):
        if name == "DictInfoToList":
            info = {"action_mask": [each["action_mask"] for each in info]}
        tensors = isinstance(info["action_mask"], torch.Tensor)
        if not tensors:
            assert envs.observation_space.contains(obs), f"{obs} is not in the space"
        actions = np.array([legal(mask, turn) for mask in info["action_mask"]])
        obs, _, _, _, info = envs.step(torch.tensor(actions) if tensors else actions)
    envs.close()


def refuses(module: ModuleType, name: str, env: Any) -> bool:
    try:
        wrapped = getattr(module, name)(env)
        wrapped.reset(seed=0)
        wrapped.step(0)
    except Exception:  # each has an error of its own
        return True
    return False


@in_one_test("name", [*SINGLE.keys() - APPLY])
def test_what_does_not_apply_refuses(name: str) -> None:
    env = state()
    assert refuses(wrappers, name, env)
    env.close()


@in_one_test("name", [*VECTOR.keys() - APPLY_TO_VECTORS])
def test_what_does_not_apply_to_vectors_refuses(name: str) -> None:
    envs = gymnasium.make_vec(ID, num_envs=1, obs_mode="state")
    assert refuses(vector, name, envs)
    envs.close()


# -- what some of them must bring ------------------------------------------------------------------


def frames_of(video: Path) -> list[Any]:
    reader = imageio_ffmpeg.read_frames(str(video))
    width, height = next(reader)["size"]
    return [np.frombuffer(frame, np.uint8).reshape(height, width, 3) for frame in reader]


def test_a_video_shows_every_step_of_the_episode(tmp_path: Path) -> None:
    size = {"width": 160, "height": 96}
    env = wrappers.RecordVideo(drawn(obs_mode="rgb", **size), str(tmp_path), fps=5)
    obs, _ = env.reset(seed=3)
    shown = [obs["rgb"]]
    place = env.unwrapped.details["navigable"][0]  # type: ignore[attr-defined]
    for action in (f"navigate to {place}", "observe", "move forward", "end"):
        obs, *_ = env.step(action)
        shown.append(obs["rgb"])
    env.close()
    (video,) = tmp_path.glob("*.mp4")
    frames = frames_of(video)
    assert len(frames) == len(shown)
    for frame, picture_ in zip(frames, shown, strict=True):
        assert np.abs(frame.astype(int) - picture_).mean() < 12  # the codec loses some
    assert np.abs(shown[0].astype(int) - shown[1]).mean() > 24


def test_statistics_are_those_of_the_episode() -> None:
    env = wrappers.RecordEpisodeStatistics(everything(obs_mode="text"))
    env.reset(seed=0)
    total = sum(float(env.step(said)[1]) for said in ("observe", "open Fridge"))
    _, reward, *_, info = env.step("end")
    assert info["episode"]["l"] == info["steps"] - 1 == 3
    assert info["episode"]["r"] == pytest.approx(total + float(reward))
    env.close()


def test_stacked_frames_are_the_last_ones() -> None:
    env = wrappers.FrameStackObservation(everything(obs_mode="state+text"), 3)
    texts = [env.reset(seed=0)[0]["text"][-1]]
    texts += [(obs := env.step(said)[0])["text"][-1] for said in ("observe", "move forward")]
    assert tuple(obs["text"]) == tuple(texts)
    env.close()


def test_numbers_become_tensors_and_words_can_be_left_out() -> None:
    env = wrappers.NumpyToTorch(NumbersOnly(everything(obs_mode="state")))
    obs, info = env.reset(seed=0)
    assert isinstance(obs["state"], torch.Tensor)
    assert all(isinstance(each, torch.Tensor) for each in info.values())
    assert info["action_mask"].dtype == info["visible_mask"].dtype == torch.int8
    assert torch.equal(info["action_mask"], torch.tensor(env.unwrapped.action_masks()))  # type: ignore[attr-defined]
    again = env.step(torch.tensor(END))[4]
    assert again.keys() == info.keys()
    env.close()


@pytest.mark.parametrize("mode", list(AutoresetMode))
@pytest.mark.parametrize("kind", ["sync", "async"])
def test_vector_environments_begin_again(kind: str, mode: AutoresetMode) -> None:
    envs = gymnasium.make_vec(
        ID,
        num_envs=2,
        vectorization_mode=kind,
        vector_kwargs={"autoreset_mode": mode},
        obs_mode="state+text",
        **SMALL,
    )
    alone = [everything(obs_mode="state+text") for _ in range(2)]
    obs, info = envs.reset(seed=[5, 6])
    began = [env.reset(seed=seed) for env, seed in zip(alone, (5, 6), strict=True)]
    look = INDEX[Action("observe")]
    actions = ([look, END], [look, look], [look, look])
    over = [False, False]
    for turn in actions:
        for k, (one, told) in enumerate(began):
            assert np.array_equal(obs["state"][k], one["state"])
            assert obs["text"][k] == one["text"]
            for key, value in told.items():
                assert not info[f"_{key}"][k] or np.array_equal(info[key][k], value), key
            assert info["_task_id"][k] or told["steps"] > 1  # after the reset of the other alone
        if mode is AutoresetMode.DISABLED and any(over):
            assert over == [False, True]
            obs, info = envs.reset(options={"reset_mask": np.array(over)})
            began[1], over = alone[1].reset(), [False, False]
            assert obs["text"][1] == began[1][0]["text"]
            continue
        obs, _, ended, cut, info = envs.step(np.array(turn))
        for k, env in enumerate(alone):
            if over[k]:
                began[k], over[k] = env.reset(), False
                continue
            one, _, terminated, truncated, told = env.step(turn[k])
            began[k], over[k] = (one, told), terminated or truncated
            assert bool(ended[k] or cut[k]) == over[k]
            if over[k] and mode is AutoresetMode.SAME_STEP:
                assert info["final_obs"][k]["text"] == one["text"]
                assert info["final_info"]["end_reason"][k] == told["end_reason"] == "end"
                began[k], over[k] = env.reset(), False
    for env in (envs, *alone):
        env.close()


@pytest.mark.parametrize("obs_mode", ["rgb+depth+instance", "objects+state+text"])
def test_the_checkers_find_nothing(obs_mode: str, recwarn: pytest.WarningsRecorder) -> None:
    env = everything(obs_mode=obs_mode, render_mode="rgb_array")
    check_env(env.unwrapped)
    env.reset(seed=0)  # gymnasium.make has put the passive checker around it
    env.step(0)
    env.render()
    env.close()
    assert [str(each.message) for each in recwarn if "ymnasium" in str(each.message)] == []
