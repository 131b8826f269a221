"""How a run's success rate is computed: which episodes count, and which are a success.

The rate of success of a run is over the episodes that its records hold, each counted once, by its
latest result. An episode that crashed is a failure until it has been played again. Episodes under
way or still to be played, tasks that were set aside and files that are no episodes are not counted.
Progress, reports, pages and trackers all use this module.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

from er_gym.rollout.records import EpisodeRecord


def succeeded(success: bool, error: str) -> bool:
    """Whether an episode counts as a success: the judge said so, and it did not crash."""
    return success and not error


@dataclass
class Outcomes:
    """The results of a run's episodes so far."""

    _success: dict[str, bool] = field(default_factory=dict)
    _crashed: set[str] = field(default_factory=set)

    @classmethod
    def of(cls, episodes: Iterable[EpisodeRecord]) -> Outcomes:
        """Those of some records."""
        found = cls()
        for each in episodes:
            found.add(each.key, each.success, each.error)
        return found

    def add(self, key: str, success: bool, error: str) -> None:
        """Count an episode's result; a later one replaces it. ``error`` is "" if it did not
        crash."""
        self._success[key] = succeeded(success, error)
        self._crashed.discard(key)
        if error:
            self._crashed.add(key)

    @property
    def n(self) -> int:
        """How many episodes have a result."""
        return len(self._success)

    @property
    def successes(self) -> int:
        """How many of them are a success."""
        return sum(self._success.values())

    @property
    def crashed(self) -> int:
        """How many of them crashed, which the same command plays again."""
        return len(self._crashed)

    @property
    def rate(self) -> float:
        """Successes / n.

        Raises:
            ValueError: no episode has a result.
        """
        if not self.n:
            raise ValueError("no episodes: a rate needs at least one")
        return self.successes / self.n
