"""Kitchen appliances and the burners and knobs of stoves."""

from __future__ import annotations

from math import atan2, cos, degrees, hypot, pi, sin

import numpy as np

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import shaded
from er_gym.sim.render.patch import Colour, Triple
from er_gym.sim.render.shapes.registry import shape
from er_gym.sim.render.shapes.tableware import lengthwise

_FRIDGES = ((0.88, 0.90, 0.92), (0.94, 0.94, 0.92), (0.78, 0.81, 0.84))
_STEEL, _DARK, _BLACK = (0.68, 0.70, 0.73), (0.15, 0.15, 0.17), (0.06, 0.06, 0.07)
_LINING, _SHELF, _SEAL = (0.95, 0.96, 0.97), (0.66, 0.80, 0.88), (0.35, 0.36, 0.38)
_CASES = ((0.74, 0.75, 0.77), (0.90, 0.90, 0.88), (0.26, 0.27, 0.29))
_PANE, _LIT, _KEY = (0.09, 0.10, 0.12), (1.0, 0.82, 0.42), (0.72, 0.73, 0.76)
_DIGITS_OFF, _DIGITS_ON, _LAMP = (0.10, 0.34, 0.24), (0.35, 1.0, 0.55), (1.0, 0.16, 0.10)
_TOASTERS = ((0.76, 0.78, 0.80), (0.76, 0.78, 0.80), (0.90, 0.86, 0.74), (0.68, 0.16, 0.14))
_HOT, _EMBER, _IRON = (1.0, 0.36, 0.06), (1.0, 0.22, 0.08), (0.13, 0.13, 0.14)
_FLAME, _FLAME_TIP, _COIL = (0.15, 0.35, 1.0), (0.55, 0.8, 1.0), (0.30, 0.30, 0.32)
_COFFEE, _JUG, _WATER = (0.20, 0.10, 0.05), (0.62, 0.72, 0.76), (0.30, 0.58, 0.88)
_OPEN = 100.0
"""Angle of an open door, degrees."""


def _hollow(
    mesh: Mesh, low: Triple, high: Triple, colour: Colour, inside: Colour, wall: float
) -> None:
    """A case between two corners that is open to the front."""
    a, b = np.array(low), np.array(high)
    mesh.box(tuple((a + b) / 2), tuple(b - a), colour, faces="xXyYz")
    c, d = a + wall, b - (wall, wall, 0.0)
    (w, h, deep), (x, y, z) = d - c, (c + d) / 2
    mesh.panel((x, c[1], z), (w, deep), inside, facing="Y")
    mesh.panel((x, d[1], z), (w, deep), shaded(inside, 0.9), facing="y")
    mesh.panel((x, y, c[2]), (w, h), shaded(inside, 0.95), facing="Z")
    mesh.panel((c[0], y, z), (deep, h), shaded(inside, 0.88), facing="X")
    mesh.panel((d[0], y, z), (deep, h), shaded(inside, 0.88), facing="x")
    for at, wide, tall in (
        ((a[0] + b[0]) / 2, b[0] - a[0], 0.0),
        (a[0] + wall / 2, wall, h),
        (b[0] - wall / 2, wall, h),
    ):
        if tall:
            mesh.panel((at, y, b[2]), (wide, tall), colour)
        else:
            mesh.panel((at, a[1] + wall / 2, b[2]), (wide, wall), colour)
            mesh.panel((at, b[1] - wall / 2, b[2]), (wide, wall), colour)


# -- fridge --------------------------------------------------------------------------------------


