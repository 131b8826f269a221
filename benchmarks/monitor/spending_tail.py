"""Follows the ledger of a run while it grows: what its replies have cost."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from pydantic import ValidationError

from agents.vlm.clients.budget import Entry
from benchmarks.monitor.line_tail import LineTail
from er_gym.rollout.events import Cost
from er_gym.rollout.run_directory import SPENDING

_LONGEST = 2**20
"""A line with more bytes is no entry, and is passed over."""


@dataclass
class SpendingTail:
    """The sum of a run's ledger (:class:`agents.vlm.clients.budget.Ledger`).

    The events of a run tell valid replies alone. The ledger has every answer that was paid for,
    also those that were rejected, and a command tells its sum when it ends.

    Attributes:
        folder: the run directory.
        spent: so far; None without a ledger.
    """

    folder: Path
    spent: Cost | None = None
    _tail: LineTail = field(init=False)

    def __post_init__(self) -> None:
        self._tail = LineTail(self.folder / SPENDING, _LONGEST)

    def read(self) -> None:
        """Read what has been added. A ledger that was replaced is read from its beginning."""
        for some in self._tail.read():
            if some.anew or self.spent is None:
                self.spent = Cost(requests=0, tokens=0, cost=0.0)
            self.spent = _with(self.spent, some.lines)


def _with(spent: Cost, lines: list[bytes]) -> Cost:
    requests, tokens, cost, estimated = spent.requests, spent.tokens, spent.cost, spent.estimated
    for line in lines:
        try:
            entry = Entry.model_validate_json(line)
        except ValidationError:
            continue  # what a killed process left half-written
        requests += 1
        tokens += entry.prompt + entry.completion
        cost += entry.cost
        estimated = estimated or entry.estimated
    return Cost(requests=requests, tokens=tokens, cost=cost, estimated=estimated)
