"""The instruction in the observation: of this episode, constant, and in every kind of process."""

from __future__ import annotations

import pickle
import warnings
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from floor_plan_1 import FRIDGE
from gymnasium.utils.env_checker import check_env
from support import make_task

from er_gym.envs.actions import ACTIONS, INDEX, parse
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.envs.wrappers import InstructionEmbedding, KeyActionShaping, make_encoder

OPEN = make_task("single_pickup", ("open", FRIDGE), instruction="Open the Fridge.")
CLOSE = make_task("single_pickup", ("close", FRIDGE), instruction="Close the Fridge.")
ID = "ER-SinglePickup-v0"


@pytest.fixture(scope="module")
def wrapped() -> Iterator[InstructionEmbedding]:
    env = InstructionEmbedding(EmbodiedEnv([OPEN], obs_mode="state"))
    yield env
    env.close()


def test_the_space(wrapped: InstructionEmbedding) -> None:
    space = wrapped.observation_space
    assert space["instruction"] == gymnasium.spaces.Box(-1.0, 1.0, (64,), np.float32)
    assert space["state"] == wrapped.env.observation_space["state"]
    assert "instruction" not in wrapped.env.observation_space.spaces
    assert wrapped.reset()[0] in space


def test_it_is_the_episodes_own_and_stays(wrapped: InstructionEmbedding) -> None:
    for task in (OPEN, CLOSE, OPEN):
        obs, _ = wrapped.reset(options={"task": task})
        expected = make_encoder()(task.instruction)
        np.testing.assert_array_equal(obs["instruction"], expected)
        for action in ("navigate to Fridge", "hmm", "end"):
            obs["instruction"][:] = 0.0  # one observation is not the next
            obs, *_ = wrapped.step(action)
            np.testing.assert_array_equal(obs["instruction"], expected)
            assert obs in wrapped.observation_space


def test_it_is_encoded_once_an_episode(
    wrapped: InstructionEmbedding, monkeypatch: pytest.MonkeyPatch
) -> None:
    texts: list[str] = []

    def encoder(text: str) -> np.ndarray:
        texts.append(text)
        return np.zeros(64, dtype=np.float32)

    monkeypatch.setattr("er_gym.envs.wrappers.instruction.make_encoder", lambda name: encoder)
    wrapped.reset()
    for _ in range(3):
        wrapped.step("observe")
    assert texts == [OPEN.instruction]


def test_action_masks(wrapped: InstructionEmbedding) -> None:
    _, info = wrapped.reset()
    masks = wrapped.action_masks()
    assert masks.shape == (len(ACTIONS),)
    np.testing.assert_array_equal(masks, info["action_mask"])
    shaped = KeyActionShaping(wrapped, gamma=0.9)
    np.testing.assert_array_equal(shaped.action_masks(), masks)
    outer = gymnasium.wrappers.RecordEpisodeStatistics(shaped)
    np.testing.assert_array_equal(outer.get_wrapper_attr("action_masks")(), masks)