@shape("Fridge")
def fridge(appearance: Appearance) -> Mesh:
    """Tall and pale: a small door above a big one, with handles; white with shelves inside."""
    w, h, d = appearance.size
    mesh, colour = Mesh(), appearance.pick(*_FRIDGES)
    door, bar = 0.07, 0.05
    front, seam = d / 2 - bar - door, _seam(appearance)
    spans = ((0.02, seam), (seam, h))
    if appearance.openness > 0:
        for low, high in spans:
            inner = max(low - 0.012, 0.0) if low < 0.1 else low
            _hollow(mesh, (-w / 2, inner, -d / 2), (w / 2, high, front), shaded(colour, 0.85),
                    _LINING, 0.03)  # fmt: skip
        _shelves(mesh, appearance, front, seam)
    else:
        mid, size = (0.0, h / 2, (front - d / 2) / 2), (w, h, front + d / 2)
        mesh.box(mid, size, shaded(colour, 0.85), "metal", faces="xXYz", turns=0.6)
    hinge = (w / 2, 0.0, front)
    for k, (low, high) in enumerate(spans):
        leaf = _fridge_door(w, (low + 0.06 * (1 - k), high - 0.008), (front, door, bar), colour, k)
        mesh.add(leaf, turn=("y", _OPEN * appearance.openness), about=hinge)
    mesh.box((0.0, 0.03, front - 0.02), (0.96 * w, 0.06, 0.05), _BLACK, faces="xXZ")
    return mesh


def _seam(appearance: Appearance) -> float:
    """Height at which the freezer begins, away from recorded objects."""
    h, standing = appearance.size[1], appearance.surface
    seam = 0.67 * h
    if standing is None or standing < seam - 0.3:
        return seam
    return standing - 0.035 if standing > 0.6 * h else min(standing + 0.32, 0.8 * h)


def _shelves(mesh: Mesh, appearance: Appearance, front: float, seam: float) -> None:
    """Boards below the freezer, one of them where the record shows objects."""
    w, _, d = appearance.size
    levels, standing = [seam * share for share in (0.28, 0.52, 0.76)], appearance.surface or 0.0
    if 0.1 < standing < seam - 0.05:
        levels = [y for y in levels if abs(y - standing) > 0.15 * seam] + [standing - 0.01]
    for y in levels:
        at = (0.0, y, (front - d / 2) / 2)
        mesh.box(at, (w - 0.06, 0.015, front + d / 2 - 0.08), _SHELF, faces="yYZ")


def _fridge_door(
    w: float, span: tuple[float, float], depths: tuple[float, float, float], colour: Colour, k: int
) -> Mesh:
    """A door with a handle at the left; its lining has racks."""
    (low, high), (front, door, bar) = span, depths
    leaf, tall = Mesh(), span[1] - span[0]
    middle = (low + high) / 2
    leaf.rounded((0.0, middle, front + door / 2 + 0.004), (0.99 * w, tall, door), colour, 0.015,
                 "metal", turns=0.6)  # fmt: skip
    leaf.panel((0.0, middle, front + 0.001), (0.9 * w, 0.94 * tall), _LINING, facing="z")
    for share in (0.2, 0.5):
        at = (0.0, low + share * tall, front - 0.03)
        leaf.box(at, (0.8 * w, 0.08, 0.07), shaded(_LINING, 0.92), faces="xXyYz")
    length = 0.46 * tall
    x, z = -0.42 * w, front + door + bar / 2
    y = low + 0.06 + length / 2 if k else high - 0.06 - length / 2
    leaf.rounded((x, y, z + bar / 4), (0.035, length, bar / 2), _SEAL, 0.01)
    for end in (-1, 1):
        leaf.box((x, y + end * 0.42 * length, z - bar / 4), (0.03, 0.04, bar / 2), _SEAL)
    return leaf


# -- on the counter ------------------------------------------------------------------------------


@shape("Microwave")
def microwave(appearance: Appearance) -> Mesh:
    """A wide case: a door with a dark window at the left, keys and a green clock at the right."""
    w, h, d = appearance.size
    mesh, colour = Mesh(), appearance.pick(*_CASES)
    dark = sum(colour) < 1.2
    front, door = d / 2 - 0.05, 0.03
    split = -0.22 * w  # gap between the door and the keys
    if appearance.openness > 0:
        inside = _LIT if appearance.on else (0.86, 0.84, 0.78)
        _hollow(mesh, (split, 0.0, -d / 2), (w / 2, h, front), colour, inside, 0.03)
        at = ((split - w / 2) / 2, h / 2, (front - d / 2) / 2)
        mesh.box(at, (split + w / 2, h, front + d / 2), colour, faces="xyYz")
    else:
        mesh.box((0, h / 2, (front - d / 2) / 2), (w, h, front + d / 2), colour)
    leaf = Mesh()
    _window(leaf, appearance, (split, w / 2), front, door, shaded(colour, 1.3 if dark else 0.9))
    mesh.add(leaf, turn=("y", _OPEN * appearance.openness), about=(w / 2, 0.0, front))
    _keys(mesh, appearance, (-w / 2, split), front + door, _DARK if not dark else _BLACK)
    mesh.box(((split - w / 2) / 2, h / 2, front + door / 2), (split + w / 2, h, door), colour,
             faces="xyY")  # fmt: skip
    return mesh


