"""Towels, cloths, curtains and blinds."""

from __future__ import annotations

from math import pi

import numpy as np

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.render.shapes.hangings import across, turned
from er_gym.sim.render.shapes.registry import shape

_TOWELS = ((0.72, 0.24, 0.26), (0.22, 0.42, 0.62), (0.30, 0.55, 0.45), (0.85, 0.62, 0.30))
_HAND_TOWELS = ((0.96, 0.93, 0.86), (0.93, 0.80, 0.55), (0.70, 0.85, 0.88), (0.95, 0.78, 0.80))
_CLOTHS = ((0.36, 0.60, 0.82), (0.86, 0.50, 0.45), (0.50, 0.72, 0.45), (0.92, 0.82, 0.40))
_DRAPES = ((0.62, 0.28, 0.26), (0.42, 0.48, 0.56), (0.82, 0.74, 0.60), (0.36, 0.50, 0.42))
_SHOWER = ((0.70, 0.86, 0.90), (0.93, 0.90, 0.82), (0.86, 0.76, 0.84))
_CREAM, _CHROME, _CORD = (0.93, 0.91, 0.85), (0.88, 0.90, 0.94), (0.55, 0.52, 0.46)
_STAIN, _WHITE = (0.36, 0.25, 0.14), (0.96, 0.96, 0.95)
_LET_DOWN, _DRAWN = 6.0, 4.0
"""Length of lowered blinds and closed shower curtains, in multiples of the gathered length."""
_SLAT = 0.05


def _hanging(
    mesh: Mesh, w: float, h: float, d: float, colour: Colour, bands: tuple[float, ...], tint: Colour
) -> None:
    """A cloth over a bar: the front half is longer, with bands at heights (shares) of the front."""
    fold = min(0.9 * d, 0.06)
    for low, z, shade in ((0.12 * h, 0.0, 1.0), (0.0, -0.5 * fold, 0.78)):
        tall = h - 0.5 * fold - low
        at = (0, low + tall / 2, z + 0.25 * fold)
        mesh.box(
            at, (w, tall, 0.45 * fold), shaded(colour, shade), "carpet", faces="xXyzZ", turns=0.2
        )
    rows = np.linspace(0, pi, 6)
    ring = [[(x, h - fold / 2 + fold / 2 * np.sin(a), 0.5 * d * np.cos(a)) for a in rows]
            for x in (-w / 2, w / 2)]  # fmt: skip
    mesh.skin(ring, colour, "carpet", closed=False, both=True, turns=(0.3, 1.0))
    for side in (-1, 1):  # the ends of the fold
        end = [(side * w / 2, y, z) for _, y, z in ring[0]]
        out = [(side, 0, 0)] * len(end)
        fan = [(0, k, k + 1) for k in range(1, len(end) - 1)]
        mesh.triangles("plain", end, out, [(0, 0)] * len(end), shaded(colour, 0.7), fan)
    for share in bands:
        at = (0, 0.12 * h + share * 0.88 * h, 0.48 * fold)
        mesh.box(at, (w * 1.004, 0.035 * h, 0.012), tint, faces="xXyYZ")


@shape("Towel")
def towel(appearance: Appearance) -> Mesh:
    """A wide thick cloth folded over a bar, with stripes at its hem."""
    w, h, d, along_z = across(appearance)
    mesh, colour = Mesh(), appearance.pick(*_TOWELS)
    if h < 0.5 * min(w, max(d, 0.1)):
        return _folded(appearance, colour)
    _hanging(mesh, w, h, d, colour, (0.10, 0.17, 0.24), mixed(colour, _WHITE, 0.7))
    return turned(mesh, along_z)


