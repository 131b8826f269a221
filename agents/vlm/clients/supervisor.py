"""Supervises the requests of a run: its time limit, its events, and its end.

All requests of a run share a :class:`RequestSupervisor`. It limits the run's minutes, reports what
happens to requests, and stops the run if the server refuses one request after another.
"""

from __future__ import annotations

import contextlib
import itertools
import logging
import math
import threading
import time
from collections.abc import Callable
from datetime import datetime, timezone
from typing import Literal

from pydantic import BaseModel, ConfigDict

from agents.vlm.chat import ModelError
from er_gym.rollout.agent import CannotGoOn

AGAIN = "run the same command again to continue"
REFUSED = 3
"""The run ends after this many refused requests with no reply between them."""
_QUIET = 15.0
"""Seconds without an event after which a waiting request reports itself."""
_GRACE = 5.0
"""Seconds that an answer under way still has after the run has stopped."""
_LONGEST_WAIT = 3600.0  # seconds of one wait; threads cannot wait for an infinite time

_log = logging.getLogger(__name__)


EventName = Literal[
    "retry", "waiting", "failed", "refused", "probe", "stopped", "aside", "back"
]  # fmt: skip


class ServerEvent(BaseModel):
    """A delay or a failure of the server; a line of ``server-events.jsonl``.

    Attributes:
        time: ISO 8601 in UTC.
        event: ``retry``: a try failed, and another follows after ``wait`` seconds; ``waiting``: no
            answer yet; ``failed``: a request was given up; ``refused``: one conversation was
            refused, as it would be again; ``probe``: a request failed, and a short one shows
            whether others would; ``stopped``: the run was stopped; of several servers, ``aside``:
            one is set aside; ``back``: it is back in use.
        what: what happened, in one line.
        seed: the episode's seed; None for the whole run.
        attempt, of: the number of the try, and the most tries.
        wait: seconds until the next try.
    """

    model_config = ConfigDict(frozen=True)

    time: str
    event: EventName
    what: str
    seed: int | None = None
    attempt: int = 0
    of: int = 0
    wait: float = 0.0

    def __str__(self) -> str:
        """One line for people."""
        place = f" (try {self.attempt} of {self.of})" if self.attempt else ""
        then = f"; trying again in {duration(self.wait)}" if self.event == "retry" else ""
        return f"{self.what}{place}{then}"


Listener = Callable[[ServerEvent], None]


