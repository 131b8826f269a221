"""Errors of the command: one line on stderr, and an exit code."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import click

from benchmarks.cli.terminal import echo

_LONGEST = 2_000  # characters of a line

if TYPE_CHECKING:
    from er_gym.tasks.errors import SetAsideTask, Substitution

CRASHED, STOPPED, INTERRUPTED = 1, 3, 130
"""Exit codes: episodes crashed; a budget or the server stopped the run; Ctrl-C. Bad input is 2."""


class BadInput(click.ClickException):
    """Bad input of the user; the message says what was given, what is allowed and what to do."""

    exit_code = 2


@contextlib.contextmanager
def bad_input(*more: type[Exception]) -> Iterator[None]:
    """Turn these errors, ValueError and OSError of the code within into :class:`BadInput`."""
    known: tuple[type[Exception], ...] = (ValueError, OSError, *more)
    try:
        yield
    except known as error:
        raise BadInput(str(error)) from error


def print_problem(message: str) -> None:
    """Print an error or a warning as one line on stderr."""
    text = " ".join(message.split())
    if len(text) > _LONGEST:
        text = f"{text[:_LONGEST]}… ({len(text) - _LONGEST:,} characters more)"
    echo(f"er-gym: {text}", err=True)


def report_set_aside(
    suite: str, set_aside: Iterable[SetAsideTask], taken: Iterable[Substitution] = ()
) -> None:
    """Print which tasks of a suite are set aside, and which objects stand for missing ones."""
    from er_gym.tasks.errors import describe_substitutions

    for line in describe_substitutions(taken):
        print_problem(f"{suite}: {line}")
    for one in set_aside:
        print_problem(f"{suite}: set aside: {one}")
