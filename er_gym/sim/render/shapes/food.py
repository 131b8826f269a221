"""Fruit, vegetables, bread and eggs, whole and sliced."""

from __future__ import annotations

from collections.abc import Callable
from math import cos, pi, sin

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.render.shapes.registry import shape
from er_gym.sim.render.shapes.tableware import lengthwise

_RED, _GREEN, _BLUSH = (0.78, 0.10, 0.10), (0.50, 0.66, 0.18), (0.86, 0.66, 0.24)
_STALK, _LEAF, _PIP = (0.30, 0.20, 0.10), (0.25, 0.55, 0.18), (0.28, 0.15, 0.07)
_FLESH = (1.15, 1.10, 0.88)
_TOMATO, _CALYX, _SEEDS = (0.90, 0.24, 0.10), (0.20, 0.46, 0.14), (0.96, 0.70, 0.28)
_SKIN, _EYE, _STARCH = (0.66, 0.48, 0.28), (0.36, 0.24, 0.13), (1.08, 0.98, 0.60)
_CRUST, _CRUMB, _TOP = (0.72, 0.45, 0.20), (1.05, 0.93, 0.70), (0.52, 0.28, 0.11)
_PALE, _FRESH, _DARK = (0.80, 0.88, 0.56), (0.50, 0.76, 0.26), (0.26, 0.54, 0.16)
_SHELLS = ((0.96, 0.92, 0.84), (0.88, 0.68, 0.50), (0.95, 0.84, 0.70))
_YOLK, _WHITE = (0.98, 0.70, 0.08), (0.97, 0.97, 0.94)
_BROWNED = (0.35, 0.20, 0.10)

Points = NDArray[np.float64]


def _blob(
    mesh: Mesh,
    size: tuple[float, float, float],
    colour: Colour | Callable[[Points], ArrayLike],
    material: str = "plain",
    *,
    bump: Callable[[Points], Points] | None = None,
    power: float = 1.0,
    segments: int = 12,
    rings: int = 8,
    at: tuple[float, float, float] = (0.0, 0.0, 0.0),
) -> None:
    """A rounded lump of a given size that stands on its underside.

    Args:
        colour: one colour, or a function from directions (V, 3) to colours (V, 3).
        bump: a function from directions (V, 3) to factors (V,) of the surface's distance.
        power: a value below 1 makes it more like a box.
    """
    up = np.linspace(-pi / 2, pi / 2, rings + 1)[:, None]
    around = np.linspace(0, 2 * pi, segments + 1)[None]
    grid = [np.cos(up) * np.cos(around), np.sin(up) + 0 * around, np.cos(up) * np.sin(around)]
    out = np.stack(grid, axis=-1).reshape(-1, 3)
    out[np.abs(out) < 1e-9] = 0.0
    points = np.sign(out) * np.abs(out) ** power * (1.0 if bump is None else bump(out)[:, None])
    low = points.min(axis=0)
    points = (points - low) / np.ptp(points, axis=0) * size - (size[0] / 2, 0.0, size[2] / 2)
    first = (np.arange(rings)[:, None] * (segments + 1) + np.arange(segments)).ravel()
    above = first + segments + 1
    faces = np.concatenate(
        [np.stack([first, first + 1, above], 1), np.stack([first + 1, above + 1, above], 1)]
    )
    a, b, c = (points[faces[:, k]] for k in range(3))
    flat = np.cross(b - a, c - a)
    flat *= np.sign((flat * out[faces].sum(axis=1)).sum(axis=1, keepdims=True))
    normals = np.zeros_like(points)
    np.add.at(normals, faces.ravel(), np.repeat(flat, 3, axis=0))
    rows = normals.reshape(rings + 1, segments + 1, 3)
    rows[:, 0] += rows[:, -1]
    rows[:, -1] = rows[:, 0]
    rows[[0, -1]] = rows[[0, -1]].sum(axis=1, keepdims=True)
    kept = faces[np.linalg.norm(flat, axis=1) > 1e-12]
    tint = colour(out) if callable(colour) else colour
    uv = np.stack(np.broadcast_arrays(3 * around / pi, 3 * up / pi), axis=-1).reshape(-1, 2)
    mesh.triangles(material, points + at, normals, uv, tint, kept)


