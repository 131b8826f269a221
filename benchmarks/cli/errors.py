"""How the command says that something went wrong: one line on stderr, and its exit code."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable, Iterator
from typing import TYPE_CHECKING

import click

from benchmarks.cli.terminal import echo

_LONGEST = 2_000  # characters of a complaint

if TYPE_CHECKING:
    from er_gym.tasks.errors import SetAsideTask, Substitution

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


def complain(message: str) -> None:
    """Say something in one line on stderr."""
    text = " ".join(message.split())
    if len(text) > _LONGEST:
        text = f"{text[:_LONGEST]}… ({len(text) - _LONGEST:,} characters more)"
    echo(f"er-gym: {text}", err=True)


def tell_left_out(
    suite: str, set_aside: Iterable[SetAsideTask], taken: Iterable[Substitution] = ()
) -> None:
    """Say which of a suite's tasks are left out, and what is taken for what the scenes lack."""
    from er_gym.tasks.errors import describe_substitutions

    for line in describe_substitutions(taken):
        complain(f"{suite}: {line}")
    for one in set_aside:
        complain(f"{suite}: set aside: {one}")
