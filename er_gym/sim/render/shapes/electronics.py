"""Screens, phones, clocks and computers."""

from __future__ import annotations

from math import atan2, cos, degrees, hypot, pi, sin

import numpy as np

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import shaded
from er_gym.sim.render.patch import Colour, Triple
from er_gym.sim.render.shapes.forms import laid, roundel
from er_gym.sim.render.shapes.registry import shape

_BLACK, _DARK, _SILVER = (0.06, 0.06, 0.07), (0.15, 0.15, 0.16), (0.72, 0.73, 0.76)
_WHITE, _KEYS, _LIT = (0.94, 0.93, 0.90), (0.10, 0.10, 0.11), (1.0, 1.0, 1.0)
_GLOSS = ((0.03, 0.035, 0.05), (0.07, 0.08, 0.11), (0.24, 0.27, 0.33), (0.10, 0.12, 0.15))
"""Colours of a dark screen's four corners: light falls on it from one side."""
_SPLINTERS = (0.10, 0.55, 0.04, 0.85, 0.22, 1.0, 0.06, 0.40)
"""Brightness of the splinters of a shattered screen."""
_FRONT = 0.006
"""Distance between two layers, metres."""


# -- screens -------------------------------------------------------------------------------------


def _screen(appearance: Appearance, width: float, height: float, material: str) -> Mesh:
    """A screen around the origin that faces forwards: dark, lit or shattered."""
    mesh = Mesh()
    if appearance.broken:
        _shattered(mesh, width, height, appearance.on)
    elif appearance.on:
        mesh.panel((0, 0, 0), (width, height), _LIT, material)
    else:
        mesh.panel((0, 0, 0), (width, height), _GLOSS)
    return mesh


def _shattered(mesh: Mesh, width: float, height: float, on: bool) -> None:
    """Splinters of glass around a point of impact."""
    half = np.array([width, height]) / 2
    hit = half * (0.22, 0.15)
    corner = [
        np.arctan2(b * half[1] - hit[1], a * half[0] - hit[0]) for a in (-1, 1) for b in (-1, 1)
    ]
    angle = np.sort(np.concatenate([corner, np.arange(12) / 12 * 2 * pi - 3.0]))
    way = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    rim = hit + way * ((half - np.sign(way) * hit) / np.abs(way)).min(axis=1, keepdims=True)
    inner = hit + (rim - hit) * np.where(np.arange(len(rim)) % 2, 0.28, 0.45)[:, None]
    flat = np.zeros((len(rim), 1))
    middle, rim, inner = np.append(hit, 0.0), np.hstack([rim, flat]), np.hstack([inner, flat])
    tint = np.array((0.70, 0.85, 1.0) if on else (0.92, 0.96, 1.0))
    for k in range(len(rim)):
        near, far = _SPLINTERS[k % 8], 0.7 * _SPLINTERS[(3 * k + 2) % 8]
        mesh.quad([middle, inner[k], inner[k - 1], middle], near * tint)
        mesh.quad([inner[k - 1], inner[k], rim[k], rim[k - 1]], far * tint)


def _rim(mesh: Mesh, y: float, size: tuple[float, float], border: float, colour: Colour) -> None:
    """The edge around a part of a top face, as wide as ``border``."""
    w, d = size
    for sign in (-1, 1):
        mesh.panel((sign * (w - border) / 2, y, 0), (border, d), colour, facing="Y")
        mesh.panel((0, y, sign * (d - border) / 2), (w - 2 * border, border), colour, facing="Y")


@shape("Television")
def television(appearance: Appearance) -> Mesh:
    """A wide screen in a thin frame: on a foot, or flat to the wall."""
    w, h, d = appearance.size
    mesh, frame = Mesh(), appearance.pick(_BLACK, _DARK, (0.30, 0.30, 0.32))
    stands = d > 0.2 or appearance.height < 0.6
    foot = 0.10 * h if stands else 0.0
    thick, border = min(d, 0.06), 0.03
    front = thick / 2 if stands else d / 2
    middle = (h + foot) / 2
    mesh.rounded((0, middle, front - thick / 2 - _FRONT), (w, h - foot, thick), frame, 0.012)
    screen = _screen(appearance, w - 2 * border, h - foot - 2 * border, "screen")
    mesh.add(screen, at=(0, middle, front))
    if stands:
        mesh.box((0, 0.6 * foot, -thick / 2), (0.12 * w, 1.2 * foot, 0.03), frame, faces="xXzZ")
        mesh.box((0, 0.012, 0), (0.5 * w, 0.024, d), frame, taper=0.9, faces="xXYzZ")
    elif d - thick > 0.03:
        back = d - thick
        mesh.box((0, middle, -d / 2 + back / 2), (0.3 * w, 0.3 * h, back), _DARK, faces="xXyYz")
    return mesh


