"""Two runs over the same tasks: what differs, in numbers and task by task."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import comb
from typing import Literal, TypeAlias

from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.scoring.metrics import normal

Change: TypeAlias = Literal["gained", "lost", "both", "neither"]
CHANGES: tuple[Change, ...] = ("gained", "lost", "both", "neither")
"""Which of two runs a task is a success in: only the second, only the first, both, neither."""


@dataclass(frozen=True)
class Pair:
    """An episode of two runs.

    Attributes:
        key: its name in both.
        first, second: what each run tells of it.
    """

    key: str
    first: EpisodeRow
    second: EpisodeRow

    @property
    def change(self) -> Change:
        """See :data:`CHANGES`."""
        if self.first.success == self.second.success:
            return "both" if self.second.success else "neither"
        return "gained" if self.second.success else "lost"


@dataclass(frozen=True)
class Difference:
    """How much more the second run succeeds, over some pairs.

    Attributes:
        name: of what was counted.
        n: pairs; ``counts``: by their change.
        first, second: success, as fractions.
        difference, low, high: second - first with its 95 % interval: the mean over pairs and its
            standard error; None for less than two pairs.
        chance: the p value of McNemar's exact test: how likely at least so unequal numbers of
            gained and lost tasks are if neither run is better.
    """

    name: str
    n: int
    counts: Mapping[Change, int]
    first: float
    second: float
    difference: float
    low: float | None
    high: float | None
    chance: float


def pairs_of(first: Mapping[str, EpisodeRow], second: Mapping[str, EpisodeRow]) -> list[Pair]:
    """The episodes that have come out in both runs; those that crashed are failures, as everywhere
    (:mod:`er_gym.rollout.outcomes`)."""
    found = ((key, row.result, second[key].result) for key, row in first.items() if key in second)
    return [Pair(key, one, other) for key, one, other in found if one and other]


def difference(name: str, pairs: Sequence[Pair]) -> Difference:
    """Count some pairs."""
    counts: dict[Change, int] = dict.fromkeys(CHANGES, 0)
    for pair in pairs:
        counts[pair.change] += 1
    n = len(pairs)
    gained, lost = counts["gained"], counts["lost"]
    every = normal([1.0] * gained + [-1.0] * lost + [0.0] * (n - gained - lost) or [0.0])
    return Difference(
        name=name,
        n=n,
        counts=counts,
        first=(counts["both"] + lost) / n if n else 0.0,
        second=(counts["both"] + gained) / n if n else 0.0,
        difference=every.mean,
        low=None if every.low is None else max(-1.0, every.low),
        high=None if every.high is None else min(1.0, every.high),
        chance=mcnemar(gained, lost),
    )


def by_type(pairs: Sequence[Pair]) -> list[Difference]:
    """The difference for each task type."""
    types: dict[str, list[Pair]] = {}
    for pair in pairs:
        types.setdefault(pair.second.task_type, []).append(pair)
    return [difference(name, types[name]) for name in sorted(types)]


def mcnemar(gained: int, lost: int) -> float:
    """The p value of McNemar's exact test, two-sided."""
    changed, fewer = gained + lost, min(gained, lost)
    tail = sum(comb(changed, k) for k in range(fewer + 1))
    return min(1.0, 2 * tail / 2**changed)
