"""What stands in a room and is no object: the stove that burners and knobs belong to.

AI2-THOR records burners and knobs, but not what they are on. Here they get a cooktop and, where
nothing else is built in below, an oven; knobs get a panel behind them: a slope at the front, a
strip on the cooktop, or a guard that stands up behind it.

A stove's frame: x to its right, y up from the floor, z to its front; its origin is on the floor
under the middle of its burners.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from hashlib import blake2b
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_gym.sim.render.look import mixed, shaded
from er_gym.sim.render.mesh import Colour, Mesh, Patch, Triple, rotation
from er_gym.sim.render.palette import palette
from er_gym.sim.render.plan import room_plan
from er_gym.sim.render.portrait import look
from er_gym.sim.render.shade import shaded as in_light
from er_gym.sim.scene import load_scene
from er_gym.sim.space.rotation import unity_rotation
from er_gym.sim.world import Settings, World

Floats = NDArray[np.float64]
Ends = tuple[float, float]

_STEEL: Colour = (0.66, 0.68, 0.71)
_WHITE: Colour = (0.95, 0.95, 0.93)
_BLACK: Colour = (0.21, 0.21, 0.23)
_GLASS: Colour = (0.08, 0.085, 0.10)
_GLINT: Colour = (0.24, 0.26, 0.30)
_PLINTH: Colour = (0.12, 0.12, 0.13)

_UNDER = 0.004
"""From a burner down to the cooktop, and from a knob back to its panel, metres."""
_MARGIN = 0.05
"""How much larger than its burners a cooktop is, metres."""
_SNUG = 0.012
"""The least that it is larger, whatever stands beside it, metres."""
_JOIN = 0.17
"""A counter that is nearer to the burners stands right beside the stove, metres."""
_TO_WALL = 0.3
"""So near to a wall, it stands at the wall, metres."""
_CLEAR = 0.22
"""From where one can stand to its door, metres."""
_LOW = 0.5
"""There is no oven under a lower cooktop, metres."""
_PLATE, _DOOR, _FOOT, _GUARD = 0.025, 0.025, 0.08, 0.06
"""How thick cooktops, doors and guards are, and how high plinths, metres."""
_LEAN = 0.045
"""How far down and forward a slope reaches from its middle, metres."""
_BASE, _SLAB = 0.03, 0.035
"""How far a counter's base stands back from its edge, and how thick its slab is, metres."""
_UP: Triple = (0.0, 1.0, 0.0)
_BESIDE = frozenset({"CounterTop", "Cabinet", "Drawer", "Fridge"})
_BELOW = frozenset({"Cabinet", "Drawer"})


@lru_cache(maxsize=128)
def fixtures(scene_name: str) -> dict[str, Patch]:
    """Triangles by material, in the world's frame, with the light in their colours."""
    world = World.load(load_scene(scene_name), Settings())
    if not any(world.of_type("StoveBurner")):
        return {}
    frame = _Frame.of(world)
    place = _place(world, frame)
    patches = _stove(place, *_finish(scene_name)).patches()
    return {name: _in_world(name, patch, frame, place.top) for name, patch in patches.items()}


def _in_world(material: str, patch: Patch, frame: _Frame, tall: float) -> Patch:
    """A patch of a stove in the world's frame and in its light."""
    turn = frame.turn.T
    return Patch(
        np.asarray(patch.vertices @ turn + frame.origin, np.float32),
        np.asarray(patch.normals @ turn, np.float32),
        patch.uv,
        np.clip(in_light(material, patch, frame.yaw, tall, 0.0), 0.0, 1.0),
        patch.triangles,
    )


def _finish(scene_name: str) -> tuple[Colour, Colour]:
    """The colours of a kitchen's stove and of its counters."""
    colours = palette(scene_name)
    steel = mixed(_STEEL, colours.metal, 0.15)
    chance = blake2b(f"{scene_name} stove".encode(), digest_size=8).digest()[0]
    return (steel, _WHITE, steel, _BLACK)[chance % 4], colours.counter


# -- where the stove stands ------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Box:
    """Low and high corners (3,) of something, in the frame of the stove."""

    low: Floats
    high: Floats
    kind: str = ""
    surface: float = 0.0
    """How high it is drawn, if it is a counter."""

    def share_over(self, other: _Box, least: float = 0.0) -> float:
        """Seen from above, the share of this box that is over another and ``least`` inside it."""
        span = np.minimum(self.high, other.high) - np.maximum(self.low, other.low) - least
        return float(np.prod(np.maximum(span, 0.0)[::2] / (self.high - self.low)[::2]))

    def with_front(self, z: float) -> _Box:
        """The box that reaches farther or less far to the front."""
        return _Box(self.low, np.array([*self.high[:2], z]), self.kind)


