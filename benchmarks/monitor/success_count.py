"""Counts of successes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.scoring.metrics import success_rate


@dataclass(frozen=True)
class SuccessCount:
    """A count of successes, as reports have it (:mod:`er_gym.rollout.outcomes`).

    Attributes:
        name: of what was counted.
        results: the task of each episode that has come out, and whether it is a success.
        rate, low, high: success with its 95 % interval, as fractions; None without episodes.
    """

    name: str
    results: Sequence[tuple[str, bool]] = field(default=(), repr=False)
    rate: float | None = None
    low: float | None = None
    high: float | None = None

    @property
    def n(self) -> int:
        """How many episodes have come out."""
        return len(self.results)

    @property
    def successes(self) -> int:
        """How many of them are a success."""
        return sum(success for _, success in self.results)

    @staticmethod
    def over(name: str, results: Sequence[tuple[str, bool]]) -> SuccessCount:
        """Count some results."""
        if not results:
            return SuccessCount(name)
        tasks, successes = zip(*results, strict=True)
        estimate = success_rate(tasks, successes)
        return SuccessCount(name, results, estimate.mean, estimate.low, estimate.high)

    @staticmethod
    def of(name: str, rows: Iterable[EpisodeRow]) -> SuccessCount:
        """Count the episodes of a run."""
        told = [row.result for row in rows]
        return SuccessCount.over(
            name, [(row.task_id, row.success) for row in told if row is not None]
        )
