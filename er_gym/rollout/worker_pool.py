"""A pool of worker processes in which a dying process costs one try at one job.

In ``concurrent.futures``, a killed process loses all running jobs, and nothing says which job was
at fault. Here each worker has a pipe of its own and holds one job at a time. The pool thus knows
which job was lost, tries it again, and does not disturb the other jobs. (Pebble's pool knows the
job, too, but neither tries it again nor starts its processes by :mod:`er_gym.rollout.processes`.)
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Any, Generic, TypeVar

from er_gym.rollout.processes import CONTEXT, Terminated, end_processes, start_process

Job = TypeVar("Job")
Result = TypeVar("Result")


@dataclass(frozen=True)
class LostJob:
    """The result of a job whose worker died at every try.

    Attributes:
        tries: the number of tries.
        exitcode: the exit code of the last worker, minus the signal's number if a signal ended it;
            None if it is unknown. why: what is known beyond the exit code.
    """

    tries: int
    exitcode: int | None
    why: str = ""

    def __str__(self) -> str:
        last = f": {self.why}" if self.why else f" with exit code {self.exitcode}"
        return f"the worker process died {self.tries} times, last{last}"


class WorkerSetupError(RuntimeError):
    """A worker could not be set up, so no job can be done."""


@dataclass(frozen=True)
class _SetupFailed:
    message: str


@dataclass
class _Try(Generic[Job]):
    job: Job
    number: int = 1


class _Worker(Generic[Job, Result]):
    """A process, the pipe to it, and the job it holds."""

    def __init__(self, make: Callable[[], Callable[[Job], Result]]) -> None:
        self.connection, theirs = CONTEXT.Pipe()
        self.holds: _Try[Job] | None = None
        self.process = start_process(_serve, theirs, make)
        # With our copy closed, the pipe ends when the process does.
        theirs.close()

    def give(self, attempt: _Try[Job]) -> None:
        """Send the worker a job. If the process is gone, :meth:`take` raises."""
        self.holds = attempt
        with contextlib.suppress(OSError):
            self.connection.send(attempt.job)

    def take(self) -> Result | _SetupFailed:
        """The result of the worker's job; EOFError or OSError if the process is gone."""
        self.holds = None
        result: Result | _SetupFailed = self.connection.recv()
        return result

    def dismiss(self) -> None:
        """Tell the process to end, at once if it is working."""
        self.connection.close()
        if self.holds is not None:
            self.process.terminate()

    def stop(self) -> int | None:
        """End the process, by force if it does not end itself, and return its exit code."""
        self.dismiss()
        end_processes([self.process])
        return self.process.exitcode


def run_jobs(
    make: Callable[[], Callable[[Job], Result]],
    jobs: Iterable[Job],
    *,
    workers: int,
    tries: int = 3,
) -> Generator[tuple[Job, Result | LostJob], None, None]:
    """Do every job in one of ``workers`` spawned processes; yield each result when it is done.

    Leaving the iterator early (an exception, Ctrl-C, ``close()``) ends the processes. They ignore
    Ctrl-C themselves. They end when this process ends, in any way.

    Args:
        make: called once in each process; it returns the function that does the jobs. If that has a
            ``close`` method, the process calls it before it ends. ``make``, the jobs and the
            results must be picklable.
        jobs: the jobs.
        workers: the largest number of processes, at least 1.
        tries: the number of tries at a job whose process dies.

    Yields:
        The job, and its result or :class:`LostJob`.

    Raises:
        WorkerSetupError: ``make`` raised an exception.
        ValueError: ``workers`` is less than 1.
    """
    if workers < 1:
        raise ValueError(f"workers is {workers}; give a whole number from 1")
    waiting = deque(_Try(job) for job in jobs)
    team: list[_Worker[Job, Result]] = []
    try:
        for _ in range(min(workers, len(waiting))):
            team.append(_Worker(make))
        while waiting or any(worker.holds for worker in team):
            for worker in team:
                if worker.holds is None and waiting:
                    worker.give(waiting.popleft())
            busy = {worker.connection: place for place, worker in enumerate(team) if worker.holds}
            for connection in wait(list(busy)):
                place = busy[connection]  # type: ignore[index]
                attempt = team[place].holds
                assert attempt is not None
                try:
                    result = team[place].take()
                except (EOFError, OSError):
                    exitcode = team[place].stop()
                    team[place] = _Worker(make)
                    if attempt.number < tries:
                        waiting.append(_Try(attempt.job, attempt.number + 1))
                    else:
                        yield attempt.job, LostJob(attempt.number, exitcode)
                    continue
                if isinstance(result, _SetupFailed):
                    raise WorkerSetupError(result.message)
                if waiting:  # at once: the caller may take long over the result
                    team[place].give(waiting.popleft())
                yield attempt.job, result
    finally:
        for worker in team:
            worker.dismiss()
        for worker in team:
            worker.stop()


def _serve(connection: Connection, make: Callable[[], Callable[[Job], Result]]) -> None:
    """Run the worker process: do the jobs from the pipe until it is closed.

    The parent may close it at any moment, on Ctrl-C for example, and leave a result unread.
    """
    try:
        do = make()
    except Terminated:
        raise
    except (Exception, SystemExit) as error:  # the parent raises it
        _send(connection, _SetupFailed(f"{type(error).__name__}: {error}"))
        return
    try:
        while True:
            try:
                job = connection.recv()
            except (EOFError, ConnectionResetError):
                return
            if not _send(connection, do(job)):
                return
    finally:
        with contextlib.suppress(Exception):
            getattr(do, "close", lambda: None)()


def _send(connection: Connection, answer: Any) -> bool:
    """Send an answer; False if the parent has closed the pipe."""
    try:
        connection.send(answer)
    except (BrokenPipeError, ConnectionResetError):
        return False
    return True
