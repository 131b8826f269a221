"""The check that another commit plays the same steps, on an episode or two."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from benchmarks.checks import same_steps
from er_gym.envs import observations
from er_gym.tasks.types import TASK_TYPES


@pytest.fixture
def told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The file of two short cases."""
    state = {"obs_mode": "state"}
    cases = (
        same_steps.Case("solved", "mini", 1, 0.6, state),
        same_steps.Case("random", "mini", 1, 0.0, {**state, "protocol": "paper"}),
    )
    monkeypatch.setattr(same_steps, "CASES", cases)
    monkeypatch.setattr(same_steps, "TASK_TYPES", TASK_TYPES[2:3])
    result = CliRunner().invoke(same_steps.main, ["--write", str(tmp_path / "told.json")])
    assert result.exit_code == 0, result.output
    assert "in 2 episodes" in result.output
    return tmp_path / "told.json"


def test_the_same_commit_plays_the_same(told: Path) -> None:
    result = CliRunner().invoke(same_steps.main, ["--against", str(told)])
    assert result.exit_code == 0, result.output
    assert f"0 of 2 episodes differ from {told}" in result.output


def test_a_number_that_differs_by_its_last_bit_is_found(
    told: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cos = observations.cos
    monkeypatch.setattr(observations, "cos", lambda angle: cos(angle) * (1 + 2e-7))
    result = CliRunner().invoke(same_steps.main, ["--against", str(told)])
    assert result.exit_code == 1
    assert "2 of 2 episodes differ" in result.output


def test_the_order_and_the_kind_of_values_count() -> None:
    def digest(value: Any) -> str:
        found = same_steps.Digest()
        found.add(value)
        return found.text()

    apart: list[Any] = [{"a": 1, "b": 2}, {"b": 2, "a": 1}, {"a": 1, "b": 2.0}, ["a", 1, "b", 2]]
    assert len({digest(value) for value in apart}) == len(apart)