@shape("HandTowel")
def hand_towel(appearance: Appearance) -> Mesh:
    """A narrow cloth pinched at its top, wider and in folds below, with one coloured hem."""
    w, h, d, along_z = across(appearance)
    mesh, colour = Mesh(), appearance.pick(*_HAND_TOWELS)
    tint = shaded(mixed(colour, appearance.palette.accent, 0.75), 0.9)
    if h < 0.5 * min(w, max(d, 0.05)):
        return _folded(appearance, colour)
    rings = []
    tints = []
    for y, wide, deep in ((0, 1.0, 0.7), (0.1, 1.0, 0.7), (0.101, 1.0, 0.7), (0.2, 0.98, 0.7),
                          (0.201, 0.98, 0.7), (0.7, 0.78, 0.9), (0.9, 0.45, 0.95),
                          (1.0, 0.5, 0.8)):  # fmt: skip
        angle = np.arange(24) / 24 * 2 * pi
        wave = 1 + 0.32 * np.cos(6 * angle) * (np.abs(np.sin(angle)) > 0.3)
        x, z = np.cos(angle) * wide * w / 2, np.sin(angle) * wave * deep * 0.38 * d
        rings.append(np.stack([x, np.full_like(x, y * h), z], axis=1))
        tints.append(np.broadcast_to(tint if 0.101 <= y <= 0.2 else colour, (24, 3)) * (
            0.86 + 0.14 * wave[:, None]))  # fmt: skip
    mesh.skin(rings, np.array(tints), closed=True)
    mesh.skin([rings[-1], rings[-1] * (0.01, 1.0, 0.01)], shaded(colour, 0.8))
    return turned(mesh, along_z)


def _folded(appearance: Appearance, colour: Colour) -> Mesh:
    """A cloth that lies folded in layers."""
    w, h, d = appearance.size
    mesh = Mesh()
    for k in range(2):
        at = (0, h * (k + 0.5) / 2, 0)
        mesh.rounded(at, (w, 0.49 * h, d), shaded(colour, 0.9 + 0.1 * k), 0.2 * h, "carpet")
    return mesh


@shape("TowelHolder")
def towel_holder(appearance: Appearance) -> Mesh:
    """A long bar held off the wall by two posts."""
    w, h, d = appearance.size
    mesh, metal = Mesh(), mixed(_CHROME, appearance.palette.metal, 0.4)
    r = min(0.016, 0.4 * h)
    y, front = h / 2, d / 2 - 1.2 * r
    mesh.tube([(-w / 2, y, front), (w / 2, y, front)], r, metal, segments=8)
    for side in (-1, 1):
        x = side * (w / 2 - 0.03)
        mesh.tube([(x, y, -d / 2), (x, y, front)], 0.8 * r, shaded(metal, 0.85), segments=7)
        mesh.cylinder((x, y, -d / 2 + 0.008), 0.5 * h, 0.016, shaded(metal, 0.8), axis="z")
        mesh.ball((side * (w / 2 - 0.01), y, front), (0.02, h, h), metal, segments=8, rings=5)
    return mesh


@shape("HandTowelHolder")
def hand_towel_holder(appearance: Appearance) -> Mesh:
    """A ring that hangs from a round plate."""
    w, h, d = appearance.size
    mesh, metal = Mesh(), mixed(_CHROME, appearance.palette.metal, 0.4)
    thick = min(0.011, 0.3 * d)
    r = min(w, 0.85 * h) / 2 - thick
    top = h - 0.035
    mesh.cylinder((0, top, -d / 2 + 0.01), 0.034, 0.02, shaded(metal, 0.85), axis="z")
    mesh.tube([(0, top, -d / 2), (0, top, 0.2 * d)], 0.014, metal, segments=8)
    middle = thick + r
    stretch = (top - thick) / (2 * r)
    angle = np.linspace(0, 2 * pi, 15)
    ring = [
        (r * np.sin(a), thick + stretch * (middle - thick - r * np.cos(a)), 0.15 * d) for a in angle
    ]
    mesh.tube(ring, thick, metal, segments=5)
    return mesh


