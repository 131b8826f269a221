"""The doors and windows of a house."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from er_gym.houses.plan import PlannedRoom
from er_gym.sim.house.assets import assets_of_type

SIDES = ("west", "north", "east", "south")
"""The sides of a room in the order of its walls, clockwise seen from above."""
_MARGIN = 0.2
"""Least distance of a door from the corner of a room, metres."""
_EXTRA = 0.3
"""The chance of a door that is not needed to reach a room."""
_BATH = 2.0
"""How much less likely a way through a bathroom is; others weigh less than 1."""
_FRAMES = 0.35
"""The share of doors without a leaf."""
_SILL = 0.3
"""Least height of a window above the floor, metres."""


@dataclass(frozen=True)
class Gap:
    """A door or a window in one side of a room.

    Attributes:
        room: the number of the room whose wall it is measured along.
        other: the number of the room beyond, 0 for outside.
        side: one of :data:`SIDES`.
        low, high: its ends along x or z, metres.
        bottom, top: heights, metres.
        open: whether one can walk through it.
    """

    kind: str
    asset: str
    room: int
    other: int
    side: str
    low: float
    high: float
    bottom: float
    top: float
    open: bool


def at_of(room: PlannedRoom, side: str) -> float:
    """The coordinate of a side of a room: x of the west and east side, z of the others."""
    return {
        "west": room.west, "east": room.east, "south": room.south, "north": room.north
    }[side]  # fmt: skip


def span_of(room: PlannedRoom, side: str) -> tuple[float, float]:
    """The ends of a side of a room along the other axis."""
    if side in ("west", "east"):
        return room.south, room.north
    return room.west, room.east


def doors(rooms: Sequence[PlannedRoom], rng: np.random.Generator) -> tuple[Gap, ...]:
    """Doors that lead to every room, a few more, and a front door, which is shut."""
    borders = list(_borders(rooms))
    weight = {
        (a.number, b.number): float(rng.random())
        + _BATH * ((a.kind == "Bathroom") + (b.kind == "Bathroom"))
        for a, b, *_ in borders
    }
    reached = {room.number: {room.number} for room in rooms}
    found = []
    for a, b, side, low, high in sorted(
        borders, key=lambda each: weight[each[0].number, each[1].number]
    ):
        needed = b.number not in reached[a.number]
        bath = "Bathroom" in (a.kind, b.kind)
        if needed or (not bath and rng.random() < _EXTRA):
            together = reached[a.number] | reached[b.number]
            for number in together:
                reached[number] = together
            found.append(_door(a.number, b.number, side, low, high, True, rng))
    outside = [
        (room, side)
        for room in rooms
        if room.kind != "Bathroom"
        for side in SIDES
        if not any(_beside(room, other, side) for other in rooms)
    ]
    room, side = outside[int(rng.integers(len(outside)))]
    found.append(_door(room.number, 0, side, *span_of(room, side), False, rng))
    return tuple(found)


def windows(
    rooms: Sequence[PlannedRoom], ways: Sequence[Gap], rng: np.random.Generator
) -> tuple[Gap, ...]:
    """One or two windows for each room that has an outer wall."""
    panes = [a for a in assets_of_type("Window") if a.size[2] < 0.2]
    found: list[Gap] = []
    for room in rooms:
        sides = [s for s in SIDES if not any(_beside(room, other, s) for other in rooms)]
        wanted = 1 + int(rng.integers(2)) if room.kind != "Bathroom" else 1
        for k in rng.permutation(len(sides)).tolist()[:wanted]:
            side, pane = sides[k], panes[int(rng.integers(len(panes)))]
            low, high = span_of(room, side)
            wide, high_up = pane.size[0], pane.size[1]
            taken = [g for g in ways if g.room == room.number and g.side == side]
            if high - low < wide + 2 * _MARGIN:
                continue
            start = round(float(rng.uniform(low + _MARGIN, high - _MARGIN - wide)), 3)
            if any(start < g.high + _MARGIN and g.low < start + wide + _MARGIN for g in taken):
                continue
            bottom = round(max(1.3 - high_up / 2, _SILL), 3)
            found.append(
                Gap("Window", pane.id, room.number, 0, side, start, round(start + wide, 3), bottom,
                    round(bottom + high_up, 3), True)
            )  # fmt: skip
    return tuple(found)


def _door(
    room: int, other: int, side: str, low: float, high: float, is_open: bool,
    rng: np.random.Generator,
) -> Gap:  # fmt: skip
    kind = "Doorframe" if is_open and rng.random() < _FRAMES else "Doorway"
    leaves = [a for a in assets_of_type(kind) if a.size[0] < 1.3]
    leaf = leaves[int(rng.integers(len(leaves)))]
    start = round(float(rng.uniform(low + _MARGIN, high - _MARGIN - leaf.size[0])), 3)
    end, top = round(start + leaf.size[0], 3), round(leaf.size[1], 3)
    return Gap(kind, leaf.id, room, other, side, start, end, 0.0, top, is_open)


def _borders(
    rooms: Sequence[PlannedRoom],
) -> Iterator[tuple[PlannedRoom, PlannedRoom, str, float, float]]:
    """Two rooms, the side of the first one, and the ends of the wall between them."""
    for a in rooms:
        for b in rooms:
            for side in ("east", "north"):
                if a != b and _beside(a, b, side):
                    (low, high), (start, end) = span_of(a, side), span_of(b, side)
                    yield a, b, side, max(low, start), min(high, end)


def _beside(room: PlannedRoom, other: PlannedRoom, side: str) -> bool:
    """Whether another room lies beyond a side of a room, along enough of it for a door."""
    across = SIDES[(SIDES.index(side) + 2) % 4]
    (low, high), (start, end) = span_of(room, side), span_of(other, side)
    long = min(high, end) - max(low, start)
    return at_of(room, side) == at_of(other, across) and long >= 1.3 + 2 * _MARGIN