@shape("Laptop")
def laptop(appearance: Appearance) -> Mesh:
    """A slab with keys, and a screen with a hinge at its back."""
    w, h, d = appearance.size
    mesh, body = Mesh(), appearance.pick(_SILVER, (0.82, 0.82, 0.83), (0.32, 0.33, 0.36))
    shut = h < 0.1
    thick = min(0.02, h / 2)
    depth = d if shut else 0.80 * d
    # An open lid leans back over its hinge as far as the box allows.
    behind, rise = (0.3 * d, 0.9 * d) if shut else (d - depth, h - thick)
    opened = 180.0 - degrees(atan2(rise, behind))
    reach = depth + (hypot(behind, rise) - depth) * appearance.openness
    hinge = (0.0, thick, d / 2 - depth)
    mesh.box((0, thick / 2, (d - depth) / 2), (w, thick, depth), body, faces="xXYzZ")
    if appearance.openness > 0:
        top = thick + 0.004
        keys = (0, top, hinge[2] + 0.33 * depth)
        mesh.panel(keys, (0.88 * w, 0.46 * depth), _LIT, "keys", facing="Y")
        pad = (0, top, d / 2 - 0.21 * depth)
        mesh.panel(pad, (0.30 * w, 0.28 * depth), shaded(body, 0.7), facing="Y")
    lid = Mesh()  # as it lies when closed: its screen looks down
    lid.box((0, 0, reach / 2), (w, 0.012, reach), body)
    screen = _screen(appearance, 0.95 * w, 0.93 * reach, "desktop")
    lid.add(screen, at=(0, -0.011, reach / 2), turn=("x", 90))
    lid.panel((0, 0.010, reach / 2), (0.14 * w, 0.10 * w), shaded(body, 0.6), facing="Y")
    lift = (0, thick + 0.012, hinge[2])
    mesh.add(lid, at=lift, turn=("x", -opened * appearance.openness))
    return mesh


@shape("Desktop")
def desktop(appearance: Appearance) -> Mesh:
    """A screen on a foot with a tower, keys and a mouse."""
    w, h, d = appearance.size
    mesh = Mesh()
    wide, tall, left = 0.74 * w, 0.76 * h, -0.13 * w
    back = -0.15 * d
    mesh.rounded((left, h - tall / 2, back), (wide, tall, 0.04), _BLACK, 0.01)
    screen = _screen(appearance, wide - 0.05, tall - 0.05, "desktop")
    mesh.add(screen, at=(left, h - tall / 2, back + 0.02 + _FRONT))
    mesh.box((left, 0.6 * (h - tall), back - 0.02), (0.08, 1.2 * (h - tall), 0.02), _DARK)
    mesh.box((left, 0.008, back), (0.30 * wide, 0.016, 0.5 * d), _DARK, faces="xXYzZ")
    mesh.box((left, 0.01, 0.34 * d), (0.62 * wide, 0.02, 0.30 * d), _DARK, faces="xXzZ")
    mesh.panel((left, 0.02, 0.34 * d), (0.62 * wide, 0.30 * d), _LIT, "keys", facing="Y")
    mesh.ball((0.27 * w, 0.015, 0.32 * d), (0.06, 0.03, 0.09), _DARK, segments=8, rings=4)
    case, high, at = 0.2 * w, 0.8 * h, 0.40 * w
    mesh.box((at, high / 2, 0), (case, high, d), (0.20, 0.20, 0.22), faces="xXYzZ")
    for k, colour in enumerate((_SILVER, _SILVER, (0.35, 0.36, 0.38))):
        y = (0.88 - 0.13 * k) * high
        mesh.panel((at, y, d / 2 + 0.004), (0.75 * case, 0.07 * high), colour)
    lamp = ((0.3, 1.0, 0.4), "glowing") if appearance.on else ((0.1, 0.25, 0.12), "plain")
    mesh.panel((at, 0.35 * high, d / 2 + 0.004), (0.025, 0.025), *lamp)
    return mesh


