"""How the command says that something was given wrongly: one line, exit code 2."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import click


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
