"""Sinks, faucets, toilets, bathtubs and showers."""

from __future__ import annotations

from collections.abc import Iterable
from math import cos, pi, radians, sin

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.render.shapes.hangings import across, cracks, frame, turned
from er_gym.sim.render.shapes.registry import shape

_CERAMIC, _STEEL, _CHROME = (0.96, 0.96, 0.95), (0.78, 0.80, 0.83), (0.88, 0.90, 0.94)
_SEAT, _DARK, _DRAIN = (0.99, 0.99, 0.98), (0.13, 0.13, 0.14), (0.24, 0.24, 0.26)
_WATER, _STREAM = (0.45, 0.68, 0.84), (0.62, 0.84, 1.0)
_ROUND, _SQUARE = 2.0, 5.0
"""Exponents of outlines: an ellipse, and a rectangle with round corners."""
_CORNERS = {"FloorPlan403": (1, -1), "FloorPlan418": (-1, -1), "FloorPlan423": (-1, 1)}
"""Sides (of x and z) at which glass goes round a corner, if they are not the positive ones."""
Area = tuple[float, float, float, float]
"""x and z of the middle, width and depth, metres."""
Ring = tuple[float, float, float]
"""Width and depth of an outline, and its height, metres."""


def outline(
    ring: Ring, power: float, at: tuple[float, float] = (0.0, 0.0), segments: int = 20
) -> NDArray[np.float64]:
    """(K, 3) a level ring around an x and a z, between an ellipse and a rectangle."""
    w, d, y = ring
    angle = (np.arange(segments) + 0.5) / segments * 2 * pi
    c, s = np.cos(angle), np.sin(angle)
    x = np.sign(c) * np.abs(c) ** (2 / power) * w / 2
    z = np.sign(s) * np.abs(s) ** (2 / power) * d / 2
    return np.stack([at[0] + x, np.full(segments, y), at[1] + z], axis=1)


def vessel(
    mesh: Mesh,
    rings: Iterable[Ring],
    colour: Colour,
    power: float,
    z: float = 0.0,
    segments: int = 20,
) -> None:
    """A vessel made of rings that go up at the outside and down at the inside."""
    mesh.skin([outline(ring, power, (0.0, z), segments) for ring in rings], colour)


def _ceramic(appearance: Appearance) -> bool:
    return appearance.room == "bathrooms"


def _place(appearance: Appearance, most: tuple[float, float]) -> tuple[Area, float] | None:
    """The area of the basin, at most this wide and deep, and its top; None if unknown."""
    for kind, (low, high) in appearance.built_in:
        if kind == f"{appearance.kind}Basin":
            w, d = min(high[0] - low[0], most[0]), min(high[2] - low[2], most[1])
            return ((low[0] + high[0]) / 2, (low[2] + high[2]) / 2, w, d), high[1]
    return None


@shape("Sink")
def sink(appearance: Appearance) -> Mesh:
    """A rim round a hollow, let into a counter or on a pedestal; the bowl is its basin."""
    w, h, d = appearance.size
    if h > 0.45:
        return _pedestal(appearance)
    mesh, whole = Mesh(), (0.0, 0.0, w, d)
    place = _place(appearance, (w - 0.03, d - 0.03))
    if place is None:
        _let_in(mesh, appearance, whole, (0.0, 0.0, 0.88 * w, 0.80 * d), None)
        return mesh
    (x, z, wide, deep), top = place
    if max(abs(x) / w, abs(z) / d) < 0.12 or max(wide / w, deep / d) > 0.9:
        _let_in(mesh, appearance, whole, place[0], top)
        return mesh
    for side in (1, -1):  # two bowls, one of which is an object
        known = top if side > 0 else None
        if abs(x) / w > abs(z) / d:
            half = (side * np.sign(x) * w / 4, 0.0, w / 2, d)
            _let_in(mesh, appearance, half, (side * x, z, min(wide, w / 2 - 0.03), deep), known)
        else:
            half = (0.0, side * np.sign(z) * d / 4, w, d / 2)
            _let_in(mesh, appearance, half, (x, side * z, wide, min(deep, d / 2 - 0.03)), known)
    return mesh


