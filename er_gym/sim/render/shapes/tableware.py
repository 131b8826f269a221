"""Plates, bowls, cups, pots, pans and bottles."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from math import atan2, cos, degrees, pi, sin

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.render.shapes.registry import shape

_SIDES = 14
_WHITE, _CREAM, _BLACK = (0.93, 0.93, 0.92), (0.90, 0.85, 0.74), (0.09, 0.09, 0.10)
_BLUE, _RED, _GREEN = (0.24, 0.42, 0.66), (0.75, 0.22, 0.18), (0.36, 0.56, 0.40)
_YELLOW, _GREY, _STEEL = (0.90, 0.72, 0.28), (0.42, 0.45, 0.48), (0.76, 0.78, 0.80)
_TINTS = ((0.62, 0.82, 0.88), (0.66, 0.84, 0.68), (0.92, 0.62, 0.52), (0.80, 0.76, 0.92))
_STAIN, _GREASE = (0.30, 0.17, 0.07), (0.56, 0.34, 0.14)
_LIQUIDS = {"water": (0.30, 0.58, 0.88), "coffee": (0.22, 0.12, 0.06), "wine": (0.50, 0.05, 0.14)}
_GLASS_GREEN, _FOIL, _PAPER = (0.10, 0.26, 0.14), (0.55, 0.10, 0.13), (0.93, 0.88, 0.74)
_PLASTIC, _CAP = (0.70, 0.86, 0.93), (0.14, 0.36, 0.72)
_PEPPER, _SALT = (0.16, 0.12, 0.11), (0.95, 0.95, 0.94)


def lengthwise(appearance: Appearance, mesh: Mesh) -> Mesh:
    """A mesh made along x, turned to the front if the object is longer in that direction."""
    if appearance.size[0] >= appearance.size[2]:
        return mesh
    turned = Mesh()
    turned.add(mesh, turn=("y", -90.0))
    return turned


def _coat(appearance: Appearance, colour: Colour) -> NDArray[np.float64]:
    """A colour for :meth:`Mesh.lathe`; a dirty object gets brown stains, vertex by vertex."""
    if not appearance.dirty:
        return np.asarray(colour)
    share = appearance.random().choice([0.12, 0.5, 0.92], (2, _SIDES))
    share = np.concatenate([share, share[:, :1]], axis=1).reshape(-1, 1)
    stain = _STAIN if sum(colour) > 0.9 else _GREASE
    return np.asarray(np.asarray(colour) * (1 - share) + np.asarray(stain) * share)


def _turned(
    mesh: Mesh,
    appearance: Appearance,
    x: float,
    colour: Colour,
    profile: Iterable[tuple[float, float]],
) -> None:
    mesh.lathe(profile, _coat(appearance, colour), at=(x, 0.0, 0.0), segments=_SIDES)


def _liquid(mesh: Mesh, appearance: Appearance, x: float, radius: float, height: float) -> None:
    """The surface of the liquid in a vessel."""
    if appearance.filled:
        colour = _LIQUIDS.get(appearance.filled, _LIQUIDS["water"])
        profile = [(radius, height), (0.6 * radius, height), (0.0, height)]
        mesh.lathe(profile, colour, at=(x, 0.0, 0.0), segments=_SIDES)
        rim = [(radius, height + 0.004), (0.86 * radius, height + 0.004)]
        mesh.lathe(rim, mixed(colour, _WHITE, 0.25), at=(x, 0.0, 0.0), segments=_SIDES)


# -- broken things -------------------------------------------------------------------------------


def _pieces(
    mesh: Mesh,
    appearance: Appearance,
    radius: float,
    colour: Colour,
    inside: Colour,
    *,
    x: float = 0.0,
) -> None:
    """Scattered shards."""
    random = appearance.random()
    thick = max(0.006, 0.05 * radius)
    for k in range(6):
        angle = 2 * pi * (k + 0.5 * random.random()) / 6
        away, wide = radius * (0.5 + 0.2 * random.random()), radius * (0.3 + 0.1 * random.random())
        spread = [angle, angle + 1.7 + 0.5 * random.random(), angle + 3.6 + random.random()]
        shard = Mesh()
        outline = [(wide * cos(a), wide * sin(a)) for a in spread]
        shard.prism(outline, 0.0, thick, inside if k % 2 else colour)
        at = (x + away * cos(angle), 0.1 * radius, away * sin(angle))
        mesh.add(shard, turn=("x" if k % 2 else "z", 25.0 * (-1) ** k), at=at)


def _stump(
    mesh: Mesh, radius: float, height: float, colour: Colour, inside: Colour, *, x: float = 0.0
) -> None:
    """The lower part of a broken vessel, with a jagged edge."""
    count = 10
    slant = [0.62 - 0.38 * cos(2 * pi * k / count) for k in range(count)]
    edge = [(0.55, 1.0, 0.6, 0.85)[k % 4] * slant[k] * height for k in range(count)]
    mesh.cylinder((x, 0.004, 0.0), 0.72 * radius, 0.008, inside, segments=count)
    for k in range(count):
        a, b = 2 * pi * k / count, 2 * pi * (k + 1) / count
        low, upper = 0.72 * radius, 0.9 * radius
        corners = np.array(
            [
                (x + low * cos(a), 0.0, low * sin(a)),
                (x + low * cos(b), 0.0, low * sin(b)),
                (x + upper * cos(b), edge[(k + 1) % count], upper * sin(b)),
                (x + upper * cos(a), edge[k], upper * sin(a)),
            ]
        )
        mesh.quad(corners, colour)
        mesh.quad((corners * (0.99, 1.0, 0.99))[::-1], inside)


# -- crockery ------------------------------------------------------------------------------------


@shape("Plate")
def plate(appearance: Appearance) -> Mesh:
    """A flat disc with a raised rim and a coloured ring."""
    w, h, d = appearance.size
    mesh, r, ring = Mesh(), min(w, d) / 2, appearance.pick(_BLUE, _RED, _GREEN, _YELLOW, _GREY)
    if appearance.broken:
        return _broken_plate(r, h, ring)
    _turned(mesh, appearance, 0.0, _WHITE, [(0, 0), (0.55 * r, 0), (r, 0.8 * h)])
    _turned(mesh, appearance, 0.0, ring, [(r, 0.8 * h), (r, h), (0.84 * r, 0.72 * h)])
    _turned(mesh, appearance, 0.0, _WHITE, [(0.84 * r, 0.72 * h), (0.66 * r, 0.3 * h)])
    centre = shaded(_WHITE, 0.92)
    _turned(mesh, appearance, 0.0, centre, [(0.66 * r, 0.3 * h), (0.3 * r, 0.3 * h), (0, 0.3 * h)])
    return mesh


def _broken_plate(r: float, h: float, ring: Colour) -> Mesh:
    """Five wedges with gaps between them."""
    mesh, cuts = Mesh(), (0.0, 1.0, 2.4, 3.3, 4.7, 2 * pi)
    for k, (a, b) in enumerate(itertools.pairwise(cuts)):
        middle, shift = (a + b) / 2, 0.10 * r
        wedge = Mesh()
        arc = np.linspace(a, b, 4)
        for low, high, colour in ((0.0, 0.66, _WHITE), (0.66, 0.86, ring)):
            outline = [(high * r * cos(t), high * r * sin(t)) for t in arc]
            outline += [(low * r * cos(t), low * r * sin(t)) for t in (arc[::-1] if low else [a])]
            top = 0.4 * h if low else 0.3 * h
            if low:  # a piece of a ring is not convex, so each is made of four
                for t, u in itertools.pairwise(arc):
                    ends = [(t, low), (u, low), (u, high), (t, high)]
                    wedge.prism([(s * r * cos(v), s * r * sin(v)) for v, s in ends], 0, top, colour)
            else:
                wedge.prism(outline, 0.0, top, colour)
        lift = (0.0, 0.3 * h, 0.0, 0.4 * h, 0.15 * h)[k]
        at = (shift * cos(middle), lift, shift * sin(middle))
        mesh.add(wedge, turn=("y", 7.0 * (-1) ** k), at=at)
    return mesh


@shape("Bowl")
def bowl(appearance: Appearance) -> Mesh:
    """A bowl: a half ball, open at the top, coloured outside and light inside."""
    w, h, d = appearance.size
    mesh, r = Mesh(), min(w, d) / 2
    colour, inside = appearance.pick(_BLUE, _CREAM, _GREEN, _RED, _GREY, _YELLOW), _WHITE
    if appearance.broken:
        _stump(mesh, 0.85 * r, 0.55 * h, colour, inside)
        _pieces(mesh, appearance, r, colour, inside)
        return mesh
    outside = [(0, 0), (0.42, 0), (0.46, 0.08), (0.72, 0.30), (0.92, 0.66), (1.0, 1.0)]
    _turned(mesh, appearance, 0.0, colour, [(a * r, b * h) for a, b in outside])
    _turned(mesh, appearance, 0.0, shaded(colour, 1.1), [(r, h), (0.92 * r, h)])
    hollow = [(0.92, 1.0), (0.83, 0.66), (0.62, 0.32), (0.36, 0.14), (0, 0.12)]
    _turned(mesh, appearance, 0.0, shaded(inside, 0.9), [(a * r, b * h) for a, b in hollow])
    _liquid(mesh, appearance, 0.0, 0.84 * r, 0.7 * h)
    return mesh


@shape("Mug")
def mug(appearance: Appearance) -> Mesh:
    """A mug: a short cylinder with a big handle."""
    length, h, breadth = max(appearance.size[::2]), appearance.size[1], min(appearance.size[::2])
    mesh, colour = Mesh(), appearance.pick(_BLUE, _RED, _WHITE, _YELLOW, _GREEN)
    r = min(breadth / 2, 0.37 * length)
    x, inside = r - length / 2, mixed(colour, _WHITE, 0.7)
    if appearance.broken:
        _stump(mesh, 1.1 * r, 0.6 * h, colour, inside, x=x)
        _pieces(mesh, appearance, r, colour, inside, x=x)
    else:
        _turned(mesh, appearance, x, colour, [(0, 0), (0.88 * r, 0), (r, 0.08 * h), (r, h)])
        _turned(mesh, appearance, x, inside, [(r, h), (0.86 * r, h)])
        hollow = [(0.86 * r, h), (0.84 * r, 0.1 * h), (0, 0.1 * h)]
        _turned(mesh, appearance, x, shaded(inside, 0.8), hollow)
        _liquid(mesh, appearance, x, 0.85 * r, 0.93 * h)
    _ear(mesh, x + r - 0.004, length / 2, (0.18 * h, 0.82 * h), 0.11 * r, colour)
    return lengthwise(appearance, mesh)


def _ear(
    mesh: Mesh, near: float, far: float, span: tuple[float, float], thick: float, colour: Colour
) -> None:
    """An ear-shaped handle at the side of a vessel."""
    low, high = span
    out, bend = far - thick, 0.25 * (high - low)
    path = [(near, high), (out - 0.3 * (out - near), high), (out, high - bend)]
    path += [(out, low + bend), (out - 0.3 * (out - near), low), (near, low)]
    mesh.tube([(x, y, 0.0) for x, y in path], thick, colour, segments=6)


@shape("Cup")
def cup(appearance: Appearance) -> Mesh:
    """A cup: a tall tumbler that is wider at the top, without a handle, with a band."""
    w, h, d = appearance.size
    mesh, r, colour = Mesh(), min(w, d) / 2, appearance.pick(*_TINTS)
    if appearance.broken:
        _stump(mesh, 0.85 * r, 0.5 * h, colour, shaded(colour, 0.8))
        _pieces(mesh, appearance, r, colour, shaded(colour, 0.8))
        return mesh

    def side(low: float, high: float) -> list[tuple[float, float]]:
        return [((0.66 + 0.34 * y) * r, y * h) for y in (low, high)]

    _turned(mesh, appearance, 0.0, colour, [(0, 0), *side(0.0, 0.55)])
    _turned(mesh, appearance, 0.0, shaded(colour, 0.6), side(0.55, 0.72))
    _turned(mesh, appearance, 0.0, colour, side(0.72, 1.0))
    _turned(mesh, appearance, 0.0, mixed(colour, _WHITE, 0.6), [(r, h), (0.9 * r, h)])
    hollow = [(0.9 * r, h), (0.58 * r, 0.08 * h), (0, 0.08 * h)]
    _turned(mesh, appearance, 0.0, shaded(colour, 0.78), hollow)
    _liquid(mesh, appearance, 0.0, 0.88 * r, 0.94 * h)
    return mesh


# -- for cooking ---------------------------------------------------------------------------------


@shape("Pot")
def pot(appearance: Appearance) -> Mesh:
    """A high steel cylinder with a thick rim and a handle on either side."""
    length, h, breadth = max(appearance.size[::2]), appearance.size[1], min(appearance.size[::2])
    mesh, steel = Mesh(), appearance.pick(_STEEL, shaded(_STEEL, 0.9), (0.66, 0.66, 0.70))
    r = min(breadth / 2, length / 2 - 0.035)
    near = min(length / 2 - r, 0.06)
    x = near + r - length / 2
    _turned(mesh, appearance, x, shaded(steel, 0.8), [(0, 0), (0.9 * r, 0), (0.94 * r, 0.12 * h)])
    _turned(mesh, appearance, x, steel, [(0.94 * r, 0.12 * h), (0.94 * r, 0.9 * h), (r, 0.94 * h)])
    _turned(mesh, appearance, x, shaded(steel, 1.2), [(r, 0.94 * h), (r, h), (0.9 * r, h)])
    hollow = [(0.9 * r, h), (0.88 * r, 0.06 * h), (0, 0.06 * h)]
    _turned(mesh, appearance, x, shaded(steel, 0.6), hollow)
    _liquid(mesh, appearance, x, 0.89 * r, 0.72 * h)
    _loop(mesh, x - 0.92 * r, -length / 2, 0.72 * h, 0.36 * r)
    if length / 2 - x - r > 0.10:
        path = [(x + 0.92 * r, 0.75 * h, 0), (length / 2 - 0.012, 0.85 * h, 0)]
        mesh.tube(path, 0.013, _BLACK, segments=7)
    else:
        _loop(mesh, x + 0.92 * r, length / 2, 0.72 * h, 0.36 * r)
    return lengthwise(appearance, mesh)


def _loop(mesh: Mesh, near: float, far: float, y: float, half: float) -> None:
    """A level handle that leads out from a vessel's wall and back."""
    thick = 0.010
    out = far - thick * np.sign(far - near)
    path = [(near, y, half), (out, y, 0.8 * half), (out, y, -0.8 * half), (near, y, -half)]
    mesh.tube(path, thick, _BLACK, segments=6)


