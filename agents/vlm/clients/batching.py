"""Does jobs from many threads in one thread, some of them together.

A model takes hardly longer for eight conversations than for one, and only one thread at a time can
use it. A job may take many steps; then others begin and end at any of them. Jobs that are done in
whole batches are jobs of one step.
"""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Sequence
from concurrent.futures import Future, InvalidStateError
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from agents.vlm.chat import ModelError
from er_gym.rollout.agent import CannotGoOn

Job = TypeVar("Job")
State = TypeVar("State")
Result = TypeVar("Result")


@dataclass(frozen=True)
class PendingJob(Generic[Job, Result]):
    """A job and the future of its result."""

    job: Job
    answer: Future[Result] = field(default_factory=Future)


@dataclass(frozen=True)
class BatchFailure:
    """How jobs failed. It does not hold the exception, whose traceback would keep their memory
    alive."""

    kind: type[Exception]
    message: str

    @classmethod
    def of(cls, error: Exception) -> BatchFailure:
        """The failure that an exception is."""
        words = " ".join(str(error).split())
        if not isinstance(error, (CannotGoOn, ModelError)):
            words = f"{type(error).__name__}: {words}"
        return cls(type(error), words)

    def tell(self, pending: PendingJob[Any, Any]) -> None:
        """Make it the answer to a job."""
        kind = CannotGoOn if issubclass(self.kind, CannotGoOn) else ModelError
        with contextlib.suppress(InvalidStateError):  # it has its answer, or nobody waits for it
            pending.answer.set_exception(kind(self.message))


CLOSED = BatchFailure(CannotGoOn, "the model has been closed")


class SteppedJobs(Generic[Job, State, Result]):
    """Does jobs of many steps from many threads in a thread of its own.

    If a step fails, its jobs begin anew one by one, so that only the faulty ones fail. If a step
    does not fit into memory, its jobs begin anew, and from then on half as many are done together.

    Args:
        begin: makes the state of a job.
        step: goes one step further with some jobs. It raises MemoryError if there are too many,
            CannotGoOn if no job can succeed any more, and any other exception if a job is faulty.
            It is always called from the same thread.
        result: the result of a job from its state; None while it is not done.
        size: the most jobs at once.
        wait: seconds that a job waits for others before its first step, if no job has begun.

    Attributes:
        waiting: the jobs that nobody has taken yet; None wakes the thread.
        closed: whether :meth:`close` has been called.
    """

    def __init__(
        self,
        begin: Callable[[Job], State],
        step: Callable[[Sequence[State]], None],
        result: Callable[[State], Result | None],
        size: int,
        wait: float = 0.0,
    ) -> None:
        self._begin, self._step, self._result = begin, step, result
        self._size, self._wait = size, wait
        self._running: list[tuple[PendingJob[Job, Result], State]] = []
        self._again: deque[PendingJob[Job, Result]] = deque()
        self._alone: deque[PendingJob[Job, Result]] = deque()
        self.waiting: queue.SimpleQueue[PendingJob[Job, Result] | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self.closed = False
        # A daemon: a program that ends without close() ends all the same.
        self._thread = threading.Thread(target=self._serve, name="model", daemon=True)
        self._thread.start()

    def do(self, job: Job) -> Result:
        """Do a job together with others and return its result.

        Raises:
            ModelError: the job failed.
            CannotGoOn: no job can succeed any more, or :meth:`close` was called.
        """
        pending: PendingJob[Job, Result] = PendingJob(job)
        try:
            with self._lock:
                if self.closed:
                    raise CannotGoOn(CLOSED.message)
                self.waiting.put(pending)
            return pending.answer.result()
        except BaseException:  # Ctrl-C, for example: nobody waits for the result any longer
            pending.answer.cancel()
            raise

    def close(self) -> None:
        """End the thread after the current step; waiting callers get CannotGoOn."""
        with self._lock:
            self.closed = True
            self.waiting.put(None)  # wakes the thread
        self._thread.join()

    # -- in the thread of the jobs -----------------------------------------------------------------

    def _serve(self) -> None:
        try:
            while not self.closed:
                self._work()
        finally:  # closed, or a job raised a BaseException: no caller may wait for ever
            with self._lock:
                self.closed = True
            for each in (*(pending for pending, _ in self._running), *self._again, *self._alone):
                CLOSED.tell(each)
            while not self.waiting.empty():
                if (left := self.waiting.get()) is not None:
                    CLOSED.tell(left)

    def _work(self) -> None:
        """Take new jobs in, and go one step further with all."""
        if self._alone:
            self._do_alone(self._alone[0])
            self._alone.popleft()
            return
        self._take_in()
        if not self._running or self.closed:
            return
        try:
            self._step([state for _, state in self._running])
            results = [self._result(state) for _, state in self._running]
        except Exception as error:
            self._failed(BatchFailure.of(error))
            return
        going_on = []
        for (pending, state), result in zip(self._running, results, strict=True):
            if result is None:
                going_on.append((pending, state))
            else:
                pending.answer.set_result(result)
        self._running = going_on

    def _take_in(self) -> None:
        """Begin jobs until there are enough; waits for one if there is none, and then for more."""
        wait = 0.0 if self._running else self._wait
        until = 0.0
        while len(self._running) < self._size:
            pending = self._next(until)
            if pending is None:
                return
            until = until or time.monotonic() + wait
            try:
                self._running.append((pending, self._begin(pending.job)))
            except Exception as error:
                BatchFailure.of(error).tell(pending)

    def _next(self, until: float) -> PendingJob[Job, Result] | None:
        """The next job, for which it waits until then (monotonic seconds) or, where none runs, for
        ever; None if there is none, or once it is closed."""
        if self._again:
            return self._again.popleft()
        while True:
            left = max(0.0, until - time.monotonic()) if self._running else None
            try:
                pending = self.waiting.get(timeout=left)
            except queue.Empty:
                return None
            if pending is None or pending.answer.set_running_or_notify_cancel():
                return pending

    def _failed(self, failure: BatchFailure) -> None:
        """Begin the running jobs anew, or end them."""
        jobs = [pending for pending, _ in self._running]
        self._running = []
        if len(jobs) == 1 or issubclass(failure.kind, CannotGoOn):
            for pending in jobs:
                failure.tell(pending)
        elif issubclass(failure.kind, MemoryError):
            self._size = len(jobs) // 2
            self._again.extend(jobs)
        else:
            self._alone.extend(jobs)

    def _do_alone(self, pending: PendingJob[Job, Result]) -> None:
        try:
            state = self._begin(pending.job)
            while (result := self._result(state)) is None:
                if self.closed:
                    return
                self._step([state])
        except Exception as error:
            BatchFailure.of(error).tell(pending)
        else:
            pending.answer.set_result(result)


@dataclass
class SingleStep(Generic[Job, Result]):
    """The state of a job that one step does.

    Attributes:
        job: the job.
        result: its result; None before the step.
    """

    job: Job
    result: Result | None = None


def batches(
    run: Callable[[Sequence[Job]], Sequence[Result]], size: int, wait: float
) -> SteppedJobs[Job, SingleStep[Job, Result], Result]:
    """Jobs that are done in whole batches, each in one step.

    Args:
        run: does some jobs together and returns their results in order; it raises what a step does.
        size: the largest batch.
        wait: seconds that a job waits for others.
    """

    def step(states: Sequence[SingleStep[Job, Result]]) -> None:
        results = run([each.job for each in states])
        for state, result in list(zip(states, results, strict=True)):
            state.result = result

    return SteppedJobs(SingleStep, step, lambda state: state.result, size, wait)
