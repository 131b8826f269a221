"""The YAML of a training run: valid values, invalid values and their error messages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from agents.configs import dump
from agents.rl.config import config_file, config_names, how_learnt, load_config


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "run.yaml"
    path.write_text("total_steps: 1000\nenv: {types: [single_search]}\n")
    return path


@pytest.mark.parametrize("name", config_names())
def test_those_that_come_with_er_gym_are_whole(name: str) -> None:
    config = load_config(config_file(name))
    assert config.env.instances == "explore"  # the figures of docs/baselines.md use this setting


def test_defaults_and_overrides(file: Path) -> None:
    config = load_config(file, ["env.step_penalty=0.5", "algorithm.n_steps=32"], {"seed": 7})
    assert (config.seed, config.env.step_penalty, config.algorithm.name) == (7, 0.5, "ppo")
    assert config.env.types == ("single_search",)


def test_what_is_written_out_is_read_the_same(file: Path, tmp_path: Path) -> None:
    config = load_config(
        file, ["warm_start.teacher=oracle", "curriculum=[{until: 10, types: [single_toggle]}]"]
    )
    again = tmp_path / "again.yaml"
    again.write_text(dump(config))
    assert load_config(again) == config


@pytest.mark.parametrize(
    ("overrides", "message"),
    [
        (["total_steps"], r"'total_steps' is not an override; give NAME=VALUE"),
        (["total_steps=-1"], r"'total_steps': input should be greater than or equal to 0, not -1"),
        (["steps=5"], r"^--set steps=5: .*'steps': there is no such field .*total_steps"),
        (["env.types=[fly]"], r"unknown task type 'fly'; choose one of: single_search,"),
        (["env.obs_mode=text"], r"'env.obs_mode': input should be 'state', 'rgb\+state'"),
        (["algorithm.name=sarsa"], r"'algorithm'.*'ppo'"),
        (["total_steps.more=1"], r"'total_steps' is 1000, which has no fields"),
        (
            ["curriculum=[{until: 9, types: [single_search]}, {until: 9, types: [single_search]}]"],
            r"end at \[9, 9\]; each must end after the one",
        ),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_one_line(file: Path, overrides: list[str], message: str) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        load_config(file, overrides)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [("a: [", "not YAML"), ("- 1", "is a table of settings"), ("", "is a table of settings")],
)
def test_files_that_are_none(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "x.yaml"
    file.write_text(text)
    with pytest.raises(ValueError, match=message):
        load_config(file)


def test_a_run_that_is_not_there() -> None:
    with pytest.raises(ValueError, match="no training run 'nowhere'; give a YAML file, or one of:"):
        config_file("nowhere")


def test_what_needs_the_warm_start(file: Path) -> None:
    overrides: list[Any] = ["warm_start.teacher=searcher", "algorithm.name=dqn"]
    with pytest.raises(ValueError, match="warm_start goes with ppo"):
        load_config(file, overrides)
    with pytest.raises(ValueError, match="total_steps is 0 and there is no warm_start"):
        load_config(file, ["total_steps=0"])
    overrides = ["warm_start.practice.rounds=1", "total_steps=0"]
    with pytest.raises(ValueError, match="practice goes with the teacher searcher"):
        load_config(file, overrides)
    load_config(file, [*overrides, "env.subtasks=true"])


def test_how_a_policy_was_trained_is_told_in_words() -> None:
    config = load_config(config_file("all"))
    assert how_learnt(config, 0) == (
        "4,000 cloned episodes of the searcher, then 4 rounds of DAgger of 16,000 steps on state "
        "and subtask"
    )
    assert how_learnt(load_config(config_file("qrdqn")), 60_032) == (
        "60,032 steps of QR-DQN over legal actions on state"
    )
