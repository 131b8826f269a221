"""Behaviour cloning: a policy learns a teacher's actions from its episodes."""

from __future__ import annotations

import json
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from agents import make_agent
from agents.rl.cloning import clone_behaviour, collect_demonstrations
from agents.rl.config import TrainConfig
from agents.rl.demonstrations import TEACHERS, Demonstrations, demonstrate
from agents.rl.envs import make_env
from agents.rl.guidance import WarmStart
from agents.rl.train import ALGORITHMS, make_vec_env, train
from er_gym.envs.actions import INDEX, Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.agent import Decision
from er_gym.rollout.play import play_episode
from er_gym.tasks.suites import load_suite

Make = Callable[..., TrainConfig]
Recited = Callable[..., Demonstrations]


@pytest.mark.parametrize("teacher", ["oracle", "searcher"])
def test_demonstrations_are_what_the_learner_would_have_seen(
    make_config: Make, teacher: str
) -> None:
    config = make_config(
        env={
            "episodes": "mini",
            "types": ["single_pickup"],
            "step_penalty": 0.0,
            "success_bonus": 0.5,
        }
    )
    how = WarmStart(teacher=teacher, episodes=6)
    seen = collect_demonstrations(config, how, seed=1)
    assert seen.episodes == 6
    assert 0 < seen.successes <= 6
    assert seen.obs["state"].shape == (
        len(seen),
        *make_env(config.env).observation_space["state"].shape,
    )
    assert seen.masks[np.arange(len(seen))][np.arange(len(seen)), seen.actions].all()
    ends = np.flatnonzero(seen.actions == 2)
    assert len(ends) == seen.successes
    assert (seen.returns[ends] == 1.5).all()  # "end" is worth 1 and the bonus; nothing follows
    assert seen.returns.max() > 1.5


def test_a_policy_learns_the_teachers_actions(make_config: Make) -> None:
    config = make_config()
    how = WarmStart(teacher="oracle", episodes=20, epochs=150, batch_size=32, learning_rate=3e-3)
    seen = collect_demonstrations(config, how, seed=0)
    env = make_vec_env(config, config.env, 0)
    try:
        model = ALGORITHMS["ppo"](config, config.algorithm, env)
        agreed = clone_behaviour(model, seen, how, seed=0)
    finally:
        env.close()
    assert agreed > 0.8  # of about 60 actions that are legal each time


def test_a_run_begins_warm(make_config: Make, tmp_path: Path) -> None:
    config = make_config(
        total_steps=256, warm_start={"teacher": "oracle", "episodes": 24, "epochs": 20}
    )
    train(config, tmp_path / "run")
    noted = json.loads((tmp_path / "run" / "warm_start.json").read_text())
    assert 0 < noted["agreement"] <= 1
    assert 0 < noted["teacher_success"] <= 1


def test_a_policy_practises_under_advice(make_config: Make, tmp_path: Path) -> None:
    config = make_config(
        total_steps=0,
        env={"episodes": "mini", "types": ["single_pickup"], "subtasks": True},
        warm_start={
            "episodes": 16,
            "epochs": 6,
            "final_learning_rate": 0.5,
            "practice": {"rounds": 2, "steps": 160, "epochs": 2},
        },
    )
    train(config, tmp_path / "run")
    noted = json.loads((tmp_path / "run" / "warm_start.json").read_text())
    first, second = noted["rounds"]
    assert noted["steps"] < first["steps"] < second["steps"] <= noted["steps"] + 320
    assert first["episodes"] > 0
    agent = make_agent(f"rl:{tmp_path / 'run'}")
    tasks = [task for task in load_suite("mini").tasks if task.type.name == "single_pickup"]
    record = play_episode(EmbodiedEnv((), obs_mode=agent.obs_mode), agent, tasks[0], 0)
    assert not record.error


class Reciter:
    """Says the same texts in each episode, whatever it sees."""

    def __init__(self, *texts: str) -> None:
        self.says = iter(texts)

    def reset(self, *_: object) -> None:
        """Nothing to prepare."""

    def act(self, *_: object) -> Decision:
        return Decision(next(self.says))


@pytest.fixture
def recited(make_config: Make, monkeypatch: pytest.MonkeyPatch) -> Recited:
    """A function to the demonstrations of an agent that recites texts in each episode."""

    def play(texts: Sequence[str], episodes: int, only_successes: bool = False) -> Demonstrations:
        monkeypatch.setitem(TEACHERS, "reciter", lambda: Reciter(*texts))
        settings = {"episodes": "mini", "types": ["single_toggle"], "illegal_penalty": 0.5}
        env = make_env(make_config(env=settings).env, with_text=True)
        env.reset(seed=0)
        try:
            return demonstrate(env, "reciter", episodes, 0.9, only_successes)
        finally:
            env.close()

    return play


def test_what_names_no_action_is_left_out_and_counted(recited: Recited) -> None:
    texts = ("hm", "open Apple", "pickup Mug", "end")  # nonsense, then what cannot be done
    seen = recited(texts, 2)
    assert (seen.episodes, seen.unread, seen.refused) == (2, 4, 2)
    assert seen.actions.tolist() == [INDEX[Action("end")]] * 2
    assert len(recited(texts, 1, only_successes=True)) == 0  # it never succeeds


def test_a_step_left_out_counts_in_the_returns_before_it(
    make_config: Make, recited: Recited
) -> None:
    step = make_config().env.step_penalty
    seen = recited(("observe", "pickup Mug", "end"), 1)
    assert seen.returns[1] == pytest.approx(-step)
    assert seen.returns[0] == pytest.approx(-step - 0.9 * (step + 0.5) - 0.81 * step)


def test_a_teacher_without_usable_steps_is_one_clear_error(make_config: Make) -> None:
    config = make_config(env={"episodes": "mini", "types": ["single_pickup"], "max_steps": 1})
    with pytest.raises(ValueError, match=r"oracle showed nothing to learn in 2 episodes \(0 succ"):
        collect_demonstrations(config, WarmStart(teacher="oracle", episodes=2), seed=0)
