"""The layout of a kitchen's stove, from its burners, its knobs and the objects beside it.

A stove's frame: x to its right, y up from the floor, z to its front. Its origin is on the floor
under the middle of its burners.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.appearance import appearance_of
from er_gym.sim.render.floor_plan import floor_plan
from er_gym.sim.render.patch import rotation
from er_gym.sim.rotation import unity_rotation
from er_gym.sim.space.solids import solid_of
from er_gym.sim.space.solids.carcass import SUNK
from er_gym.sim.world import World

Floats = NDArray[np.float64]
Ends = tuple[float, float]

_UNDER = 0.004
"""Distance from a burner down to the cooktop, and from a knob back to its panel, metres."""
_MARGIN = 0.05
"""How much larger than its burners a cooktop is, metres."""
_SNUG = 0.012
"""The same, at least, if something stands beside it, metres."""
_JOIN = 0.17
"""A counter that is nearer to the burners than this touches the stove, metres."""
_TO_WALL = 0.3
"""A stove that is nearer to a wall than this touches the wall, metres."""
_CLEAR = 0.22
"""Distance from the stove's door to where the agent can stand, metres."""
_LOW = 0.5
"""A lower cooktop has no oven, metres."""
LEAN = 0.045
"""How far a sloping panel extends down and forward from its middle, metres."""
_BESIDE = frozenset({"CounterTop", "Cabinet", "Drawer", "Fridge"})
_BELOW = frozenset({"Cabinet", "Drawer"})


@dataclass(frozen=True, eq=False)
class Box:
    """Low and high corners (3,) of a box in the stove's frame."""

    low: Floats
    high: Floats
    kind: str = ""
    surface: float = 0.0
    """Height at which a counter is drawn."""

    def share_over(self, other: Box, least: float = 0.0) -> float:
        """Seen from above, the share of this box over another one and ``least`` inside it."""
        span = np.minimum(self.high, other.high) - np.maximum(self.low, other.low) - least
        return float(np.prod(np.maximum(span, 0.0)[::2] / (self.high - self.low)[::2]))

    def with_front(self, z: float) -> Box:
        """The same box with its front at another z."""
        return Box(self.low, np.array([*self.high[:2], z]), self.kind)


@dataclass(frozen=True, eq=False)
class StoveFrame:
    """The frame of a stove in the world: the heading of its front, and its origin (3,)."""

    yaw: float
    origin: Floats

    @property
    def turn(self) -> Floats:
        """(3, 3) from this frame to the world's."""
        return rotation("y", self.yaw)

    @property
    def across(self) -> bool:
        """Whether the stove stands across a corner."""
        return self.yaw % 90.0 != 0.0

    def local(self, points: Floats) -> Floats:
        """World points (..., 3) in this frame."""
        found: Floats = (points - self.origin) @ self.turn
        return found

    def box(self, low: Floats, high: Floats, kind: str = "", surface: float = 0.0) -> Box:
        """A box of the world in this frame. Burners and knobs are turned as the stove is."""
        half = (high - low) / 2 @ np.abs(self.turn)
        half[::2] *= 0.5 if self.across and not kind else 1.0
        middle = self.local((low + high) / 2)
        return Box(middle - half, middle + half, kind, surface - float(self.origin[1]))

    @staticmethod
    def of(world: World) -> StoveFrame:
        """The frame of a kitchen's stove.

        Its front faces the nearest position of the agent, and the row of knobs runs along it.
        """
        burners, knobs = list(world.of_type("StoveBurner")), list(world.of_type("StoveKnob"))
        origin = (world.low[burners].min(axis=0) + world.high[burners].max(axis=0)) / 2
        origin[1] = world.high[next(world.of_type("Floor")), 1]
        places = np.insert(world.scene.reachable, 1, origin[1], axis=1)
        row = (world.low[knobs] + world.high[knobs]) / 2

        def doubt(frame: StoveFrame) -> float:
            x, z = frame.local(places)[:, ::2].T
            before = z[(np.abs(x) < 0.35) & (z > 0.0)]
            return float(before.min(initial=9.0) + 3 * np.ptp(frame.local(row)[:, 2]))

        return min((StoveFrame(45.0 * k, origin) for k in range(8)), key=doubt)