@shape("Cloth")
def cloth(appearance: Appearance) -> Mesh:
    """A crumpled rag of one colour, lying about; stained when dirty."""
    w, h, d = appearance.size
    mesh, random = Mesh(), appearance.random()
    colour = _CLOTHS[int(random.integers(len(_CLOTHS)))]
    n = 9
    u = np.linspace(-0.5, 0.5, n)
    x, z = np.meshgrid(u, u)
    phase = 2 * pi * random.random(4)
    bump = np.sin(9 * x + 5 * z + phase[0]) + np.sin(11 * z - 4 * x + phase[1])
    bump += 0.8 * np.sin(17 * x + phase[2]) * np.sin(15 * z + phase[3])
    bump = (bump - bump.min()) / np.ptp(bump)
    edge = np.maximum(np.abs(x), np.abs(z)) * 2
    y = np.where(edge > 0.99, 0.0, 0.15 + 0.85 * bump * np.where(edge > 0.7, 0.55, 1.0))
    shift = (random.random((n, n, 2)) - 0.5) * 0.5 / n
    points = np.stack([(x + shift[..., 0]) * w, y * h / y.max(), (z + shift[..., 1]) * d], axis=2)
    points = np.clip(points, (-w / 2, 0, -d / 2), (w / 2, h, d / 2))
    tint = np.array(colour) * (0.6 + 0.4 * bump[..., None])
    band = (np.abs(np.abs(x) - 0.375) < 0.01) | (np.abs(np.abs(z) - 0.375) < 0.01)
    tint = np.where(band[..., None], 0.5 * tint + 0.4 * np.array(_WHITE), tint)
    if appearance.dirty:
        blot = np.hypot(x + 0.1, z - 0.08) < 0.24
        blot |= np.hypot(x - 0.26, z + 0.25) < 0.17
        tint = np.where(blot[..., None], _STAIN, tint * (0.72, 0.66, 0.56))
    mesh.skin(points, tint, closed=False)
    return mesh


def _folds(
    mesh: Mesh,
    x: tuple[float, float],
    y: tuple[float, float],
    deep: float,
    folds: int,
    colours: tuple[Colour, Colour],
    flare: float = 1.0,
) -> None:
    """A curtain from low to high x and y, in folds that are darker where they go in.

    ``colours`` are those of the cloth and of a band at its hem. ``flare`` is its width half way up.
    """
    steps = 4 * folds + 1
    t = np.linspace(0, 1, steps)
    wave = np.cos(t * folds * 2 * pi)
    middle = (x[0] + x[1]) / 2
    rows, tints = [], []
    tall = y[1] - y[0]
    hem = min(0.08 * tall, 0.15)
    for height, colour, wide in ((0, 1, 1.0), (hem, 1, 1.0), (hem + 1e-4, 0, 1.0),
                                 (0.45 * tall, 0, flare), (tall, 0, 1.0)):  # fmt: skip
        across_ = middle + (x[0] + t * (x[1] - x[0]) - middle) * wide
        rows.append(np.stack([across_, np.full(steps, y[0] + height), wave * deep / 2], axis=1))
        tints.append(np.array(colours[colour]) * (0.78 + 0.22 * wave)[:, None])
    mesh.skin(rows, np.array(tints), closed=False, both=True)