def _blend(one: Colour, other: Colour, share: Points) -> Points:
    """(V, 3) mixtures of two colours by shares (V,)."""
    kept = np.clip(share, 0.0, 1.0)[:, None]
    return np.asarray(one) * (1 - kept) + np.asarray(other) * kept


def _lumps(appearance: Appearance, amount: float, pitch: float) -> Callable[[Points], Points]:
    """An uneven surface."""
    random = appearance.random()
    waves, phase = random.normal(size=(4, 3)) * pitch, random.uniform(0, 2 * pi, 4)
    return lambda out: np.asarray(1 + amount * np.sin(out @ waves.T + phase).mean(axis=1) * 2)


# -- whole ---------------------------------------------------------------------------------------


@shape("Apple")
def apple(appearance: Appearance) -> Mesh:
    """An apple: widest above its middle, dented at the stalk, with a leaf."""
    w, h, d = appearance.size
    mesh, red = (
        Mesh(),
        mixed(_RED, _GREEN, float(appearance.random().choice([0.0, 0.0, 0.15, 0.9]))),
    )
    body = (
        (0.06, 0.03), (0.18, 0.0), (0.34, 0.07), (0.46, 0.28), (0.50, 0.52), (0.46, 0.72),
        (0.33, 0.84),
    )  # fmt: skip
    blush, sides = mixed(red, _BLUSH, 0.7), 14
    fade = np.repeat([red, blush], sides + 1, axis=0)
    crown = ((0.33, 0.84), (0.20, 0.85))
    for outline, colour in ((body, red), (crown, fade), (((0.20, 0.85), (0.0, 0.72)), blush)):
        line = [(r * w, y * h) for r, y in outline]
        mesh.lathe(line, colour, squash=(1.0, d / w), segments=sides)
    thick = 0.035 * w
    mesh.tube([(0, 0.72 * h, 0), (0.06 * w, h - thick, 0)], thick, _STALK, segments=5)
    leaf = [(0.03, 0.93, 0), (0.18, 0.90, 0.12), (0.42, 0.94, 0.06), (0.24, 0.99, -0.08)]
    mesh.quad([(x * w, y * h, z * d) for x, y, z in leaf], _LEAF, both=True)
    return mesh


@shape("Tomato")
def tomato(appearance: Appearance) -> Mesh:
    """A tomato: flat and ribbed, orange red, with a green star on top."""
    w, h, d = appearance.size
    mesh = Mesh()

    def ribs(out: Points) -> Points:
        angle = np.arctan2(out[:, 2], out[:, 0])
        dent = 0.16 * np.clip(out[:, 1] - 0.85, 0.0, None) / 0.15
        return np.asarray(1 + 0.035 * np.cos(5 * angle) * np.abs(out[:, 1]) - dent)

    _blob(mesh, (w, 0.95 * h, d), _TOMATO, bump=ribs, power=0.9, segments=15, rings=7)
    for k in range(5):
        a, wide = 2 * pi * k / 5, 0.5
        star = [(0.0, 0.95, 0.0), (0.17, 0.99, -wide), (0.44, 0.90, 0.0), (0.17, 0.99, wide)]
        corners = [(r * w * cos(a + t), y * h, r * d * sin(a + t)) for r, y, t in star]
        mesh.quad(corners, _CALYX, both=True)
    mesh.tube([(0, 0.85 * h, 0), (0.02 * w, h - 0.03 * w, 0)], 0.03 * w, _CALYX, segments=5)
    return mesh


@shape("Potato")
def potato(appearance: Appearance) -> Mesh:
    """A potato: lumpy, long and brown with dark eyes; cooked: browned and cut open across."""
    mesh, random = Mesh(), appearance.random()
    skin = mixed(_SKIN, (0.76, 0.60, 0.36), float(random.random()))
    skin = mixed(skin, _BROWNED, 0.55) if appearance.cooked else skin
    eyes = random.normal(size=(14, 3))
    eyes /= np.linalg.norm(eyes, axis=1, keepdims=True)

    def tint(out: Points) -> ArrayLike:
        return _blend(skin, _EYE, 14 * ((out @ eyes.T).max(axis=1) - 0.93))

    _blob(mesh, appearance.size, tint, bump=_lumps(appearance, 0.10, 2.2), power=0.9, rings=9)
    if appearance.cooked:
        w, h, d = appearance.size
        for wide, long in ((0.14 * w, 0.5 * d), (0.5 * w, 0.12 * d)):
            mesh.rounded((0, 0.93 * h, 0), (wide, 0.18 * h, long), _STARCH, 0.05 * h)
    return mesh


