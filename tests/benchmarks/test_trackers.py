"""Figures of a run for TensorBoard and trackio."""

from __future__ import annotations

import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest

from benchmarks.cli import trackers
from benchmarks.cli.bench import TRACKERS
from er_gym.rollout.run_directory import RunDirectory

RUN = ("bench", "--suite", "mini", "--types", "single_search", "--agent", "random")


def test_the_names_are_those_of_the_trackers() -> None:
    assert tuple(trackers.PACKAGES) == TRACKERS == tuple(trackers._OPEN)


def test_tensorboard_gets_the_figures_after_each_episode_of_every_start(er_gym, tmp_path) -> None:
    out = tmp_path / "run"
    for limit in (3, 5):
        code, _, err = er_gym(*RUN, "--out", out, "--limit", limit, "--track", "tensorboard")
        assert code == 0, err
    from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

    found = EventAccumulator(str(out / "tensorboard"))
    found.Reload()
    success = {event.step: event.value for event in found.Scalars("success")}
    assert sorted(success) == [1, 2, 3, 4, 5]
    won = sum(each.success for each in RunDirectory.open(out).episodes())
    assert success[5] == pytest.approx(won / 5)
    steps = [event.value for event in found.Scalars("episode/steps")]
    assert sorted(steps) == sorted(each.num_steps - 1 for each in RunDirectory.open(out).episodes())


def test_trackio_is_asked_as_it_documents(
    er_gym, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """trackio would start a server of its own, so a module in its place takes the calls."""
    calls: list[tuple[Any, ...]] = []
    run = SimpleNamespace(log=lambda figures, step: calls.append(("log", step, figures)))

    def init(**given: Any) -> Any:
        calls.append(("init", given["project"], given["name"], given["resume"]))
        return run

    stand_in = ModuleType("trackio")
    stand_in.__dict__.update(init=init, finish=lambda: calls.append(("finish",)))
    stand_in.__spec__ = SimpleNamespace(name="trackio")  # type: ignore[assignment]
    monkeypatch.setitem(sys.modules, "trackio", stand_in)
    out = tmp_path / "project" / "run"
    code, _, err = er_gym(*RUN, "--out", out, "--limit", "2", "--track", "trackio")
    assert code == 0, err
    assert calls[0] == ("init", "project", "run", "allow")
    assert [each[1] for each in calls[1:-1]] == [1, 2]
    assert {"success", "crashed", "episode/reward"} <= set(calls[-2][2])
    assert calls[-1] == ("finish",)


def test_what_is_missing_is_told_before_anything_is_played(er_gym, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(trackers, "find_spec", lambda name: None)
    code, _, err = er_gym(*RUN, "--out", tmp_path / "run", "--track", "trackio")
    assert code == 2
    assert "--track trackio needs trackio: pip install trackio" in err
    assert not list(tmp_path.rglob("*-*.json"))
