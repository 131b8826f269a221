"""What the records of a run tell that its event stream does not: metrics, and why episodes failed.

Records are read a few at a time, each once, while pages wait and while they are open.
"""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from benchmarks.monitor.event_tail import EpisodeRow, Figures
from benchmarks.monitor.failures import FAILURES, failure_of
from benchmarks.scoring.metrics import (
    METRICS,
    TIDY,
    Estimate,
    Score,
    estimate_of,
    score_episode,
    success_rate,
)
from benchmarks.scoring.samples import most_samples
from benchmarks.scoring.scorers import CORRECTED, PAPER
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tasks.side_effects import KINDS

BESIDE_SUCCESS = ("search_efficiency", "completeness")
"""The metrics that the paper's table has beside success."""
SHOWN = (METRICS[0], TIDY, *METRICS[1:])
"""The metrics in the order in which pages give them."""


@dataclass
class RecordFigures:
    """Reads the records of a run.

    Attributes:
        done: how many of those that have ended have been read.
    """

    done: int = 0
    _found: dict[str, tuple[float, Figures | None]] = field(default_factory=dict)
    """By episode: when it ended, and what its record tells; None if it cannot be read."""

    def read(self, run: RunDirectory, rows: Mapping[str, EpisodeRow], seconds: float) -> None:
        """Read records that were not read yet, for a while, and tell their rows.

        Args:
            run: their directory.
            rows: its episodes.
            seconds: no record is begun later, but one is always read.
        """
        until = time.monotonic() + seconds
        self.done, late = 0, False
        for row in rows.values():
            if row.ended is None:
                continue
            known = self._found.get(row.key)
            if known is None or known[0] != row.ended:
                if late:
                    continue
                known = self._found[row.key] = row.ended, _figures(run, row)
                late = time.monotonic() > until
            row.figures = known[1]
            if row.side_effects is None and row.figures and row.figures.side_effects is not None:
                row.side_effects = len(row.figures.side_effects)
            self.done += 1


@dataclass(frozen=True)
class FailureCounts:
    """Why the episodes of a run failed.

    Attributes:
        done, failed: how many failed episodes have been read, and how many there are.
        numbers: how many failed in each way.
    """

    done: int
    failed: int
    numbers: Mapping[str, int]

    @staticmethod
    def of(rows: Iterable[EpisodeRow]) -> FailureCounts:
        """Count the episodes of a run."""
        failed = [row for row in rows if row.outcome in ("failure", "crashed")]
        read = [row for row in failed if row.figures is not None]
        return FailureCounts(len(read), len(failed), Counter(row.failure for row in read))

    def counts(self) -> list[tuple[str, int]]:
        """The number of failures of each kind that occurs, most frequent first."""
        return sorted(
            ((each, self.numbers[each]) for each in FAILURES if self.numbers[each]),
            key=lambda pair: (-pair[1], FAILURES.index(pair[0])),
        )


@dataclass(frozen=True)
class Means:
    """The metrics of some episodes, as ``er-gym bench`` prints them.

    Attributes:
        n: how many of them have been read.
        metrics: by their names, by the corrected scorer; tidy success among them where all tell it.
        by_paper: the share of successes by the paper's scorer.
        side_effects: how many there were of each kind that occurs, most frequent first.
        effects_n: how many of the episodes tell theirs.
    """

    n: int
    metrics: Mapping[str, Estimate]
    by_paper: float
    side_effects: Mapping[str, int]
    effects_n: int

    @staticmethod
    def of(rows: Iterable[EpisodeRow], metrics: Collection[str] = SHOWN) -> Means | None:
        """The means over the episodes that have been read; None if none has.

        Args:
            rows: the episodes.
            metrics: the names of those that are wanted.
        """
        read = [row for row in rows if row.figures is not None and row.figures.metrics]
        if not read:
            return None
        tasks, several = [row.task_id for row in read], most_samples(read) > 1
        told: Sequence[Figures] = [row.figures for row in read if row.figures is not None]
        columns = zip(*(each.metrics for each in told), strict=True)
        means = {
            name: estimate_of(name, tasks, values, several)
            for name, values in zip(METRICS, columns, strict=True)
            if name in metrics
        }
        tidy = [each.tidy_success for each in told]
        if TIDY in metrics and None not in tidy:
            means[TIDY] = success_rate(tasks, [bool(each) for each in tidy])
        effects = [each.side_effects for each in told if each.side_effects is not None]
        kinds = Counter(kind for each in effects for kind in each)
        return Means(
            n=len(read),
            metrics={name: means[name] for name in metrics if name in means},
            by_paper=sum(each.by_paper for each in told) / len(told),
            side_effects=dict(kinds.most_common()),
            effects_n=len(effects),
        )


def _figures(run: RunDirectory, row: EpisodeRow) -> Figures | None:
    try:
        record = run.episode(row.key)
        score: Score = score_episode(record, CORRECTED)
        return Figures(
            failure=failure_of(record) or "",
            metrics=tuple(float(getattr(score, name)) for name in METRICS),
            by_paper=PAPER.count(record).success,
            side_effects=_kinds(record.side_effects),
        )
    except (ValueError, OSError, KeyError):  # the file is gone or damaged, or of another package
        return Figures("crashed") if row.outcome == "crashed" else None


def _kinds(side_effects: Sequence[str] | None) -> tuple[str, ...] | None:
    """The kind of each side effect; that of a record of other hands may be any word."""
    if side_effects is None:
        return None
    kinds = (each.partition(" ")[0] for each in side_effects)
    return tuple(sys.intern(kind) if kind in KINDS else "-" for kind in kinds)