def _window(
    leaf: Mesh,
    appearance: Appearance,
    span: tuple[float, float],
    front: float,
    door: float,
    colour: Colour,
) -> None:
    """The door of the microwave with its handle; lit from behind while it is on."""
    h, (low, high) = appearance.size[1], span
    x, wide = (low + high) / 2, high - low
    leaf.box((x, h / 2, front + door / 2), (wide - 0.004, 0.98 * h, door), colour)
    pane = (0.74 * wide, 0.64 * h)
    at, z = x + 0.06 * wide, front + door + 0.004
    leaf.panel((at, h / 2, z), (pane[0] + 0.03, pane[1] + 0.03), _BLACK)
    if appearance.on:
        leaf.panel((at, h / 2, z + 0.004), pane, _LIT, "glowing")
        leaf.panel((at, 0.28 * h, z + 0.008), (0.5 * pane[0], 0.03), (0.55, 0.35, 0.12), "glowing")
    else:
        leaf.panel((at, h / 2, z + 0.004), pane, _PANE)
        shine = [(-0.30, -0.5), (-0.12, -0.5), (0.10, 0.5), (-0.08, 0.5)]
        corners = [(at - u * pane[0], h / 2 + v * pane[1], z + 0.008) for u, v in shine]
        leaf.quad(corners, (0.24, 0.26, 0.29))
    leaf.rounded((low + 0.03, h / 2, front + door + 0.012), (0.022, 0.8 * h, 0.016), _STEEL, 0.006)


def _keys(
    mesh: Mesh, appearance: Appearance, span: tuple[float, float], z: float, colour: Colour
) -> None:
    """A panel of keys under a clock."""
    h, (low, high) = appearance.size[1], span
    x, wide = (low + high) / 2, high - low
    mesh.panel((x, h / 2, z), (wide, h), colour)
    clock = _DIGITS_ON if appearance.on else _DIGITS_OFF
    mesh.panel((x, 0.82 * h, z + 0.004), (0.76 * wide, 0.18 * h), clock, "glowing")
    for row in range(4):
        for column in (-1, 0, 1):
            at = (x + 0.26 * wide * column, (0.60 - 0.14 * row) * h, z + 0.004)
            mesh.panel(at, (0.18 * wide, 0.08 * h), _KEY)


@shape("Toaster")
def toaster(appearance: Appearance) -> Mesh:
    """A long rounded case with two slots on top and a lever; the slots glow while it is on."""
    length, h, breadth = max(appearance.size[::2]), appearance.size[1], min(appearance.size[::2])
    mesh, colour = Mesh(), appearance.pick(*_TOASTERS)
    body, foot = length - 0.035, 0.10 * h
    x = -0.035 / 2
    mesh.box((x, foot / 2, 0.0), (0.94 * body, foot, 0.92 * breadth), _DARK)
    mesh.rounded((x, (h + foot) / 2, 0.0), (body, h - foot, breadth), colour, 0.16 * h,
                 "metal", turns=0.3)  # fmt: skip
    for side in (-1, 1):
        at = (x, h + 0.003, side * 0.19 * breadth)
        mesh.panel(at, (0.76 * body, 0.19 * breadth), _BLACK, facing="Y")
        if appearance.on:
            for line in (-1, 1):
                wire = (x, h + 0.007, at[2] + line * 0.05 * breadth)
                mesh.panel(wire, (0.70 * body, 0.07 * breadth), _HOT, "glowing", facing="Y")
    end = x + body / 2
    mesh.panel((end + 0.004, 0.55 * h, 0.0), (0.10 * breadth, 0.55 * h), _BLACK, facing="X")
    y = 0.34 * h if appearance.on else 0.74 * h
    mesh.rounded((end + 0.018, y, 0.0), (0.034, 0.10 * h, 0.36 * breadth), _BLACK, 0.008)
    lamp = (_LAMP, "glowing") if appearance.on else (_SEAL, "plain")
    mesh.panel((end + 0.004, 0.25 * h, 0.28 * breadth), (0.03, 0.03), *lamp, facing="X")
    return lengthwise(appearance, mesh)


