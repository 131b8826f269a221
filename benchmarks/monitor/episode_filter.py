"""What the episodes of a run can be filtered and sorted by."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.monitor.listing import TaskFilter

FLAG = "flag"
"""The filter of notes that takes flagged episodes alone."""

SORTS: Mapping[str, Callable[[EpisodeRow], Any]] = {
    "ended": lambda row: row.ended or float("inf"),
    "task": lambda row: row.key,
    "type": lambda row: row.task_type,
    "scene": lambda row: room_number(row.scene),
    "outcome": lambda row: row.outcome,
    "reason": lambda row: row.end_reason,
    "failure": lambda row: row.failure,
    "efficiency": lambda row: row.metric("search_efficiency") or 0.0,
    "completeness": lambda row: row.metric("completeness") or 0.0,
    "effects": lambda row: -1 if row.side_effects is None else row.side_effects,
    "steps": lambda row: row.steps,
    "reward": lambda row: row.reward,
    "tokens": lambda row: row.tokens,
    "cost": lambda row: row.cost,
    "seconds": lambda row: row.seconds,
}
"""What rows can be sorted by."""


def room_number(scene: str) -> tuple[int, str]:
    """By what rooms are sorted: their number, then their name."""
    digits = "".join(char for char in scene if char.isascii() and char.isdigit())
    return (int(digits[:9]) if digits else -1, scene)


@dataclass(frozen=True)
class Filter(TaskFilter[EpisodeRow]):
    """Which episodes of a run are shown.

    Attributes:
        scene, outcome, failure, reason: exact values; "" for any.
        note: ``flag`` for those that are flagged, ``note`` for all of which something is noted; ""
            for any.
        steps: ``5``, ``5-10``, ``-10`` or ``5-``; "" for any.
    """

    sorts: ClassVar[Mapping[str, Callable[[EpisodeRow], Any]]] = SORTS

    scene: str = ""
    outcome: str = ""
    failure: str = ""
    reason: str = ""
    note: str = ""
    steps: str = ""
    sort: str = "-ended"

    def takes(self, row: EpisodeRow) -> bool:
        """Whether a row is shown."""
        exact = {
            "scene": row.scene,
            "outcome": row.outcome,
            "failure": row.failure,
            "reason": row.end_reason,
        }
        noted = row.note.text if row.note else ""
        said = f"{row.key} {row.instruction} {noted}"
        return (
            self.matches(row.task_type, exact, said)
            and _within(row.steps, self.steps)
            and (not self.note or (row.note is not None and (self.note != FLAG or row.note.flag)))
        )


def _within(number: int, bounds: str) -> bool:
    low, dash, high = bounds.partition("-")
    if not all(part.isascii() and (part.isdigit() or not part) for part in (low, high)):
        return True
    if not dash:
        return not low or number == int(low)
    return (not low or number >= int(low)) and (not high or number <= int(high))