@shape("CellPhone")
def cell_phone(appearance: Appearance) -> Mesh:
    """A thin dark slab with a large screen in a bright edge."""
    case = appearance.pick(_SILVER, (0.88, 0.86, 0.82), (0.75, 0.60, 0.42), (0.25, 0.35, 0.60))
    return laid(appearance.size, lambda size: _phone(appearance, size, case))


def _phone(appearance: Appearance, size: Triple, case: Colour) -> Mesh:
    w, h, d = size
    mesh, turned = Mesh(), w > d
    short, long = min(w, d), max(w, d)
    mesh.box((0, h / 2, 0), size, case, faces="xXzZ")
    mesh.panel((0, h / 2, 0), (w, d), case, facing="Y")  # seen through cracks in the seams above
    border = 0.07 * short
    _rim(mesh, h, (w, d), border, case)
    screen = _screen(appearance, short - 2 * border, long - 2 * border, "phone")
    upright = Mesh()
    upright.add(screen, turn=("x", -90))
    mesh.add(upright, at=(0, h, 0), turn=("y", 90 if turned else 0))
    return mesh


@shape("RemoteControl")
def remote_control(appearance: Appearance) -> Mesh:
    """Long, dark and narrow, with rows of bright buttons and a red one."""
    case = appearance.pick(_DARK, (0.22, 0.22, 0.24), (0.10, 0.10, 0.12))
    w, h, d = appearance.size
    if h > max(w, d):
        return laid(appearance.size, lambda size: _remote(size, case))
    mesh = Mesh()
    mesh.add(_remote((min(w, d), h, max(w, d)), case), turn=("y", 90 if w > d else 0))
    return mesh


def _remote(size: Triple, case: Colour) -> Mesh:
    w, h, d = size
    mesh, raised = Mesh(), 0.005
    top = h - raised
    mesh.rounded((0, top / 2, 0), (w, top, d), case, 0.3 * top)

    def button(x: float, z: float, wide: float, deep: float, colour: Colour) -> None:
        at = (x * w, top + raised / 2, z * d)
        mesh.box(at, (wide * w, raised, deep * d), colour, faces="xXYzZ")

    button(-0.24, -0.41, 0.26, 0.07, (0.90, 0.12, 0.10))
    button(0.24, -0.41, 0.26, 0.07, _SILVER)
    for row in range(3):
        for x in (-0.28, 0.0, 0.28):
            button(x, -0.28 + 0.085 * row, 0.19, 0.055, _WHITE)
    mesh.cylinder((0, top + raised / 2, 0.09 * d), 0.36 * w, raised, _SILVER, segments=10)
    mesh.cylinder((0, h, 0.09 * d), 0.17 * w, 2 * raised, case, segments=8)
    bright = ((0.85, 0.2, 0.2), (0.25, 0.65, 0.3), (0.9, 0.75, 0.2), (0.2, 0.4, 0.85))
    for k, colour in enumerate(bright):
        button(-0.33 + 0.22 * k, 0.29, 0.16, 0.045, colour)
    for x in (-0.22, 0.22):
        button(x, 0.40, 0.3, 0.06, (0.5, 0.5, 0.52))
    return mesh


# -- clocks --------------------------------------------------------------------------------------


@shape("AlarmClock")
def alarm_clock(appearance: Appearance) -> Mesh:
    """Two bells over a round face; or a box with a face; or a low clock with glowing digits."""
    w, h, _ = appearance.size
    colour = appearance.pick(
        (0.75, 0.16, 0.14), (0.16, 0.40, 0.55), (0.20, 0.50, 0.35), (0.85, 0.65, 0.20)
    )
    if w > 1.25 * h:
        return _digital_clock(appearance)
    return (
        _bell_clock(appearance, colour)
        if appearance.random().random() < 0.75
        else _box_clock(appearance, colour)
    )


