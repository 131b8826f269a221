"""Why the episodes of a run failed, counted a few at a time."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field

from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.monitor.failures import FAILURES, Failure, failure_of
from er_gym.rollout.run_directory import RunDirectory


@dataclass
class FailureCounts:
    """The failures of a run, by their kind.

    The event stream does not tell why an episode failed, so each failed one is read once.
    """

    _found: dict[str, tuple[float, Failure | None]] = field(default_factory=dict)
    _failed: int = 0

    def read(self, run: RunDirectory, rows: Mapping[str, EpisodeRow], seconds: float) -> None:
        """Read failed episodes that were not read yet, for a while.

        Args:
            run: their directory.
            rows: its episodes.
            seconds: no episode is begun later, but one is always read.
        """
        until = time.monotonic() + seconds
        failed = [row for row in rows.values() if row.outcome in ("failure", "crashed")]
        self._failed = len(failed)
        if len(self._found) > len(failed):  # some were played again
            left = {row.key for row in failed}
            self._found = {key: one for key, one in self._found.items() if key in left}
        for row in failed:
            ended = row.ended or 0.0
            if row.key in self._found and self._found[row.key][0] == ended:
                continue
            self._found[row.key] = ended, _failure(run, row)
            if time.monotonic() > until:
                return

    @property
    def done(self) -> int:
        """How many failed episodes have been read."""
        return len(self._found)

    @property
    def failed(self) -> int:
        """How many episodes failed."""
        return self._failed

    def number(self, kind: Failure) -> int:
        """The number of failures of a kind."""
        return sum(failure == kind for _, failure in self._found.values())

    def counts(self) -> list[tuple[Failure, int]]:
        """The number of failures of each kind that occurs, most frequent first."""
        number = Counter(failure for _, failure in self._found.values() if failure)
        return sorted(
            ((each, number[each]) for each in FAILURES if number[each]),
            key=lambda pair: (-pair[1], FAILURES.index(pair[0])),
        )


def _failure(run: RunDirectory, row: EpisodeRow) -> Failure | None:
    if row.outcome == "crashed":
        return "crashed"
    try:
        return failure_of(run.episode(row.key))
    except (ValueError, OSError):  # the file is gone or damaged
        return None
