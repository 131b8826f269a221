"""DQN and QR-DQN explore and choose only legal actions."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("sb3_contrib")

import torch
from sb3_contrib.common.maskable.evaluation import evaluate_policy
from stable_baselines3.common.buffers import DictReplayBuffer
from stable_baselines3.common.vec_env import DummyVecEnv, VecEnv

from agents.rl import dqn
from agents.rl.agent import RLAgent
from agents.rl.config import EnvConfig, Network, TrainConfig, VecEnvConfig
from agents.rl.envs import make_env
from agents.rl.model_file import save
from agents.rl.train import ALGORITHMS, TRAINING, load_last_checkpoint
from er_gym.envs.actions import INDEX
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks.suites import load_suite

ENVS = 2
EPISODES = EnvConfig(episodes="mini", types=("single_pickup",))
NAMES = pytest.mark.parametrize("name", ["dqn", "qrdqn"])


@pytest.fixture(scope="module")
def env() -> Iterator[VecEnv]:
    made = DummyVecEnv([partial(make_env, EPISODES, with_mask=True)] * ENVS)
    yield made
    made.close()


def configured(name: str, **settings: Any) -> TrainConfig:
    """A small learner that begins to learn after 40 steps."""
    few = {"learning_starts": 40, "batch_size": 16, "buffer_size": 200, "gradient_steps": 1}
    return TrainConfig(
        algorithm={"name": name, "quantiles": 5, "target_update_interval": 20, **few, **settings},
        total_steps=1000,
        env=EPISODES,
        vec=VecEnvConfig(envs=ENVS, workers=1),
        network=Network(width=8, kind=4),
    )


def learner(env: VecEnv, name: str, **settings: Any) -> Any:
    config = configured(name, **settings)
    model = ALGORITHMS[name](config, config.algorithm, env)
    env.seed(0)
    return model


def worth(model: Any, obs: dict[str, Any]) -> Any:
    """(quantiles, n, A) what the target network thinks."""
    net = model.q_net_target if isinstance(model, dqn.LegalDQN) else model.quantile_net_target
    with torch.no_grad():
        said = net({key: torch.as_tensor(value) for key, value in obs.items()}).numpy()
    return said[None] if said.ndim == 2 else said.swapaxes(0, 1)


@NAMES
@pytest.mark.parametrize("rate", [1.0, 0.5, 0.0])
def test_only_legal_actions_are_done(env: VecEnv, name: str, rate: float) -> None:
    model = learner(env, name)
    model.exploration_schedule = lambda progress: rate
    model.learn(160, log_interval=None)
    assert model._n_updates > 0
    assert model.exploration_rate == rate
    buffer = model.replay_buffer
    rows = buffer.pos
    masks, after = (kept["mask"][:rows] for kept in (buffer.observations, buffer.next_observations))
    assert rows == 160 / ENVS
    assert np.take_along_axis(masks, buffer.actions[:rows], axis=-1).all()
    went_on = buffer.dones[: rows - 1] == 0
    assert (after[:-1][went_on] == masks[1:][went_on]).all()


@NAMES
def test_only_a_legal_action_is_thought_best(env: VecEnv, name: str) -> None:
    model = learner(env, name)
    obs = env.reset()
    for action in np.flatnonzero(obs["mask"][0]):
        only = np.zeros_like(obs["mask"])
        only[:, action] = 1
        told = {**obs, "mask": only}
        for deterministic in (True, False):
            actions, _ = model.predict(told, deterministic=deterministic)
            assert actions.tolist() == [action] * ENVS
    one = {key: value[0] for key, value in obs.items()}
    assert one["mask"][int(model.predict(one, deterministic=True)[0])]


@NAMES
def test_illegal_actions_have_very_low_values(env: VecEnv, name: str) -> None:
    obs = env.reset()
    said = worth(learner(env, name), obs)
    assert said[:, obs["mask"] == 0].max() < -1000 < said[:, obs["mask"] == 1].min()
    assert np.isfinite(said).all()


def test_each_environment_explores_for_itself(env: VecEnv) -> None:
    model = learner(env, "dqn")
    model.exploration_rate = 0.5
    obs = env.reset()
    best, _ = model.predict(obs, deterministic=True)
    tried = np.array([model.predict(obs)[0] != best for _ in range(100)])
    assert 30 < (tried.sum(axis=1) == 1).sum() < 70


def test_the_warm_up_is_at_random(env: VecEnv) -> None:
    model = learner(env, "dqn")
    model.exploration_schedule = lambda progress: 0.0
    model.learn(40, log_interval=None)
    obs = {key: kept[:20, 0] for key, kept in model.replay_buffer.observations.items()}
    best, _ = model.predict(obs, deterministic=True)
    assert (best == model.replay_buffer.actions[:20, 0, 0]).mean() < 0.5


def test_every_legal_action_is_tried(env: VecEnv) -> None:
    model = learner(env, "dqn")
    model.exploration_rate = 1.0
    obs = env.reset()
    tried = {int(model.predict(obs)[0][0]) for _ in range(1000)}
    assert tried == set(np.flatnonzero(obs["mask"][0]))


@NAMES
def test_learning_stays_finite(env: VecEnv, name: str) -> None:
    model = learner(env, name)
    model.learn(100, log_interval=None)
    assert model.replay_buffer.dones.any()
    before = [each.clone() for each in model.policy.parameters()]
    model.train(20, batch_size=32)
    assert model.logger.name_to_value["train/loss"] < 100  # one illegal action would be a million
    after = list(model.policy.parameters())
    assert all(each.isfinite().all() for each in after)
    assert any((now != old).any() for now, old in zip(after, before, strict=True))


@NAMES
def test_a_loaded_model_acts_alike(env: VecEnv, name: str, tmp_path: Path) -> None:
    model = learner(env, name)
    model.learn(60, log_interval=None)
    TRAINING.begin(tmp_path, configured(name))
    save(model, tmp_path)
    loaded = load_last_checkpoint(tmp_path)
    rows = slice(0, model.replay_buffer.pos)
    obs = {key: value[rows, 0] for key, value in model.replay_buffer.observations.items()}
    one, other = (each.predict(obs, deterministic=True)[0] for each in (model, loaded))
    assert (one == other).all()
    assert (worth(model, obs) == worth(loaded, obs)).all()


def test_a_continued_run_fills_its_buffer_before_it_learns(env: VecEnv, tmp_path: Path) -> None:
    model = learner(env, "qrdqn")
    model.learn(80, log_interval=None)
    TRAINING.begin(tmp_path, configured("qrdqn"))
    save(model, tmp_path)
    loaded = load_last_checkpoint(tmp_path)
    loaded.set_env(env)
    updates = loaded._n_updates
    assert updates > 0
    loaded.learn(32, reset_num_timesteps=False, log_interval=None)
    assert loaded._n_updates == updates
    loaded.learn(32, reset_num_timesteps=False, log_interval=None)
    assert loaded._n_updates > updates


def test_a_full_buffer_is_enough_if_it_is_smaller_than_the_warm_up(env: VecEnv) -> None:
    model = learner(env, "dqn", buffer_size=20)
    model.learn(60, log_interval=None)
    assert model._n_updates > 0


def test_the_buffer_keeps_observations(env: VecEnv) -> None:
    spaces = env.observation_space, env.action_space
    half, plain = (
        kind(10, *spaces, n_envs=ENVS) for kind in (dqn.HalfReplayBuffer, DictReplayBuffer)
    )
    obs = env.reset()
    nothing = np.zeros(ENVS, int)
    half.add(obs, obs, nothing, nothing, nothing, [{}] * ENVS)
    kept = {key: value[0] for key, value in half.observations.items()}
    assert half.observations["state"].nbytes * 2 == plain.observations["state"].nbytes
    assert (kept["mask"] == obs["mask"]).all()
    assert np.abs(kept["state"] - obs["state"]).max() < 1e-3
    assert ((kept["state"] > 0) == (obs["state"] > 0)).all()


@NAMES
def test_the_evaluation_of_maskable_learners_plays_it(env: VecEnv, name: str) -> None:
    rewards, lengths = evaluate_policy(
        learner(env, name), env, ENVS, return_episode_rewards=True, warn=False
    )
    assert len(rewards) == len(lengths) == ENVS


@NAMES
def test_the_agent_plays_it(env: VecEnv, name: str, tmp_path: Path) -> None:
    TRAINING.begin(tmp_path, configured(name))
    save(learner(env, name), tmp_path)
    agent = RLAgent(tmp_path)
    task = load_suite("mini").tasks[0]
    room = EmbodiedEnv((), obs_mode=agent.obs_mode)
    obs, info = room.reset(seed=0, options={"task": task})
    agent.reset(task, obs, info)
    for _ in range(3):
        action = INDEX[agent.act(obs, info).action]
        assert info["action_mask"][action]
        obs, _, ended, cut, info = room.step(action)
        if ended or cut:
            break
    room.close()
