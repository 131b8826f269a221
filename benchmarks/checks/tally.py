"""What came of a check that tries many things."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tally:
    """How often something was tried.

    Attributes:
        what: was tried, in the plural.
        tried, short: how many, and how many of them fall short.
        seconds: that it took.
    """

    what: str
    tried: int = 0
    short: int = 0
    seconds: float = 0.0

    def __add__(self, other: Tally) -> Tally:
        """Both, under the first one's name."""
        return Tally(
            self.what,
            self.tried + other.tried,
            self.short + other.short,
            self.seconds + other.seconds,
        )

    def __str__(self) -> str:
        return f"{self.tried} {self.what} in {self.seconds:.0f} s: {self.short} fall short"
