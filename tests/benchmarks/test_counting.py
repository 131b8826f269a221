"""A run has one rate of success, wherever it is told: the same n, the same successes."""

from __future__ import annotations

import io
import json
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import redirect_stderr
from pathlib import Path

import pytest
from fastapi.testclient import TestClient
from sampled_agents import TASKS
from unsteady_agent import CRASHES

from benchmarks.cli import main as cli
from benchmarks.monitor import comparison
from benchmarks.monitor.app import make_app
from benchmarks.monitor.comparison import difference, pairs_of
from benchmarks.monitor.directories import Directories
from benchmarks.monitor.export import ExportRequest, export
from benchmarks.monitor.run_view import RunView
from benchmarks.scoring.metrics import score_episode
from benchmarks.scoring.paired import paired_difference
from benchmarks.scoring.report import RunReport, load_run, sample_slices, slices
from benchmarks.scoring.scorers import CORRECTED, SCORERS
from er_gym.rollout.events import EVENTS, read_events
from er_gym.rollout.outcomes import Outcomes
from er_gym.rollout.run_directory import EPISODES, RunDirectory
from tests.support import ROOT, in_one_test

Command = Callable[..., tuple[int, str, str]]
BENCH = (
    *("bench", "--suite", "mini", "--agent", "unsteady_agent:Unsteady", "--samples", "2"),
    *("--task-ids", ",".join(TASKS), "--track", "tensorboard"),
)


def told(run: Path) -> tuple[int, float, float | None, float | None]:
    """n, rate and interval, as the report has them."""
    summary = slices(load_run(run).scores[CORRECTED.name])[0][2]
    rate = summary["success"]
    return summary.n, rate.mean, rate.low, rate.high


def shown(run: Path) -> tuple[int, float | None, float | None, float | None]:
    """The same, as the monitor has them."""
    view = RunView(Directories([run]).of_kind("run")[0])
    view.read()
    count = view.summary().success
    return count.n, count.rate, count.low, count.high


def logged(run: Path) -> dict[int, float]:
    """Step to success in TensorBoard's logs; each step is there once."""
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    found = EventAccumulator(str(run / "tensorboard"))
    found.Reload()
    points = found.Scalars("success")
    assert len({each.step for each in points}) == len(points)
    return {each.step: each.value for each in points}