def _let_in(mesh: Mesh, appearance: Appearance, area: Area, hole: Area, top: float | None) -> None:
    """A rim with a hole over a basin with this top, or with a hollow of its own if it is None."""
    h, whole = appearance.size[1], area[2:] == (appearance.size[0], appearance.size[2])
    colour = _CERAMIC if _ceramic(appearance) else _STEEL
    rim = min(0.02, 0.15 * h)
    power = 2.6 if _ceramic(appearance) else _SQUARE
    outer = 3.5 if _ceramic(appearance) else _SQUARE if whole else 40.0

    def ring(of: Area, y: float, shape_of: float = power, more: float = 0.0) -> NDArray[np.float64]:
        return outline((of[2] + more, of[3] + more, y), shape_of, of[:2])

    mesh.skin(
        [ring(hole, 0, more=0.01), ring(hole, h - rim, more=0.01), ring(area, h - rim, outer),
         ring(area, h, outer), ring(hole, h)],
        colour,
    )  # fmt: skip
    if top is not None:
        mesh.skin([ring(hole, h), ring(hole, min(top, h) - 0.01)], shaded(colour, 0.85))
        return
    hollow = [ring(hole, h), ring(hole, 0.006, more=-0.02), ring((*hole[:2], 0, 0), 0.002)]
    mesh.skin(hollow, shaded(colour, 0.85))


def _pedestal(appearance: Appearance) -> Mesh:
    """A wide bowl on a foot."""
    w, h, d = appearance.size
    mesh, low = Mesh(), max(0.0, appearance.size[1] - 0.28)
    colour = _CERAMIC if _ceramic(appearance) else _STEEL
    power = 3.5 if _ceramic(appearance) else _SQUARE
    foot = [(0.20 * w, 0), (0.14 * w, 0.12 * h), (0.12 * w, 0.6 * low), (0.22 * w, low)]
    mesh.lathe(foot, colour, squash=(1.0, min(1.0, d / w)))
    rings = [(0.4 * w, 0.4 * d, low - 0.02), (0.85 * w, 0.85 * d, h - 0.16),
             (w, d, h - 0.035), (w, d, h), (0.9 * w, 0.88 * d, h)]  # fmt: skip
    vessel(mesh, rings, colour, power)
    place = _place(appearance, (0.88 * w, 0.84 * d))
    (x, z, wide, deep), top = place or ((0.0, 0.0, 0.5 * w, 0.47 * d), h - 0.055)
    y = min(top, h) - 0.005
    slope = [outline(rings[-1], power), outline((0.97 * wide, 0.97 * deep, y), 2.6, (x, z))]
    mesh.skin(slope, shaded(colour, 0.9))
    if place is None:
        hollow = [(0.97 * wide, 0.97 * deep, y), (0.9 * wide, 0.9 * deep, low), (0, 0, low)]
        vessel(mesh, hollow, shaded(colour, 0.8), 2.6)
    return mesh


def _basin(appearance: Appearance, colour: Colour, power: float) -> Mesh:
    """A bowl with a thin lip, a drain, and water when filled."""
    w, h, d = appearance.size
    mesh = Mesh()
    wall = min(0.02, 0.06 * min(w, d))
    floor = min(0.02, 0.15 * h)
    outer = [(0.84 * w, 0.84 * d, 0.0), (w, d, h), (w - 2 * wall, d - 2 * wall, h)]
    vessel(mesh, outer, colour, power)
    sides = [outer[-1], (0.82 * w, 0.82 * d, floor)]
    vessel(mesh, sides, shaded(colour, 0.84), power)
    bottom = [sides[-1], (0.0, 0.0, floor - 0.004)]
    vessel(mesh, bottom, shaded(colour, 0.74), power)
    mesh.cylinder((0, floor + 0.003, 0), 0.1 * min(w, d) + 0.005, 0.01, _DRAIN, segments=12)
    if appearance.filled:
        level = 0.62 * h
        share = 0.84 + 0.1 * 0.62
        vessel(mesh, [(share * w, share * d, level), (0.0, 0.0, level)], _WATER, power)
    return mesh


@shape("SinkBasin")
def sink_basin(appearance: Appearance) -> Mesh:
    """The bowl of a sink, with a dark drain."""
    ceramic = _ceramic(appearance)
    return _basin(appearance, _CERAMIC if ceramic else _STEEL, 2.6 if ceramic else _SQUARE)


@shape("BathtubBasin")
def bathtub_basin(appearance: Appearance) -> Mesh:
    """The long hollow of a bathtub, with a drain."""
    return _basin(appearance, shaded(_CERAMIC, 0.97), 3.5)