@shape("Bread")
def bread(appearance: Appearance) -> Mesh:
    """A loaf: rounded, dark on top with three pale scores, lighter at its sides."""
    length, h, breadth = max(appearance.size[::2]), appearance.size[1], min(appearance.size[::2])
    mesh = Mesh()
    crust = mixed(_CRUST, _TOP, 0.4 * float(appearance.random().random()))

    def bake(out: Points) -> ArrayLike:
        return _blend(crust, mixed(crust, _TOP, 0.9), 1.5 * out[:, 1] + 0.2)

    lower = (0.97 * length, 0.7 * h, 0.88 * breadth)
    _blob(mesh, lower, mixed(crust, _CRUMB, 0.3), power=0.3, rings=5)
    _blob(mesh, (length, 0.76 * h, breadth), bake, "crust", power=0.6, segments=16, rings=6,
          at=(0.0, 0.22 * h, 0.0))  # fmt: skip
    for x in (-0.25, 0.0, 0.25):
        path = [(0.06, 0.93, -0.28), (0.02, 0.985, -0.10), (-0.02, 0.985, 0.10)]
        points = [
            ((x + u) * length, (v - 0.03) * h, t * breadth)
            for u, v, t in [*path, (-0.06, 0.93, 0.28)]
        ]
        mesh.tube(points, 0.045 * h + 0.004, _CRUMB, segments=5)
    return lengthwise(appearance, mesh)


@shape("Lettuce")
def lettuce(appearance: Appearance) -> Mesh:
    """A head of ruffled leaves, pale within and below, dark at the edges."""
    w, h, d = appearance.size
    mesh = Mesh()

    def leaves(out: Points) -> ArrayLike:
        return _blend(_PALE, _FRESH, 0.6 + 0.5 * np.sin(9 * np.arctan2(out[:, 2], out[:, 0])))

    _blob(mesh, (0.84 * w, 0.97 * h, 0.84 * d), leaves, bump=_lumps(appearance, 0.10, 4.0),
          segments=14, rings=7, at=(0.0, 0.03 * h, 0.0))  # fmt: skip
    for k in range(6):
        _outer_leaf(mesh, appearance.size, 2 * pi * k / 6, 0.12 if k % 2 else 0.0)
    return mesh


def _outer_leaf(mesh: Mesh, size: tuple[float, float, float], angle: float, lift: float) -> None:
    """A leaf on the head of lettuce with a wavy edge that stands off."""
    w, h, d = size
    rows = ((0.0, 0.14, 0.3), (0.28, 0.42, 0.56), (0.52, 0.45, 0.66), (0.72, 0.47, 0.55))
    points, colours = [], []
    for k, (y, reach, half) in enumerate(rows):
        for j, side in enumerate((-1.0, -0.5, 0.0, 0.5, 1.0)):
            ruffle = (0.03 if (j + k) % 2 else -0.02) * max(k / 3, abs(side))
            r, a = reach + ruffle - 0.3 * lift, angle + side * half
            rise = y - (0.10 * abs(side) if k == 3 else 0.0) + lift
            points.append((r * w * cos(a), rise * h, r * d * sin(a)))
            edge = max(k / 3, abs(side)) ** 2
            colours.append(mixed(_PALE if side == 0.0 else _FRESH, _DARK, 0.8 * edge))
    faces = [
        triple
        for k in range(3)
        for j in range(4)
        for a in [5 * k + j]
        for triple in ((a, a + 1, a + 6), (a, a + 6, a + 5))
    ]
    out = np.array(points) - (0.0, 0.3 * h, 0.0)
    for sign in (1.0, -1.0):
        mesh.triangles("plain", points, sign * out, np.zeros((20, 2)), colours, faces)


@shape("Egg")
def egg(appearance: Appearance) -> Mesh:
    """An egg: smooth and pale, one end narrower."""
    w, h, _ = appearance.size
    if appearance.broken:
        return egg_cracked(appearance)
    mesh, shell = Mesh(), appearance.pick(*_SHELLS)
    long = max(appearance.size)

    def taper(out: Points) -> Points:
        along = out[:, 0] if w == long else out[:, 1] if h == long else out[:, 2]
        return np.asarray(1 - 0.16 * along + 0.04 * along**2)

    _blob(mesh, appearance.size, shell, bump=taper, rings=8)
    return mesh


