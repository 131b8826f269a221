"""Knives, forks, spoons and other kitchen tools."""

from __future__ import annotations

import itertools
from math import atan2, cos, degrees, hypot, pi, sin

import numpy as np

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import shaded
from er_gym.sim.render.shapes.registry import shape
from er_gym.sim.render.shapes.tableware import lengthwise

_BLADE, _STEEL, _EDGE = (0.76, 0.80, 0.86), (0.52, 0.55, 0.60), (0.94, 0.96, 0.98)
_BLACK, _WALNUT, _PLASTIC = (0.09, 0.09, 0.10), (0.36, 0.20, 0.11), (0.15, 0.15, 0.17)
_GRIPS = ((0.70, 0.16, 0.14), (0.16, 0.36, 0.52), (0.14, 0.14, 0.15))
_THICK = 0.005
"""Thickness of blades and flat handles, metres."""


def _extent(appearance: Appearance) -> tuple[float, float, float]:
    """Length, breadth and thickness of a lying object; it leans if its box is high."""
    w, h, d = appearance.size
    length, breadth = max(w, d), min(w, d)
    return (hypot(length, h) if _leans(appearance) else length), breadth, h


def _leans(appearance: Appearance) -> bool:
    return appearance.size[1] > 0.3 * max(appearance.size[::2])


def _laid(appearance: Appearance, mesh: Mesh) -> Mesh:
    """A tool made along x from its grip to its head (at +x), placed as its box lies."""
    if not _leans(appearance):
        return lengthwise(appearance, mesh)
    leaning, rise = Mesh(), degrees(atan2(appearance.size[1], max(appearance.size[::2])))
    leaning.add(mesh, turn=("z", rise), at=(0.0, appearance.size[1] / 2, 0.0))
    return lengthwise(appearance, leaning)


def _grip(mesh: Mesh, start: float, end: float, breadth: float, colour: tuple[float, ...]) -> None:
    """A rounded handle along x."""
    size = (end - start, 0.6 * breadth, breadth)
    mesh.rounded(((start + end) / 2, 0.3 * breadth, 0.0), size, colour, 0.2 * breadth)


@shape("Knife")
def knife(appearance: Appearance) -> Mesh:
    """A broad blade with a point, on a dark handle with rivets."""
    length, breadth, _ = _extent(appearance)
    mesh, half, b = Mesh(), length / 2, breadth / 2
    heel, belly = -0.10 * length, 0.22 * length
    low, high = 0.002, 0.002 + _THICK
    spine = [(heel, -0.35 * b), (belly, -0.25 * b), (half, b), (heel, b)]
    mesh.prism(spine, low, high, _BLADE)
    bevel = [(heel, -b), (0.12 * length, -0.9 * b), (belly + 0.06 * length, -0.45 * b), (half, b)]
    mesh.prism([*bevel, (belly, -0.25 * b), (heel, -0.35 * b)], low, high, _EDGE)
    handle, wide = Mesh(), 0.95 * b
    _grip(handle, -half, heel, wide, appearance.pick(_BLACK, _WALNUT))
    handle.box((heel - 0.008, 0.3 * wide, 0), (0.016, 0.66 * wide, 1.05 * wide), _STEEL)
    for x in (-0.42, -0.32, -0.22):
        handle.box((x * length, 0.3 * wide, 0), (0.008, 0.7 * wide, 0.008), _BLADE, faces="Y")
    mesh.add(handle, at=(0.0, 0.0, 0.5 * b))
    return _laid(appearance, mesh)


@shape("ButterKnife")
def butter_knife(appearance: Appearance) -> Mesh:
    """All steel and narrow; a rounded tip, no point."""
    length, breadth, _ = _extent(appearance)
    mesh, half, b = Mesh(), length / 2, 0.62 * breadth
    thick = max(_THICK, 0.5 * appearance.size[1])
    blade = [(0.0, 0.3 * b), (0.02 * length, -0.45 * b), (0.38 * length, -0.8 * b)]
    blade += [(0.46 * length, -0.7 * b), (half, -0.1 * b), (0.47 * length, 0.4 * b)]
    mesh.prism([*blade, (0.40 * length, 0.5 * b)], 0.0, thick, _BLADE)
    handle = [(-half, 0.3 * b), (-half, -0.3 * b), (-0.46 * length, -0.5 * b), (0.0, -0.25 * b)]
    mesh.prism([*handle, (0.0, 0.25 * b), (-0.46 * length, 0.5 * b)], 0.0, thick, _STEEL)
    mesh.box((0.01 * length, thick / 2, 0), (0.03 * length, 1.6 * thick, 0.6 * b), _STEEL)
    return _laid(appearance, mesh)


def _shaft(mesh: Mesh, points: list[tuple[float, float]], wide: float, narrow: float) -> None:
    """A flat steel handle along points (x, y): broad at its end, narrow at its neck."""
    for k, ((x, y), (u, v)) in enumerate(itertools.pairwise(points)):
        shares = (k / (len(points) - 1), (k + 1) / (len(points) - 1))
        a, b = (wide + (narrow - wide) * share for share in shares)
        low = [(x, y, -a / 2), (u, v, -b / 2), (u, v, b / 2), (x, y, a / 2)]
        high = np.asarray(low) + np.array([0.0, _THICK, 0.0])
        mesh.quad(low[::-1], _STEEL)
        mesh.quad(high, _STEEL)
        for i, j in ((0, 1), (2, 3), (3, 0)):
            mesh.quad([low[i], high[i], high[j], low[j]], shaded(_STEEL, 0.8), both=True)