@pytest.mark.parametrize("obs_mode", ["state", "text", "rgb+state"])
def test_check_env_finds_no_problem(obs_mode: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # It warns of wrappers as such.
        warnings.filterwarnings("ignore", message=".*is different from the unwrapped version")
        env = InstructionEmbedding(EmbodiedEnv([OPEN], obs_mode=obs_mode, width=32, height=32))
        check_env(env, skip_render_check=True)
        env.close()


def test_of_a_made_environment_and_made_again_from_its_spec() -> None:
    env = gymnasium.make(ID, obs_mode="state", episode_source=[OPEN, CLOSE])
    env = KeyActionShaping(InstructionEmbedding(env, "hashed"), gamma=0.5, scale=2.0)
    assert env.spec is not None
    again = gymnasium.make(env.spec)
    assert isinstance(again, KeyActionShaping)
    assert again.observation_space == env.observation_space
    played = []
    for one in (env, again):
        obs, _ = one.reset(seed=3)
        played.append((obs["instruction"].tobytes(), one.step(INDEX[parse("observe")])[1]))
        one.close()
    assert played[0] == played[1]


def test_pickles_in_the_middle_of_an_episode() -> None:
    env = InstructionEmbedding(gymnasium.make(ID, obs_mode="state"))
    first, _ = env.reset(seed=5)
    again, _ = pickle.loads(pickle.dumps(env)).reset(seed=5)
    np.testing.assert_array_equal(first["instruction"], again["instruction"])
    assert np.linalg.norm(again["instruction"]) == pytest.approx(1.0)
    env.close()


def test_make_vec() -> None:
    vec = gymnasium.make_vec(
        ID, 2, "sync", wrappers=[InstructionEmbedding], obs_mode="state", episode_source=[OPEN]
    )
    obs, _ = vec.reset(seed=1)
    np.testing.assert_array_equal(obs["instruction"], [make_encoder()(OPEN.instruction)] * 2)
    vec.close()


class Bare(gymnasium.Env[Any, Any]):
    """None of ours."""

    action_space = gymnasium.spaces.Discrete(2)

    def __init__(self, observation_space: gymnasium.Space[Any]) -> None:
        self.observation_space = observation_space

    def reset(self, **arguments: Any) -> tuple[Any, dict[str, Any]]:
        return self.observation_space.sample(), {}


def test_invalid_uses_of_the_wrapper(wrapped: InstructionEmbedding) -> None:
    box = gymnasium.spaces.Box(0.0, 1.0, (2,))
    with pytest.raises(ValueError, match=r"cannot add 'instruction' to .*Box.* is a Dict"):
        InstructionEmbedding(Bare(box))
    with pytest.raises(ValueError, match=r"cannot add 'instruction' to .*once"):
        InstructionEmbedding(wrapped)
    with pytest.raises(ValueError, match="unknown encoder 'bow'"):
        InstructionEmbedding(wrapped.env, "bow")
    other = InstructionEmbedding(Bare(gymnasium.spaces.Dict(a=box)))
    with pytest.raises(ValueError, match=r"info has no 'instruction'; wrap an er-gym environment"):
        other.reset()
    with pytest.raises(AttributeError, match="action_masks"):
        other.action_masks()


def test_a_step_before_reset_is_refused(wrapped: InstructionEmbedding) -> None:
    with pytest.raises(gymnasium.error.ResetNeeded):
        InstructionEmbedding(EmbodiedEnv([OPEN], obs_mode="state")).step("observe")


def test_masks_reach_a_learner() -> None:
    """As sb3-contrib's MaskablePPO asks for them, in this process and in a spawned one."""
    maskable = pytest.importorskip("sb3_contrib", reason="needs pip install 'er-gym[rl]'")
    from sb3_contrib.common.maskable.utils import get_action_masks, is_masking_supported
    from stable_baselines3.common.vec_env import DummyVecEnv, SubprocVecEnv

    def make() -> gymnasium.Env[Any, Any]:
        env = gymnasium.make(ID, obs_mode="state", episode_source=[OPEN])
        return KeyActionShaping(InstructionEmbedding(env), gamma=0.99)

    expected = make_encoder()(OPEN.instruction)
    masks = []
    for vec in (DummyVecEnv([make]), SubprocVecEnv([make], start_method="spawn")):
        assert is_masking_supported(vec)
        obs = vec.reset()
        np.testing.assert_array_equal(obs["instruction"], [expected])
        masks.append(get_action_masks(vec))
        obs, _, _, infos = vec.step(np.array([INDEX[parse("observe")]]))
        np.testing.assert_array_equal(obs["instruction"], [expected])
        assert infos[0]["unshaped_reward"] == 0.0
        if isinstance(vec, DummyVecEnv):
            learner = maskable.MaskablePPO(
                "MultiInputPolicy", vec, n_steps=8, batch_size=8, n_epochs=1, device="cpu"
            )
            learner.learn(8)
        vec.close()
    assert masks[0].shape == (1, len(ACTIONS))
    np.testing.assert_array_equal(*masks)
