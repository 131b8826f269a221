"""Draws a part of training data."""

from __future__ import annotations

import random
from collections.abc import Iterable
from typing import TypeVar

Item = TypeVar("Item")


def drawn(items: Iterable[Item], limit: int | None) -> Iterable[Item]:
    """All items, or so many of them, drawn at random: data is often ordered by task type.

    The draw is always the same, a smaller one is part of a larger one, and the items keep their
    order.

    Args:
        items: what is drawn from; read at once only if there is a limit.
        limit: how many at most; None for all.
    """
    if limit is None:
        return items
    every = list(items)
    places = list(range(len(every)))
    random.Random(0).shuffle(places)
    return [every[place] for place in sorted(places[:limit])]
