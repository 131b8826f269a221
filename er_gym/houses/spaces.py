"""The floor of a room while it is furnished: what stands there, and what must stay free."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from er_gym.houses.openings import Gap, at_of
from er_gym.houses.plan import PlannedRoom

Rectangle = tuple[float, float, float, float]
"""Low x and z, high x and z, metres."""
APART = 0.04
"""Least distance between two pieces of furniture, metres."""
_BEFORE_DOORS, _BESIDE_DOORS = 1.0, 0.1
"""Free floor before and beside a door, metres."""


@dataclass
class Space:
    """The floor of a room.

    Attributes:
        windows: windows and doors by side: their ends along it, and the height of their lower edge.
        taken: rectangles on which something stands.
        kept: rectangles that stay free, which may overlap one another.
    """

    room: PlannedRoom
    windows: dict[str, list[tuple[float, float, float]]] = field(default_factory=dict)
    taken: list[Rectangle] = field(default_factory=list)
    kept: list[Rectangle] = field(default_factory=list)

    def fits(self, thing: Rectangle, before: Sequence[Rectangle] = ()) -> bool:
        """Whether a thing fits, with the places before it that stay free."""
        room = self.room
        inside = all(
            room.west <= x0 and room.south <= z0 and x1 <= room.east and z1 <= room.north
            for x0, z0, x1, z1 in (thing, *before)
        )
        return (
            inside
            and not any(overlap(thing, other, APART) for other in self.taken)
            and not any(overlap(thing, other) for other in self.kept)
            and not any(overlap(place, other) for place in before for other in self.taken)
        )

    def put(self, thing: Rectangle, before: Sequence[Rectangle] = ()) -> None:
        self.taken.append(thing)
        self.kept.extend(before)

    def hides_window(self, side: str, low: float, high: float, tall: float) -> bool:
        """Whether something so tall at a side would stand before a window or a door."""
        return any(
            low < end and start < high and tall > bottom - 0.02
            for start, end, bottom in self.windows.get(side, ())
        )


def empty_space(room: PlannedRoom, gaps: Sequence[Gap], other_side: dict[str, str]) -> Space:
    """The floor of a room before it is furnished; the floor before its doors is kept free."""
    space = Space(room)
    for gap in gaps:
        if room.number not in (gap.room, gap.other):
            continue
        side = gap.side if gap.room == room.number else other_side[gap.side]
        space.windows.setdefault(side, []).append((gap.low, gap.high, gap.bottom))
        if gap.kind != "Window":
            space.kept.append(
                before(room, side, gap.low - _BESIDE_DOORS, gap.high + _BESIDE_DOORS, _BEFORE_DOORS)
            )
    return space


def before(room: PlannedRoom, side: str, low: float, high: float, deep: float) -> Rectangle:
    """The floor of a room along a part of one of its sides."""
    at = at_of(room, side)
    inner = at + deep if side in ("west", "south") else at - deep
    near, far = sorted((at, inner))
    return (near, low, far, high) if side in ("west", "east") else (low, near, high, far)


def overlap(one: Rectangle, other: Rectangle, apart: float = 0.0) -> bool:
    """Whether two rectangles overlap, or are nearer to each other than ``apart``."""
    return (
        one[0] < other[2] + apart
        and other[0] < one[2] + apart
        and one[1] < other[3] + apart
        and other[1] < one[3] + apart
    )
