"""How the command says that something went wrong: one line on stderr, and its exit code."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING, NoReturn

import click

from benchmarks.cli.terminal import echo

_LONGEST = 2_000  # characters of a complaint
_MOST_LINES = 10  # about tasks of a suite

if TYPE_CHECKING:
    from er_gym.tasks.errors import SetAside, Taken

CRASHED, STOPPED, INTERRUPTED = 1, 3, 130
"""Exit codes: episodes crashed; a run stopped before its end, as it was told to; Ctrl-C. And 2 is
for what the user gave wrongly."""


class BadInput(click.ClickException):
    """Something that the user gave; the message says what, what is allowed and what to do."""

    exit_code = 2


@contextlib.contextmanager
def bad_input(*more: type[Exception]) -> Iterator[None]:
    """What the code within raises of these, ValueError and OSError is the user's to mend."""
    known: tuple[type[Exception], ...] = (ValueError, OSError, *more)
    try:
        yield
    except known as error:
        raise BadInput(str(error)) from error


@contextlib.contextmanager
def interrupted_by_sigterm() -> Iterator[None]:
    """Take SIGTERM, with which schedulers end jobs, for Ctrl-C: what has been done is kept, and a
    start that has done nothing leaves nothing."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGTERM, _interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, before)


def _interrupt(signum: int, frame: object) -> NoReturn:
    raise KeyboardInterrupt


def complain(message: str) -> None:
    """Say something in one line on stderr."""
    text = " ".join(message.split())
    if len(text) > _LONGEST:
        text = f"{text[:_LONGEST]}… ({len(text) - _LONGEST:,} characters more)"
    echo(f"er-gym: {text}", err=True)


def tell_left_out(suite: str, set_aside: Iterable[SetAside], taken: Iterable[Taken] = ()) -> None:
    """Say which of a suite's tasks are left out, and what is taken for what the scenes lack: a line
    each, as long as there are not too many."""
    from er_gym.tasks.errors import told_once

    aside = [f"set aside: {one}" for one in set_aside]
    for lines, what in ((told_once(taken), "objects taken for others"), (aside, "tasks set aside")):
        for line in lines[:_MOST_LINES]:
            complain(f"{suite}: {line}")
        if len(lines) > _MOST_LINES:
            complain(f"{suite}: and {len(lines) - _MOST_LINES:,} more {what}")
