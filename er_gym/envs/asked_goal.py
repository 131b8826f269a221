"""What an instruction asks for, read from its words alone: verbs, and the object types it names."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.tasks import verbs
from er_gym.thor.objects import KIND_OF, TYPES

GOAL_VERBS: Mapping[str, str] = {
    "search": r"find|search|look|locate|where",
    "pickup": r"pick|take|grab|get|fetch|bring",
    "put": r"put|place|set|move|store|leave",
    "toggle": r"toggle|turn|switch|flip",
    "open": r"open",
    "close": r"close|shut",
    "then": r"then|after|before|first",
    **{verb.name: "|".join(map(re.escape, verb.said)) for verb in verbs.ADDED},
}
"""The words of an instruction that say what to do, by their meaning. The words of the verbs that
other packages add are included."""


@cache
def _named() -> Sequence[tuple[str, str, re.Pattern[str]]]:
    """The object types, the longest names first, each with its first word in small letters, and
    with how an instruction names it."""
    found = []
    for name in sorted(TYPES, key=len, reverse=True):
        words = re.findall(r"[A-Z]+(?![a-z])|[A-Z][a-z]+|\d+", name)
        apart = r"[\s-]?".join(words)
        pattern = re.compile(rf"\b{apart}(?:s|es)?\b", re.IGNORECASE)
        found.append((name, words[0].lower(), pattern))
    return found


@cache
def _asked() -> Sequence[re.Pattern[str]]:
    return [re.compile(rf"\b(?:{words})", re.IGNORECASE) for words in GOAL_VERBS.values()]


@lru_cache(maxsize=4096)
def goal(instruction: str) -> tuple[tuple[float, ...], tuple[tuple[str, float], ...]]:
    """What an instruction asks for, read from its words alone.

    Returns:
        A 0 or 1 for each of :data:`GOAL_VERBS`; and a weight for each object type that the
        instruction names: 1 for the first, then 1/2, 1/3 and so on. ``credit card`` names a
        CreditCard. A name inside a longer name in the same place does not count.
    """
    mentions = []
    taken = np.zeros(len(instruction) + 1, dtype=bool)
    small = instruction.casefold()
    for name, first_word, pattern in _named():
        if first_word not in small:  # quicker than the pattern, which most names do not match
            continue
        for match in pattern.finditer(instruction):
            span = slice(*match.span())
            if not taken[span].any():
                taken[span] = True
                mentions.append((match.start(), name))
    order = list(dict.fromkeys(name for _, name in sorted(mentions)))
    asked = tuple(float(bool(pattern.search(instruction))) for pattern in _asked())
    return asked, tuple((name, 1.0 / (rank + 1)) for rank, name in enumerate(order))


@lru_cache(maxsize=4096)
def goal_row(instruction: str) -> NDArray[np.float32]:
    """(T,) float32, the weight of each type in an instruction, see :func:`goal`; read-only."""
    row = np.zeros(len(TYPES), dtype=np.float32)
    for name, weight in goal(instruction)[1]:
        row[KIND_OF[name]] = weight
    return row
