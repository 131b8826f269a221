"""Two runs over the same tasks: what differs, in numbers and task by task."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import comb
from statistics import fmean
from typing import Literal, TypeAlias

from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.scoring.metrics import TIDY
from benchmarks.scoring.paired import paired_difference

Change: TypeAlias = Literal["gained", "lost", "both", "neither"]
CHANGES: tuple[Change, ...] = ("gained", "lost", "both", "neither")
"""Which of two runs a task succeeds more often in: the second, the first; or in both as often, or
in neither."""
MEASURES = ("success", TIDY)
"""What runs are compared by."""
_FEWEST = 10
"""Over fewer tasks no interval is told."""


@dataclass(frozen=True)
class Pair:
    """A task of two runs.

    Attributes:
        task_id: its id.
        first, second: what each run tells of its episodes, at least one.
        measure: what is compared, one of :data:`MEASURES`, which all of them tell.
    """

    task_id: str
    first: Sequence[EpisodeRow]
    second: Sequence[EpisodeRow]
    measure: str = "success"

    @property
    def rates(self) -> tuple[float, float]:
        """The share of its episodes that succeeded, in each run."""
        first, second = (
            fmean(getattr(row, self.measure) for row in rows) for rows in (self.first, self.second)
        )
        return first, second

    @property
    def change(self) -> Change:
        """See :data:`CHANGES`."""
        before, after = self.rates
        if before == after:
            return "both" if after else "neither"
        return "gained" if after > before else "lost"

    @property
    def key(self) -> str:
        """The name of the first episode that both runs have; "" if there is none."""
        there = {row.key for row in self.second}
        return next((row.key for row in self.first if row.key in there), "")


@dataclass(frozen=True)
class Difference:
    """How much more the second run succeeds, over some tasks. One that was played several times
    counts with its mean, since its episodes are not independent.

    Attributes:
        name: of what was counted.
        n: tasks; ``counts``: by their change.
        first, second: success, as fractions.
        difference, low, high: second - first with its 95 % interval
            (:func:`~benchmarks.scoring.paired.paired_difference`), which says too much for fewer
            than ten tasks, or if none changed: then None.
        chance: the p value of the sign test, which is McNemar's exact one where each task was
            played once: how likely at least so unequal numbers of gained and lost tasks are if
            neither run is better.
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


def measures_of(runs: Iterable[Mapping[str, EpisodeRow]]) -> tuple[str, ...]:
    """The measures by which some runs can be compared: those that all their results tell."""
    results = [row.result for rows in runs for row in rows.values()]
    return tuple(
        measure
        for measure in MEASURES
        if all(row is None or getattr(row, measure) is not None for row in results)
    )


def pairs_of(
    first: Mapping[str, EpisodeRow], second: Mapping[str, EpisodeRow], measure: str = "success"
) -> list[Pair]:
    """The tasks that have come out in both runs; episodes that crashed are failures, as everywhere
    (:mod:`er_gym.rollout.outcomes`)."""
    one, other = _by_task(first), _by_task(second)
    return [Pair(task, rows, other[task], measure) for task, rows in one.items() if task in other]


def _by_task(rows: Mapping[str, EpisodeRow]) -> dict[str, list[EpisodeRow]]:
    found: dict[str, list[EpisodeRow]] = {}
    for row in rows.values():
        if row.result is not None:
            found.setdefault(row.task_id, []).append(row.result)
    return {task: sorted(several, key=lambda row: row.sample) for task, several in found.items()}


def difference(name: str, pairs: Sequence[Pair]) -> Difference:
    """Count some pairs."""
    counts: dict[Change, int] = dict.fromkeys(CHANGES, 0)
    for pair in pairs:
        counts[pair.change] += 1
    rates = [pair.rates for pair in pairs] or [(0.0, 0.0)]
    mean, low, high = 0.0, None, None
    if pairs:
        before = [row for pair in pairs for row in pair.first]
        after = [row for pair in pairs for row in pair.second]
        estimate = paired_difference(before, after, pairs[0].measure)
        mean = estimate.mean
        if len(pairs) >= _FEWEST and counts["gained"] + counts["lost"]:
            low, high = estimate.low, estimate.high
    return Difference(
        name=name,
        n=len(pairs),
        counts=counts,
        first=fmean(before for before, _ in rates),
        second=fmean(after for _, after in rates),
        difference=mean,
        low=None if low is None else max(-1.0, low),
        high=None if high is None else min(1.0, high),
        chance=mcnemar(counts["gained"], counts["lost"]),
    )


def by_type(pairs: Sequence[Pair]) -> list[Difference]:
    """The difference for each task type."""
    types: dict[str, list[Pair]] = {}
    for pair in pairs:
        types.setdefault(pair.second[0].task_type, []).append(pair)
    return [difference(name, types[name]) for name in sorted(types)]


def mcnemar(gained: int, lost: int) -> float:
    """The p value of the two-sided sign test, McNemar's exact one for pairs of successes."""
    changed, fewer = gained + lost, min(gained, lost)
    tail = sum(comb(changed, k) for k in range(fewer + 1))
    return min(1.0, 2 * tail / 2**changed)
