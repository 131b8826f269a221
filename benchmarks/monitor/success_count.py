"""Counts of successes."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.scoring.metrics import Estimate, success_rate

Result: TypeAlias = tuple[str, bool, bool | None]


@dataclass(frozen=True)
class SuccessCount:
    """A count of successes, as reports have it (:mod:`er_gym.rollout.outcomes`).

    Attributes:
        name: of what was counted.
        results: of each episode that has come out its task, whether it is a success, and whether it
            is a tidy one; None if nobody tells.
        rate, low, high: success with its 95 % interval, as fractions; None without episodes.
        tidy: tidy success; None without episodes, and if not all tell it.
    """

    name: str
    results: Sequence[Result] = field(default=(), repr=False)
    rate: float | None = None
    low: float | None = None
    high: float | None = None
    tidy: Estimate | None = None

    @property
    def n(self) -> int:
        """How many episodes have come out."""
        return len(self.results)

    @property
    def successes(self) -> int:
        """How many of them are a success."""
        return sum(success for _, success, _ in self.results)

    @staticmethod
    def over(name: str, results: Sequence[Result]) -> SuccessCount:
        """Count some results."""
        if not results:
            return SuccessCount(name)
        tasks, successes, tidy = zip(*results, strict=True)
        estimate = success_rate(tasks, successes)
        told = None if None in tidy else success_rate(tasks, tidy)
        return SuccessCount(name, results, estimate.mean, estimate.low, estimate.high, told)

    @staticmethod
    def of(name: str, rows: Iterable[EpisodeRow]) -> SuccessCount:
        """Count the episodes of a run."""
        told = [row.result for row in rows]
        return SuccessCount.over(
            name,
            [(row.task_id, row.success, row.tidy_success) for row in told if row is not None],
        )
