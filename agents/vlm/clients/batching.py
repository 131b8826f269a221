"""Batches jobs from many threads and runs each batch in one thread.

A model takes hardly longer for eight conversations than for one, and only one thread at a time can
use it.
"""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, InvalidStateError
from dataclasses import dataclass, field
from typing import Generic, TypeVar

from agents.vlm.chat import ModelError
from er_gym.rollout.agent import CannotGoOn

Job = TypeVar("Job")
Result = TypeVar("Result")

_CLOSED = "the model has been closed"


@dataclass(frozen=True)
class _Asked(Generic[Job, Result]):
    """A job and the future of its result."""

    job: Job
    answer: Future[Result] = field(default_factory=Future)


@dataclass(frozen=True)
class _Failure:
    """How a batch failed. It does not hold the exception, whose traceback would keep the batch's
    memory alive."""

    kind: type[Exception]
    message: str


class Batcher(Generic[Job, Result]):
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
        self._waiting: queue.SimpleQueue[_Asked[Job, Result] | None] = queue.SimpleQueue()
        self._lock = threading.Lock()
        self._closed = False
        # A daemon: a program that ends without close() ends all the same.
        self._thread = threading.Thread(target=self._serve, name="model", daemon=True)
        self._thread.start()

    def do(self, job: Job) -> Result:
        """Run a job with the next batch and return its result.

        Raises:
            ModelError: the job failed.
            CannotGoOn: no job can succeed any more, or :meth:`close` was called.
        """
        asked: _Asked[Job, Result] = _Asked(job)
        try:
            with self._lock:
                if self._closed:
                    raise CannotGoOn(_CLOSED)
                self._waiting.put(asked)
            return asked.answer.result()
        except BaseException:  # Ctrl-C, for example: nobody waits for the result any longer
            asked.answer.cancel()
            raise

    def close(self) -> None:
        """End the thread once ``run`` returns; waiting callers get CannotGoOn."""
        with self._lock:
            self._closed = True
            self._waiting.put(None)  # wakes the thread
        self._thread.join()

    # -- the thread ------------------------------------------------------------------------------

    def _serve(self) -> None:
        batch: list[_Asked[Job, Result]] = []
        try:
            while not self._closed:
                batch = self._gathered()
                self._answer([each for each in batch if each.answer.set_running_or_notify_cancel()])
        finally:  # closed, or run raised a BaseException: no caller may wait for ever
            with self._lock:
                self._closed = True
            while not self._waiting.empty():
                if (left := self._waiting.get()) is not None:
                    batch.append(left)
            _refuse(batch, CannotGoOn, _CLOSED)

    def _gathered(self) -> list[_Asked[Job, Result]]:
        """The next batch, once there is one; fewer jobs, or none, once it is closed."""
        batch = [self._waiting.get()]
        until = time.monotonic() + self._wait
        while batch[-1] is not None and len(batch) < self._size:
            try:
                batch.append(self._waiting.get(timeout=max(0.0, until - time.monotonic())))
            except queue.Empty:
                break
        return [each for each in batch if each is not None]

    def _answer(self, batch: Sequence[_Asked[Job, Result]]) -> None:
        if not batch:
            return
        failure = _Failure(CannotGoOn, _CLOSED) if self._closed else self._tried(batch)
        if failure is None:
            return
        if issubclass(failure.kind, CannotGoOn):
            _refuse(batch, CannotGoOn, failure.message)
        elif len(batch) == 1:
            _refuse(batch, ModelError, failure.message)
        elif issubclass(failure.kind, MemoryError):
            self._size = len(batch) // 2
            while batch:  # in parts that may become still smaller on the way
                part, batch = batch[: self._size], batch[self._size :]
                self._answer(part)
        else:
            for each in batch:
                self._answer([each])

    def _tried(self, batch: Sequence[_Asked[Job, Result]]) -> _Failure | None:
        try:
            results = self._run([each.job for each in batch])
            for each, result in list(zip(batch, results, strict=True)):
                each.answer.set_result(result)
        except Exception as error:
            words = " ".join(str(error).split())
            if not isinstance(error, (CannotGoOn, ModelError)):
                words = f"{type(error).__name__}: {words}"
            return _Failure(type(error), words)
        return None


def _refuse(batch: Sequence[_Asked[Job, Result]], kind: type[Exception], message: str) -> None:
    for each in batch:
        with contextlib.suppress(InvalidStateError):  # it has its answer, or nobody waits for it
            each.answer.set_exception(kind(message))
