"""The small things of a house: on tables and shelves, and in drawers, fridges and boxes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from er_gym.houses.catalogue import SMALL, small_choices
from er_gym.houses.furniture import Placed
from er_gym.houses.plan import PlannedRoom
from er_gym.houses.spaces import Rectangle, overlap
from er_gym.sim.house.assets import Asset
from er_gym.sim.placement_restrictions import accepts
from er_gym.sim.space.solids.families import family

_EDGE, _APART = 0.03, 0.02
"""Distance of small things from the edges of what they lie on, and from each other, metres."""
_TRIES = 25
_INSIDE = 0.02
"""How far above the underside of a drawer or a fridge things lie in it, metres."""
_ENCLOSING = frozenset({"Fridge", "Drawer", "Cabinet", "Microwave", "Safe", "Box"})
_LEFT_OUT = frozenset(
    {
        *("GarbageCan", "LaundryHamper", "Toilet", "Sink", "SinkBasin", "CoffeeMachine"),
        *("Toaster", "Chair", "Stool", "Shelf", "ShelvingUnit"),
    }
)
"""Receptacles in which a house begins with nothing."""
_HIDDEN = 0.4
"""The share of small things that are put away if they can be."""
_ON_TOP_OF_SEATS = 0.3
"""How far from the edges of a seat or a bed things lie, as a share of its size."""


@dataclass
class Surface:
    """A place where small things lie.

    Attributes:
        host: the number of the placed thing that it is part of.
        type: its object type, which decides what is accepted.
        area: on the floor plan, metres.
        height: at which things stand, metres.
        headroom: the most that they may be tall, metres.
        taken: where things lie already.
    """

    host: int
    type: str
    area: Rectangle
    height: float
    headroom: float
    taken: list[Rectangle] = field(default_factory=list)


def clutter(
    room: PlannedRoom, furniture: Sequence[Placed], first: int, rng: np.random.Generator
) -> list[Placed]:
    """The small things of a room.

    Args:
        furniture: all furniture of the house; the room's own is used.
        first: the number that the first thing gets.
    """
    surfaces = [
        surface
        for k, piece in enumerate(furniture)
        if piece.room == room.number
        for surface in surfaces_of(k, piece, furniture)
    ]
    found: list[Placed] = []
    kinds = SMALL[room.kind].split()
    for kind in [kinds[k] for k in rng.permutation(len(kinds)).tolist()]:
        fitting = [s for s in surfaces if accepts(kind, s.type)]
        hidden = [s for s in fitting if s.type in _ENCLOSING]
        if hidden and rng.random() < _HIDDEN:
            fitting = hidden
        elif len(hidden) < len(fitting):
            fitting = [s for s in fitting if s.type not in _ENCLOSING]
        assets = small_choices(kind)
        if not fitting or not assets:
            continue
        placed = _placed(kind, assets, fitting, room, rng)
        if placed is not None:
            found.append(placed)
    return found


def _placed(
    kind: str, assets: Sequence[Asset], fitting: Sequence[Surface], room: PlannedRoom,
    rng: np.random.Generator,
) -> Placed | None:  # fmt: skip
    for _ in range(_TRIES):
        surface = fitting[int(rng.integers(len(fitting)))]
        asset = assets[int(rng.integers(len(assets)))]
        yaw = 90.0 * int(rng.integers(4))
        w, h, d = asset.size
        if round(yaw / 90.0) % 2:
            w, d = d, w
        x0, z0, x1, z1 = surface.area
        if x1 - x0 < w or z1 - z0 < d or h > surface.headroom:
            continue
        x = float(rng.uniform(x0 + w / 2, x1 - w / 2))
        z = float(rng.uniform(z0 + d / 2, z1 - d / 2))
        body = (x - w / 2, z - d / 2, x + w / 2, z + d / 2)
        if any(overlap(body, other, _APART) for other in surface.taken):
            continue
        surface.taken.append(body)
        y = round(surface.height + h / 2 + 0.002, 4)
        return Placed(asset, round(x, 3), y, round(z, 3), yaw, room.number, surface.host)
    return None


def surfaces_of(number: int, piece: Placed, furniture: Sequence[Placed]) -> Iterator[Surface]:
    """The places on and in a piece of furniture."""
    kind, (_, h, _) = piece.asset.type, piece.asset.size
    bottom = piece.y - h / 2
    if "receptacle" in piece.asset.has and kind not in _LEFT_OUT:
        inset = _EDGE
        stand = family(kind, False).stand
        if kind in _ENCLOSING:
            height, headroom, inset = bottom + _INSIDE, h - 3 * _INSIDE, 0.08
            if kind == "Fridge":  # at the middle shelf
                height, headroom = bottom + 0.45 * h, 0.35 * h
        else:
            height, headroom = bottom + (1.0 if stand is None else stand) * h, 1.0
        area = _shrunk(piece.rectangle, inset)
        if kind in ("Sofa", "ArmChair", "Bed"):
            x0, z0, x1, z1 = piece.rectangle
            x, z = _ON_TOP_OF_SEATS * (x1 - x0), _ON_TOP_OF_SEATS * (z1 - z0)
            area = (x0 + x, z0 + z, x1 - x, z1 - z)
        taken = [each.rectangle for each in furniture if each.on == number]
        yield Surface(number, kind, area, height, headroom, taken)
    for part in piece.asset.parts:
        if part.type not in _LEFT_OUT and part.type in _ENCLOSING:
            yield _of_part(number, piece, part.type, part.middle, part.size)


def _of_part(
    number: int,
    piece: Placed,
    kind: str,
    middle: tuple[float, float, float],
    size: tuple[float, float, float],
) -> Surface:
    turn = np.radians(piece.yaw)
    x = piece.x + middle[0] * np.cos(turn) + middle[2] * np.sin(turn)
    z = piece.z - middle[0] * np.sin(turn) + middle[2] * np.cos(turn)
    w, h, d = size
    if round(piece.yaw / 90.0) % 2:
        w, d = d, w
    area = (float(x - w / 2), float(z - d / 2), float(x + w / 2), float(z + d / 2))
    bottom = piece.y + middle[1] - h / 2
    return Surface(number, kind, _shrunk(area, _EDGE), bottom + _INSIDE, h - 2 * _INSIDE)


def _shrunk(area: Rectangle, by: float) -> Rectangle:
    x0, z0, x1, z1 = area
    return x0 + by, z0 + by, x1 - by, z1 - by
