"""Batches jobs from many threads and runs each batch in one thread.

A model takes hardly longer for eight conversations than for one, and only one thread at a time can
use it.
"""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from concurrent.futures import Future, InvalidStateError
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from agents.vlm.chat import ModelError
from er_gym.rollout.agent import CannotGoOn

Job = TypeVar("Job")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Asked(Generic[Job, Result]):
    """A job and the future of its result."""

    job: Job
    answer: Future[Result] = field(default_factory=Future)


@dataclass(frozen=True)
class Failure:
    """How jobs failed. It does not hold the exception, whose traceback would keep their memory
    alive."""

    kind: type[Exception]
    message: str

    @classmethod
    def of(cls, error: Exception) -> Failure:
        """The failure that an exception is."""
        words = " ".join(str(error).split())
        if not isinstance(error, (CannotGoOn, ModelError)):
            words = f"{type(error).__name__}: {words}"
        return cls(type(error), words)

    def tell(self, asked: Asked[Any, Any]) -> None:
        """Make it the answer to a job."""
        kind = CannotGoOn if issubclass(self.kind, CannotGoOn) else ModelError
        with contextlib.suppress(InvalidStateError):  # it has its answer, or nobody waits for it
            asked.answer.set_exception(kind(self.message))


CLOSED = Failure(CannotGoOn, "the model has been closed")


class JobThread(ABC, Generic[Job, Result]):
    """Does jobs from many threads in a thread of its own, which starts in ``__init__``: a subclass
    sets its own attributes before.

    Attributes:
        waiting: the jobs that nobody has taken yet; None wakes the thread.
        closed: whether :meth:`close` has been called.
    """

    def __init__(self) -> None:
        self.waiting: queue.SimpleQueue[Asked[Job, Result] | None] = queue.SimpleQueue()
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
        asked: Asked[Job, Result] = Asked(job)
        try:
            with self._lock:
                if self.closed:
                    raise CannotGoOn(CLOSED.message)
                self.waiting.put(asked)
            return asked.answer.result()
        except BaseException:  # Ctrl-C, for example: nobody waits for the result any longer
            asked.answer.cancel()
            raise

    def close(self) -> None:
        """End the thread once the jobs at hand allow it; waiting callers get CannotGoOn."""
        with self._lock:
            self.closed = True
            self.waiting.put(None)  # wakes the thread
        self._thread.join()

    @abstractmethod
    def work(self) -> None:
        """Wait for jobs and do some. It is called in the thread again and again until closed."""

    @abstractmethod
    def unanswered(self) -> Sequence[Asked[Job, Result]]:
        """The jobs that have been taken from the queue and may have no answer yet."""

    def _serve(self) -> None:
        try:
            while not self.closed:
                self.work()
        finally:  # closed, or work raised a BaseException: no caller may wait for ever
            with self._lock:
                self.closed = True
            for each in self.unanswered():
                CLOSED.tell(each)
            while not self.waiting.empty():
                if (left := self.waiting.get()) is not None:
                    CLOSED.tell(left)


class Batcher(JobThread[Job, Result]):
    """Runs jobs from many threads in batches, in one thread of its own.

    If a batch fails, its jobs are run one by one, so that only the faulty jobs fail. If a batch
    does not fit into memory, it is halved, and no larger batch is tried afterwards.

    Args:
        run: runs some jobs together and returns their results in order. It raises MemoryError if
            there are too many jobs, CannotGoOn if no job can succeed any more, and any other
            exception if a job is faulty. It is always called from the same thread.
        size: the largest batch.
        wait: seconds that a job waits for others.
    """

    def __init__(
        self, run: Callable[[Sequence[Job]], Sequence[Result]], size: int, wait: float
    ) -> None:
        self._run, self._size, self._wait = run, size, wait
        self._batch: Sequence[Asked[Job, Result]] = ()
        super().__init__()

    def unanswered(self) -> Sequence[Asked[Job, Result]]:
        """The batch at hand."""
        return self._batch

    def work(self) -> None:
        """Run a batch."""
        self._batch = self._gathered()
        self._answer([each for each in self._batch if each.answer.set_running_or_notify_cancel()])

    def _gathered(self) -> list[Asked[Job, Result]]:
        """The next batch, once there is one; fewer jobs, or none, once it is closed."""
        batch = [self.waiting.get()]
        until = time.monotonic() + self._wait
        while batch[-1] is not None and len(batch) < self._size:
            try:
                batch.append(self.waiting.get(timeout=max(0.0, until - time.monotonic())))
            except queue.Empty:
                break
        return [each for each in batch if each is not None]

    def _answer(self, batch: Sequence[Asked[Job, Result]]) -> None:
        if not batch:
            return
        failure = CLOSED if self.closed else self._tried(batch)
        if failure is None:
            return
        if len(batch) == 1 or issubclass(failure.kind, CannotGoOn):
            for each in batch:
                failure.tell(each)
        elif issubclass(failure.kind, MemoryError):
            self._size = len(batch) // 2
            while batch:  # in parts that may become still smaller on the way
                part, batch = batch[: self._size], batch[self._size :]
                self._answer(part)
        else:
            for each in batch:
                self._answer([each])

    def _tried(self, batch: Sequence[Asked[Job, Result]]) -> Failure | None:
        try:
            results = self._run([each.job for each in batch])
            for each, result in list(zip(batch, results, strict=True)):
                each.answer.set_result(result)
        except Exception as error:
            return Failure.of(error)
        return None
