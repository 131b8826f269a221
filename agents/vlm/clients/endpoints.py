"""The servers of one model: which gets a request, and which are set aside or used again.

A request goes to the server with the fewest requests under way. A server that gives no answer, or
fails with 5xx, is set aside and asked for its list of models now and then. If it answers, one
request is sent to it on trial; a reply puts it back in use. A server that asks to wait is set aside
for that time. A server that refuses every request is set aside for good.

While all of them are set aside, requests are still sent, with the waits and tries of a single
server. A single server is never set aside.
"""

from __future__ import annotations

import itertools
import math
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal

from agents.vlm.chat import ModelError
from agents.vlm.clients.endpoint import Endpoint
from agents.vlm.clients.failures import Failure
from agents.vlm.clients.supervisor import RequestSupervisor, duration
from er_gym.rollout.agent import CannotGoOn

_FIRST_REST, _LONGEST_REST = 0.5, 30.0  # seconds until a server that is set aside is asked again
_END = 1.0  # seconds that a health check under way has to end


@dataclass
class _Standing:
    """How a server stands; the lock of :class:`Endpoints` guards it.

    Attributes:
        endpoint: the server.
        state: ``trial`` is for one that seems to be back.
        under_way: its requests.
        turn: when it was last chosen, in turns of all servers.
        since: when it was last set aside, monotonic seconds.
        until: when it is asked again.
        limited: whether it has asked to wait; otherwise a health check decides.
        rests: how often in a row it was set aside or found to be still down.
        trial: the use that tries whether it is back.
        check: the thread of its health check.
    """

    endpoint: Endpoint
    state: Literal["used", "trial", "aside", "refused"] = "used"
    under_way: int = 0
    turn: int = -1
    since: float = -math.inf
    until: float = 0.0
    limited: bool = False
    rests: int = 0
    trial: Use | None = None
    check: threading.Thread | None = None

    def rest(self) -> float:
        """The seconds until it is asked again, unless it says so itself."""
        self.rests += 1
        return min(_LONGEST_REST, _FIRST_REST * 2.0 ** min(self.rests - 1, 10))

    def rank(self, now: float) -> tuple[int, float, int, int]:
        """The server of the lowest rank gets the next request."""
        if self.state == "aside" and self.limited and now >= self.until:
            self.state = "trial"
        free = self.state == "used" or (self.state == "trial" and self.trial is None)
        kind = 0 if free else {"trial": 1, "aside": 2, "refused": 3}[self.state]
        return kind, self.until if kind == 2 else 0.0, self.under_way, self.turn

    def set_aside(self, began: float, failure: Failure) -> bool:
        """Set it aside after a failed try that began then; whether it was in use until now."""
        now = time.monotonic()
        limited = failure.server == "busy"
        if began < self.since or self.state in ("aside", "refused"):
            # Others have told that already.
            if failure.retry_after is not None and self.state == "aside":
                self.limited, self.until = True, max(self.until, now + failure.retry_after)
            return False
        was_used = self.state == "used"
        wait = self.rest() if failure.retry_after is None else failure.retry_after
        self.state, self.since, self.until, self.limited = "aside", now, now + wait, limited
        return was_used


@dataclass(frozen=True, eq=False)
class Use:
    """One try of a request on a server, and when it began (monotonic seconds)."""

    standing: _Standing
    began: float

    @property
    def endpoint(self) -> Endpoint:
        """The server."""
        return self.standing.endpoint