@shape("Pan")
def pan(appearance: Appearance) -> Mesh:
    """A low dark disc with a rim and one long handle."""
    length, h, breadth = max(appearance.size[::2]), appearance.size[1], min(appearance.size[::2])
    mesh, colour = (
        Mesh(),
        appearance.pick((0.16, 0.16, 0.17), (0.22, 0.22, 0.25), (0.20, 0.15, 0.13)),
    )
    r = min(breadth / 2, 0.36 * length)
    x, rim = r - length / 2, h * (0.62 if h > 0.06 else 0.85)
    _turned(mesh, appearance, x, colour, [(0, 0), (0.8 * r, 0), (r, rim)])
    _turned(mesh, appearance, x, (0.55, 0.56, 0.58), [(r, rim), (0.94 * r, rim)])
    hollow = [(0.94 * r, rim), (0.78 * r, 0.15 * rim), (0.4 * r, 0.15 * rim), (0, 0.15 * rim)]
    _turned(mesh, appearance, x, mixed(colour, (0.4, 0.4, 0.42), 0.25), hollow)
    start, end = x + 0.95 * r, length / 2
    neck, thick = start + 0.22 * (end - start), 0.010
    mesh.tube([(start, 0.8 * rim, 0), (neck, 0.5 * (rim + h) - thick, 0)], 0.8 * thick, _STEEL)
    grip = [(neck, 0.5 * (rim + h) - thick, 0), (end - 0.004, h - thick, 0)]
    mesh.tube(grip, 1.3 * thick, _BLACK, segments=8)
    return lengthwise(appearance, mesh)


