"""The plan of a house: a rectangle, divided into rooms. Lengths are metres."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

KINDS = ("Kitchen", "LivingRoom", "Bedroom", "Bathroom")
"""ProcTHOR's kinds of rooms."""
_AREAS = {"Kitchen": 15.0, "LivingRoom": 20.0, "Bedroom": 15.0, "Bathroom": 7.5}
"""The area of each kind, on average, square metres."""
_NARROWEST = {"Kitchen": 3.25, "LivingRoom": 3.5, "Bedroom": 3.25, "Bathroom": 2.25}
_LONGEST = 2.4
"""The largest ratio of a room's sides."""
_STEP = 0.25
"""Rooms end on a grid of this step, as the agent walks on one."""
_TRIES = 5000


@dataclass(frozen=True)
class PlannedRoom:
    """A room: its number, its kind, and the corners of its rectangle."""

    number: int
    kind: str
    west: float
    south: float
    east: float
    north: float

    @property
    def id(self) -> str:
        return f"room|{self.number}"

    @property
    def size(self) -> tuple[float, float]:
        return self.east - self.west, self.north - self.south


def plan_rooms(count: int, rng: np.random.Generator) -> tuple[PlannedRoom, ...]:
    """A house of ``count`` rooms; the first one is a kitchen unless it is the only one."""
    kinds = room_kinds(count, rng)
    for _ in range(_TRIES):
        area = sum(_AREAS[kind] for kind in kinds) * rng.uniform(0.95, 1.3)
        deep = _rounded(np.sqrt(area / rng.uniform(1.0, 1.7)))
        sides = (_rounded(area / deep), deep)
        order = [kinds[k] for k in rng.permutation(len(kinds)).tolist()]
        rooms = _divided((0.0, 0.0, *sides), order, rng)
        if rooms is not None:
            number = {kind: kinds.index(kind) for kind in kinds}
            rooms.sort(key=lambda room: number[room[0]])
            return tuple(PlannedRoom(k + 1, *room) for k, room in enumerate(rooms))
    raise RuntimeError(f"no plan for {count} rooms")


def room_kinds(count: int, rng: np.random.Generator) -> list[str]:
    """The kinds of the rooms: one of each before there are two of any."""
    if count == 1:
        return [KINDS[int(rng.integers(3))]]
    if count == 2:
        return ["Kitchen", KINDS[1 + int(rng.integers(2))]]
    others = ["LivingRoom", "Bathroom", "Bedroom", "Bedroom", "Bathroom"]
    if count == 3:
        others = [["LivingRoom", "Bedroom"][int(rng.integers(2))], "Bathroom"]
    return ["Kitchen", *others[: count - 1]] if count != 4 else ["Kitchen", *others[:3]]


def _rounded(length: float) -> float:
    return max(round(float(length) / _STEP), 1) * _STEP


def _divided(
    box: tuple[float, float, float, float], kinds: Sequence[str], rng: np.random.Generator
) -> list[tuple[str, float, float, float, float]] | None:
    """The rooms that a rectangle is divided into, None if one would be too narrow."""
    west, south, east, north = box
    wide, deep = east - west, north - south
    if len(kinds) == 1:
        least, most = sorted((wide, deep))
        fits = least >= _NARROWEST[kinds[0]] and most <= _LONGEST * least
        return [(kinds[0], *box)] if fits else None
    first = int(rng.integers(1, len(kinds))) if len(kinds) < 4 else len(kinds) // 2
    here, there = kinds[:first], kinds[first:]
    areas = [sum(_AREAS[kind] for kind in group) for group in (here, there)]
    share = areas[0] / sum(areas) * rng.uniform(0.9, 1.1)
    if wide >= deep:
        cut = west + _rounded(share * wide)
        boxes = (west, south, cut, north), (cut, south, east, north)
    else:
        cut = south + _rounded(share * deep)
        boxes = (west, south, east, cut), (west, cut, east, north)
    parts = [_divided(part, group, rng) for part, group in zip(boxes, (here, there), strict=True)]
    if parts[0] is None or parts[1] is None:
        return None
    return [*parts[0], *parts[1]]