@shape("Bathtub")
def bathtub(appearance: Appearance) -> Mesh:
    """A long white tub with a wide round rim that slopes down into its basin."""
    w, h, d = appearance.size
    mesh, rim = Mesh(), 0.08 * min(w, d)
    outer = [(0.97 * w, 0.97 * d, 0), (0.97 * w, 0.97 * d, h - 0.06), (w, d, h - 0.05),
             (w, d, h - 0.01), (0.985 * w, 0.985 * d, h),
             (w - 2 * rim, d - 2 * rim, h)]  # fmt: skip
    vessel(mesh, outer, _CERAMIC, 6.0)
    place = _place(appearance, (w - 2.2 * rim, d - 2.2 * rim))
    share = (0.80, 0.56) if w > d else (0.56, 0.80)
    (x, z, wide, deep), top = place or ((0.0, 0.0, share[0] * w, share[1] * d), 0.74 * h)
    ledge = (0.99 * wide, 0.99 * deep, min(top, h) - 0.006)
    slope = [outline(outer[-1], 6.0), outline(ledge, 3.5, (x, z))]
    mesh.skin(slope, shaded(_CERAMIC, 0.92))
    if place is None:
        hollow = [ledge, (0.92 * wide, 0.92 * deep, 0.012), (0, 0, 0.008)]
        vessel(mesh, hollow, shaded(_CERAMIC, 0.82), 3.5)
    return mesh


def _stream(mesh: Mesh, at: tuple[float, float, float], length: float, radius: float) -> None:
    """Falling water, light blue."""
    x, y, z = at
    line = [(radius, y - length), (0.7 * radius, y - 0.6 * length), (radius, y), (0.0, y)]
    mesh.lathe(line, _STREAM, "glowing", at=(x, 0.0, z), segments=7)


@shape("Faucet")
def faucet(appearance: Appearance) -> Mesh:
    """A chrome spout that bends forward and down, with a handle or two."""
    w, h, d = appearance.size
    mesh, metal = Mesh(), mixed(_CHROME, appearance.palette.metal, 0.25)
    tube = min(0.02, 0.09 * h + 0.003, 0.3 * w)
    back, tip = -d / 2 + 1.4 * tube, d / 2 - tube
    top = h - tube - (0.14 * h if w < 0.14 else 0.0)
    mesh.cylinder((0, 0.06 * h, back), 1.4 * tube, 0.12 * h, metal)
    arch = [(0, 0.05 * h, back), (0, top - 0.16 * h, back), (0, top, back + 0.25 * d),
            (0, top, tip - 0.16 * d), (0, top - 0.1 * h, tip), (0, top - 0.3 * h, tip)]  # fmt: skip
    mesh.tube(arch, tube, metal, segments=7)
    for point in arch[1:5]:
        mesh.ball(point, (2 * tube,) * 3, metal, segments=7, rings=4)
    mesh.cylinder((0, top - 0.31 * h, tip), 1.2 * tube, 0.06 * h, shaded(metal, 0.7))
    if w < 0.14:
        lift = 24 if appearance.on else 0
        lever = Mesh()
        lever.box((0, 0, 0.2 * d), (1.2 * tube, 0.05 * h, 0.4 * d), shaded(metal, 0.85))
        mesh.add(lever, turn=("x", -lift), at=(0, h - 0.03 * h, back))
        low, high = top - 0.2 * h, h - 0.03 * h
        mesh.cylinder((0, (low + high) / 2, back), 1.3 * tube, high - low, metal)
    else:
        for side in (-1, 1):
            _tap(mesh, (side * (w / 2 - 0.032), 0.0, back), h, appearance.on, metal, side)
    if appearance.on:
        _stream(mesh, (0, top - 0.3 * h, tip), 0.18, 0.55 * tube + 0.004)
    return mesh


