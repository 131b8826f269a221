"""Starts and ends worker processes: they ignore Ctrl-C, and none is left behind.

All of er-gym starts its worker processes here: whole episodes
(:mod:`er_gym.rollout.worker_pool`), environments for the threads of this process
(:mod:`er_gym.rollout.env_pool`), and batches of environments for a learner
(:mod:`agents.rl.vec_env`).
"""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from multiprocessing.context import SpawnProcess
from typing import Any, NoReturn

CONTEXT = multiprocessing.get_context("spawn")
"""Processes are spawned, since a renderer or torch does not work in a forked process."""
GRACE_SECONDS = 5.0
"""Seconds within which a process must end by itself; then it is killed."""

_AGAIN_SECONDS = 0.05
"""After which a signal whose exception was lost comes again."""


class Terminated(SystemExit):
    """Raised on SIGTERM: the process must end, whatever code is running in it."""


def start_process(target: Callable[..., None], *args: Any) -> SpawnProcess:
    """Start a process that calls ``target(*args)``; both must be picklable.

    The process ignores Ctrl-C from its first instruction, exits cleanly on SIGTERM, and ends when
    this process ends, in any way.
    """
    process = CONTEXT.Process(target=_run, args=(target, args), daemon=True)
    with _interrupts_blocked(), _inheritable_stderr():
        process.start()
    return process


def end_processes(processes: Iterable[SpawnProcess], grace: float = GRACE_SECONDS) -> None:
    """Wait for processes that were told to end; kill those still alive after ``grace`` seconds."""
    deadline = time.monotonic() + grace
    for process in processes:
        process.join(max(0.0, deadline - time.monotonic()))
        if process.is_alive():
            process.kill()
            process.join()


@contextlib.contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block Ctrl-C in this thread and in the processes that it starts meanwhile."""
    is_main = threading.current_thread() is threading.main_thread()
    # Only the main thread may set handlers. Another thread blocks the signal instead; the process
    # it starts inherits the blocking, and ignores the signal before it unblocks anything.
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN) if is_main else None
    has_masks = hasattr(signal, "pthread_sigmask")
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT}) if has_masks else None
    try:
        yield
    finally:
        if mask is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        if is_main:
            signal.signal(signal.SIGINT, handler)


@contextlib.contextmanager
def _inheritable_stderr() -> Iterator[None]:
    """Let ``sys.stderr`` be a file that another process can inherit, as multiprocessing expects.

    A display that takes the whole terminal, such as Inspect's, replaces it by an object whose
    descriptor is -1. multiprocessing would pass that on to its helper process, and fail.
    """
    shown = sys.stderr
    if not _has_descriptor(shown):
        sys.stderr = sys.__stderr__ if _has_descriptor(sys.__stderr__) else None
    try:
        yield
    finally:
        sys.stderr = shown


def _has_descriptor(stream: Any) -> bool:
    try:
        os.fstat(stream.fileno())
    except Exception:  # of any kind: the stream may be anybody's
        return False
    return True


def _run(target: Callable[..., None], args: tuple[Any, ...]) -> None:
    """The first thing that a worker process calls."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _exit_cleanly)
    sys.unraisablehook = _end_later
    end_with_parent()
    target(*args)


def end_with_parent() -> None:
    """End this process once the process that started it by :data:`CONTEXT` has ended, in any way:
    by SIGTERM, or by force after the grace period."""
    threading.Thread(target=_follow_parent, daemon=True).start()


def _exit_cleanly(signum: int, frame: object) -> NoReturn:
    """Handle a signal by an exception, so that everything is closed first.

    A second signal must not interrupt the closing. SIGTERM often comes twice: to all processes of a
    group, and from the parent.
    """
    signal.signal(signum, lambda *_: None)  # programs started meanwhile would inherit SIG_IGN
    raise Terminated(128 + signum)


def _end_later(lost: sys.UnraisableHookArgs) -> None:
    """Where Python can raise nothing, as while it lets go of an object, the signal comes again."""
    if not isinstance(lost.exc_value, Terminated):
        sys.__unraisablehook__(lost)
        return
    signal.signal(signal.SIGTERM, _exit_cleanly)
    again = threading.Timer(_AGAIN_SECONDS, os.kill, (os.getpid(), signal.SIGTERM))
    again.daemon = True
    again.start()


def _follow_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(GRACE_SECONDS)
    os._exit(1)