@shape("CoffeeMachine")
def coffee_machine(appearance: Appearance) -> Mesh:
    """A dark frame with a jug and room for a mug; a red lamp and coffee while it is on."""
    w, h, d = appearance.size
    mesh, colour = Mesh(), appearance.pick(_DARK, (0.20, 0.19, 0.20), (0.24, 0.14, 0.13))
    base = max(0.02, (appearance.surface or 0.02) - 0.004)
    deep, top = 0.34 * d, 0.30 * h
    mesh.rounded((0, base / 2, 0), (w, base, d), shaded(colour, 0.7), 0.01)
    back = (0.0, (base + h) / 2, (deep - d) / 2)
    mesh.box(back, (0.94 * w, h - base, deep), colour, faces="xXYzZ")
    mesh.rounded((0, h - top / 2, -0.06 * d), (0.98 * w, top, 0.84 * d), shaded(colour, 1.2), 0.02)
    front = 0.36 * d
    band = (0.0, h - 0.5 * top, front + 0.004)
    mesh.panel(band, (0.9 * w, 0.42 * top), _STEEL)
    lamp = (_LAMP, "glowing") if appearance.on else ((0.22, 0.08, 0.08), "plain")
    mesh.panel((-0.34 * w, h - 0.5 * top, front + 0.010), (0.09 * w, 0.24 * top), *lamp)
    for x in (-0.12, 0.06):
        mesh.panel((x * w, h - 0.5 * top, front + 0.010), (0.07 * w, 0.16 * top), _DARK)
    mesh.cylinder((-0.1 * w, h - top - 0.02, 0.06 * d), 0.02, 0.04, _STEEL, top=0.03, segments=8)
    tray = (-0.12 * w, base + 0.003, 0.14 * d)
    mesh.panel(tray, (0.5 * w, 0.56 * d), _SEAL, facing="Y")
    r, tall = min(0.085, 0.23 * w), min(0.20, h - top - base - 0.02)
    jug = Mesh()
    _jug(jug, appearance, r, tall)
    mesh.add(jug, at=(0.47 * w - r, base, 0.13 * d))
    return mesh


def _jug(mesh: Mesh, appearance: Appearance, r: float, h: float) -> None:
    """A glass jug with a dark lid and handle, shattered if the machine is broken."""
    if appearance.broken:
        for k in range(5):
            a = 2.5 * k
            at = np.array([0.5 * r * cos(a), 0.006, 0.5 * r * sin(a)])
            ends = [
                at + 0.6 * r * np.array([cos(a + t), 0.2 * (t > 2), sin(a + t)])
                for t in (0, 2.2, 4)
            ]
            mesh.quad([at, *ends], _JUG, both=True)
        return
    full = _COFFEE if appearance.on else shaded(_JUG, 0.9)
    mesh.lathe([(0, 0), (0.9 * r, 0), (r, 0.12 * h), (r, 0.5 * h)], full, segments=12)
    mesh.lathe([(r, 0.5 * h), (0.72 * r, 0.82 * h)], _JUG, segments=12)
    mesh.lathe([(0.76 * r, 0.82 * h), (0.76 * r, 0.92 * h), (0, h)], _BLACK, segments=12)
    path = [(0, 0.86 * h, 0.7 * r), (0, 0.8 * h, 1.5 * r), (0, 0.2 * h, 1.45 * r), (0, 0.15 * h, r)]
    mesh.tube(path, 0.12 * r, _BLACK, segments=5)


# -- the stove -----------------------------------------------------------------------------------


