"""Prints text literally: no control codes for the terminal, no markup for Rich.

Names, paths, instructions, replies of servers and errors can hold either. All that the command
prints goes through :func:`echo` or a :class:`Terminal`.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from rich.console import Console

_UNSEEN = re.compile(
    "[\x00-\x08\x0b-\x1f\x7f-\x9f"  # control characters, but for tab and newline
    "\u061c\u200e\u200f\u202a-\u202e\u2066-\u2069"  # what reorders a line
    "\u2028\u2029\ud800-\udfff\ufeff\ufdd0-\ufdef\ufffe\uffff]"
)


def without_control_codes(text: str) -> str:
    r"""Text without terminal control codes: ``\x1b`` in place of the escape character."""
    return _UNSEEN.sub(lambda found: ascii(found[0])[1:-1], text)


def echo(message: object = "", *, nl: bool = True, err: bool = False) -> None:
    """Print text, on stderr with ``err``, with a newline at its end with ``nl``."""
    click.echo(without_control_codes(str(message)), nl=nl, err=err)


def use_any_encoding() -> None:
    """Print characters that an output's encoding lacks as escapes, instead of raising an error."""
    for stream in (sys.stdout, sys.stderr):
        if reconfigure := getattr(stream, "reconfigure", None):
            reconfigure(errors="backslashreplace")


def terminal(*, stderr: bool = False, width: int | None = None) -> Console:
    """A console of Rich that prints text literally: without markup, emoji or escape codes."""
    from rich.console import Console, ConsoleOptions
    from rich.segment import Segment

    class Terminal(Console):
        def render(
            self, renderable: Any, options: ConsoleOptions | None = None
        ) -> Iterable[Segment]:
            for segment in super().render(renderable, options):
                if segment.control:  # Rich's own
                    yield segment
                else:
                    yield Segment(without_control_codes(segment.text), segment.style)

    return Terminal(stderr=stderr, width=width, markup=False, emoji=False, highlight=False)


def stdout() -> Console:
    """Tables are as wide as the terminal, and as wide as they need to be in a file."""
    return terminal(width=None if sys.stdout.isatty() else 240)