class RequestSupervisor:
    """Supervises the requests of a run. All threads share one supervisor.

    Args:
        max_minutes: the run's time limit, counted from now; None for no limit.

    Attributes:
        show: is called with each event that the user should see, from the thread concerned;
            by default the module's logger warns.
        log_event: is called with every event.
    """

    def __init__(self, max_minutes: float | None = None) -> None:
        self.show: Listener = _warn
        self.log_event: Listener = lambda server_event: None
        self._minutes = max_minutes
        self._ends = math.inf if max_minutes is None else time.monotonic() + 60 * max_minutes
        self._changed = threading.Condition()
        self._numbers = itertools.count()
        self._refused: set[int] = set()  # those with a failed try since the last reply
        self._given_up = 0  # how many of them had no further try
        self._last_reply = -math.inf
        self._stopped: tuple[float, str, bool] | None = None
        self._closed = False
        self._last_news = time.monotonic()
        self._quiet = _QUIET

    def request(self, seed: int) -> Request:
        """A request that begins now."""
        return Request(self, next(self._numbers), seed)

    def health_check(self) -> Request:
        """A health check of a server that begins now; the end of the run ends it, too."""
        return _HealthCheck(self, next(self._numbers), seed=0)

    @property
    def over(self) -> bool:
        """Whether the time limit is reached."""
        return time.monotonic() >= self._ends

    def stop(self, why: str, *, waits_for_answers: bool = False) -> CannotGoOn:
        """End all requests that have begun.

        Args:
            why: the reason, in one line.
            waits_for_answers: whether to wait for answers under way, since they are paid for.
                Otherwise they have five seconds.

        Returns:
            The exception to raise.
        """
        with self._changed:
            self._stopped = (time.monotonic(), why, waits_for_answers)
            self._forget_refusals()
            self._changed.notify_all()
        self.emit("stopped", why)
        return CannotGoOn(why)

    def close(self) -> None:
        """End every wait; waiting requests get a ModelError."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def wake(self) -> None:
        """Let waiting requests see whether they can go on."""
        with self._changed:
            self._changed.notify_all()

    def emit(
        self,
        event: EventName,
        what: str,
        seed: int | None = None,
        attempt: int = 0,
        of: int = 0,
        wait: float = 0.0,
        shown: bool = True,
    ) -> None:
        """Report an event; for the arguments see :class:`ServerEvent`. One that is not ``shown`` is
        only logged."""
        now = datetime.now(timezone.utc).isoformat(timespec="milliseconds")
        server_event = ServerEvent(
            time=now, event=event, what=what, seed=seed, attempt=attempt, of=of, wait=wait
        )
        self._last_news = time.monotonic()
        self.log_event(server_event)
        if shown and event != "stopped":  # the exception says so
            with contextlib.suppress(OSError, ValueError):  # the terminal is closed
                self.show(server_event)

    # -- for requests ------------------------------------------------------------------------------

    def _left(self, request: Request, answering: bool) -> float:
        """The seconds left; raises the error that ends the request."""
        now = time.monotonic()
        if self._closed:
            raise ModelError("the client has been closed")
        if self._stopped is not None:
            since, why, waits = self._stopped
            still = answering and (waits or now < since + _GRACE)
            if since >= request.began and not still:
                raise CannotGoOn(why)
        if now >= self._ends:
            raise CannotGoOn(f"the {self._minutes:g} minutes are over; {AGAIN}")
        return self._ends - now

    def _wait(self, request: Request, seconds: float, unless: Callable[[], bool]) -> None:
        until = time.monotonic() + seconds
        with self._changed:
            while (left := until - time.monotonic()) > 0 and not unless():
                self._changed.wait(min(left, self._left(request, False), _LONGEST_WAIT))
        self._left(request, False)

    def _is_quiet(self) -> bool:
        """Whether there was no event for long; True for one of the waiting threads only."""
        with self._changed:
            now = time.monotonic()
            if now - self._last_news < self._quiet:
                return False
            self._last_news = now
            return True

    def _answered(self, seconds: float) -> None:
        with self._changed:
            self._forget_refusals()
            self._last_reply = self._last_news = time.monotonic()
            # A server that always takes long is not reported.
            self._quiet = max(_QUIET, 2 * seconds)

    def _forget_refusals(self) -> None:
        self._refused.clear()
        self._given_up = 0

    def _failed(self, request: Request) -> None:
        """A try of a request failed."""
        with self._changed:
            request.failing_since = min(request.failing_since, time.monotonic())
            self._refused.add(request.number)

    def _gave_up(self, request: Request) -> int:
        """How many requests in a row the server has refused; 0 if the fault may lie with this
        request alone. Raises CannotGoOn if the run has stopped meanwhile."""
        with self._changed:
            self._left(request, False)
            self._given_up += 1
            # No request got a reply in the meantime.
            dead = self._last_reply < request.failing_since and len(self._refused) >= REFUSED
            return len(self._refused) if dead or self._given_up >= REFUSED else 0


class Request:
    """A request from its first try to its reply; it belongs to one thread.

    Attributes:
        number: counts the supervisor's requests.
        seed: the episode's seed.
        began: monotonic seconds; ``failing_since``: the time of the first failed try.
        answering: whether the server has accepted the current try with a status of 2xx.
        attempt: the number of the current try; ``of``: the most tries.
    """

    def __init__(self, supervisor: RequestSupervisor, number: int, seed: int) -> None:
        self.number, self.seed = number, seed
        self.began = time.monotonic()
        self.failing_since = math.inf
        self.answering = False
        self.attempt = self.of = 0
        self._supervisor = supervisor

    def left(self, *, answering: bool = False) -> float:
        """The seconds until the run's time limit.

        Args:
            answering: whether an answer is under way.

        Raises:
            CannotGoOn: the limit is reached, or the run has stopped.
            ModelError: the client has been closed.
        """
        return self._supervisor._left(self, answering)

    def wait(self, seconds: float, unless: Callable[[], bool] = lambda: False) -> None:
        """Wait; raises as :meth:`left` if the run ends meanwhile.

        Args:
            seconds: how long.
            unless: ends the wait when it is true; :meth:`RequestSupervisor.wake` has it asked.
        """
        self._supervisor._wait(self, seconds, unless)

    def still_waiting(self, what: str, seconds: float) -> None:
        """Report that the answer is still missing, if there was no other event for long."""
        if self._supervisor._is_quiet():
            self._supervisor.emit("waiting", what, self.seed, self.attempt, self.of, seconds)

    def retry(self, what: str, wait: float, of: int, *, shown: bool = True) -> None:
        """Report that a try failed and that another of ``of`` follows."""
        self._supervisor._failed(self)
        self._supervisor.emit("retry", what, self.seed, self.attempt, of, wait, shown)

    def refused(self, what: str) -> None:
        """Report that this conversation is refused and others are not."""
        self._supervisor.emit("refused", what, self.seed, shown=False)

    def probing(self, what: str) -> None:
        """Report that a try failed and that a short request shows whether others fail as well."""
        self._supervisor.emit("probe", what, self.seed, shown=False)

    def answered(self) -> None:
        """Report a reply."""
        self._supervisor._answered(time.monotonic() - self.began)

    def gave_up(
        self, what: str, answers: Callable[[], bool] = lambda: False
    ) -> ModelError | CannotGoOn:
        """The exception to raise after the last try.

        The run stops if the server has refused several requests in a row and answers no other,
        either; otherwise the fault may lie with these requests alone.

        Args:
            what: how it failed, in one line.
            answers: asks the server something else; whether it answers.
        """
        self._supervisor._failed(self)
        try:
            refused = self._supervisor._gave_up(self)
            if refused and answers():
                self._supervisor.emit("failed", what, self.seed)
                return ModelError(what)
        except CannotGoOn as error:
            self._supervisor.emit("stopped", what, self.seed)
            return error
        if refused:
            return self._supervisor.stop(
                f"the server has refused {refused} requests in a row, the last with: {what}; see "
                f"to it, and {AGAIN}"
            )
        self._supervisor.emit("failed", what, self.seed)
        return ModelError(what)


class _HealthCheck(Request):
    """A request that nobody waits for."""

    def still_waiting(self, what: str, seconds: float) -> None:
        """Say nothing."""


def duration(seconds: float) -> str:
    """A duration for people: ``0.5 s``, ``90 s``, ``10 min``, ``5 h``."""
    if math.isinf(seconds):
        return "for ever"
    if seconds < 120:
        return f"{seconds:.1f} s" if seconds < 10 else f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.0f} h"


def _warn(server_event: ServerEvent) -> None:
    _log.warning("%s", server_event)