def _tap(
    mesh: Mesh, at: tuple[float, float, float], h: float, on: bool, metal: Colour, side: int
) -> None:
    """A handle in the shape of a cross, turned when on, red for hot and blue for cold."""
    x, y, z = at
    tall = min(0.45 * h, 0.09)
    mesh.cylinder((x, y + tall / 2, z), 0.02, tall, metal, top=0.013, segments=9)
    cross = Mesh()
    cross.box((0, 0, 0), (0.062, 0.014, 0.014), metal)
    cross.box((0, 0, 0), (0.014, 0.014, 0.062), metal)
    mesh.add(cross, at=(x, y + tall, z), turn=("y", 45 if on else 0))
    cap = (0.85, 0.2, 0.2) if side > 0 else (0.2, 0.35, 0.85)
    mesh.cylinder((x, y + tall + 0.009, z), 0.009, 0.006, cap, segments=7)


@shape("Toilet")
def toilet(appearance: Appearance) -> Mesh:
    """A cistern at the back, an oval bowl on a foot, a seat under a hinged lid."""
    w, h, d = appearance.size
    mesh = Mesh()
    tank, rim = 0.24 * d, 0.36 * h + 0.05
    wide = min(0.86 * w, 0.5 * d)
    deep, z = d - tank - 0.01, tank / 2
    broad = min(w, 1.15 * wide)
    base = rim - 0.04
    mesh.rounded((0, (base + h - 0.04) / 2, -d / 2 + tank / 2),
                 (0.94 * broad, h - 0.04 - base, tank), _CERAMIC, 0.03)  # fmt: skip
    mesh.rounded(
        (0, h - 0.025, -d / 2 + tank / 2 + 0.005), (broad, 0.05, tank + 0.01), _SEAT, 0.015
    )
    mesh.box((-0.3 * broad, h - 0.13, -d / 2 + tank + 0.012), (0.1, 0.025, 0.025), _CHROME)
    mesh.box((0, base / 2, -d / 2 + 0.5 * tank + 0.12 * deep),
             (0.5 * wide, base, tank + 0.24 * deep),
             shaded(_CERAMIC, 0.97), faces="xXZ")  # fmt: skip
    bowl = [(0.62 * wide, 0.72 * deep, 0), (0.5 * wide, 0.62 * deep, 0.3 * rim),
            (0.62 * wide, 0.74 * deep, 0.5 * rim), (0.96 * wide, 0.98 * deep, 0.88 * rim),
            (0.98 * wide, 0.99 * deep, rim), (0.66 * wide, 0.70 * deep, rim)]  # fmt: skip
    vessel(mesh, bowl, _CERAMIC, _ROUND, z)
    vessel(mesh, [bowl[-1], (0.5 * wide, 0.5 * deep, 0.66 * rim)], shaded(_CERAMIC, 0.8), 2.0, z)
    pool = [(0.56 * wide, 0.58 * deep, 0.74 * rim), (0.0, 0.0, 0.74 * rim)]
    vessel(mesh, pool, _WATER, _ROUND, z)
    seat = [(wide, deep, rim + 0.006), (wide, deep, rim + 0.03),
            (0.62 * wide, 0.64 * deep, rim + 0.03),
            (0.62 * wide, 0.64 * deep, rim + 0.006)]  # fmt: skip
    vessel(mesh, seat, _SEAT, _ROUND, z)
    lid, thick = Mesh(), 0.025
    shell = [(0.0, 0.0, 0), (wide, deep, 0), (wide, deep, thick), (0.9 * wide, 0.9 * deep, 0.04),
             (0.0, 0.0, 0.04)]  # fmt: skip
    vessel(lid, shell, shaded(_SEAT, 0.97), _ROUND, z)
    hinge = (0.0, 0.0, -d / 2 + tank + 0.03)
    mesh.add(lid, at=(0, rim + 0.04, 0), turn=("x", -97 * appearance.openness), about=hinge)
    for side in (-1, 1):
        mesh.box((side * 0.2 * wide, rim + 0.035, hinge[2]), (0.05, 0.03, 0.03), _CHROME)
    return mesh


def _glazed(appearance: Appearance, w: float, h: float, d: float) -> Mesh:
    """Glass in a metal frame."""
    mesh, metal = Mesh(), mixed(_STEEL, appearance.palette.metal, 0.4)
    bar = min(0.045, 0.1 * min(w, h))
    frame(mesh, (w, h, d), bar, metal)
    inside = (w - 2 * bar, h - 2 * bar)
    mesh.quad([(-w / 2, 0, 0), (w / 2, 0, 0), (w / 2, h, 0), (-w / 2, h, 0)],
              _STREAM, "glass", both=True)  # fmt: skip
    for x in (-0.18, 0.12):  # gleams
        mesh.quad([((x - 0.02) * w, 0.35 * h, 0), ((x + 0.03) * w, 0.35 * h, 0),
                   ((x + 0.16) * w, 0.75 * h, 0), ((x + 0.11) * w, 0.75 * h, 0)],
                  _STREAM, "glass", both=True)  # fmt: skip
    if appearance.broken:
        cracks(mesh, inside, h / 2, 0.0, 0.004)
    return mesh


