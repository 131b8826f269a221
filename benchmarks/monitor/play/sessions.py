"""The sessions that are open."""

from __future__ import annotations

import threading

from benchmarks.monitor.play.plan import Plan
from benchmarks.monitor.play.session import Refused, Session

MOST = 4
"""The most sessions at once; each has an environment in a process of its own."""
IDLE_SECONDS = 1800.0
"""A session in which the person decides nothing for so long is closed."""
_MOST_KEPT = 32
_PATIENCE_SECONDS = 5.0


class Sessions:
    """All sessions of this process.

    Args:
        most: the most that are open at once.
        idle_seconds: see :data:`IDLE_SECONDS`.
    """

    def __init__(self, most: int = MOST, idle_seconds: float = IDLE_SECONDS) -> None:
        self._most, self._idle = most, idle_seconds
        self._lock = threading.Lock()
        self._all: dict[str, Session] = {}

    def begin(self, plan: Plan) -> Session:
        """Open a session.

        Raises:
            Refused: too many are open, or one plays in the same run directory.
        """
        with self._lock:
            for each in self._open():
                if each.plan.path == plan.path and each.now.phase == "over":
                    each.close(_PATIENCE_SECONDS)  # no episode is in play that could be lost
            open_now = self._open()
            if any(each.plan.path == plan.path for each in open_now):
                raise Refused("play_twice")
            if len(open_now) >= self._most:
                raise Refused("play_too_many", 429, n=self._most)
            session = Session(plan, self._idle)
            self._all[session.id] = session
            for old in [each for each in self._all.values() if each not in open_now]:
                if len(self._all) > _MOST_KEPT and old is not session:
                    del self._all[old.id]
            return session

    def get(self, id: str) -> Session | None:
        """The session with an id, open or closed; None if there is none."""
        return self._all.get(id)

    def open_now(self) -> list[Session]:
        """Those that are open."""
        with self._lock:
            return self._open()

    def _open(self) -> list[Session]:
        return [each for each in self._all.values() if each.now.phase != "closed"]

    def close(self) -> None:
        """Close all; episodes in play leave no record."""
        there = self.open_now()
        for session in there:
            session.close()
        for session in there:
            session.close(_PATIENCE_SECONDS)
