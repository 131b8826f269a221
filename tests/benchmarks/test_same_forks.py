"""The check of forks finds none that goes on otherwise, and one that does."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from benchmarks.checks import same_forks, same_steps
from er_gym.envs.action_handler import DefaultActionHandler
from er_gym.tasks.types import TASK_TYPES


@pytest.fixture(autouse=True)
def _few_cases(monkeypatch: pytest.MonkeyPatch) -> None:
    explore = {"obs_mode": "state", "instances": "explore"}
    cases = (same_steps.Case("explore", "mini", 1, 0.0, explore),)
    monkeypatch.setattr(same_forks, "CASES", cases)
    monkeypatch.setattr(same_forks, "TASK_TYPES", TASK_TYPES[2:3])


def test_forks_go_on_as_their_origin() -> None:
    result = CliRunner().invoke(same_forks.main, ["--forks", "10"])
    assert result.exit_code == 0, result.output
    assert ": 0 differences" in result.output


def test_a_handler_that_forgets_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = DefaultActionHandler.state
    monkeypatch.setattr(DefaultActionHandler, "state", lambda self: {**whole(self), "visited": {}})
    result = CliRunner().invoke(same_forks.main, ["--forks", "60"])
    assert result.exit_code == 1, result.output
    assert "explore, seed " in result.output
