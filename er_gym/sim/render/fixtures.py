"""The stoves of kitchens. A stove is not an object: only its burners and knobs are.

AI2-THOR records burners and knobs, but not the stove. Here the burners get a cooktop and, unless
something else is built in below, an oven. The knobs get a panel behind them: a slope at the front,
a strip on the cooktop, or a guard behind it.

A stove's frame: x to its right, y up from the floor, z to its front. Its origin is on the floor
under the middle of its burners.
"""

from __future__ import annotations

import itertools
from functools import lru_cache
from hashlib import blake2b

import numpy as np
from numpy.typing import ArrayLike

from er_gym.sim.render.lighting import lit_colours
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, palette, shaded
from er_gym.sim.render.patch import Colour, Patch, Triple
from er_gym.sim.render.stove_layout import (
    LEAN,
    Box,
    Ends,
    StoveFrame,
    StoveLayout,
    slope,
    stove_layout,
)
from er_gym.sim.scene import load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.world import World

_STEEL: Colour = (0.66, 0.68, 0.71)
_WHITE: Colour = (0.95, 0.95, 0.93)
_BLACK: Colour = (0.21, 0.21, 0.23)
_GLASS: Colour = (0.08, 0.085, 0.10)
_GLINT: Colour = (0.24, 0.26, 0.30)
_PLINTH: Colour = (0.12, 0.12, 0.13)

_PLATE, _DOOR, _FOOT, _GUARD = 0.025, 0.025, 0.08, 0.06
"""Thickness of cooktops, doors and guards, and height of plinths, metres."""
_BASE, _SLAB = 0.03, 0.035
"""How far a counter's base stands back from its edge, and thickness of its slab, metres."""
_UP: Triple = (0.0, 1.0, 0.0)


@lru_cache(maxsize=128)
def fixtures(scene_name: str) -> dict[str, Patch]:
    """Lit triangles by material, in the world's frame."""
    world = World.load(load_scene(scene_name), Settings())
    if not any(world.of_type("StoveBurner")):
        return {}
    frame = StoveFrame.of(world)
    place = stove_layout(world, frame)
    patches = _stove(place, *_finish(scene_name)).patches()
    return {name: _in_world(name, patch, frame, place.top) for name, patch in patches.items()}


def _in_world(material: str, patch: Patch, frame: StoveFrame, tall: float) -> Patch:
    """A patch of a stove, lit and in the world's frame."""
    turn = frame.turn.T
    return Patch(
        np.asarray(patch.vertices @ turn + frame.origin, np.float32),
        np.asarray(patch.normals @ turn, np.float32),
        patch.uv,
        np.clip(lit_colours(material, patch, frame.yaw, tall, 0.0), 0.0, 1.0),
        patch.triangles,
    )


def _finish(scene_name: str) -> tuple[Colour, Colour]:
    """The colours of a kitchen's stove and of its counters."""
    colours = palette(scene_name)
    steel = mixed(_STEEL, colours.metal, 0.15)
    chance = blake2b(f"{scene_name} stove".encode(), digest_size=8).digest()[0]
    return (steel, _WHITE, steel, _BLACK)[chance % 4], colours.counter


def _stove(place: StoveLayout, colour: Colour, stone: Colour) -> Mesh:
    """A cooktop, a panel for the knobs, and an oven if there is room for one."""
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
    """A box between two coordinates along each axis."""
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


def _cooktop(mesh: Mesh, place: StoveLayout, front: float, colour: Colour) -> None:
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


def _ring(mesh: Mesh, hole: Box, top: float, colour: Colour) -> None:
    """The rest of a square around a round hole."""
    (x, _, z), (w, _, d) = (hole.low + hole.high) / 2, (hole.high - hole.low) / 2
    for quarter in range(4):
        a = np.radians(90.0 * quarter + np.linspace(0.0, 90.0, 6))
        arc = np.stack([x + w * np.cos(a), np.full(6, top), z + d * np.sin(a)], axis=1)
        corner = np.array([x + w * np.sign(np.cos(a[2])), top, z + d * np.sign(np.sin(a[2]))])
        _flat(mesh, [corner, *arc], _UP, colour)


def _fill(mesh: Mesh, place: StoveLayout, stone: Colour) -> None:
    """The counter behind a stove that stands across a corner."""
    height, front = place.top - 0.023, place.front - 0.03
    corner, *ends = place.gap
    first, last = sorted(ends, key=lambda point: float(point[0]))
    outline = [corner, first, (place.left, front), (place.right, front), last]
    mesh.prism(outline, height - _SLAB, height, stone, "stone")


def _leaning(mesh: Mesh, place: StoveLayout, colour: Colour) -> tuple[float, float]:
    """A panel that leans back. Returns the cooktop's front end and the panel's lowest height."""
    y, z = slope(place.row)
    low = y - LEAN
    start = max(y + z - place.top, float(place.fire.high[2]) + 0.008)
    back = start - 0.03
    outline = [(back, place.top - 0.001), (start, place.top - 0.001)]
    if start > y + z - place.top:
        outline.append((start, y + z - start))
    outline += [(place.front, low), (place.front, low - 0.03), (back, low - 0.03)]
    ends = place.inner or (place.left, place.right)
    mesh.prism(outline, *ends, shaded(colour, 1.05), axis="x")
    return start, low - 0.03


def _strip(mesh: Mesh, place: StoveLayout, colour: Colour) -> None:
    """A strip under knobs on the cooktop: along its front if they are there."""
    row, top = place.row, float(place.row.low[1]) - 0.003
    if top - place.top < 0.004:
        return
    x, z = ((float(row.low[k]) - 0.012, float(row.high[k]) + 0.012) for k in (0, 2))
    if row.low[2] > place.fire.high[2] + 0.01 and top - place.top > 0.012:
        x, z = (place.left, place.right), (z[0] + 0.006, place.front)
    _box(mesh, x, (place.top - 0.001, top), z, shaded(colour, 0.8), "xXYzZ")


def _guard(mesh: Mesh, place: StoveLayout, colour: Colour) -> None:
    """A panel that stands behind the cooktop, with a clock if the knobs leave room for one."""
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


def _case(
    mesh: Mesh, place: StoveLayout, x: Ends, start: float, low: float, colour: Colour
) -> None:
    """The case of a stove: a strip under the edge of the cooktop, and the oven below it."""
    face = place.front - 0.004
    under = place.top - _PLATE + 0.005
    _box(mesh, x, (low, under), (place.back, start - 0.03), shaded(colour, 0.9), "xXz")
    if place.bearing != "slope":
        _box(mesh, x, (low, under), (start - 0.04, face), shaded(colour, 1.03), "xXyZ")
    _oven(mesh, x, low, (place.back, face), colour)


def _let_in(mesh: Mesh, place: StoveLayout, counter: Box, colour: Colour) -> None:
    """An oven under a counter."""
    face, high = float(counter.high[2]) - _BASE + 0.012 + _DOOR, counter.surface - _SLAB - 0.01
    _oven(mesh, (place.left, place.right), high, (face - 0.1, face), colour)


def _oven(mesh: Mesh, x: Ends, high: float, z: Ends, colour: Colour) -> None:
    """A case on a plinth with a drawer, and a door with a window and a handle."""
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