@shape("StoveBurner")
def stove_burner(appearance: Appearance) -> Mesh:
    """An iron grate over a gas burner, or flat rings; blue flames or a red glow while on."""
    return _grate(appearance) if appearance.size[1] > 0.015 else _rings(appearance)


def _rings(appearance: Appearance) -> Mesh:
    """Electric: coils in a steel ring."""
    w, h, d = appearance.size
    mesh, r, high = Mesh(), w / 2, max(h, 0.008)
    squash = (1.0, d / w)
    bowl = [(r, 0.0), (r, 0.6 * high), (0.90 * r, 0.6 * high)]
    mesh.lathe(bowl, _STEEL, squash=squash, segments=18)
    mesh.lathe([(0.9 * r, 0.4 * high), (0, 0.4 * high)], _BLACK, squash=squash, segments=18)
    for k in (0.82, 0.58, 0.34):
        ring = [(k * r, 0.4 * high), ((k - 0.02) * r, high), ((k - 0.12) * r, high)]
        colour, material = (_EMBER, "glowing") if appearance.on else (_COIL, "plain")
        mesh.lathe([*ring, ((k - 0.14) * r, 0.4 * high)], colour, material, squash=squash,
                   segments=16)  # fmt: skip
    return mesh


def _grate(appearance: Appearance) -> Mesh:
    """Gas: four bars in a frame over a cap."""
    w, h, d = appearance.size
    mesh, r, bar = Mesh(), min(w, d) / 2, 0.07 * min(w, d)
    mesh.lathe([(0.62 * r, 0.002), (0.58 * r, 0.2 * h), (0, 0.2 * h)], _STEEL, segments=14)
    mesh.lathe([(0.34 * r, 0.1 * h), (0.34 * r, 0.55 * h), (0, 0.6 * h)], _IRON, segments=12)
    for side in (-1, 1):
        mesh.box((0, 0.82 * h, side * (d - bar) / 2), (w, 0.36 * h, bar), _COIL)
        mesh.box((side * (w - bar) / 2, 0.82 * h, 0), (bar, 0.36 * h, d - 2 * bar), _COIL)
        for other in (-1, 1):
            at = (side * (w - bar) / 2, 0.32 * h, other * (d - bar) / 2)
            mesh.box(at, (bar, 0.64 * h, bar), _COIL, faces="xXzZ")
        mesh.box((side * 0.32 * w, 0.84 * h, 0), (0.30 * w, 0.32 * h, bar), _COIL)
        mesh.box((0, 0.84 * h, side * 0.32 * d), (bar, 0.32 * h, 0.30 * d), _COIL)
    if appearance.on:
        _flames(mesh, 0.40 * r, h)
    return mesh


def _flames(mesh: Mesh, r: float, h: float) -> None:
    """A ring of small blue flames that lick outwards."""
    high = max(1.5 * h, 0.04)
    for k in range(10):
        a = 2 * pi * k / 10
        root, tip = ((u * r * cos(a), y, u * r * sin(a)) for u, y in ((1, 0.3 * h), (1.5, high)))
        side = 0.30 * r * np.array([-sin(a), 0.0, cos(a)])
        waist = (np.array(root) + np.array(tip)) / 2
        corners = np.array([root, waist - side, tip, waist + side])
        mesh.quad(corners, _FLAME if k % 2 else _FLAME_TIP, "glowing", both=True)


@shape("StoveKnob")
def stove_knob(appearance: Appearance) -> Mesh:
    """A round knob with a ridge and a mark, upright when off and level with a red mark when on."""
    face = np.array(appearance.face or (0.0, 0.0, 1.0))
    # Along each axis, its box is as long as the visible part of its disc and its axle.
    spans = np.stack([np.sqrt(1.0 - face**2), np.abs(face)], axis=1)
    (wide, thick), *_ = np.linalg.lstsq(spans, np.array(appearance.size))
    wide, thick = max(wide, 0.01), max(thick, 0.2 * wide)
    x, y, z = face.tolist()
    mesh, leaning = Mesh(), Mesh()
    leaning.add(_knob(appearance, wide / 2, thick), turn=("x", -degrees(atan2(y, hypot(x, z)))))
    back = np.array([0.0, appearance.size[1] / 2, 0.0]) - thick / 2 * face
    mesh.add(leaning, turn=("y", degrees(atan2(x, z))), at=back)
    return mesh