# -- sliced --------------------------------------------------------------------------------------


def _slab(appearance: Appearance) -> tuple[float, float, float]:
    """Breadth, height and thickness of a slice, with a gap to the next one."""
    w, h, d = appearance.size
    return max(w, d), h, 0.8 * min(w, d)


def _round_slice(mesh: Mesh, appearance: Appearance, skin: Colour, flesh: Colour) -> None:
    """An upright disc, cut surfaces to the front and the back."""
    breadth, h, thick = _slab(appearance)
    cut, rim, t = 0.86, 0.2 * thick, thick / 2
    at, squash, r = (0.0, h / 2, 0.0), (1.0, h / breadth), breadth / 2
    for profile, colour in (
        ([(0, -t), (cut, -t)], flesh),
        ([(cut, -t), (1, -rim)], mixed(flesh, skin, 0.35)),
        ([(1, -rim), (1, rim)], skin),
        ([(1, rim), (cut, t)], mixed(flesh, skin, 0.35)),
        ([(cut, t), (0, t)], flesh),
    ):
        line = [(share * r, z) for share, z in profile]
        mesh.lathe(line, colour, at=at, axis="z", squash=squash, segments=14)


def _dots(
    mesh: Mesh,
    appearance: Appearance,
    spots: list[tuple[float, float]],
    size: tuple[float, float],
    colour: Colour,
    off: float = 0.05,
) -> None:
    """Ovals on both cut surfaces, (x, y) and (width, height) as shares of the slice.

    ``off`` is their distance from the surface, as a share of the slice's thickness.
    """
    breadth, h, thick = _slab(appearance)
    for x, y in spots:
        angle = np.linspace(0, 2 * pi, 7)[:-1] + 0.2
        outline = [
            ((x + size[0] / 2 * cos(a)) * breadth, (0.5 + y + size[1] / 2 * sin(a)) * h)
            for a in angle
        ]
        mesh.prism(outline, -(0.5 + off) * thick, (0.5 + off) * thick, colour, axis="z")


@shape("AppleSliced")
def apple_slice(appearance: Appearance) -> Mesh:
    """A pale disc with a red rim, a core and dark pips."""
    mesh = Mesh()
    _round_slice(mesh, appearance, _RED, _FLESH)
    _dots(mesh, appearance, [(0.0, 0.0)], (0.30, 0.42), shaded(_FLESH, 0.86))
    pips = [(0.07, 0.09), (-0.07, -0.09), (-0.07, 0.09), (0.07, -0.09)]
    _dots(mesh, appearance, pips, (0.10, 0.15), _PIP, off=0.11)
    return lengthwise(appearance, mesh)


@shape("TomatoSliced")
def tomato_slice(appearance: Appearance) -> Mesh:
    """A red disc with chambers of yellow seeds."""
    mesh = Mesh()
    _round_slice(mesh, appearance, _TOMATO, mixed(_TOMATO, _WHITE, 0.12))
    spots = [(0.26 * cos(a), 0.26 * sin(a)) for a in (0.5, 1.75, 3.0, 4.25, 5.5)]
    _dots(mesh, appearance, spots, (0.20, 0.20), _SEEDS)
    return lengthwise(appearance, mesh)


@shape("PotatoSliced")
def potato_slice(appearance: Appearance) -> Mesh:
    """A plain yellowish disc with a thin brown rim; cooked: fried brown."""
    mesh = Mesh()
    skin = mixed(_SKIN, _BROWNED, 0.6 if appearance.cooked else 0.0)
    flesh = mixed(_STARCH, (0.70, 0.38, 0.10), 0.8 if appearance.cooked else 0.0)
    _round_slice(mesh, appearance, skin, flesh)
    if appearance.cooked:
        spots = [(0.2, 0.15), (-0.22, 0.05), (0.02, -0.22)]
        _dots(mesh, appearance, spots, (0.22, 0.18), _BROWNED)
    return lengthwise(appearance, mesh)


