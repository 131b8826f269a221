"""The table of families: the boxes that an object of a given type and size is made of.

A builder takes an object's width w (left to right), height h and depth d (back to front), and the
height s at which things stand in or on it, all in metres. It returns boxes with corners (x, y, z),
counted from the object's left lower back corner. If things stand on one part only, that part comes
first.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Corner = tuple[float, float, float]
Parts = list[tuple[Corner, Corner]]
Builder = Callable[[float, float, float, float], Parts]

_BOARD = 0.03
"""Thickness of boards and panels, metres."""
_LEG = 0.05
"""Side of a leg, metres."""

_DOOR = 0.03
"""Thickness of a front, as a share of the furniture's depth."""
_PEDESTAL = 0.45
"""A higher sink stands on a foot, metres."""


def whole(w: float, h: float, d: float, s: float) -> Parts:
    """The box itself."""
    return [((0, 0, 0), (w, h, d))]


def _core(width: float, top: float) -> Builder:
    """The middle of the box, a share of its width and depth, up to a share of its height."""
    a, b = (1 - width) / 2, (1 + width) / 2
    return lambda w, h, d, s: [((a * w, 0, a * d), (b * w, top * h, b * d))]


def _legs(w: float, h: float, d: float) -> Parts:
    leg = min(_LEG, w / 4, d / 4)
    return [((x, 0, z), (x + leg, h, z + leg)) for x in (0, w - leg) for z in (0, d - leg)]


def table(w: float, h: float, d: float, s: float) -> Parts:
    """A top on legs; the part above the surface is a panel at the back."""
    slab = min(0.06, 0.15 * s)
    panel = [((0.0, s, 0.0), (w, h, _BOARD))] if h - s > 0.1 else []
    return [((0, s - slab, 0), (w, s, d)), *panel, *_legs(w, s - slab, d)]


def chair(w: float, h: float, d: float, s: float) -> Parts:
    """A seat on legs with a back."""
    seat = max(s - _LEG, 0.0)
    return [((0, seat, 0), (w, s, d)), ((0, s, 0), (w, h, 0.1 * d)), *_legs(w, seat, d)]


def sofa(w: float, h: float, d: float, s: float) -> Parts:
    """A seat between two arms, with a back."""
    arm, back, rest = 0.12 * w, 0.25 * d, min(h, s + 0.4 * (h - s))
    return [
        ((arm, 0, back), (w - arm, s, d)),
        ((0, 0, 0), (w, h, back)),
        ((0, 0, back), (arm, rest, d)),
        ((w - arm, 0, back), (w, rest, d)),
    ]


def bed(w: float, h: float, d: float, s: float) -> Parts:
    """A mattress on its frame, with a headboard in front, where the record has the pillows."""
    return [((0, 0, 0), (w, s, d - 0.08)), ((0, 0, d - 0.08), (w, h, d))]


def toilet(w: float, h: float, d: float, s: float) -> Parts:
    """A cistern, on which things stand, and a bowl before it."""
    tank = 0.32 * d
    return [
        ((0, 0.4 * h, 0), (w, s, tank)),
        ((0.15 * w, 0, 0.1 * d), (0.85 * w, 0.42 * h, d)),
    ]


def basin(w: float, h: float, d: float, s: float) -> Parts:
    """A bottom and four walls: a tub, a bin, a box."""
    wall = min(_BOARD, 0.1 * w, 0.1 * d)
    return [
        ((0, 0, 0), (w, min(_BOARD, 0.2 * h), d)),
        ((0, 0, 0), (w, h, wall)),
        ((0, 0, d - wall), (w, h, d)),
        ((0, 0, wall), (wall, h, d - wall)),
        ((w - wall, 0, wall), (w, h, d - wall)),
    ]


def bowl(w: float, h: float, d: float, s: float) -> Parts:
    """The hiding parts of a sink: the bowl if it stands on a foot, nothing if it is let in."""
    low, wall = h - 0.28, 0.1 * min(w, d)
    if h < _PEDESTAL:
        return []
    around = basin(w, h - low - 0.02, d, s)[1:]
    lifted = [((a, b + low, c), (e, f + low, g)) for (a, b, c), (e, f, g) in around]
    return [((wall, low, wall), (w - wall, low + 0.03, d - wall)), *lifted]


def boards(w: float, h: float, d: float, s: float) -> Parts:
    """An open case: back, sides, bottom and top."""
    return [
        ((0, 0, 0), (w, _BOARD, d)),
        ((0, 0, 0), (_BOARD, h, d)),
        ((w - _BOARD, 0, 0), (w, h, d)),
        ((0, h - _BOARD, 0), (w, h, d)),
        ((0, 0, 0), (w, h, _BOARD)),
    ]


def shelf(w: float, h: float, d: float, s: float) -> Parts:
    """The board under the space that the record calls a shelf."""
    return [((0, 0, 0), (w, min(_BOARD, h), d))]


def desk(w: float, h: float, d: float, s: float) -> Parts:
    """The hiding parts of a desk: its top, two upright sides and a board behind the knees."""
    slab = min(0.04, 0.15 * s)
    under, side = s - slab, _BOARD + 0.02
    return [
        ((0, under, 0), (w, s, d)),
        ((0, 0, 0.02), (side, under, d - 0.02)),
        ((w - side, 0, 0.02), (w, under, d - 0.02)),
        ((side, 0.5 * under, 0.05), (w - side, under, 0.09)),
    ]


def closed(w: float, h: float, d: float, s: float) -> Parts:
    """The box without a little at the front and the back, where doors and drawers are."""
    return [((0, 0, _DOOR * d), (w, h, (1 - _DOOR) * d))]