@shape("ShowerDoor")
def shower_door(appearance: Appearance) -> Mesh:
    """A tall glass door in a metal frame, with a long handle and hinges at one side."""
    w, h, d, along_z = across(appearance)
    thick = min(d, 0.06)
    leaf, mesh = _glazed(appearance, w, h, thick), Mesh()
    for side in (-1, 1):
        z = side * (thick / 2 + 0.025)
        leaf.tube([(0.36 * w, 0.42 * h, z), (0.36 * w, 0.62 * h, z)], 0.014, _DARK, segments=6)
        for y in (0.44, 0.60):
            leaf.box((0.36 * w, y * h, z / 2), (0.0, 0.0, abs(z)), _DARK)
    mesh.add(leaf, turn=("y", -85 * appearance.openness), about=(-w / 2, 0, 0))
    return turned(mesh, along_z)


@shape("ShowerGlass")
def shower_glass(appearance: Appearance) -> Mesh:
    """A fixed pane in a metal frame; round a corner where its box is deep."""
    w, h, d = appearance.size
    if min(w, d) < 0.3:
        w, h, d, along_z = across(appearance)
        return turned(_glazed(appearance, w, h, min(d, 0.06)), along_z)
    mesh, thick = Mesh(), 0.05
    x, z = _CORNERS.get(appearance.scene, (1, 1))
    mesh.add(_glazed(appearance, w, h, thick), at=(0, 0, z * (d - thick) / 2))
    mesh.add(
        _glazed(appearance, d - thick, h, thick), turn=("y", 90), at=(x * (w - thick) / 2, 0, 0)
    )
    return mesh


@shape("ShowerHead")
def shower_head(appearance: Appearance) -> Mesh:
    """A broad shower head on a tall rail, with a hose and a mixer."""
    w, h, d = appearance.size
    mesh, metal = Mesh(), mixed(_CHROME, appearance.palette.metal, 0.25)
    rail = -d / 2 + 0.05
    mesh.tube([(0, 0.04 * h, rail), (0, 0.97 * h, rail)], 0.019, metal, segments=8)
    for y in (0.05, 0.95):
        mesh.box((0, y * h, -d / 2 + 0.025), (0.05, 0.05, 0.05), shaded(metal, 0.8))
    mesh.tube([(0, 0.96 * h, rail), (0, 0.985 * h, 0.1 * d), (0, 0.95 * h, 0.25 * d)],
              0.014, metal, segments=7)  # fmt: skip
    rose, r = Mesh(), min(0.5 * w, 0.34 * d)
    rose.lathe([(0, 0), (r, 0), (r, 0.018), (0.35 * r, 0.05), (0, 0.055)], metal)
    rose.cylinder((0, -0.003, 0), 0.82 * r, 0.006, _DARK)
    tilt = radians(25)
    at = np.array([0.0, 0.91 * h, 0.5 * d - r])
    mesh.add(rose, turn=("x", -25), at=at)
    hose = [
        (0.25 * w * sin(pi * t), 0.9 * h - t * 0.55 * h, rail + 0.02) for t in np.linspace(0, 1, 7)
    ]
    mesh.tube(hose, 0.011, shaded(metal, 0.75), segments=5)
    mesh.tube([(-0.4 * w, 0.35 * h, rail), (0.4 * w, 0.35 * h, rail)], 0.024, metal, segments=8)
    mesh.box((0, 0.35 * h, rail + 0.03), (0.03, 0.05, 0.06), shaded(metal, 0.8))
    if appearance.on:
        for k in range(9):
            a, share = 2 * pi * k / 8, 0.0 if k == 8 else 0.7 * r
            x, z = share * cos(a), share * sin(a)
            start = at + np.array([x, 0.0, z * cos(tilt)])
            end = start + np.array([0.5 * x, -0.8, 0.24 + 0.3 * z])
            mesh.tube([start, end], 0.005, _STREAM, "glowing", segments=4)
    return mesh