@shape("Curtains")
def curtains(appearance: Appearance) -> Mesh:
    """Folded cloth on a rod with knobs: one piece at each side if it is wide."""
    w, h, d, along_z = across(appearance)
    mesh, rod = Mesh(), shaded(appearance.palette.wood, 0.7)
    colour = mixed(appearance.pick(*_DRAPES), appearance.palette.fabric, 0.35)
    colours = colour, shaded(mixed(colour, _WHITE, 0.35), 0.9)
    r = min(0.022, 0.25 * d)
    if w > 1.4 and h > 0.8:
        side = min(0.26 * w, 0.75)
        for x in ((-w / 2, -w / 2 + side), (w / 2 - side, w / 2)):
            _folds(mesh, x, (0, h - 2.2 * r), 0.7 * d, 5, colours, 0.72)
            at = (sum(x) / 2, 0.45 * h, 0)  # the band that holds it
            mesh.box(at, (0.74 * side, 0.06, 0.8 * d), colours[1])
    else:
        _folds(
            mesh,
            (-w / 2, w / 2),
            (0, h - 2.2 * r),
            0.7 * d,
            min(14, max(4, int(w / 0.16))),
            colours,
        )
    mesh.tube([(-w / 2, h - r, 0), (w / 2, h - r, 0)], r, rod, segments=7)
    for end in (-1, 1):
        at = (end * (w / 2 - 1.3 * r), h - 1.4 * r, 0)
        mesh.ball(at, (2.6 * r, 2.8 * r, 2.6 * r), rod, segments=8, rings=5)
    return turned(mesh, along_z)


@shape("ShowerCurtain")
def shower_curtain(appearance: Appearance) -> Mesh:
    """A pale curtain on rings: gathered as recorded, drawn along the tub when open."""
    w, h, d = appearance.size
    along_z = not appearance.asset  # in the direction of their tubs
    w, d = (d, w) if along_z else (w, d)
    mesh, colour = Mesh(), appearance.pick(*_SHOWER)
    right = -w / 2 + w * (1 + (_DRAWN - 1) * appearance.openness)
    ring, folds = 0.06, 7
    deep = d * (0.9 - 0.6 * appearance.openness)
    colours = colour, shaded(mixed(colour, appearance.palette.accent, 0.6), 0.95)
    _folds(mesh, (-w / 2, right), (0, h - ring), deep, folds, colours)
    mesh.tube(
        [(-w / 2, h - 0.014, 0), (max(right, w / 2), h - 0.014, 0)], 0.014, _CHROME, segments=7
    )
    for k in range(folds):
        x = -w / 2 + (right + w / 2) * (k + 0.5) / folds
        mesh.box((x, h - ring / 2, 0), (0.012, ring, 0.045), shaded(_CHROME, 0.8))
    found = Mesh()
    found.add(mesh, turn=("y", -90) if along_z else None)
    return found


@shape("Blinds")
def blinds(appearance: Appearance) -> Mesh:
    """Slats under a rail: gathered at the top as recorded, lowered over the window when open."""
    w, h, d, along_z = across(appearance)
    mesh, colour = (
        Mesh(),
        appearance.pick(_CREAM, mixed(appearance.palette.wood, _CREAM, 0.35), _WHITE),
    )
    short = h < 0.45
    rest = h if short else 0.2
    drop = rest + appearance.openness * ((_LET_DOWN - 1) * h if short else h - rest)
    rail = min(0.05, 0.3 * rest)
    mesh.box((0, h - rail / 2, 0), (w, rail, d), shaded(colour, 0.9))
    slats = max(8, min(28, round(_LET_DOWN * rest / _SLAT)))
    step = (drop - 2 * rail) / slats
    tilt = min(0.8 * step, 0.035)
    for k in range(slats):
        y = h - rail - step * (k + 0.5)
        tint = shaded(colour, 1.0 if k % 2 else 0.84)
        low, high = y - tilt / 2, y + tilt / 2
        mesh.quad([(-w / 2, low, 0.45 * d), (w / 2, low, 0.45 * d),
                   (w / 2, high, -0.3 * d), (-w / 2, high, -0.3 * d)], tint, both=True)  # fmt: skip
    mesh.box((0, h - drop + rail / 2, 0), (w, rail, 0.8 * d), shaded(colour, 0.75))
    for x in (-0.36 * w, 0.36 * w):
        mesh.box((x, h - drop / 2, 0.47 * d), (0.014, drop - rail, 0.004), _CORD, faces="xXZ")
    x = 0.46 * w
    mesh.tube([(x, h - rail, 0.5 * d), (x, h - drop, 0.5 * d)], 0.004, _CORD, segments=4)
    return turned(mesh, along_z)