@shape("BreadSliced")
def bread_slice(appearance: Appearance) -> Mesh:
    """The outline of a loaf: crumb within a brown crust; cooked: toast."""
    breadth, h, thick = _slab(appearance)
    mesh = Mesh()
    outline = np.array(
        [(-0.44, 0.0), (0.44, 0.0), (0.44, 0.56), (0.5, 0.68), (0.46, 0.86), (0.30, 0.97),
         (0.0, 1.0), (-0.30, 0.97), (-0.46, 0.86), (-0.5, 0.68), (-0.44, 0.56)]
    )  # fmt: skip
    crust = mixed(_CRUST, _BROWNED, 0.75 if appearance.cooked else 0.2)
    crumb = mixed(_CRUMB, (0.62, 0.34, 0.12), 0.85 if appearance.cooked else 0.0)
    size = np.array([breadth, h])
    mesh.prism(outline * size, -0.36 * thick, 0.36 * thick, crust, axis="z")
    inner = (outline - (0.0, 0.5)) * 0.86 + (0.0, 0.5)
    mesh.prism(inner * size, -0.5 * thick, 0.5 * thick, crumb, axis="z")
    if appearance.cooked:
        dark = (outline - (0.0, 0.5)) * 0.55 + (0.0, 0.48)
        mesh.prism(
            dark * size, -0.5 * thick - 0.003, 0.5 * thick + 0.003, shaded(crumb, 0.6), axis="z"
        )
    return lengthwise(appearance, mesh)


@shape("LettuceSliced")
def lettuce_slice(appearance: Appearance) -> Mesh:
    """A ragged sheet of leaf: a pale rib, green, dark wavy edges."""
    breadth, h, thick = _slab(appearance)
    mesh, count = Mesh(), 14
    points, colours = [(0.0, 0.12 * h, 0.0)], [_PALE]
    for radius, wave, colour in ((0.5, 0.25, _FRESH), (1.0, 0.5, _DARK)):
        for k in range(count):
            a = 2 * pi * k / count
            r = radius * (1.0 if radius < 1 or k % 2 else 0.82)
            x, y = 0.5 * r * breadth * cos(a), 0.5 * h * (1 + r * sin(a))
            points.append((x, y, wave * thick * (-1) ** k))
            colours.append(_PALE if radius < 1 and abs(a - 1.5 * pi) < 0.7 else colour)
    faces = []
    for k in range(count):
        a, b = 1 + k, 1 + (k + 1) % count
        faces += [(0, a, b), (a, a + count, b), (b, a + count, b + count)]
    for sign in (1.0, -1.0):
        normals = [(0.3 * sign * x / breadth, 0.3, sign) for x, _, _ in points]
        mesh.triangles("plain", points, normals, np.zeros((len(points), 2)), colours, faces)
    mesh.tube([(0, 0.03 * h, 0), (0, 0.72 * h, 0)], min(0.006, 0.25 * thick), _PALE, segments=5)
    return lengthwise(appearance, mesh)


@shape("EggCracked")
def egg_cracked(appearance: Appearance) -> Mesh:
    """A yolk in its white, and half a shell beside it; cooked: fried, brown at the edges."""
    w, h, d = appearance.size
    mesh, shell = Mesh(), appearance.pick(*_SHELLS)
    edge = mixed(_WHITE, (0.55, 0.30, 0.10), 0.85) if appearance.cooked else shaded(_WHITE, 0.9)
    count, thick = 12, 0.004
    wavy = [(0.5 if k % 3 else 0.42, 2 * pi * k / count) for k in range(count)]
    for share, high, colour in ((1.0, thick, edge), (0.84, 2 * thick, _WHITE)):
        outline = [(share * r * w * cos(a), share * r * d * sin(a)) for r, a in wavy]
        mesh.prism(outline, 0.0, high, colour)
    yolk = mixed(_YOLK, (0.95, 0.55, 0.10), 0.6 if appearance.cooked else 0.0)
    size = (0.46 * w, 0.28 * h, 0.46 * d)
    _blob(mesh, size, yolk, rings=6, at=(0.1 * w, thick, 0.06 * d))
    if not appearance.cooked:
        half, r = Mesh(), 0.2 * min(w, d)
        profile = [(0, 0), (0.7, 0.25), (1, 0.8), (0.94, 0.8), (0.6, 0.3), (0, 0.12)]
        half.lathe([(a * r, b * 1.3 * r) for a, b in profile], shell, segments=8)
        mesh.add(half, turn=("z", 35.0), at=(-0.24 * w, 0.3 * r + thick, -0.2 * d))
    return mesh
