"""Follows the ledger of a run while it grows: what its replies have cost."""

from __future__ import annotations

from dataclasses import dataclass

from pydantic import ValidationError

from agents.vlm.clients.budget import Entry
from benchmarks.monitor.line_tail import LineFollower, Lines
from er_gym.rollout.events import Cost


@dataclass
class SpendingTail(LineFollower):
    """The sum of a run's ledger (:class:`agents.vlm.clients.budget.Ledger`).

    The events of a run tell valid replies alone. The ledger has every answer that was paid for,
    also those that were rejected, and a command tells its sum when it ends.

    Attributes:
        spent: so far; None without a ledger.
    """

    longest = 2**20

    spent: Cost | None = None

    def _take(self, lines: Lines) -> None:
        spent = self.spent or Cost(requests=0, tokens=0, cost=0.0)
        requests, tokens, cost, estimated = (
            spent.requests,
            spent.tokens,
            spent.cost,
            spent.estimated,
        )
        for line in lines.lines:
            try:
                entry = Entry.model_validate_json(line)
            except ValidationError:
                continue  # what a killed process left half-written
            requests += 1
            tokens += entry.prompt + entry.completion
            cost += entry.cost
            estimated = estimated or entry.estimated
        self.spent = Cost(requests=requests, tokens=tokens, cost=cost, estimated=estimated)
