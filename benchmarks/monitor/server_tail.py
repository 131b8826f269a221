"""Follows the log of a run's model server while it grows: failures, retries, waits."""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field

from pydantic import ValidationError

from agents.vlm.clients.supervisor import ServerEvent
from benchmarks.monitor.curve_tail import Thinned
from benchmarks.monitor.line_tail import LineFollower, Lines
from benchmarks.monitor.spending_tail import seconds_of

_LAST = 50


@dataclass
class ServerTail(LineFollower):
    """What :class:`agents.vlm.clients.supervisor.ServerEvent` lines tell.

    Attributes:
        counts: how many events of each kind there were.
        waited: seconds of all retries.
        last: the last events, oldest first.
        over: of each kind, how many there were until a time, in seconds since the epoch.
    """

    longest = 2**20

    counts: Counter[str] = field(default_factory=Counter)
    waited: float = 0.0
    last: deque[ServerEvent] = field(default_factory=lambda: deque(maxlen=_LAST))
    over: dict[str, Thinned] = field(default_factory=dict)

    def _take(self, lines: Lines) -> None:
        for line in lines.lines:
            try:
                event = ServerEvent.model_validate_json(line)
            except ValidationError:
                continue  # half a line, or of a later version
            self.counts[event.event] += 1
            self.waited += event.wait
            self.last.append(event)
            time = seconds_of(event.time)
            if time is not None:
                count = self.counts[event.event]
                self.over.setdefault(event.event, Thinned()).add([time], [count])
