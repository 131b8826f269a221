"""Episodes that nobody played."""

from __future__ import annotations

from collections.abc import Sequence

from agents.reinforce.episodes import Episode, Turn
from er_gym.rollout.records import EpisodeRecord, StepRecord


def played(steps: Sequence[StepRecord], *, appended: bool = False) -> Episode:
    """One of the task ``t`` with these steps of its agent, and perhaps an appended ``end``."""
    every = [StepRecord(verb="init", success=True), *steps]
    if appended:
        every.append(StepRecord(verb="end", success=True, appended=True))
    record = EpisodeRecord(
        task_id="t", task_type="single_search", scene="FloorPlan1", instruction="?", name="?",
        key_actions=[], max_steps=10, agent="a", seed=0, success=False, end_reason="end",
        total_reward=0.0, seconds=0.0, steps=every,
    )  # fmt: skip
    return Episode(record, tuple(Turn([1], [2], [], "x") for _ in steps))
