"""Does jobs of many steps from many threads, some of them together; one can begin or end at any
step."""

from __future__ import annotations

import queue
from collections import deque
from collections.abc import Callable, Sequence
from typing import Generic, TypeVar

from agents.vlm.clients.batching import Asked, Failure, Job, JobThread, Result
from er_gym.rollout.agent import CannotGoOn

State = TypeVar("State")


class SteppedJobs(JobThread[Job, Result], Generic[Job, State, Result]):
    """Does jobs of many steps in one thread of its own.

    If a step fails, its jobs begin anew one by one, so that only the faulty ones fail. If a step
    does not fit into memory, its jobs begin anew, and from then on half as many are done together.

    Args:
        begin: makes the state of a job.
        step: goes one step further with some jobs. It raises MemoryError if there are too many,
            CannotGoOn if no job can succeed any more, and any other exception if a job is faulty.
        result: the result of a job from its state; None while it is not done.
        size: the most jobs at once.
    """

    def __init__(
        self,
        begin: Callable[[Job], State],
        step: Callable[[Sequence[State]], None],
        result: Callable[[State], Result | None],
        size: int,
    ) -> None:
        self._begin, self._step, self._result = begin, step, result
        self._size = size
        self._running: list[tuple[Asked[Job, Result], State]] = []
        self._again: deque[Asked[Job, Result]] = deque()
        self._alone: deque[Asked[Job, Result]] = deque()
        super().__init__()

    def unanswered(self) -> Sequence[Asked[Job, Result]]:
        """The jobs that have begun."""
        return [*(asked for asked, _ in self._running), *self._again, *self._alone]

    def work(self) -> None:
        """Take new jobs in, and go one step further with all."""
        if self._alone:
            self._do_alone(self._alone[0])
            self._alone.popleft()
            return
        self._take_in()
        if not self._running:
            return
        try:
            self._step([state for _, state in self._running])
            results = [self._result(state) for _, state in self._running]
        except Exception as error:
            self._failed(Failure.of(error))
            return
        going_on = []
        for (asked, state), result in zip(self._running, results, strict=True):
            if result is None:
                going_on.append((asked, state))
            else:
                asked.answer.set_result(result)
        self._running = going_on

    def _take_in(self) -> None:
        """Begin jobs until there are enough; waits for one if there is none."""
        while len(self._running) < self._size:
            asked = self._next()
            if asked is None:
                return
            try:
                self._running.append((asked, self._begin(asked.job)))
            except Exception as error:
                Failure.of(error).tell(asked)

    def _next(self) -> Asked[Job, Result] | None:
        """The next job; None if there is none beside those that run, or once it is closed."""
        if self._again:
            return self._again.popleft()
        while True:
            try:
                asked = self.waiting.get(block=not self._running)
            except queue.Empty:
                return None
            if asked is None or asked.answer.set_running_or_notify_cancel():
                return asked

    def _failed(self, failure: Failure) -> None:
        """Begin the running jobs anew, or end them."""
        jobs = [asked for asked, _ in self._running]
        self._running = []
        if len(jobs) == 1 or issubclass(failure.kind, CannotGoOn):
            for asked in jobs:
                failure.tell(asked)
        elif issubclass(failure.kind, MemoryError):
            self._size = len(jobs) // 2
            self._again.extend(jobs)
        else:
            self._alone.extend(jobs)

    def _do_alone(self, asked: Asked[Job, Result]) -> None:
        try:
            state = self._begin(asked.job)
            while (result := self._result(state)) is None:
                if self.closed:
                    return
                self._step([state])
        except Exception as error:
            Failure.of(error).tell(asked)
        else:
            asked.answer.set_result(result)
