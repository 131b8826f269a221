"""Tries many things, prints what is wrong, and counts: what all checks of that kind are made of."""

from __future__ import annotations

import signal
import sys
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import click

Try = tuple[str, Iterable[str]]
"""The name of what is tried, and what is wrong with it: found while it is iterated."""
Check = Callable[[Sequence[str]], "Tally"]


@dataclass(frozen=True)
class Tally:
    """Counts tries and failures.

    Attributes:
        what: the name of what was tried, in the plural. tried, failed: the numbers of tries and of
            failures. seconds: the time that they took.
    """

    what: str
    tried: int = 0
    failed: int = 0
    seconds: float = 0.0

    def __add__(self, other: Tally) -> Tally:
        """The sum, under the first one's name."""
        return Tally(
            self.what,
            self.tried + other.tried,
            self.failed + other.failed,
            self.seconds + other.seconds,
        )

    def __str__(self) -> str:
        return f"{self.tried} {self.what} in {self.seconds:.0f} s: {self.failed} failed"


def tally(what: str, tries: Iterable[Try], say: Callable[[str], None] = click.echo) -> Tally:
    """Try all, and say each problem as soon as it is found."""
    began, tried, failed = time.monotonic(), 0, 0
    for name, problems in tries:
        tried += 1
        wrong = False
        for problem in problems:
            wrong = True
            say(f"{name}: {problem}")
        failed += wrong
    return Tally(what, tried, failed, time.monotonic() - began)


def has_words(text: str, words: Sequence[str]) -> bool:
    """Whether a name has all words that were given to choose by."""
    return all(word in text for word in words)


def end_on_sigterm() -> None:
    """Let SIGTERM end the script as an error would: what it started and made is tidied up."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(128 + signal.SIGTERM))


def run_check(check: Check, doc: str | None) -> None:
    """The command line of a check: ``[WORD …]``, which the names of what is tried must hold.

    Prints the failures and their number, and ends with exit code 1 if there is one.
    """

    @click.command(
        help=f"\b\n{(doc or '').strip()}", context_settings={"ignore_unknown_options": True}
    )
    @click.argument("words", nargs=-1, metavar="[WORD]...")
    def command(words: tuple[str, ...]) -> None:
        end_on_sigterm()
        end(check(words))

    command()


def end(done: Tally) -> None:
    """Print a tally, and end the script: with exit code 1 if something failed."""
    click.echo(done)
    sys.exit(int(done.failed > 0))