# -- bottles and shakers -------------------------------------------------------------------------


@shape("WineBottle")
def wine_bottle(appearance: Appearance) -> Mesh:
    """Dark green, with a long thin neck, a label and red foil."""
    w, h, d = appearance.size
    mesh, r = Mesh(), min(w, d) / 2
    glass = _GLASS_GREEN
    if appearance.broken:
        _stump(mesh, 1.2 * r, 0.34 * h, glass, shaded(glass, 0.6))
        _pieces(mesh, appearance, r, shaded(glass, 1.4), glass)
        return mesh
    body = mixed(glass, _LIQUIDS["wine"], 0.25) if appearance.filled else shaded(glass, 2.2)
    _turned(mesh, appearance, 0.0, body, [(0, 0), (0.97 * r, 0), (r, 0.03 * h), (r, 0.12 * h)])
    _turned(mesh, appearance, 0.0, _PAPER, [(r, 0.12 * h), (r, 0.42 * h)])
    shoulder = [(r, 0.42 * h), (r, 0.52 * h), (0.82 * r, 0.60 * h), (0.36 * r, 0.68 * h)]
    _turned(mesh, appearance, 0.0, body, shoulder)
    _turned(mesh, appearance, 0.0, shaded(glass, 1.5), [(0.36 * r, 0.68 * h), (0.32 * r, 0.80 * h)])
    _turned(mesh, appearance, 0.0, _FOIL, [(0.38 * r, 0.80 * h), (0.38 * r, h), (0, h)])
    mesh.box((0, 0.31 * h, r), (0.7 * r, 0.09 * h, 0.008), _FOIL, faces="xXyYZ")
    return mesh