def open_case(w: float, h: float, d: float, s: float) -> Parts:
    """A case that is open at its front except for its bottom."""
    return boards(w, s if s > 0.6 * h else h, d, s)[1:]


def plant(w: float, h: float, d: float, s: float) -> Parts:
    """A pot, and leaves above it."""
    return [
        ((0.2 * w, 0, 0.2 * d), (0.8 * w, 0.5 * h, 0.8 * d)),
        ((0, 0.5 * h, 0), (w, h, d)),
    ]


def lamp(w: float, h: float, d: float, s: float) -> Parts:
    """A foot, a pole and a shade."""
    return [
        ((0.25 * w, 0, 0.25 * d), (0.75 * w, _BOARD, 0.75 * d)),
        ((w / 2 - 0.015, 0, d / 2 - 0.015), (w / 2 + 0.015, 0.8 * h, d / 2 + 0.015)),
        ((0, 0.75 * h, 0), (w, h, d)),
    ]


def door_frame(w: float, h: float, d: float, s: float) -> Parts:
    """Two jambs and a lintel."""
    sides = [((x, 0.0, 0.0), (x + _BOARD, h, d)) for x in (0.0, w - _BOARD)]
    return [*sides, ((0.0, h - _BOARD, 0.0), (w, h, d))]


def nothing(w: float, h: float, d: float, s: float) -> Parts:
    """No part at all."""
    return []


@dataclass(frozen=True)
class Family:
    """How objects of some types are made.

    Attributes:
        parts: builds their parts.
        hides: builds the boxes that hide what is behind, None if all parts do. Leaves, glass and
            lattices hide nothing.
        snug: whether the hiding boxes are as wide as recorded.
        stand: the surface's height as a share of the object's, if the record shows nothing standing
            there; None for near the floor of the box.
    """

    parts: Builder = whole
    hides: Builder | None = None
    stand: float | None = 1.0
    snug: bool = False


_CASE = Family(stand=None)
_VESSEL = Family(hides=_core(0.7, 0.95), stand=None)
_SEE_THROUGH = Family(hides=nothing)
_SMALL = Family(hides=_core(0.7, 0.95))
"""Objects that can be picked up are rounded: the corners of their boxes are air."""

_BY_TYPES = {
    "Desk": Family(table, desk),
    "TVStand": Family(hides=open_case),
    "DiningTable CoffeeTable SideTable Stool Footstool": Family(
        table, lambda w, h, d, s: table(w, h, d, s)[:1]
    ),
    "Chair": Family(chair, lambda w, h, d, s: chair(w, h, d, s)[:2], stand=0.5),
    "Sofa ArmChair": Family(sofa, stand=0.5),
    "Bed": Family(bed, stand=0.55),
    "DogBed": Family(hides=_core(1.0, 0.5), stand=0.5),
    "Toilet": Family(toilet, stand=1.0),
    "Bathtub": Family(basin, stand=None),
    "Sink": Family(basin, bowl, stand=None),
    "Box GarbageCan LaundryHamper": Family(basin, _core(0.9, 0.9), stand=None),
    "ShelvingUnit": Family(boards, nothing),
    "Shelf": Family(shelf, nothing, stand=None),
    "Cabinet Drawer": Family(hides=closed, stand=None, snug=True),
    "Dresser": Family(hides=closed, snug=True),
    "Fridge Microwave Safe Cart Toaster CoffeeMachine": _CASE,
    "Pot Pan Bowl Plate Cup Mug": _VESSEL,
    "HousePlant": Family(plant, lambda w, h, d, s: plant(w, h, d, s)[:1]),
    "FloorLamp DeskLamp": Family(lamp, nothing),
    "CounterTop": Family(hides=nothing),
    # Objects that lie flat on a wall or the floor, glass, frames, and the space inside basins.
    "Floor Window Curtains Blinds Painting Poster Mirror LightSwitch ShowerGlass ShowerDoor "
    "ShowerHead StoveBurner StoveKnob Faucet TowelHolder HandTowelHolder ToiletPaperHanger "
    "RoomDecor": _SEE_THROUGH,
    "Doorway Doorframe": Family(door_frame, nothing),
    "SinkBasin BathtubBasin": Family(hides=nothing, stand=None),
}
_FAMILIES = {name: family for names, family in _BY_TYPES.items() for name in names.split()}
_WHOLE = Family()


def family(object_type: str, small: bool) -> Family:
    """The family of an object type; ``small`` says whether it can be picked up."""
    return _FAMILIES.get(object_type, _SMALL if small else _WHOLE)


@lru_cache(maxsize=8192)
def parts(
    object_type: str, small: bool, size: tuple[float, float, float], surface: float | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """The parts of an object, and the boxes that hide what is behind it.

    Args:
        object_type: AI2-THOR's object type.
        small: whether it can be picked up.
        size: (3,) its own width, height and depth, metres.
        surface: height above its underside at which things stand, metres; None for its family's.

    Returns:
        (K, 2, 3) and (H, 2, 3) corners of boxes, metres from its left lower back corner; read-only.
    """
    kind = family(object_type, small)
    if surface is None:
        surface = size[1] * (kind.stand or 0.0)
    made_of = kind.parts(*size, surface)
    hiding = made_of if kind.hides is None else kind.hides(*size, surface)
    found = tuple(
        np.clip(np.array(boxes, dtype=np.float64).reshape(-1, 2, 3), 0.0, size)
        for boxes in (made_of, hiding)
    )
    for boxes in found:
        boxes.setflags(write=False)
    return found  # type: ignore[return-value]  # a pair
