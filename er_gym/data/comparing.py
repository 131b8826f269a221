"""What differs between a record and what is derived anew, one line for each difference."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from pydantic import BaseModel

_LONGEST = 120
"""Characters of a value that a message quotes."""
_NOTHING = object()
"""Stands for an entry that is not there."""


def compared(what: str, recorded: Any, now: Any, by: str = "") -> Iterator[str]:
    """The first difference of two values, as a line; nothing if they are equal.

    Args:
        what: the name of the field.
        recorded: what the record has.
        now: what it should have.
        by: what says so, such as ``the task``; ``""`` for the replay.
    """
    if recorded == now:
        return
    place, found, expected = _first(what, recorded, now)
    says = f" by {by}" if by else ""
    yield f"{place} is {_short(expected)}{says}, recorded was {_short(found)}"


def _first(what: str, recorded: Any, now: Any) -> tuple[str, Any, Any]:
    """The place, the recorded and the derived value of what differs first within two values."""
    for kind, entries in _ENTRIES:
        if isinstance(recorded, kind) and isinstance(now, kind):
            ours, theirs = entries(recorded), entries(now)
            for name in {**ours, **theirs}:
                one, other = ours.get(name, _NOTHING), theirs.get(name, _NOTHING)
                if one != other:
                    return _first(f"{what}{name}", one, other)
    return what, recorded, now


_ENTRIES: tuple[tuple[type, Any], ...] = (
    (list, lambda value: {f"[{index}]": one for index, one in enumerate(value)}),
    (Mapping, lambda value: {f"[{name!r}]": one for name, one in value.items()}),
    (BaseModel, lambda value: {f".{name}": one for name, one in value}),
)
"""The entries of a value by how a message names them."""


def _short(value: object) -> str:
    text = "nothing" if value is _NOTHING else repr(value)
    return text if len(text) <= _LONGEST else f"{text[:_LONGEST]}…"
