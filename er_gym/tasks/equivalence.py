"""Object types that mean the same thing to a task."""

from __future__ import annotations

from collections.abc import Iterable

BASIN_OF = {"Sink": "SinkBasin", "Bathtub": "BathtubBasin"}
"""Types that hold things by way of a part: AI2-THOR puts a Mug into the SinkBasin, not the Sink."""


def same_type(one: str, other: str) -> bool:
    """Whether two types mean the same thing: a Sink and its SinkBasin do."""
    return one == other or BASIN_OF.get(one, one) == BASIN_OF.get(other, other)


def is_among(object_type: str, types: Iterable[str]) -> bool:
    """Whether one of some types means the same thing as a type."""
    return any(same_type(object_type, each) for each in types)
