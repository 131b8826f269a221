"""What states are worth: the mean of what the episodes earn that go on from them."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any, cast

from played import played

from agents.reinforce.branches import with_values
from agents.reinforce.episodes import Episode
from agents.reinforce.player import Job
from agents.reinforce.settings import ReinforceSettings
from er_gym.rollout.records import StepRecord


def episode(*rewards: float) -> Episode:
    """One whose turns do these shares of its key actions."""
    return played([StepRecord(verb="observe", success=True, reward=each) for each in rewards])


def test_episodes_are_continued_from_every_state_that_is_asked_for() -> None:
    asked: list[Job] = []

    def play(jobs: Sequence[Job]) -> list[tuple[Job, Episode, None]]:
        """The n-th continuation from turn t earns n, and one of them crashes."""
        asked.extend(jobs)
        found = []
        for job in jobs:
            _, turn, branch = job.key.split("/")
            if (turn, branch) != ("2", "1"):
                found.append((job, episode(int(branch), 2.0), None))
        return found

    settings = ReinforceSettings.model_validate({
        "rewards": {"key_actions": 1.0},
        "advantage": {"row": "branches", "branches": 2, "branch_every": 2, "discount": 0.5},
    })  # fmt: skip
    player = SimpleNamespace(forks=["a0", "a1", "a2"], snapshots=[b"0", b"1", b"2"])
    task = cast(Any, SimpleNamespace(id="t"))
    done: Any = [(Job(task, "t", 1, 7), episode(0, 0, 0), player)]
    sampler: Any = SimpleNamespace(play=play)
    (found,), continued = with_values(sampler, done, settings, lambda key: len(key))
    assert found.values == (1.5, None, 1.0)  # the means of 0 + 1 and 1 + 1, and of 0 + 1
    assert [(job.agent, job.snapshot) for job in asked] == [("a0", b"0")] * 2 + [("a2", b"2")] * 2
    assert len({job.key for job in asked}) == continued == 4