def check_all_surfaces(run: Path, err: str) -> None:
    n, rate, low, high = told(run)
    assert shown(run) == (n, pytest.approx(rate), pytest.approx(low), pytest.approx(high))
    steps = logged(run)
    assert sorted(steps) == [*range(1, len(steps) + 1)]
    assert steps[max(steps)] == pytest.approx(rate)
    (last,) = re.findall(r"6/6 episodes, ([\d.]+) % success", err)
    assert last == f"{100 * rate:.1f}"
    outcomes = Outcomes.of(RunDirectory.open(run).episodes())
    assert (outcomes.n, outcomes.rate) == (n, pytest.approx(rate))


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Six episodes, of which two succeed, two are given up and two crash; and what was shown."""
    out = tmp_path_factory.mktemp("counted") / "run"
    shown = io.StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stderr(shown):
        patch.setenv(CRASHES, ",".join(TASKS[:2]))
        with pytest.raises(SystemExit) as left:
            cli.main([*BENCH, "--out", str(out)])
    assert left.value.code == 1
    return out, shown.getvalue()


@pytest.fixture
def run(played: tuple[Path, str], tmp_path: Path) -> Path:
    """A copy of it, for one test."""
    return shutil.copytree(played[0], tmp_path / "run")


def test_every_surface_tells_the_same_rate(played: tuple[Path, str], er_gym: Command) -> None:
    run, err = played
    assert told(run)[:2] == (6, pytest.approx(1 / 3))
    check_all_surfaces(run, err)
    _, out, _ = er_gym("report", run)
    assert "33.33" in out
    assert "2 of 6 episodes crashed and count as failures" in out
    page = run.parent / "run.html"
    export(ExportRequest(run=run, out=page, episodes=None, draw=False))
    assert "33.3" in page.read_text(encoding="utf-8")


def test_crashes_are_failures_until_they_are_played_again(run: Path, er_gym: Command) -> None:
    code, _, err = er_gym(*BENCH, "--out", run)
    assert code == 0, err
    assert told(run)[:2] == (6, pytest.approx(2 / 3))
    check_all_surfaces(run, err)
    assert sorted(logged(run)) == [*range(1, 9)]  # six results, and two of episodes played again


def test_what_a_kill_left_and_what_was_taken_away(run: Path, er_gym: Command) -> None:
    """Records count: one without an event does, an event without a record does not."""
    stream = run / EVENTS
    lines = stream.read_bytes().splitlines(keepends=True)
    ends = [n for n, line in enumerate(lines) if b'"kind":"episode_ended"' in line]
    lines = lines[: ends[-1]]  # killed after a record, before its event
    stream.write_bytes(b"".join(lines))
    assert shown(run) == told(run)
    assert told(run)[0] == 6
    (run / EPISODES / f"{TASKS[2]}.json").unlink()
    assert shown(run) == told(run)
    assert told(run)[0] == 5
    code, _, err = er_gym(*BENCH, "--out", run)
    assert code == 0, err
    assert told(run)[:2] == (6, pytest.approx(2 / 3))
    check_all_surfaces(run, err)
    ended = [each.task_id for each in read_events(run, ["episode_ended"])]
    assert set(ended) == {each.key for each in RunDirectory.open(run).episodes()}


def test_while_crashed_ones_are_played_again(run: Path) -> None:
    """The old results count until there are new ones, in the pages as in the report."""
    lines = (run / EVENTS).read_bytes().splitlines(keepends=True)
    begun = next(line for line in lines if b'"kind":"run_begun"' in line)
    crashed = next(each for each in RunDirectory.open(run).episodes() if each.error)
    again = next(
        line
        for line in lines
        if b'"kind":"episode_begun"' in line and json.loads(line)["task_id"] == crashed.key
    )
    with (run / EVENTS).open("ab") as stream:
        stream.write(begun + again)
    assert shown(run) == told(run)


def test_a_comparison_counts_as_the_reports_do(
    run: Path, er_gym: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(comparison, "_FEWEST", 2)  # usually there is no interval over so few
    other = run.parent / "oracle"
    code, _, err = er_gym(
        *BENCH[:3], *("--agent", "oracle", "--task-ids", ",".join(TASKS), "--samples", "2"),
        *("--out", other),
    )  # fmt: skip
    assert code == 0, err
    rows = []
    for each in (run, other):
        view = RunView(Directories([each]).of_kind("run")[0])
        view.read()
        rows.append(view.rows)
    found = difference("", pairs_of(*rows))
    reports: list[RunReport] = [load_run(each) for each in (run, other)]
    paired = paired_difference(*(each.scores[CORRECTED.name] for each in reports))
    assert found.n == 3  # tasks, each played twice
    assert (found.first, found.second) == (pytest.approx(told(run)[1]), 1.0)
    assert found.difference == pytest.approx(paired.mean)
    assert (found.low, found.high) == (paired.low, pytest.approx(min(paired.high or 1.0, 1.0)))
    assert sum(found.counts.values()) == 3


def test_a_run_with_samples_tells_pass_at_k_as_the_report_does(run: Path) -> None:
    view = RunView(Directories([run]).of_kind("run")[0])
    view.read()
    scores = load_run(run).scores[CORRECTED.name]
    expected = {name if level == "group" else "": counted
                for level, name, counted in sample_slices(scores) if level != "type"}  # fmt: skip
    assert dict(view.sample_counts()) == expected
    client = TestClient(make_app([run]), base_url="http://127.0.0.1")
    (row,) = client.get("/").text.split("<tbody>")[1].split("</tbody>")[:1]
    page = client.get(re.findall(r'href="(/runs/\w+)"', row)[0]).text
    assert "pass@2" in page
    assert page.count(">sample 1<") == page.count(">sample 2<") == 3


@in_one_test("name", SCORERS)
def test_no_scorer_counts_a_crash_after_the_last_action(name: str, run: Path) -> None:
    done = next(each for each in RunDirectory.open(run).episodes() if each.success)
    assert score_episode(done, SCORERS[name]).success
    crashed = done.model_copy(update={"error": "OSError: later", "success": False})
    scored = score_episode(crashed, SCORERS[name])
    assert not scored.success
    assert scored.search_efficiency == 0


def test_after_a_sigkill_the_logs_have_each_step_once(tmp_path: Path, er_gym: Command) -> None:
    run = tmp_path / "run"
    options = (
        *("bench", "--suite", "mini", "--types", "single_search", "--limit", "6"),
        *("--agent", "random", "--track", "tensorboard", "--out", str(run)),
    )
    with subprocess.Popen(
        [sys.executable, "-m", "benchmarks.cli", *options],
        cwd=ROOT,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    ) as first:
        while sum(1 for _ in read_events(run, ["episode_ended"])) < 2:
            assert first.poll() is None
            time.sleep(0.01)
        first.send_signal(signal.SIGKILL)
    there = len([*RunDirectory.open(run).episodes()])
    code, _, err = er_gym(*options)
    assert code == 0, err
    n, rate, *_ = told(run)
    assert 2 <= there <= n == 6
    steps = logged(run)
    assert sorted(steps) == [*range(1, n + 1)]
    assert steps[n] == pytest.approx(rate)
    assert shown(run)[:2] == (n, pytest.approx(rate))