@shape("Bottle")
def bottle(appearance: Appearance) -> Mesh:
    """A bottle of light blue plastic, broad and waisted, with a short neck and a blue screw cap."""
    w, h, d = appearance.size
    mesh, r = Mesh(), min(w, d) / 2
    if appearance.broken:
        _stump(mesh, 1.2 * r, 0.4 * h, _PLASTIC, shaded(_PLASTIC, 0.8))
        _pieces(mesh, appearance, r, _PLASTIC, shaded(_PLASTIC, 0.8))
        return mesh
    full = _LIQUIDS.get(appearance.filled, _PLASTIC)
    low = [(0, 0), (0.9, 0), (1, 0.04), (1, 0.22), (0.9, 0.25), (1, 0.28)]
    _turned(mesh, appearance, 0.0, full, [(a * r, b * h) for a, b in low])
    _turned(mesh, appearance, 0.0, _CAP, [(r, 0.28 * h), (r, 0.48 * h)])
    high = [(1, 0.48), (0.9, 0.51), (1, 0.54), (0.98, 0.62), (0.74, 0.74)]
    _turned(mesh, appearance, 0.0, full, [(a * r, b * h) for a, b in high])
    _turned(mesh, appearance, 0.0, _PLASTIC, [(0.74 * r, 0.74 * h), (0.40 * r, 0.84 * h)])
    _turned(mesh, appearance, 0.0, _CAP, [(0.46 * r, 0.84 * h), (0.46 * r, h), (0, h)])
    return mesh


