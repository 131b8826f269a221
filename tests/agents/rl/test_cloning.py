"""Behaviour cloning: what a teacher does is learnt from its episodes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from agents.rl.cloning import clone, watch
from agents.rl.config import TrainConfig, WarmStart
from agents.rl.envs import make_env
from agents.rl.train import FAMILIES, train, vectorised

Make = Callable[..., TrainConfig]


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
    seen = watch(config, how, seed=1)
    assert seen.episodes == 6
    assert 0 < seen.successes <= 6
    assert seen.obs["state"].shape == (
        len(seen),
        *make_env(config.env).observation_space["state"].shape,
    )
    assert seen.masks[np.arange(len(seen)), seen.actions].all()
    ends = np.flatnonzero(seen.actions == 2)
    assert len(ends) == seen.successes
    assert (seen.returns[ends] == 1.5).all()  # "end" is worth 1 and the bonus; nothing follows
    assert seen.returns.max() > 1.5


def test_a_policy_comes_to_do_what_the_teacher_did(make_config: Make) -> None:
    config = make_config()
    how = WarmStart(teacher="oracle", episodes=20, epochs=150, batch_size=32, learning_rate=3e-3)
    seen = watch(config, how, seed=0)
    env = vectorised(config, config.env, 0)
    try:
        model = FAMILIES["ppo"].make(config, config.algorithm, env)
        agreed = clone(model, seen, how, seed=0)
    finally:
        env.close()
    assert agreed > 0.8  # of about 60 actions that are legal each time


def test_a_run_begins_warm(make_config: Make, tmp_path: Path) -> None:
    config = make_config(
        total_steps=256, warm_start={"teacher": "oracle", "episodes": 24, "epochs": 6}
    )
    train(config, tmp_path / "run")
    noted = json.loads((tmp_path / "run" / "warm_start.json").read_text())
    assert 0 < noted["agreement"] <= 1
    assert 0 < noted["teacher_success"] <= 1