@dataclass(frozen=True, eq=False)
class StoveLayout:
    """A stove and its surroundings, in its frame.

    Attributes:
        burners, knobs: their boxes.
        fire, row: the boxes around all burners and all knobs.
        bearing: the part that carries the knobs; "slope" is a front that leans back.
        top: height of the cooktop.
        pierced: whether the cooktop has holes for burners that lie deeper.
        left, right, back, front: ends of the cooktop.
        inner: left and right end of the case under it, None if there is no room for one.
        counter: the counter that it is let into, None if it stands alone.
        gap: (K, 2) x and z of the empty corner behind it.
    """

    burners: list[Box]
    knobs: list[Box]
    fire: Box
    row: Box
    bearing: Literal["top", "slope", "front", "back"]
    top: float
    pierced: bool
    left: float
    right: float
    back: float
    front: float
    inner: tuple[float, float] | None
    counter: Box | None
    gap: Floats


def stove_layout(world: World, frame: StoveFrame) -> StoveLayout:
    """The layout of a kitchen's stove between the objects beside it."""
    burners, knobs = (
        [frame.box(world.low[i], world.high[i]) for i in world.of_type(kind)]
        for kind in ("StoveBurner", "StoveKnob")
    )
    fire, row = _around(burners), _around(knobs)
    about = list(_about(world, frame))
    under = [box for box in about if box.kind == "CounterTop" and fire.share_over(box)]
    about = [] if frame.across else about
    counter = next((box for box in under if fire.share_over(box) > 0.5), None)
    counter = None if frame.across else counter
    lowest = float(fire.low[1])
    top = max([lowest - _UNDER, *(box.surface + 0.003 for box in under)])
    beside = [
        box
        for box in about
        if box is not counter and box.low[1] < top - 0.01 and box.high[1] > 0.1
        if box.low[2] < fire.high[2] - 0.02 and box.high[2] > fire.low[2] + 0.02
    ]
    bearing = _bearing(world, fire, row)
    edges = [] if counter else [float(b.high[2]) for b in beside if b.kind == "CounterTop"]
    places = frame.local(np.insert(world.scene.reachable, 1, 0.0, axis=1))
    near = places[(np.abs(places[:, 0]) < 0.6) & (places[:, 2] > fire.high[2]), 2]
    limit = float(near.min(initial=9.0)) - _CLEAR
    # A stove across a corner has drawers on both sides, just below the cooktop.
    inner = _SNUG if frame.across else _MARGIN
    ends = [_end(fire, row, [] if counter else beside, sign, inner) for sign in (-1, 1)]
    # An oven extends to the front of the counter that the cooktop is let into.
    deep = fire if counter is None else fire.with_front(float(counter.high[2]))
    taken = any(b.kind in _BELOW and b.low[1] < top and deep.share_over(b, 0.02) for b in about)
    return StoveLayout(
        burners=burners,
        knobs=sorted(knobs, key=lambda box: float(box.low[0])),
        fire=fire,
        row=row,
        bearing=bearing,
        top=top,
        pierced=top > lowest - 0.0003 and not frame.across,
        left=ends[0][0],
        right=ends[1][0],
        back=_back(_wall(world.scene.name, frame), fire, row, bearing, counter),
        front=min(_front(fire, row, bearing, edges), limit),
        inner=(ends[0][1], ends[1][1]) if top > _LOW and not taken else None,
        counter=counter,
        gap=_gap(world, frame) if frame.across else np.empty((0, 2)),
    )


def _around(boxes: list[Box]) -> Box:
    return Box(
        np.min([box.low for box in boxes], axis=0), np.max([box.high for box in boxes], axis=0)
    )