@shape("SaltShaker", "PepperShaker")
def shaker(appearance: Appearance) -> Mesh:
    """A shaker, white with an S or black with a P, under a domed steel cap with holes; tall: a
    mill."""
    w, h, d = appearance.size
    salt = appearance.kind == "SaltShaker"
    mesh, r, colour = Mesh(), min(w, d) / 2, _SALT if salt else _PEPPER
    if h > 2 * w:
        body = [(0, 0), (1, 0), (1, 0.06), (0.74, 0.30), (0.62, 0.46), (0.86, 0.62), (0.86, 0.66)]
        _turned(mesh, appearance, 0.0, colour, [(a * r, b * h) for a, b in body])
        _turned(
            mesh,
            appearance,
            0.0,
            _STEEL,
            [(0.86 * r, 0.66 * h), (0.86 * r, 0.70 * h), (0, 0.7 * h)],
        )
        head = [(0.80, 0.70), (0.84, 0.80), (0.5, 0.90), (0.28, 0.92), (0.34, 0.97), (0, 1)]
        _turned(mesh, appearance, 0.0, colour, [(a * r, b * h) for a, b in head])
        return mesh
    _turned(
        mesh, appearance, 0.0, colour, [(0, 0), (r, 0), (0.98 * r, 0.12 * h), (0.74 * r, 0.64 * h)]
    )
    cap = [(0.84, 0.62), (0.84, 0.78), (0.66, 0.93), (0.3, 1), (0, 1)]
    _turned(mesh, appearance, 0.0, _STEEL, [(a * r, b * h) for a, b in cap])
    for k in range(3):
        a = 2 * pi * k / 3
        mesh.panel((0.3 * r * cos(a), h + 0.001, 0.3 * r * sin(a)), (0.16 * r, 0.16 * r), _BLACK,
                   facing="Y")  # fmt: skip
    letter, face = Mesh(), Mesh()
    _letter(letter, "S" if salt else "P", 0.29 * r, _PEPPER if salt else _SALT)
    face.add(letter, turn=("x", -degrees(atan2(0.24 * r, 0.52 * h))), at=(0.0, 0.14 * h, r))
    mesh.add(face)
    mesh.add(face, turn=("y", 180.0))
    return mesh


def _letter(mesh: Mesh, letter: str, half: float, colour: Colour) -> None:
    """The letter S or P of upright and level bars, seen from the front (x points left)."""
    t = 0.45 * half
    bars = [(0.0, 4 * half, 2 * half), (0.0, 2 * half, 2 * half)]
    for x, y, wide in [*bars, (0.0, 0.0, 2 * half)] if letter == "S" else bars:
        mesh.panel((x, y + t / 2, 0.0), (wide, t), colour)
    left, right = (half, 2 * half), (-half, 2 * half)
    below = (-half, 0.0) if letter == "S" else (half, 0.0)
    for x, y in (left, below) if letter == "S" else (left, below, right):
        inner = x - t / 2 if x > 0 else x + t / 2
        mesh.panel((inner, y + half + t / 2, 0.0), (t, 2 * half), colour)
