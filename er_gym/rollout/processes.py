"""Worker processes: how they start, that they ignore Ctrl-C, and that none is left behind.

Everything in er-gym that works in other processes starts them here: whole episodes
(:mod:`er_gym.rollout.worker_pool`), environments for the threads of this process
(:mod:`er_gym.rollout.env_pool`), and batches of environments for a learner
(:mod:`agents.rl.vec_env`).
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.context import SpawnProcess
from typing import Any, NoReturn

CONTEXT = multiprocessing.get_context("spawn")
"""Processes are spawned, not forked: a forked renderer or torch does not work."""
GRACE = 5.0
"""Seconds that a process has to end by itself before it is killed."""


class Terminated(SystemExit):
    """SIGTERM has come: the process is to end, whatever is called in it."""


def start_process(target: Callable[..., None], *args: Any) -> SpawnProcess:
    """Start a process that calls ``target(*args)``; both have to be picklable.

    The process ignores Ctrl-C from its first instruction, exits cleanly on SIGTERM, and ends when
    this process does, however this process ends.
    """
    process = CONTEXT.Process(target=_run, args=(target, args), daemon=True)
    with _interrupts_blocked():
        process.start()
    return process


def end_processes(processes: Iterable[SpawnProcess], grace: float = GRACE) -> None:
    """Wait for processes that have been told to end; kill those that have not after ``grace`` s."""
    deadline = time.monotonic() + grace
    for process in processes:
        process.join(max(0.0, deadline - time.monotonic()))
        if process.is_alive():
            process.kill()
            process.join()


@contextlib.contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Keep Ctrl-C from this thread and from a process that it starts meanwhile."""
    is_main = threading.current_thread() is threading.main_thread()
    # Only the main thread may set handlers. Another thread blocks the signal instead; the process
    # it starts inherits the blocking, and ignores the signal before it unblocks anything.
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN) if is_main else None
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        if is_main:
            signal.signal(signal.SIGINT, handler)


def _run(target: Callable[..., None], args: tuple[Any, ...]) -> None:
    """The first thing that a worker process calls."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _exit_cleanly)
    threading.Thread(target=_follow_parent, daemon=True).start()
    target(*args)


def _exit_cleanly(signum: int, frame: object) -> NoReturn:
    """Handle a signal by an exception, so that everything is closed first."""
    raise Terminated(128 + signum)


def _follow_parent() -> None:
    """End this process once its parent has ended: first cleanly, after the grace at once."""
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE)
    os._exit(1)