def _about(world: World, frame: StoveFrame) -> Iterator[Box]:
    """The boxes of fixed objects that are not part of the stove."""
    for i, kind in enumerate(world.types):
        if kind in ("StoveBurner", "StoveKnob", "Floor") or world.has(i, "pickupable"):
            continue
        surface = 0.0
        if kind == "CounterTop":
            seen = appearance_of(world, i)
            height = seen.size[1] if seen.surface is None else max(seen.surface, 0.0)
            surface = float(world.low[i, 1]) + min(height, seen.size[1]) - SUNK
        boxes = (
            solid_of(world, i).boxes if kind == "CounterTop" else [(world.low[i], world.high[i])]
        )
        for low, high in boxes:
            yield frame.box(low, high, kind, surface)


def _bearing(world: World, fire: Box, row: Box) -> Literal["top", "slope", "front", "back"]:
    """The part of the stove that carries the knobs, from how they are turned."""
    first = next(world.of_type("StoveKnob"))
    rise = abs(float((unity_rotation(world.rotation[first]) @ (0.0, 1.0, 0.0))[1]))
    if rise > 0.9:
        return "top"
    if row.low[1] > fire.high[1] + 0.03:
        return "back"
    return "slope" if rise > 0.4 else "front"


def _front(fire: Box, row: Box, bearing: str, edges: list[float]) -> float:
    """The z of a stove's front: that of the counters beside it, if possible."""
    if bearing == "slope":
        return slope(row)[1] + LEAN
    if bearing == "front":
        return float(row.low[2] + row.high[2]) / 2 - 0.028
    front = float(max(fire.high[2] + _MARGIN, row.high[2] + 0.02))
    return max([front, *(edge for edge in edges if edge < front + 0.15)])


def slope(row: Box) -> tuple[float, float]:
    """Height and z of a point on a sloping panel, from the row of knobs on it."""
    y, z = ((row.low + row.high)[1:] / 2).tolist()
    behind = (0.25 * float(row.high[1] - row.low[1]) + _UNDER) * 0.5**0.5
    return y - behind, z - behind


def _back(wall: float, fire: Box, row: Box, bearing: str, counter: Box | None) -> float:
    """The z of a cooktop's back: at a near wall, or at the guard if there is one."""
    if bearing == "back":
        return float(row.low[2]) - _UNDER
    if counter is None and fire.low[2] - _TO_WALL < wall < fire.low[2]:
        return wall + 0.002
    return float(fire.low[2]) - _MARGIN


def _wall(scene_name: str, frame: StoveFrame) -> float:
    """The z of the wall behind a stove; minus infinity if there is none."""
    found = [-np.inf]
    for wall in floor_plan(scene_name).walls:
        point = np.array(frame.origin)
        if wall.low < point[2 - 2 * wall.axis] < wall.high:
            point[2 * wall.axis] = wall.at
            x, _, z = frame.local(point)
            if abs(x) < 0.01 and z < 0.0:
                found.append(float(z))
    return max(found)


def _end(fire: Box, row: Box, beside: list[Box], sign: int, inner: float) -> tuple[float, float]:
    """The ends on one side, of the cooktop and of the case under it.

    They touch the objects beside them, or extend a little beyond the burners if there are none.
    """

    def out(box: Box, side: int) -> float:
        return sign * float((box.high if side > 0 else box.low)[0])

    edge = out(fire, sign)
    wanted = max(edge + _MARGIN, out(row, sign) + 0.015)
    near = [
        (out(box, -sign) - 0.003, box.kind in _BESIDE)
        for box in beside
        if sign * float((box.low + box.high)[0]) > 0.0
    ]
    first, joins = min(near, default=(np.inf, False))
    if first < wanted or (joins and first < edge + _JOIN):
        return sign * max(first, edge + _SNUG), sign * first
    return sign * wanted, sign * (wanted - _MARGIN + inner)


def _gap(world: World, frame: StoveFrame) -> Floats:
    """(3, 2) the corner of the room behind a stove across it, and points on its two walls."""
    plan = floor_plan(world.scene.name)
    behind = frame.turn[[0, 2], 2] < 0.0
    corner = np.where(behind, (plan.xs[-1], plan.zs[-1]), (plan.xs[0], plan.zs[0]))
    x, z = frame.origin[::2]
    points = np.array([corner, (corner[0], z), (x, corner[1])])
    found: Floats = frame.local(np.insert(points, 1, 0.0, axis=1))[:, ::2]
    return found
