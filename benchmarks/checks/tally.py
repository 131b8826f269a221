"""The result of a check that tries many things."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tally:
    """Counts tries and failures.

    Attributes:
        what: the name of what was tried, in the plural. tried, short: the numbers of tries and of
            failures. seconds: the time that they took.
    """

    what: str
    tried: int = 0
    short: int = 0
    seconds: float = 0.0

    def __add__(self, other: Tally) -> Tally:
        """The sum, under the first one's name."""
        return Tally(
            self.what,
            self.tried + other.tried,
            self.short + other.short,
            self.seconds + other.seconds,
        )

    def __str__(self) -> str:
        return f"{self.tried} {self.what} in {self.seconds:.0f} s: {self.short} failed"
