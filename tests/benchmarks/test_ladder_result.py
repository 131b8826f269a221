"""What a ladder's tables say of faults and of repeated exploration."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from statistics import mean

import pytest
from click.testing import CliRunner

from benchmarks.cli.main import cli
from benchmarks.scoring.report import load_run
from benchmarks.scoring.scorers import CORRECTED
from benchmarks.study.kinds import LADDER, Study
from benchmarks.study.ladder import ladder_tables
from benchmarks.study.ladder_phases import rungs
from benchmarks.study.ladder_settings import LadderSettings
from benchmarks.study.results import Result

RATE = 0.3
PLAYERS = {"imitation": "random", "exploration": "searcher", "reflection": "oracle"}
"""Agents that play where the stages' models would."""


@pytest.fixture(scope="module")
def settings() -> LadderSettings:
    return LADDER.load("tiny-text", [f"evaluation.faults=[{RATE}]", "evaluation.fault_samples=3"])


@pytest.fixture(scope="module")
def root(settings: LadderSettings, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A ladder's directory with real runs of few tasks."""
    root = tmp_path_factory.mktemp("ladder")
    for rung in rungs(settings):
        if rung.name not in PLAYERS:
            continue
        (run,) = rung.runs.values()
        command = ["bench", "--suite", "mini", "--limit", "11", "--spread"]
        # In explore the next cabinet is another object, so that repeats and revisits differ.
        command += ["--instances", "explore"]
        command += ["--agent", PLAYERS[rung.name], "--out", str(root / run)]
        if rung.faults:
            command += ["--faults", str(RATE), "--samples", str(settings.evaluation.fault_samples)]
        played = CliRunner().invoke(cli, command)
        assert played.exit_code == 0, played.output
    return root


@pytest.fixture(scope="module")
def results(settings: LadderSettings, root: Path) -> dict[tuple[str, float], Result]:
    ((_, found),) = Study(LADDER, root, settings).results()
    return {(each.name, each.of.faults): each for each in found}


def by_task(root: Path, result: Result, metric: str) -> Mapping[str, float]:
    (run,) = result.of.runs.values()
    scores = load_run(root / run).scores[CORRECTED.name]
    tasks = {each.task_id for each in scores}
    return {
        task: mean(float(getattr(each, metric)) for each in scores if each.task_id == task)
        for task in tasks
    }


def test_only_faults_are_played_several_times(settings: LadderSettings, tmp_path: Path) -> None:
    plan = {phase.name: phase.command for phase in Study(LADDER, tmp_path, settings).plan.phases}
    assert "--samples" not in plan["evaluations/3-reflection"]
    faulty = plan[f"evaluations/3-reflection-faults-{RATE}"]
    assert ("--samples", "3") in [*pairwise(faulty)]


def test_what_faults_cost_is_paired_over_tasks(
    root: Path, results: Mapping[tuple[str, float], Result]
) -> None:
    losses = {}
    for name in ("exploration", "reflection"):
        without, faulty = results[name, 0.0], results[name, RATE]
        assert faulty.summary.n == 33
        before, after = by_task(root, without, "success"), by_task(root, faulty, "success")
        losses[name] = mean(after[task] - before[task] for task in before)
        assert faulty.differences["change"] is not None
        assert faulty.differences["change"].mean == pytest.approx(losses[name])
    assert results["exploration", RATE].differences["loss_reduction"] is None
    reduction = results["reflection", RATE].differences["loss_reduction"]
    assert reduction is not None
    assert reduction.mean == pytest.approx(losses["reflection"] - losses["exploration"])
    assert reduction.low < reduction.mean < reduction.high
    (table,) = (each for each in ladder_tables([*results.values()]) if "faults" in each.title)
    assert [row[0] for row in table.rows] == ["exploration", "reflection"]


def test_repeated_exploration_is_compared_with_the_first_stage(
    root: Path, results: Mapping[tuple[str, float], Result]
) -> None:
    for name in ("exploration", "reflection"):
        told = results[name, 0.0]
        for metric, more in (
            ("repeat_rate", told.differences["more_repeats"]),
            ("revisit_rate", told.differences["more_revisits"]),
        ):
            first = by_task(root, results["imitation", 0.0], metric)
            now = by_task(root, told, metric)
            assert more is not None
            assert more.mean == pytest.approx(mean(now[t] - first[t] for t in first))
    assert results["imitation", 0.0].differences["more_repeats"] is None
    assert results["exploration", RATE].differences["more_repeats"] is None
    (table,) = (each for each in ladder_tables([*results.values()]) if "Repeated" in each.title)
    assert [row[:2] for row in table.rows] == [
        ("exploration", "0"),
        ("reflection", "0"),
        ("reflection", f"{100 * RATE:g}"),
    ]