@dataclass(frozen=True, eq=False)
class _Frame:
    """The frame of a stove in the world: the heading of its front, and its origin (3,)."""

    yaw: float
    origin: Floats

    @property
    def turn(self) -> Floats:
        """(3, 3) from this frame to the world's."""
        return rotation("y", self.yaw)

    @property
    def across(self) -> bool:
        """Whether it stands across a corner."""
        return self.yaw % 90.0 != 0.0

    def local(self, points: Floats) -> Floats:
        """World points (..., 3) in this frame."""
        found: Floats = (points - self.origin) @ self.turn
        return found

    def box(self, low: Floats, high: Floats, kind: str = "", surface: float = 0.0) -> _Box:
        """A box of the world; what is of the stove itself is turned as it is."""
        half = (high - low) / 2 @ np.abs(self.turn)
        half[::2] *= 0.5 if self.across and not kind else 1.0
        middle = self.local((low + high) / 2)
        return _Box(middle - half, middle + half, kind, surface - float(self.origin[1]))

    @staticmethod
    def of(world: World) -> _Frame:
        """The front is where one can stand nearest; the row of the knobs runs along it."""
        burners, knobs = list(world.of_type("StoveBurner")), list(world.of_type("StoveKnob"))
        origin = (world.low[burners].min(axis=0) + world.high[burners].max(axis=0)) / 2
        origin[1] = world.high[next(world.of_type("Floor")), 1]
        places = np.insert(world.scene.reachable, 1, origin[1], axis=1)
        row = (world.low[knobs] + world.high[knobs]) / 2

        def doubt(frame: _Frame) -> float:
            x, z = frame.local(places)[:, ::2].T
            before = z[(np.abs(x) < 0.35) & (z > 0.0)]
            return float(before.min(initial=9.0) + 3 * np.ptp(frame.local(row)[:, 2]))

        return min((_Frame(45.0 * k, origin) for k in range(8)), key=doubt)


@dataclass(frozen=True, eq=False)
class _Place:
    """Where a stove is, and what is about it, in its frame.

    Attributes:
        burners, knobs: of each its box. fire, row: the boxes around them.
        bearing: which part bears the knobs; "slope" is a front that leans back.
        top: height of the cooktop. left, right, back, front: its ends.
        pierced: it has holes for the burners, which lie deeper.
        inner: left and right ends of the case under it, None if there is no room for one.
        counter: what it is let into. gap: (K, 2) x and z of what is empty in the corner behind.
    """

    burners: list[_Box]
    knobs: list[_Box]
    fire: _Box
    row: _Box
    bearing: Literal["top", "slope", "front", "back"]
    top: float
    pierced: bool
    left: float
    right: float
    back: float
    front: float
    inner: tuple[float, float] | None
    counter: _Box | None
    gap: Floats


