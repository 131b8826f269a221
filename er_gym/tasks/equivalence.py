"""Object types that a task treats as one."""

from __future__ import annotations

from collections.abc import Iterable

BASIN_OF = {"Sink": "SinkBasin", "Bathtub": "BathtubBasin"}
"""Types whose part is the receptacle: AI2-THOR puts a Mug into the SinkBasin, not the Sink."""


def same_type(one: str, other: str) -> bool:
    """Whether a task treats two types as one, such as Sink and SinkBasin."""
    return one == other or BASIN_OF.get(one, one) == BASIN_OF.get(other, other)


def is_among(object_type: str, types: Iterable[str]) -> bool:
    """Whether ``types`` has ``object_type`` or a type that a task treats as the same."""
    return any(same_type(object_type, each) for each in types)
