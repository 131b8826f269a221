"""Follows the ledger of a run while it grows: what its replies have cost."""

from __future__ import annotations

from dataclasses import dataclass, field
from datetime import datetime

from pydantic import ValidationError

from agents.vlm.clients.budget import Entry
from benchmarks.monitor.curve_tail import Thinned
from benchmarks.monitor.line_tail import LineFollower, Lines
from er_gym.rollout.events import Cost


@dataclass
class SpendingTail(LineFollower):
    """The sum of a run's ledger (:class:`agents.vlm.clients.budget.Ledger`).

    The events of a run tell valid replies alone. The ledger has every answer that was paid for,
    also those that were rejected, and a command tells its sum when it ends.

    Attributes:
        spent: so far; None without a ledger.
        over: by ``cost``, ``tokens`` and ``requests``, how much was spent until a time, in seconds
            since the epoch.
        rejected: how many answers were paid for that were no valid replies.
    """

    longest = 2**20

    spent: Cost | None = None
    over: dict[str, Thinned] = field(default_factory=dict)
    rejected: int = 0

    def _take(self, lines: Lines) -> None:
        spent = self.spent or Cost(requests=0, tokens=0, cost=0.0)
        requests, tokens, cost, estimated = (
            spent.requests,
            spent.tokens,
            spent.cost,
            spent.estimated,
        )
        told: list[tuple[float | None, float, int, int]] = []
        for line in lines.lines:
            try:
                entry = Entry.model_validate_json(line)
            except ValidationError:
                continue  # what a killed process left half-written
            requests += 1
            tokens += entry.prompt + entry.completion
            cost += entry.cost
            estimated = estimated or entry.estimated
            self.rejected += bool(entry.rejected)
            told.append((seconds_of(entry.time), cost, tokens, requests))
        timed = [each for each in told if each[0] is not None]
        if timed:
            times, *sums = zip(*timed, strict=True)
            for name, values in zip(("cost", "tokens", "requests"), sums, strict=True):
                self.over.setdefault(name, Thinned()).add(times, values)
        self.spent = Cost(requests=requests, tokens=tokens, cost=cost, estimated=estimated)


def seconds_of(time: str) -> float | None:
    """A time in ISO 8601 as seconds since the epoch; None if it is none."""
    try:
        return datetime.fromisoformat(time).timestamp()
    except (ValueError, OverflowError, OSError):
        return None