@shape("Fork")
def fork(appearance: Appearance) -> Mesh:
    """Steel; four tines with gaps between them."""
    length, breadth, h = _extent(appearance)
    mesh, half = Mesh(), length / 2
    rise = min(h, 0.03) - _THICK
    _shaft(mesh, [(-half, 0.5 * rise), (-0.2 * length, rise), (0.14 * length, 0.25 * rise)],
           0.6 * breadth, 0.28 * breadth)  # fmt: skip
    y, root = 0.0, 0.28 * length
    palm = [(0.12 * length, 0.12 * breadth), (0.12 * length, -0.12 * breadth)]
    palm += [(0.19 * length, -0.5 * breadth), (root, -0.5 * breadth)]
    mesh.prism(
        [*palm, (root, 0.5 * breadth), (0.19 * length, 0.5 * breadth)], y, y + _THICK, _BLADE
    )
    tine = 0.15 * breadth
    for k in range(4):
        z = (k - 1.5) * (breadth - tine) / 3
        points = [(root, z - tine / 2), (root, z + tine / 2), (half, z + tine / 4)]
        mesh.prism([*points, (half, z - tine / 4)], y, y + _THICK, _BLADE)
    return _laid(appearance, mesh)


@shape("Spoon")
def spoon(appearance: Appearance) -> Mesh:
    """Steel; an oval bowl at the end of the handle."""
    length, breadth, h = _extent(appearance)
    mesh, half = Mesh(), length / 2
    deep, long = min(0.7 * h, 0.016), 0.32 * length
    middle = half - long / 2
    _shaft(mesh, [(-half, 0.3 * deep), (-0.25 * length, deep), (middle - 0.45 * long, 0.8 * deep)],
           0.5 * breadth, 0.26 * breadth)  # fmt: skip
    r, squash, at = breadth / 2, (long / breadth, 1.0), (middle, 0.0, 0.0)
    outside = [(0, 0), (0.6 * r, 0.2 * deep), (r, deep)]
    mesh.lathe(outside, _BLADE, at=at, squash=squash, segments=14)
    rim = [(r, deep), (0.84 * r, deep + 0.001)]
    mesh.lathe(rim, shaded(_STEEL, 1.3), at=at, squash=squash, segments=14)
    inside = [(0.84 * r, deep + 0.001), (0.5 * r, 0.45 * deep), (0, 0.3 * deep)]
    mesh.lathe(inside, shaded(_STEEL, 0.75), at=at, squash=squash, segments=14)
    return _laid(appearance, mesh)


@shape("Spatula")
def spatula(appearance: Appearance) -> Mesh:
    """A flat black head with slots, a steel shaft and a coloured grip."""
    length, breadth, h = _extent(appearance)
    mesh, half = Mesh(), length / 2
    root, thick = half - 0.34 * length, 0.006
    rise = min(h, 0.03) - 0.012
    bar, frame = 0.16 * breadth, 0.10 * length
    for k in range(4):
        z = (k - 1.5) * (breadth - bar) / 3
        mesh.box(((root + half) / 2, thick / 2, z), (half - root, thick, bar), _PLASTIC)
    for x in (root + frame / 2, half - 0.02 * length):
        wide = frame if x < 0.3 * length else 0.04 * length
        mesh.box((x, thick / 2, 0.0), (wide, thick, breadth), _PLASTIC)
    mesh.tube([(root, thick, 0), (-0.12 * length, thick + 0.5 * rise, 0)], 0.005, _STEEL)
    handle = Mesh()
    _grip(handle, -half, -0.1 * length, 0.024, appearance.pick(*_GRIPS))
    mesh.add(handle, at=(0.0, max(rise - 0.004, 0.0), 0.0))
    return _laid(appearance, mesh)


@shape("Ladle")
def ladle(appearance: Appearance) -> Mesh:
    """A deep round bowl; a long handle rises from it and ends in a hook."""
    length, h, breadth = max(appearance.size[::2]), appearance.size[1], min(appearance.size[::2])
    mesh, half, r = Mesh(), length / 2, min(0.5 * breadth, 0.18 * length)
    deep, middle, thick = min(0.9 * r, 0.6 * h), half - r, 0.006
    t = np.linspace(0, pi / 2, 5)
    outside = [(r * sin(a), deep * (1 - cos(a))) for a in t]
    mesh.lathe([*outside, (0.88 * r, deep)], _STEEL, at=(middle, 0, 0), segments=12)
    inside = [(0.88 * r * sin(a), deep - 0.85 * deep * cos(a)) for a in t[::-1]]
    mesh.lathe(inside, shaded(_STEEL, 0.6), at=(middle, 0, 0), segments=12)
    top = h - thick
    path = [(middle - 0.95 * r, deep, 0), (middle - 1.3 * r, 0.55 * deep + 0.45 * top, 0)]
    path += [(-half + 0.10 * length, top, 0), (-half + 0.03 * length, top, 0)]
    path += [(-half + thick, top - 0.04 * length, 0)]
    mesh.tube(path, thick, _STEEL, segments=6)
    mesh.tube(path[1:3], 1.5 * thick, _BLACK, segments=6)
    return lengthwise(appearance, mesh)
