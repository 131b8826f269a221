"""A reward of another package, by its dotted name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from agents.rl.config import EnvConfig
from agents.rl.envs import evaluation_config, make_env
from benchmarks.cli.main import cli
from er_gym.envs.actions import ACTIONS, INDEX, Action
from er_gym.envs.faults import KIND_OF_VERB
from er_gym.plugins import PluginError
from tests.support import in_one_test

REWARDS = """
import gymnasium


class Doubled(gymnasium.RewardWrapper):
    def reward(self, reward):
        return 2 * reward + 1


def curious(env):
    return gymnasium.wrappers.TransformReward(env, lambda reward: reward + 10)


def other(env):
    return gymnasium.make("CartPole-v1")


def nothing(env):
    return None


def needs_more(env, factor):
    return env


def blind(env):
    return gymnasium.wrappers.FlattenObservation(env)


NUMBER = 3
"""
LOOK = INDEX[Action("observe")]
OPTIONS = EnvConfig(episodes="mini", step_penalty=0.25)


@pytest.fixture
def _rewards(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "own_rewards.py").write_text(REWARDS)
    monkeypatch.syspath_prepend(str(tmp_path))


def first_reward(options: EnvConfig) -> float:
    env = make_env(options)
    obs, _ = env.reset(seed=0)
    assert env.observation_space.contains(obs)
    reward = float(env.step(LOOK)[1])
    env.close()
    return reward


@pytest.mark.usefixtures("_rewards")
def test_it_is_the_reward_in_training_and_none_in_evaluation() -> None:
    doubled = OPTIONS.model_copy(update={"reward": "own_rewards:Doubled"})
    curious = OPTIONS.model_copy(update={"reward": "own_rewards:curious"})
    plain = first_reward(OPTIONS)
    assert plain == -0.25
    assert first_reward(doubled) == 2 * plain + 1
    assert first_reward(curious) == plain + 10
    assert first_reward(evaluation_config(doubled, "mini")) == 0.0


def test_actions_go_wrong_in_training_and_not_in_evaluation() -> None:
    always = OPTIONS.model_copy(update={"faults": 1.0})
    faults, kinds = [], []
    for options in (OPTIONS, always, evaluation_config(always, "mini")):
        env = make_env(options)
        env.reset(seed=0)
        legal = np.flatnonzero(env.get_wrapper_attr("action_masks")())
        move = next(i for i in legal if ACTIONS[i].verb in KIND_OF_VERB)
        kinds.append(KIND_OF_VERB[ACTIONS[move].verb])
        faults.append(env.step(move)[4]["fault"])
        env.close()
    assert faults == ["", kinds[1], ""]


WRONG = {
    "reward_of_my_own": "unknown reward wrapper 'reward_of_my_own'; choose one of: package.module",
    "own_rewards:Trebled": "has no 'Trebled'",
    "no_such_rewards:Doubled": "Cannot import 'no_such_rewards'",
    "own_rewards:NUMBER": "is 3; give a wrapper's class",
    "own_rewards:needs_more": "cannot be put around the environment (TypeError",
    "own_rewards:nothing": "returns NoneType, which is not around the environment",
    "own_rewards:other": "which is not around the environment",
    "own_rewards:blind": "changes the observation space; give a wrapper that changes the reward",
}


@pytest.mark.usefixtures("_rewards")
@in_one_test("name", WRONG)
def test_what_is_no_reward_wrapper_is_told_in_one_line(name: str) -> None:
    with pytest.raises(PluginError) as caught:
        make_env(OPTIONS.model_copy(update={"reward": name}))
    assert WRONG[name] in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("_rewards")
def test_the_command_takes_it_and_leaves_nothing_if_it_is_wrong(tmp_path: Path) -> None:
    run = tmp_path / "run"
    command = ["train-rl", "--config", "exposed", "--reward", "own_rewards:Trebled"]
    told = CliRunner().invoke(
        cli, [*command, "--set", "vec.envs=1", "--set", "vec.workers=1", "--out", str(run)]
    )
    assert told.exit_code == 2
    assert "reward wrapper 'own_rewards:Trebled': 'own_rewards' has no 'Trebled'" in told.output
    assert not run.exists()
