"""Many threads ask, one works: what waits at the same time is done together.

A model takes hardly longer over eight conversations than over one, and can only be used by one
thread at a time.
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
    """A job, and where its result is waited for."""

    job: Job
    answer: Future[Result] = field(default_factory=Future)


@dataclass(frozen=True)
class _Failure:
    """How a batch failed. Not the exception: its traceback holds on to the batch's memory."""

    kind: type[Exception]
    message: str


class Batcher(Generic[Job, Result]):
    """Does jobs that come from many threads together, in one thread of its own.

    Where a batch fails, its jobs are tried one by one, so that only those fail that are at fault;
    where it does not fit into memory it is halved, and no larger one is tried afterwards.

    Args:
        run: does some jobs together and returns a result for each, in order. Raises MemoryError
            where they are too many, CannotGoOn where no job will ever succeed again, and anything
            else where one of them is at fault. Always called from the same thread.
        size: so many jobs at once, at most.
        wait: seconds that a job waits for others to join it.
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
        """Wait until a job has been done, and return its result.

        Raises:
            ModelError: it failed.
            CannotGoOn: so will all others, or :meth:`close` has been called.
        """
        asked: _Asked[Job, Result] = _Asked(job)
        try:
            with self._lock:
                if self._closed:
                    raise CannotGoOn(_CLOSED)
                self._waiting.put(asked)
            return asked.answer.result()
        except BaseException:  # Ctrl-C above all: nobody waits for it any longer
            asked.answer.cancel()
            raise

    def close(self) -> None:
        """End the thread once ``run`` returns; whoever waits gets CannotGoOn."""
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
        finally:  # closed; or run has raised what is no Exception, and nobody may wait for ever
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
