"""Kinds of trajectories: how much the expert searches before it goes to the right place."""

from __future__ import annotations

from collections.abc import Mapping
from random import Random

MODES: Mapping[str, tuple[str, ...]] = {
    "a": ("0", "01", "010"),
    "b": ("1", "10", "100"),
    "c": ("00", "001"),
}
"""By kind, the modes of which one is drawn. A mode has a digit for each place of the first plan: 1
for the right place, 0 for a wrong one. Kind ``a`` searches a wrong place first, ``b`` goes to the
right place at once, ``c`` searches two wrong places."""
ORDERED_KIND = "b"
"""The kind of tasks whose key actions are in order."""


def draw_mode(kind: str, random: Random) -> str:
    """A mode of a kind.

    Raises:
        ValueError: there is no such kind; the message lists the kinds.
    """
    if kind not in MODES:
        raise ValueError(f"unknown kind {kind!r}; choose one of: {', '.join(MODES)}")
    return random.choice(MODES[kind])
