"""Furnishing a room: what stands at its walls, in the open, and on other furniture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from er_gym.houses.catalogue import FURNITURE, Piece, choices
from er_gym.houses.openings import SIDES, span_of
from er_gym.houses.plan import PlannedRoom
from er_gym.houses.spaces import Rectangle, Space, before
from er_gym.sim.house.assets import Asset

_BEHIND = 0.02
"""Distance from a wall to what stands at it, metres."""
_TRIES = 40
_GRID = 0.05
_FRONT_OF_SIDE = {"west": 90.0, "north": 180.0, "east": 270.0, "south": 0.0}
"""The heading of what stands with its back to a side of the room, degrees."""
_EDGE = 0.03


@dataclass(frozen=True)
class Placed:
    """An asset at its place.

    Attributes:
        x, y, z: the middle of its box, metres.
        yaw: its heading, a quarter turn, degrees.
        on: the number of the placed thing that it stands on, -1 for the floor.
        room: the number of its room.
    """

    asset: Asset
    x: float
    y: float
    z: float
    yaw: float
    room: int
    on: int = -1

    @property
    def spread(self) -> tuple[float, float]:
        """Its size along x and z, metres."""
        w, _, d = self.asset.size
        return (d, w) if round(self.yaw / 90.0) % 2 else (w, d)

    @property
    def rectangle(self) -> Rectangle:
        w, d = self.spread
        return self.x - w / 2, self.z - d / 2, self.x + w / 2, self.z + d / 2

    @property
    def top(self) -> float:
        return self.y + self.asset.size[1] / 2


def furnish(space: Space, first: int, rng: np.random.Generator) -> list[Placed]:
    """The furniture of a room.

    Args:
        space: the floor of the room, which is changed.
        first: the number that the first piece gets.
    """
    found: list[Placed] = []
    for piece in FURNITURE[space.room.kind]:
        count = int(piece.chance) + int(rng.random() < piece.chance - int(piece.chance))
        for _ in range(count):
            assets = choices(piece)
            placed = None
            for _ in range(_TRIES):
                asset = assets[int(rng.integers(len(assets)))]
                if piece.on:
                    placed = _on_top(piece, asset, found, first, rng)
                elif piece.at_wall:
                    placed = _at_wall(piece, asset, space, rng)
                else:
                    placed = _in_the_open(piece, asset, space, rng)
                if placed is not None:
                    found.append(placed)
                    break
    return found


def _at_wall(piece: Piece, asset: Asset, space: Space, rng: np.random.Generator) -> Placed | None:
    room, (w, h, d) = space.room, asset.size
    side = SIDES[int(rng.integers(4))]
    low, high = span_of(room, side)
    if high - low < w + 2 * _BEHIND:
        return None
    start = round(float(rng.uniform(low + _BEHIND, high - _BEHIND - w)), 3)
    if rng.random() < 0.5:  # corners are used first, as people do
        start = low + _BEHIND if rng.random() < 0.5 else high - _BEHIND - w
    if space.hides_window(side, start, start + w, h):
        return None
    body = before(room, side, start, start + w, _BEHIND + d)
    yaw = _FRONT_OF_SIDE[side]
    free = [before(room, side, start, start + w, _BEHIND + d + piece.free)] if piece.free else []
    if free:
        free = [_beyond(free[0], body, side)]
    if not space.fits(body, free):
        return None
    space.put(body, free)
    x, z = (body[0] + body[2]) / 2, (body[1] + body[3]) / 2
    shift = _BEHIND / 2  # the body reaches from the wall to its front
    x += {"west": shift, "east": -shift}.get(side, 0.0)
    z += {"south": shift, "north": -shift}.get(side, 0.0)
    turn = yaw + (180.0 if piece.turned else 0.0)
    return Placed(asset, round(x, 3), h / 2, round(z, 3), turn % 360.0, room.number)


def _beyond(whole: Rectangle, body: Rectangle, side: str) -> Rectangle:
    """The part of a strip along a wall that is beyond the thing at the wall."""
    x0, z0, x1, z1 = whole
    return {
        "west": (body[2], z0, x1, z1),
        "east": (x0, z0, body[0], z1),
        "south": (x0, body[3], x1, z1),
        "north": (x0, z0, x1, body[1]),
    }[side]


def _in_the_open(
    piece: Piece, asset: Asset, space: Space, rng: np.random.Generator
) -> Placed | None:
    room, yaw = space.room, 90.0 * int(rng.integers(4))
    w, d = asset.size[0], asset.size[2]
    if round(yaw / 90.0) % 2:
        w, d = d, w
    around = max(piece.free, 0.45) if piece.type != "Chair" else 0.1
    (wide, deep) = room.size
    if wide < w + 2 * around or deep < d + 2 * around:
        return None
    x = float(rng.uniform(room.west + around + w / 2, room.east - around - w / 2))
    z = float(rng.uniform(room.south + around + d / 2, room.north - around - d / 2))
    x, z = round(x / _GRID) * _GRID, round(z / _GRID) * _GRID
    body = (x - w / 2, z - d / 2, x + w / 2, z + d / 2)
    near = (body[0] - around, body[1] - around, body[2] + around, body[3] + around)
    if not space.fits(body, [near] if piece.type != "Chair" else ()):
        return None
    # Chairs may stand at the table, so only the table itself is taken.
    space.put(body)
    return Placed(asset, round(x, 3), asset.size[1] / 2, round(z, 3), yaw, room.number)


def _on_top(
    piece: Piece, asset: Asset, found: Sequence[Placed], first: int, rng: np.random.Generator
) -> Placed | None:
    """A place on furniture of the type that the piece stands on, at its back."""
    hosts = [k for k, each in enumerate(found) if each.asset.type == piece.on]
    if not hosts:
        return None
    k = hosts[int(rng.integers(len(hosts)))]
    host = found[k]
    w, h, d = asset.size
    wide, _, deep = host.asset.size
    if w > wide - 2 * _EDGE or d > deep + 0.02:
        return None
    aside = float(rng.uniform(-1.0, 1.0)) * (wide / 2 - _EDGE - w / 2)
    back = -(deep - d) / 2 + min(_EDGE, max(deep - d, 0.0) / 2)
    turn = np.radians(host.yaw)
    x = host.x + aside * np.cos(turn) + back * np.sin(turn)
    z = host.z - aside * np.sin(turn) + back * np.cos(turn)
    placed = Placed(
        asset, round(float(x), 3), round(host.top + h / 2, 4), round(float(z), 3), host.yaw,
        host.room, first + k,
    )  # fmt: skip
    others = [each for each in found if each.on == first + k]
    if any(_overlap(placed, other) for other in others):
        return None
    return placed


def _overlap(one: Placed, other: Placed) -> bool:
    (a, b, c, d), (e, f, g, h) = one.rectangle, other.rectangle
    return a < g + _EDGE and e < c + _EDGE and b < h + _EDGE and f < d + _EDGE


def is_reachable_room(room: PlannedRoom, places: np.ndarray) -> bool:
    """Whether the agent can stand in a room, at some of (P, 2) places."""
    return bool(
        (
            (places[:, 0] > room.west)
            & (places[:, 0] < room.east)
            & (places[:, 1] > room.south)
            & (places[:, 1] < room.north)
        ).any()
    )
