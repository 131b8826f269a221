"""Intervals that take the tasks of one arrangement to be alike."""

from __future__ import annotations

from math import sqrt
from pathlib import Path
from statistics import NormalDist

import pytest
from click.testing import CliRunner

from benchmarks.checks.arrangements import main
from benchmarks.cli.main import cli as er_gym
from benchmarks.scoring.metrics import between, wilson
from benchmarks.scoring.samples import arrangement_of


@pytest.mark.parametrize(
    ("scene", "task_id", "arrangement"),
    [
        ("FloorPlan3", "FloorPlan3-246031-single_search-Bowl", "FloorPlan3-246031"),
        ("FloorPlan3", "FloorPlan3-single_search-Bowl", "FloorPlan3"),
        ("FloorPlan3", "paper-797", "FloorPlan3"),
        ("House1-7000", "House1-7000-795600-single_pickup-Pen", "House1-7000-795600"),
        ("FloorPlan3", "FloorPlan301-1-single_search-Bowl", "FloorPlan3"),
    ],
)
def test_arrangements_by_the_ids_of_tasks(scene: str, task_id: str, arrangement: str) -> None:
    assert arrangement_of(scene, task_id) == arrangement


def test_the_interval_of_differences_that_come_in_groups() -> None:
    values = [1.0, 1.0, 0.0, 0.0, -1.0, 0.0]
    one = between(["a", "a", "b", "b", "c", "c"], values)
    # The mean is 1/6; the groups' sums differ from twice that by 5/3, -1/3 and -4/3.
    error = sqrt(3 / 2 * (25 + 1 + 16) / 9 / 6**2)
    assert one.mean == pytest.approx(1 / 6)
    assert one.low == pytest.approx(1 / 6 - NormalDist().inv_cdf(0.975) * error)
    assert one.high == pytest.approx(1 / 6 + NormalDist().inv_cdf(0.975) * error)
    assert between(["a", "a"], [1.0, 0.0]).low is None


def test_the_table_of_runs(tmp_path: Path) -> None:
    runs = [str(tmp_path / name) for name in ("random", "oracle")]
    for agent, run in zip(("random", "oracle"), runs, strict=True):
        command = ["bench", "--suite", "er-1k", "--limit", "40", "--agent", agent, "--out", run]
        assert CliRunner().invoke(er_gym, command).exit_code == 0
    alone = CliRunner().invoke(main, runs)
    assert alone.exit_code == 0, alone.output
    [row] = [line for line in alone.output.splitlines() if line.startswith("| oracle")]
    _, _, tasks, arrangements, rate, by_tasks, by_arrangements, _ = row.split("|")
    assert (tasks.strip(), rate.strip()) == ("40", "100.0")

    # Where all succeed, a task counts once, and an arrangement less than that if others have fewer
    # tasks.
    def lowest(count: int) -> float:
        low = wilson(count, count).low
        assert low is not None
        return 100 * low

    assert by_tasks.strip() == f"{lowest(40):.1f} to 100.0"
    low = float(by_arrangements.split()[0])
    assert lowest(int(arrangements) - 8) < low < lowest(int(arrangements))
    assert int(arrangements) < int(tasks)
    paired = CliRunner().invoke(main, [runs[1], "--before", runs[1]])
    assert "| 0.0 | 0.0 to 0.0 | 0.0 to 0.0 |" in paired.output
    missing = CliRunner().invoke(main, [str(tmp_path / "none")])
    assert missing.exit_code == 1
    assert "is no run" in missing.output
