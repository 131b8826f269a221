"""A trained policy plays where its files are not."""

from __future__ import annotations

import pickle
import shutil

import pytest

pytest.importorskip("torch", reason="needs the extra rl")

from agents import NamedAgent
from agents.zoo.index import FOLDER
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.play import play_episode
from er_gym.tasks import load_suite


def test_a_policy_plays_alike_without_its_directory(tmp_path):
    run = tmp_path / "run"
    shutil.copytree(FOLDER / "single-search", run)
    by_name = NamedAgent(f"rl:{run}")
    carried = pickle.dumps(by_name.carried())
    task = load_suite("mini").tasks[0]
    records = []
    for make in (by_name, pickle.loads(carried)):
        agent = make(task, 0)
        env = EmbodiedEnv((), obs_mode=agent.obs_mode)
        record = play_episode(env, agent, task, 0)
        env.close()
        records.append([(step.verb, step.object_type) for step in record.steps])
        assert not record.error
        shutil.rmtree(run, ignore_errors=True)
    assert records[0] == records[1]
    assert len(records[0]) > 2


def test_other_agents_carry_nothing():
    oracle = NamedAgent("oracle")
    assert oracle.carried() is oracle