def _bell_clock(appearance: Appearance, colour: Colour) -> Mesh:
    w, h, d = appearance.size
    mesh, radius = Mesh(), min(0.5 * w, 0.38 * h)
    y, deep = 0.09 * h + radius, 0.7 * d
    mesh.cylinder((0, y, 0), radius, deep, colour, axis="z", segments=16)
    face = roundel(1.76 * radius, 1.76 * radius, _LIT, "clock")
    mesh.add(face, at=(0, y, deep / 2 + 0.004))
    for side in (-1, 1):
        at = (side * 0.58 * radius, y + 0.93 * radius, 0.0)
        bell = Mesh()
        wide = min(0.46 * radius, 0.48 * d)
        dome = [(0, 0), (wide, 0), (0.85 * wide, 0.22 * radius), (0, 0.40 * radius)]
        bell.lathe(dome, _SILVER, "metal", segments=10)
        mesh.add(bell, at=at, turn=("z", -side * 28))
        foot = [(side * 0.5 * radius, 0.3 * h, 0), (side * 0.75 * radius, 0, 0)]
        mesh.tube(foot, 0.07 * radius, _SILVER, segments=5)
    arch = [
        (0.75 * radius * cos(a), min(h - 0.008, y + 1.25 * radius + 0.35 * radius * sin(a)), 0)
        for a in np.linspace(0, pi, 6)
    ]
    mesh.tube(arch, 0.05 * radius, _SILVER, segments=5)
    return mesh


def _box_clock(appearance: Appearance, colour: Colour) -> Mesh:
    w, h, d = appearance.size
    mesh, body = Mesh(), 0.90 * h
    mesh.rounded((0, body / 2, -0.003), (w, body, d - 0.012), colour, 0.015)
    side = 0.86 * min(w, body)
    mesh.add(roundel(side, side, _LIT, "clock"), at=(0, body / 2, d / 2))
    mesh.box((0, 0.95 * h, 0), (0.4 * w, 0.10 * h, 0.4 * d), _SILVER, faces="xXYzZ")
    return mesh


def _digital_clock(appearance: Appearance) -> Mesh:
    w, h, d = appearance.size
    mesh, top = Mesh(), 0.92 * h
    case = appearance.pick(_DARK, _WHITE, (0.36, 0.22, 0.13))
    mesh.box((0, top / 2, -0.004), (w, top, d - 0.008), case, faces="xXYzZ", taper=0.96)
    mesh.box((0, 0.96 * h, 0), (0.4 * w, 0.08 * h, 0.3 * d), _SILVER, faces="xXYzZ")
    mesh.panel((0, 0.46 * h, d / 2), (0.90 * w, 0.72 * h), _LIT, "digits")
    return mesh


@shape("Watch")
def watch(appearance: Appearance) -> Mesh:
    """A loop of strap with a round dial on top."""
    w, h, d = appearance.size
    strap = appearance.pick((0.45, 0.26, 0.14), (0.20, 0.20, 0.23), (0.24, 0.30, 0.52))
    mesh, case = Mesh(), (0.86, 0.72, 0.35) if appearance.random().random() < 0.5 else _SILVER
    radius, wide, ring = min(d, w) / 2, 0.52 * d, 0.86 * h
    loop = [
        (w / 2, -wide / 2), (w / 2, wide / 2), (0.42 * w, wide / 2), (0.42 * w, -wide / 2),
        (w / 2, -wide / 2),
    ]  # fmt: skip
    mesh.lathe(
        loop, strap, at=(0, ring / 2, 0), axis="z", segments=16, squash=(1, ring / w), smooth=False
    )
    mesh.cylinder((0, 0.87 * h, 0), 0.95 * radius, 0.20 * h, case, "metal", segments=14)
    dial = Mesh()
    dial.add(roundel(1.6 * radius, 1.6 * radius, _LIT, "clock"), turn=("x", -90))
    mesh.add(dial, at=(0, h, 0))
    mesh.cylinder((0.97 * radius, 0.88 * h, 0), 0.06 * d, 0.1 * d, case, axis="x", segments=6)
    return mesh
