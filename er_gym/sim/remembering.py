"""Answers that are remembered, the last used ones."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from contextlib import suppress
from typing import Any, TypeVar

T = TypeVar("T")


def get_or_compute(
    memory: OrderedDict[Any, T], question: Any, limit: int, compute: Callable[[], T]
) -> T:
    """The remembered answer, or a new one, which is remembered in place of the least used one.

    Several threads may ask at once, so an entry can vanish between two lines.
    """
    with suppress(KeyError):
        known: T = memory[question]
        memory.move_to_end(question)
        return known
    memory[question] = found = compute()
    if len(memory) > limit:
        memory.popitem(last=False)
    return found
