"""Jobs in worker processes, where a process that dies costs one try at one job.

``concurrent.futures`` loses every running job when one process is killed and does not say which of
them was at fault. Here each worker has a pipe of its own and holds one job at a time, so the job is
known, is tried again, and the others are not disturbed.
"""

from __future__ import annotations

import contextlib
from collections import deque
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from typing import Generic, TypeVar

from er_gym.rollout.processes import CONTEXT, Terminated, end_processes, start_process

Job = TypeVar("Job")
Result = TypeVar("Result")


@dataclass(frozen=True)
class Lost:
    """What is returned for a job whose worker died every time.

    Attributes:
        tries: how often it was tried.
        exitcode: of the last worker; minus the signal's number if a signal ended it.
    """

    tries: int
    exitcode: int | None


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
        """Hand it a job. If the process is gone, :meth:`take` will say so."""
        self.holds = attempt
        with contextlib.suppress(OSError):
            self.connection.send(attempt.job)

    def take(self) -> Result | _SetupFailed:
        """What it did with its job; raises EOFError or OSError if the process is gone."""
        self.holds = None
        result: Result | _SetupFailed = self.connection.recv()
        return result

    def dismiss(self) -> None:
        """Tell the process to end: at once if it is at work."""
        self.connection.close()
        if self.holds is not None:
            self.process.terminate()

    def stop(self) -> int | None:
        """End the process, killing it if it does not end by itself, and return its exit code."""
        self.dismiss()
        end_processes([self.process])
        return self.process.exitcode


def do_jobs(
    make: Callable[[], Callable[[Job], Result]],
    jobs: Iterable[Job],
    *,
    workers: int,
    tries: int = 3,
) -> Generator[tuple[Job, Result | Lost], None, None]:
    """Do every job in one of ``workers`` spawned processes; yield each when it is done.

    Leaving the iterator early (an exception, Ctrl-C, ``close()``) ends the processes. They ignore
    Ctrl-C themselves, and end when this process does, however it ends.

    Args:
        make: called once in each process, it returns what does the jobs; if that has a ``close``
            method, it is called before the process ends. Picklable, as are jobs and results.
        jobs: what to do.
        workers: how many processes at most.
        tries: how often a job is tried when the process that does it dies.

    Yields:
        The job, and its result or :class:`Lost`.

    Raises:
        WorkerSetupError: ``make`` raised.
    """
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
                        yield attempt.job, Lost(attempt.number, exitcode)
                    continue
                if isinstance(result, _SetupFailed):
                    raise WorkerSetupError(result.message)
                yield attempt.job, result
    finally:
        for worker in team:
            worker.dismiss()
        for worker in team:
            worker.stop()


def _serve(connection: Connection, make: Callable[[], Callable[[Job], Result]]) -> None:
    """The worker process: do what comes through the pipe until it is closed."""
    try:
        do = make()
    except Terminated:
        raise
    except (Exception, SystemExit) as error:  # whatever it is, the parent must hear of it
        connection.send(_SetupFailed(f"{type(error).__name__}: {error}"))
        return
    try:
        while True:
            try:
                job = connection.recv()
            except EOFError:
                return
            connection.send(do(job))
    finally:
        with contextlib.suppress(Exception):
            getattr(do, "close", lambda: None)()