def _knob(appearance: Appearance, r: float, thick: float) -> Mesh:
    """The knob, lying on its back at z = 0."""
    knob, turned = Mesh(), Mesh()
    knob.cylinder((0, 0, 0.1 * thick), r, 0.2 * thick, _STEEL, axis="z", segments=14)
    knob.cylinder((0, 0, 0.4 * thick), 0.86 * r, 0.5 * thick, _DARK, top=0.76 * r, axis="z")
    turned.box((0, 0, 0.75 * thick), (0.34 * r, 1.5 * r, 0.5 * thick), shaded(_DARK, 1.6))
    mark = (_LAMP, "glowing") if appearance.on else ((0.95, 0.95, 0.95), "plain")
    turned.panel((0, 0.38 * r, thick + 0.001), (0.22 * r, 0.7 * r), *mark)
    knob.add(turned, turn=("z", 90.0 if appearance.on else 0.0))
    return knob


@shape("Kettle")
def kettle(appearance: Appearance) -> Mesh:
    """A squat body with a spout to the front and an arched handle over a lid."""
    w, h, d = appearance.size
    mesh, colour = Mesh(), appearance.palette.accent
    r = min(w / 2, 0.40 * d)
    z = r - d / 2
    body = [(0, 0), (0.92, 0), (1, 0.06), (0.98, 0.24), (0.80, 0.46), (0.50, 0.60)]
    mesh.lathe([(a * r, b * h) for a, b in body], colour, at=(0, 0, z), segments=14)
    gauge = _WATER if appearance.filled else shaded(_STEEL, 1.2)
    for side in (-1, 1):
        mesh.box((side * 0.97 * r, 0.21 * h, z), (0.06 * r, 0.30 * h, 0.30 * r), gauge)
    _lid(mesh, appearance, r, z, colour)
    out, rise = d / 2 - z - 0.62 * r - 0.03 * h, 0.36 * h
    spout, long = Mesh(), hypot(out, rise)
    spout.cylinder((0, long / 2, 0), 0.13 * h, long, shaded(colour, 0.9), top=0.06 * h, segments=8)
    mesh.add(spout, turn=("x", degrees(atan2(out, rise))), at=(0, 0.22 * h, z + 0.62 * r))
    arch = [(0.40, -0.78), (0.80, -0.66), (1.0, -0.30), (1.0, 0.30), (0.80, 0.66), (0.40, 0.78)]
    path = [(0.0, y * h - 0.010 * (y == 1), z + u * r) for y, u in arch]
    mesh.tube(path[:2], 0.008, _STEEL, segments=6)
    mesh.tube(path[1:5], 0.010, _BLACK, segments=6)
    mesh.tube(path[4:], 0.008, _STEEL, segments=6)
    return mesh


def _lid(mesh: Mesh, appearance: Appearance, r: float, z: float, colour: Colour) -> None:
    """A lid with a knob, which lifts to one side."""
    h = appearance.size[1]
    hole = _WATER if appearance.filled else _BLACK
    mesh.lathe([(0.5 * r, 0.6 * h), (0, 0.6 * h)], hole, at=(0, 0, z), segments=12)
    lid = Mesh()
    lid.lathe(
        [(0.52 * r, 0.60 * h), (0.44 * r, 0.67 * h), (0, 0.69 * h)],
        shaded(colour, 1.2),
        segments=12,
    )
    lid.lathe([(0.5 * r, 0.60 * h), (0, 0.60 * h)][::-1], shaded(colour, 0.6), segments=12)
    lid.cylinder((0, 0.73 * h, 0), 0.10 * r, 0.09 * h, _BLACK, top=0.14 * r, segments=8)
    hinge = (0.5 * r, 0.6 * h, 0.0)
    mesh.add(lid, turn=("z", -95.0 * appearance.openness), about=hinge, at=(0, 0, z))
