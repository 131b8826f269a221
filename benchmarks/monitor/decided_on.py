"""Which pictures stand beside a step: those that it was decided on, on the pages of all kinds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol


class Shown(Protocol):
    """What is needed of a step."""

    @property
    def pictures(self) -> Sequence[int]:
        """The numbers of the pictures that the agent was shown for it, and not before."""


def decided_on(steps: Sequence[Shown]) -> list[Sequence[int]]:
    """For each step, the numbers of the last pictures that the agent had when it decided it.

    Nobody decides the first step of a run, which places the agent; before any picture, the first
    ones stand there.
    """
    seen = next((step.pictures for step in steps if step.pictures), ())
    found = []
    for step in steps:
        seen = step.pictures or seen
        found.append(seen)
    return found
