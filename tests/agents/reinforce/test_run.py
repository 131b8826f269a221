"""Whole runs of a tiny model: what it earns rises, chances agree, and going on after a kill."""

from __future__ import annotations

import multiprocessing
import os
import signal
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from bandit_runs import bandit_settings, curve
from click.testing import CliRunner
from forked import SPAWNED

from agents.finetune.model_files import open_model
from agents.finetune.run_files import RunFiles, lines_of
from agents.reinforce import train as training
from agents.reinforce.run_files import EPISODES
from agents.reinforce.settings import ReinforceSettings
from agents.reinforce.train import Result, reinforce
from benchmarks.cli.main import cli
from er_gym.resumable import FolderConflict
from er_gym.rollout import processes
from er_gym.tasks.suites import Suite, load_suite

MANY = {
    "play": {"group": 12},
    "training": {"updates": 5, "batch": 16},
}


def settings(**more: Any) -> ReinforceSettings:
    return bandit_settings(MANY, more)


@pytest.fixture(scope="module")
def whole(model: Path, suite: Suite, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was never interrupted."""
    out = tmp_path_factory.mktemp("reinforce") / "whole"
    reinforce(settings(), model, suite, out)
    return out


def test_what_it_earns_rises(whole: Path, model: Path) -> None:
    lines = curve(whole)
    assert [line["update"] for line in lines] == [1, 2, 3, 4, 5]
    earned = [line["reward"] / line["turns"] for line in lines]
    assert earned[0] < 0.65
    assert earned[-1] > 0.8
    assert lines[0]["reward/bandit:even_letters"] == lines[0]["reward"]
    # the chances at play are those that the learner computes
    assert max(line.get("sampler_gap", 0.0) for line in lines) < 1e-4
    made = open_model(whole)
    assert made.agent == open_model(model).agent
    [record] = made.history.runs
    assert (record.updates, record.conversations) == (5, 60)
    assert len(lines_of(whole / EPISODES)) == 60


def test_after_a_kill_it_goes_on_as_if_nothing_had_been(
    whole: Path, model: Path, suite: Suite, tmp_path: Path
) -> None:
    out = tmp_path / "killed"

    def again() -> Result:
        return reinforce(settings(), model, suite, out)

    def child() -> None:
        processes.CONTEXT = SPAWNED  # the server from which tests fork is no child of this process
        seen = iter(range(1, 100))
        learn = training.Learner.learn

        def dying(*args: Any) -> Any:
            if next(seen) == 4:
                os.kill(os.getpid(), signal.SIGKILL)
            return learn(*args)

        training.Learner.learn = dying  # type: ignore[method-assign]
        again()

    process = multiprocessing.get_context("fork").Process(target=child)
    process.start()
    process.join(120)
    assert process.exitcode == -signal.SIGKILL
    assert [line["update"] for line in curve(out)] == [1, 2, 3]
    assert [each.name for each in RunFiles(out).checkpoints.iterdir()] == ["checkpoint-2"]
    again()
    assert curve(out) == curve(whole)
    assert lines_of(out / EPISODES) == lines_of(whole / EPISODES)
    mine, theirs = ((each / "model/model.safetensors").read_bytes() for each in (out, whole))
    assert mine == theirs
    assert not again().new
    with pytest.raises(FolderConflict, match="learning_rate"):
        reinforce(settings(training={"learning_rate": 0.01}), model, suite, out)


@pytest.mark.parametrize(
    "more",
    [
        {
            "model": {"lora": {"rank": 4}},
            "objective": {"kl": 0.1, "entropy": 0.01},
            "advantage": {"row": "rloo"},
            "training": {"steps": 2, "passes": 2, "optimizer": "muon"},
        },
        {
            "model": {"dtype": "bfloat16"},
            "objective": {"kl": 0.1},
            "advantage": {"row": "branches", "branches": 2},
            "play": {"group": 2, "concurrency": 4},
            "training": {"steps": 2},
            "validation": {"suite": "mini", "tasks": 1, "every": 1, "best": True},
        },
        {
            "objective": {"kl": 0.1},
            "play": {
                "starts": "refusal",
                "places": 2,
                "turns": 1,
                "group": 3,
                "concurrency": 4,
            },
            "training": {"steps": 2},
        },
    ],
)
def test_each_way_of_learning_runs(
    more: dict[str, Any], model: Path, suite: Suite, tmp_path: Path
) -> None:
    made = settings(**{**more, "training": {**more["training"], "updates": 1}})
    result = reinforce(made, model, suite, tmp_path / "run")
    [*_, line] = curve(result.path)
    assert line["kl"] >= 0
    assert line["gradient_norm"] > 0
    after = made.play.starts == "refusal"
    assert (line["continued"] > 0) == (after or made.advantage.row == "branches")
    logged = lines_of(result.path / EPISODES)
    on = [each for each in logged if each["start"]]
    assert len(logged) - len(on) == line["episodes"] == result.episodes
    assert line["episodes"] == (1 if after else made.play.group)
    assert len({each["start"] for each in on}) == (2 if after else 0)
    assert len(on) == 6 * after
    assert all(each["turns"] == 1 for each in on)
    assert any(each["ended"] == "cut short" for each in on) == after
    assert ("continued/reward" in line) == after
    assert (result.path / "model").is_dir()
    assert len(result.validation) == (2 if "validation" in more else 0)
    if "validation" in more:
        assert line["validation/refused"] > 1  # it says nothing that the environment knows


def test_the_command_says_what_cannot_learn(tmp_path: Path) -> None:
    def said(*words: str) -> str:
        told = ["reinforce", "--out", str(tmp_path / "run"), *words]
        result = CliRunner().invoke(cli, told)
        assert result.exit_code == 2
        assert not (tmp_path / "run").exists()
        return result.output

    model = ("--model", "zoo:single-search", "--suite", "mini")
    assert "zoo:single-search is a policy" in said("--config", "tiny", *model)
    assert "er-tiny-text" in said("--config", "large", *model)
    assert "training.updates" in said("--config", "tiny", *model, "--set", "training.updates=0")


def test_what_does_not_go_together_is_refused(model: Path, suite: Suite, tmp_path: Path) -> None:
    def refused(match: str, made: ReinforceSettings, tasks: Suite = suite) -> None:
        with pytest.raises(ValueError, match=match):
            reinforce(made, model, tasks, tmp_path / "run")
        assert not (tmp_path / "run").exists()

    refused("play.group=8", settings(play={"group": 1}))
    twice = settings(play={"starts": "refusal"}, advantage={"row": "branches"})
    refused("branches .* play.starts=beginning", twice)
    refused("kept for evaluation", settings(), load_suite("mini"))
    validated = settings(validation={"suite": "er-val", "tasks": 1})
    same = [t for t in load_suite("er-val").tasks if t.arrangement.layout][:1]
    refused("1 arrangements .* also in er-val", validated, replace(suite, tasks=tuple(same)))
    refused("unknown|no advantage", settings(advantage={"row": "best"}))
    with pytest.raises(ValueError, match="set starts=refusal"):
        settings(play={"turns": 2})
    with pytest.raises(ValueError, match=r"lora\.dropout"):
        settings(model={"lora": {"dropout": 0.1}})