class Endpoints:
    """The servers of one model. All threads share them.

    Args:
        endpoints: the servers; one or more.
        model: the model's name, for messages.
        supervisor: the run's request supervisor; it reports who is set aside and who is back.
    """

    def __init__(
        self, endpoints: Sequence[Endpoint], model: str, supervisor: RequestSupervisor
    ) -> None:
        self._all = [_Standing(each) for each in endpoints]
        self._model, self._supervisor = model, supervisor
        self._lock = threading.Lock()
        self._turns = itertools.count()
        self._alone = len(self._all) == 1

    @contextmanager
    def use(self) -> Iterator[Use]:
        """The server for the next try, which is under way until the context ends."""
        self._check_those_aside()
        with self._lock:
            now = time.monotonic()
            chosen = min(self._all, key=lambda each: each.rank(now))
            used = Use(chosen, now)
            chosen.turn = next(self._turns)
            chosen.under_way += 1
            if chosen.state == "trial" and chosen.trial is None:
                chosen.trial = used
        try:
            yield used
        finally:
            with self._lock:
                chosen.under_way -= 1
                if chosen.trial is used:
                    chosen.trial = None

    def ready(self) -> bool:
        """Whether there are several servers and one of them takes requests now."""
        with self._lock:
            now = time.monotonic()
            return not self._alone and any(each.rank(now)[0] == 0 for each in self._all)

    def replied(self, used: Use) -> None:
        """Take note of a reply."""
        one = used.standing
        with self._lock:
            one.endpoint.answered = True
            one.rests = 0
            back = one.state in ("aside", "trial") and used.began >= one.since
            if back:
                one.state = "used"
        if back:
            self._tell("back", f"{self._model} at {one.endpoint.where} answers again", "in use")
            self._supervisor.wake()

    def failed(self, used: Use, failure: Failure, what: str) -> Failure:
        """Take note of a failed try.

        Args:
            used: the server that failed.
            failure: how.
            what: the same in one line, for people.

        Returns:
            The failure as it is for the request: what ends the run with one server need not end it
            with several.
        """
        if self._alone:
            return failure
        one, told = used.standing, ""
        with self._lock:
            if any(each.endpoint.answered for each in self._all):
                failure = replace(failure, no_server=False)
            if failure.fatal:
                if not one.endpoint.answered and one.since == -math.inf:
                    return failure  # the run has just begun: its user sets that right
                told = "" if one.state == "refused" else "; not asked again"
                one.state, one.since = "refused", time.monotonic()
                if all(each.state == "refused" for each in self._all):
                    return failure
                failure = replace(failure, fatal="", retryable=True, server="down")
            elif failure.server and one.set_aside(used.began, failure):
                wait = duration(max(0.0, one.until - time.monotonic()))
                told = f"; set aside for {wait}" if one.limited else "; set aside"
        if told:
            self._tell("aside", what + told, "left")
        self._check_those_aside()
        return failure

    def wait_asked(self, failure: Failure) -> float | None:
        """The seconds to wait after a failure, as servers ask; None if none asks."""
        if self._alone or not failure.server:
            return failure.retry_after
        with self._lock:
            ends = [each.until for each in self._all if each.state == "aside" and each.limited]
        return max(0.0, min(ends) - time.monotonic()) if ends else None

    def close(self) -> None:
        """Close all connections."""
        with self._lock:
            checks = [each.check for each in self._all]
        for check in checks:
            if check is not None:
                check.join(_END)
        for each in self._all:
            each.endpoint.close()

    def _tell(self, event: Literal["aside", "back"], what: str, which: str) -> None:
        with self._lock:
            count = sum(each.state in ("used", "trial") for each in self._all)
        self._supervisor.emit(event, f"{what}; {count} of {len(self._all)} servers {which}")

    # -- health checks -----------------------------------------------------------------------------

    def _check_those_aside(self) -> None:
        """See to it that each server that is set aside is checked; the end of a run ends checks."""
        with self._lock:
            for each in self._all:
                if self._needs_check(each) and each.check is None:
                    # A daemon: a program that ends without close() ends all the same.
                    each.check = threading.Thread(
                        target=self._check, args=(each,), name="health check", daemon=True
                    )
                    each.check.start()

    @staticmethod
    def _needs_check(one: _Standing) -> bool:
        return one.state == "aside" and not one.limited

    def _check(self, one: _Standing) -> None:
        """Ask a server until it answers."""
        request = self._supervisor.health_check()
        try:
            while True:
                request.wait(one.until - time.monotonic())
                up = one.endpoint.is_up(request)
                with self._lock:
                    if not self._needs_check(one):
                        break
                    if up:
                        one.state = "trial"
                        break
                    one.until = time.monotonic() + one.rest()
        except (CannotGoOn, ModelError):  # the run ends
            pass
        finally:
            with self._lock:
                one.check = None
        self._supervisor.wake()
