"""Errors of the command: one line on stderr, and an exit code."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from typing import TYPE_CHECKING, NoReturn, TypeVar

import click

from benchmarks.terminal import echo

_Value = TypeVar("_Value")
_LONGEST = 2_000  # characters of a line
_MOST_LINES = 10  # about tasks of a suite

if TYPE_CHECKING:
    from er_gym.tasks.errors import SetAsideTask, Substitution

CRASHED, STOPPED, INTERRUPTED = 1, 3, 130
"""Exit codes: episodes crashed; a budget or the server stopped the run; Ctrl-C. Bad input is 2."""


class BadInput(click.ClickException):
    """Invalid input; the message says what was given, what is allowed and what to do."""

    exit_code = 2


@contextlib.contextmanager
def bad_input(*more: type[Exception]) -> Iterator[None]:
    """Turn these errors, ValueError and OSError of the code within into :class:`BadInput`."""
    known: tuple[type[Exception], ...] = (ValueError, OSError, *more)
    try:
        yield
    except known as error:
        raise BadInput(str(error)) from error


@contextlib.contextmanager
def entered(
    make: Callable[[], AbstractContextManager[_Value]], *more: type[Exception]
) -> Iterator[_Value]:
    """What a context gives, for a ``with`` block; where it cannot be entered, that is bad input."""
    with contextlib.ExitStack() as stack:
        with bad_input(*more):
            value = stack.enter_context(make())
        yield value


@contextlib.contextmanager
def needing(what: str, install: str) -> Iterator[None]:
    """Turn a package that the imports within lack into :class:`BadInput`.

    Args:
        what: needs the package; the subject of the sentence.
        install: what brings all that it needs, such as ``er-gym[rl]``.
    """
    try:
        yield
    except ImportError as error:
        from er_gym.extras import MissingPackage, is_own

        if is_own(error):
            raise
        raise BadInput(str(MissingPackage(what, error.name or str(error), install))) from error


def exit_code_of(error: BaseException) -> tuple[str, int]:
    """Why a command ended early, in words, and its exit code.

    Args:
        error: a KeyboardInterrupt, or a :class:`~er_gym.rollout.agent.CannotGoOn`.
    """
    if isinstance(error, KeyboardInterrupt):
        return "interrupted", INTERRUPTED
    return str(error), STOPPED


@contextlib.contextmanager
def interrupted_by_sigterm() -> Iterator[None]:
    """Treat SIGTERM, with which schedulers end jobs, like Ctrl-C: finished work is kept, and a run
    that has done nothing leaves no files.
    """
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


def print_problem(message: str) -> None:
    """Print an error or a warning as one line on stderr."""
    text = " ".join(message.split())
    if len(text) > _LONGEST:
        text = f"{text[:_LONGEST]}… ({len(text) - _LONGEST:,} characters more)"
    echo(f"er-gym: {text}", err=True)


def report_set_aside(
    suite: str, set_aside: Iterable[SetAsideTask], taken: Iterable[Substitution] = ()
) -> None:
    """Print which tasks of a suite are set aside, and which objects stand for missing ones.

    Each has a line, as long as there are not too many.
    """
    from er_gym.tasks.errors import describe_substitutions

    aside = [f"set aside: {one}" for one in set_aside]
    replaced = describe_substitutions(taken)
    for lines, what in ((replaced, "objects used for others"), (aside, "tasks set aside")):
        for line in lines[:_MOST_LINES]:
            print_problem(f"{suite}: {line}")
        if len(lines) > _MOST_LINES:
            print_problem(f"{suite}: and {len(lines) - _MOST_LINES:,} more {what}")