def _place(world: World, frame: _Frame) -> _Place:
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
    # Who stands across a corner has drawers to both sides, just below the cooktop.
    inner = _SNUG if frame.across else _MARGIN
    ends = [_end(fire, row, [] if counter else beside, sign, inner) for sign in (-1, 1)]
    # An oven reaches to the front of the counter that the cooktop is let into.
    deep = fire if counter is None else fire.with_front(float(counter.high[2]))
    taken = any(b.kind in _BELOW and b.low[1] < top and deep.share_over(b, 0.02) for b in about)
    return _Place(
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


def _around(boxes: list[_Box]) -> _Box:
    return _Box(
        np.min([box.low for box in boxes], axis=0), np.max([box.high for box in boxes], axis=0)
    )


def _about(world: World, frame: _Frame) -> Iterator[_Box]:
    """What stands near and is no part of the stove."""
    for i, kind in enumerate(world.types):
        if kind in ("StoveBurner", "StoveKnob", "Floor") or world.has(i, "pickupable"):
            continue
        surface = 0.0
        if kind == "CounterTop":
            seen = look(world, i)
            height = seen.size[1] if seen.surface is None else max(seen.surface, 0.0)
            surface = float(world.low[i, 1]) + min(height, seen.size[1]) + 0.002
        boxes = world.shape(i).boxes if kind == "CounterTop" else [(world.low[i], world.high[i])]
        for low, high in boxes:
            yield frame.box(low, high, kind, surface)


def _bearing(world: World, fire: _Box, row: _Box) -> Literal["top", "slope", "front", "back"]:
    """Which part of the stove bears the knobs, by how they are turned."""
    first = next(world.of_type("StoveKnob"))
    rise = abs(float((unity_rotation(world.rotation[first]) @ (0.0, 1.0, 0.0))[1]))
    if rise > 0.9:
        return "top"
    if row.low[1] > fire.high[1] + 0.03:
        return "back"
    return "slope" if rise > 0.4 else "front"


def _front(fire: _Box, row: _Box, bearing: str, edges: list[float]) -> float:
    """How far to its front a stove reaches: as far as the counters beside it, if it can."""
    if bearing == "slope":
        return _slope(row)[1] + _LEAN
    if bearing == "front":
        return float(row.low[2] + row.high[2]) / 2 - 0.028
    front = float(max(fire.high[2] + _MARGIN, row.high[2] + 0.02))
    return max([front, *(edge for edge in edges if edge < front + 0.15)])


def _slope(row: _Box) -> tuple[float, float]:
    """Height and z of a point of the panel that knobs which lean back are on."""
    y, z = ((row.low + row.high)[1:] / 2).tolist()
    behind = (0.25 * float(row.high[1] - row.low[1]) + _UNDER) * 0.5**0.5
    return y - behind, z - behind


def _back(wall: float, fire: _Box, row: _Box, bearing: str, counter: _Box | None) -> float:
    """How far back a cooktop reaches: to the wall if one is near, to the guard if there is one."""
    if bearing == "back":
        return float(row.low[2]) - _UNDER
    if counter is None and fire.low[2] - _TO_WALL < wall < fire.low[2]:
        return wall + 0.002
    return float(fire.low[2]) - _MARGIN


def _wall(scene_name: str, frame: _Frame) -> float:
    """The z of the wall behind a stove; minus infinity if there is none."""
    found = [-np.inf]
    for wall in room_plan(scene_name).walls:
        point = np.array(frame.origin)
        if wall.low < point[2 - 2 * wall.axis] < wall.high:
            point[2 * wall.axis] = wall.at
            x, _, z = frame.local(point)
            if abs(x) < 0.01 and z < 0.0:
                found.append(float(z))
    return max(found)


def _end(fire: _Box, row: _Box, beside: list[_Box], sign: int, inner: float) -> tuple[float, float]:
    """The ends to one side of the cooktop and of the case under it.

    They reach to what stands beside them, or a little over the burners if nothing does.
    """

    def out(box: _Box, side: int) -> float:
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


def _gap(world: World, frame: _Frame) -> Floats:
    """(3, 2) the corner of the room behind a stove that stands across it, and along its walls."""
    plan = room_plan(world.scene.name)
    behind = frame.turn[[0, 2], 2] < 0.0
    corner = np.where(behind, (plan.xs[-1], plan.zs[-1]), (plan.xs[0], plan.zs[0]))
    x, z = frame.origin[::2]
    points = np.array([corner, (corner[0], z), (x, corner[1])])
    found: Floats = frame.local(np.insert(points, 1, 0.0, axis=1))[:, ::2]
    return found


# -- what it looks like ----------------------------------------------------------------------------


def _stove(place: _Place, colour: Colour, stone: Colour) -> Mesh:
    """A cooktop and what bears the knobs, and an oven if there is room for one."""
    mesh, grates = Mesh(), place.fire.high[1] - place.fire.low[1] > 0.015
    hob = colour
    if grates and colour == _BLACK:  # black grates would not show on black
        hob = _STEEL
    elif not grates and place.counter is not None:
        hob = _GLASS
    start, low = place.front, place.top - 0.09
    if place.bearing == "slope":
        start, low = _leaning(mesh, place, colour)
    elif place.bearing == "front":
        low = float(place.row.low[1]) - 0.03
    elif place.bearing == "top":
        _strip(mesh, place, colour)
    else:
        _guard(mesh, place, colour)
    _cooktop(mesh, place, start, shaded(hob, 0.94))
    if place.inner is not None and place.counter is not None:
        _let_in(mesh, place, place.counter, colour)
    elif place.inner is not None:
        _case(mesh, place, place.inner, start, low, colour)
    if len(place.gap):
        _fill(mesh, place, stone)
    return mesh


def _box(mesh: Mesh, x: Ends, y: Ends, z: Ends, colour: Colour, faces: str = "xXyYzZ") -> None:
    """A box from end to end along each axis."""
    (x0, x1), (y0, y1), (z0, z1) = x, y, z
    at, size = ((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2), (x1 - x0, y1 - y0, z1 - z0)
    mesh.box(at, size, colour, faces=faces)


def _flat(mesh: Mesh, points: ArrayLike, out: Triple, colour: Colour) -> None:
    """A convex outline (K, 3)."""
    corners = np.asarray(points, dtype=np.float64)
    faces = [(0, k, k + 1) for k in range(1, len(corners) - 1)]
    count = (len(corners), 1)
    mesh.triangles(
        "plain", corners, np.tile(out, count), np.zeros((len(corners), 2)), colour, faces
    )


def _cooktop(mesh: Mesh, place: _Place, front: float, colour: Colour) -> None:
    x, z = (place.left, place.right), (place.back, front)
    thick = _PLATE if place.counter is None else 0.008
    around = "xXyzZ" if place.pierced else "xXyYzZ"
    _box(mesh, x, (place.top - thick, place.top), z, colour, around)
    if not place.pierced:
        return
    holes = place.burners
    xs, zs = (
        np.unique([*ends, *(float(end[k]) for hole in holes for end in (hole.low, hole.high))])
        for k, ends in ((0, x), (2, z))
    )
    for (x0, x1), (z0, z1) in itertools.product(itertools.pairwise(xs), itertools.pairwise(zs)):
        middle = np.array([(x0 + x1) / 2, 0.0, (z0 + z1) / 2])
        if not any(((h.low < middle) & (middle < h.high))[::2].all() for h in holes):
            square = [(x0, place.top, z0), (x1, place.top, z0), (x1, place.top, z1)]
            _flat(mesh, [*square, (x0, place.top, z1)], _UP, colour)
    for hole in holes:
        _ring(mesh, hole, place.top, colour)


def _ring(mesh: Mesh, hole: _Box, top: float, colour: Colour) -> None:
    """What a round hole leaves of a square."""
    (x, _, z), (w, _, d) = (hole.low + hole.high) / 2, (hole.high - hole.low) / 2
    for quarter in range(4):
        a = np.radians(90.0 * quarter + np.linspace(0.0, 90.0, 6))
        arc = np.stack([x + w * np.cos(a), np.full(6, top), z + d * np.sin(a)], axis=1)
        corner = np.array([x + w * np.sign(np.cos(a[2])), top, z + d * np.sign(np.sin(a[2]))])
        _flat(mesh, [corner, *arc], _UP, colour)


def _fill(mesh: Mesh, place: _Place, stone: Colour) -> None:
    """The counter behind a stove that stands across a corner."""
    height, front = place.top - 0.023, place.front - 0.03
    corner, *ends = place.gap
    first, last = sorted(ends, key=lambda point: float(point[0]))
    outline = [corner, first, (place.left, front), (place.right, front), last]
    mesh.prism(outline, height - _SLAB, height, stone, "stone")


def _leaning(mesh: Mesh, place: _Place, colour: Colour) -> tuple[float, float]:
    """A panel that leans back; where the cooktop ends before it, and how low it reaches."""
    y, z = _slope(place.row)
    low = y - _LEAN
    start = max(y + z - place.top, float(place.fire.high[2]) + 0.008)
    back = start - 0.03
    outline = [(back, place.top - 0.001), (start, place.top - 0.001)]
    if start > y + z - place.top:
        outline.append((start, y + z - start))
    outline += [(place.front, low), (place.front, low - 0.03), (back, low - 0.03)]
    ends = place.inner or (place.left, place.right)
    mesh.prism(outline, *ends, shaded(colour, 1.05), axis="x")
    return start, low - 0.03


def _strip(mesh: Mesh, place: _Place, colour: Colour) -> None:
    """What lifts knobs to where they are on the cooktop: along its front if they are there."""
    row, top = place.row, float(place.row.low[1]) - 0.003
    if top - place.top < 0.004:
        return
    x, z = ((float(row.low[k]) - 0.012, float(row.high[k]) + 0.012) for k in (0, 2))
    if row.low[2] > place.fire.high[2] + 0.01 and top - place.top > 0.012:
        x, z = (place.left, place.right), (z[0] + 0.006, place.front)
    _box(mesh, x, (place.top - 0.001, top), z, shaded(colour, 0.8), "xXYzZ")


def _guard(mesh: Mesh, place: _Place, colour: Colour) -> None:
    """A panel that stands up behind the cooktop, with a clock where knobs leave room for one."""
    face, high = place.back, float(place.row.high[1]) + 0.035
    x, z = (place.left, place.right), (face - _GUARD, face)
    _box(mesh, x, (place.top - _PLATE, high), z, colour, "xXYzZ")
    _box(mesh, x, (high, high + 0.012), (z[0], face + 0.012), shaded(colour, 0.8))
    room, middle = max(
        (float(b.low[0] - a.high[0]), float(b.low[0] + a.high[0]) / 2)
        for a, b in itertools.pairwise(place.knobs)
    )
    if room > 0.06:
        wide, y = min(room - 0.03, 0.16), float(place.row.low[1] + place.row.high[1]) / 2
        mesh.panel((middle, y, face + 0.004), (wide, 0.055), _GLASS)
        mesh.panel((middle, y, face + 0.008), (min(wide, 0.07) - 0.014, 0.03), (1, 1, 1), "digits")


def _case(mesh: Mesh, place: _Place, x: Ends, start: float, low: float, colour: Colour) -> None:
    """What a stove stands on: a strip under the edge of the cooktop, and the oven below it."""
    face = place.front - 0.004
    under = place.top - _PLATE + 0.005
    _box(mesh, x, (low, under), (place.back, start - 0.03), shaded(colour, 0.9), "xXz")
    if place.bearing != "slope":
        _box(mesh, x, (low, under), (start - 0.04, face), shaded(colour, 1.03), "xXyZ")
    _oven(mesh, x, low, (place.back, face), colour)


def _let_in(mesh: Mesh, place: _Place, counter: _Box, colour: Colour) -> None:
    """An oven under a counter."""
    face, high = float(counter.high[2]) - _BASE + 0.012 + _DOOR, counter.surface - _SLAB - 0.01
    _oven(mesh, (place.left, place.right), high, (face - 0.1, face), colour)


def _oven(mesh: Mesh, x: Ends, high: float, z: Ends, colour: Colour) -> None:
    """A case on a plinth with a drawer, and a door with a window and a bar to pull it by."""
    back, face = z
    _box(mesh, x, (_FOOT, high), (back, face - _DOOR), shaded(colour, 0.9), "xXzZ")
    _box(mesh, x, (0.0, _FOOT), (back, face - 0.07), _PLINTH, "xXzZ")
    wide, middle = x[1] - x[0] - 0.012, (x[0] + x[1]) / 2
    ends = (middle - wide / 2, middle + wide / 2)
    drawer = _FOOT + 0.20 * (high - _FOOT)
    for y in ((_FOOT + 0.008, drawer - 0.006), (drawer + 0.006, high - 0.008)):
        _box(mesh, ends, y, (face - _DOOR, face), colour, "xXyYZ")
    mesh.panel((middle, drawer - 0.03, face + 0.004), (0.5 * wide, 0.016), _PLINTH)
    up, size = drawer + 0.42 * (high - drawer), (0.68 * wide, 0.46 * (high - drawer))
    mesh.panel((middle, up, face + 0.004), (size[0] + 0.03, size[1] + 0.03), shaded(_GLASS, 1.8))
    mesh.panel((middle, up, face + 0.008), size, _GLASS)
    _shine(mesh, (middle, up, face + 0.012), size)
    _bar(mesh, middle, high - 0.055, face, 0.8 * wide, colour)


def _shine(mesh: Mesh, at: Triple, size: tuple[float, float]) -> None:
    """Two streaks of light across a window."""
    x, y, z = at
    h = 0.36 * size[1]
    for off, wide in ((-0.12, 0.10), (0.06, 0.04)):
        left, right = x + off * size[0], x + (off + wide) * size[0]
        low, high = ((end - h / 2, y - h, z) for end in (left, right))
        top, last = ((end + h / 2, y + h, z) for end in (right, left))
        _flat(mesh, [low, high, top, last], (0.0, 0.0, 1.0), _GLINT)


def _bar(mesh: Mesh, x: float, y: float, face: float, wide: float, colour: Colour) -> None:
    """The handle of a door."""
    metal = shaded(_STEEL, 0.75 if colour != _BLACK else 1.1)
    out = face + 0.04
    mesh.tube([(x - wide / 2, y, out), (x + wide / 2, y, out)], 0.011, metal, segments=7)
    for sign in (-1, 1):
        at = x + sign * (wide / 2 - 0.03)
        _box(mesh, (at - 0.009, at + 0.009), (y - 0.009, y + 0.009), (face, out), metal, "xXyY")
