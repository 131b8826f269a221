"""Vases, statues, plants and other ornaments."""

from __future__ import annotations

from collections.abc import Sequence
from math import cos, pi, sin

import numpy as np

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour, Triple
from er_gym.sim.render.shapes.registry import shape
from er_gym.sim.render.shapes.statues import STATUES, base

_GLAZES: tuple[Colour, ...] = (
    (0.20, 0.45, 0.62), (0.80, 0.50, 0.30), (0.88, 0.87, 0.82), (0.32, 0.55, 0.45),
    (0.70, 0.22, 0.24), (0.90, 0.70, 0.28),
)  # fmt: skip
_STONES: tuple[Colour, ...] = (
    (0.62, 0.60, 0.56), (0.48, 0.34, 0.20), (0.42, 0.44, 0.47), (0.80, 0.77, 0.70),
    (0.66, 0.52, 0.26),
)  # fmt: skip
_POTS: tuple[Colour, ...] = (
    (0.74, 0.40, 0.25), (0.90, 0.89, 0.86), (0.30, 0.32, 0.35), (0.35, 0.50, 0.58),
)  # fmt: skip
_GREENS: tuple[Colour, ...] = ((0.34, 0.70, 0.26), (0.46, 0.76, 0.30), (0.24, 0.62, 0.34))
_DRY_SOIL, _WET_SOIL, _INSIDE = (0.50, 0.36, 0.24), (0.16, 0.09, 0.05), (0.10, 0.09, 0.09)
_WATER, _TWIG, _BRASS = (0.35, 0.60, 0.85), (0.42, 0.29, 0.18), (0.80, 0.64, 0.30)

Outline = Sequence[tuple[float, float]]


# -- vases ---------------------------------------------------------------------------------------

_VASES: dict[str, Outline] = {
    "Flat": (
        (0.0, 0.0), (0.26, 0.0), (0.44, 0.22), (0.50, 0.42), (0.42, 0.62), (0.18, 0.78),
        (0.14, 0.88), (0.20, 1.0),
    ),
    "Medium": (
        (0.0, 0.0), (0.24, 0.0), (0.42, 0.18), (0.50, 0.42), (0.40, 0.66), (0.22, 0.78),
        (0.19, 0.88), (0.30, 1.0),
    ),
    "Open": (
        (0.0, 0.0), (0.26, 0.0), (0.17, 0.06), (0.26, 0.18), (0.34, 0.34), (0.33, 0.48),
        (0.24, 0.70), (0.27, 0.88), (0.50, 1.0),
    ),
    "Tall": (
        (0.0, 0.0), (0.24, 0.0), (0.20, 0.05), (0.30, 0.25), (0.46, 0.52), (0.50, 0.64),
        (0.38, 0.78), (0.18, 0.86), (0.18, 0.92), (0.30, 1.0),
    ),
    "Decorative": (
        (0.0, 0.0), (0.34, 0.0), (0.20, 0.08), (0.26, 0.16), (0.50, 0.40), (0.44, 0.56),
        (0.22, 0.68), (0.20, 0.82), (0.36, 1.0),
    ),
}  # fmt: skip
"""Outlines (radius, height) as shares of width and height, by the second word of the asset id."""


@shape("Vase")
def vase(appearance: Appearance) -> Mesh:
    """A swelling body with a painted band, a narrow neck and a flared dark mouth."""
    w, h, d = appearance.size
    glaze = appearance.pick(*_GLAZES)
    if appearance.broken:
        return _shards(appearance.size, glaze)
    kind = next((name for name in _VASES if f"_{name}_" in appearance.asset), "Tall")
    line, mesh, squash = [(r * w, y * h) for r, y in _VASES[kind]], Mesh(), (1.0, d / w)
    band = max(range(len(line)), key=lambda k: line[k][0] if 0.2 * h < line[k][1] < 0.75 * h else 0)
    pale = mixed(glaze, (0.97, 0.95, 0.88), 0.75) if sum(glaze) < 2.4 else (0.25, 0.40, 0.62)
    for part, colour in (
        (line[: band + 1], glaze), (line[band : band + 2], pale), (line[band + 1 :], glaze),
    ):  # fmt: skip
        mesh.lathe(part, colour, segments=14, squash=squash)
    mouth, inside = line[-1][0], 0.86 * line[-1][0]
    mesh.lathe([(mouth, h), (inside, h)], pale, segments=14, squash=squash)
    mesh.lathe([(inside, h), (0.6 * inside, 0.86 * h), (0, 0.86 * h)], _INSIDE, squash=squash)
    if kind == "Decorative":
        for side in (-1, 1):
            ear = [(0.21, 0.86), (0.40, 0.82), (0.44, 0.70), (0.36, 0.54)]
            mesh.tube([(side * x * w, y * h, 0) for x, y in ear], 0.035 * w, pale, segments=5)
    return mesh


def _shards(size: Triple, colour: Colour) -> Mesh:
    """A broken vase: a jagged bottom with pieces around it."""
    w, h, d = size
    mesh, random, count = Mesh(), np.random.default_rng(5), 10
    turn = np.arange(count + 1) / count * 2 * pi
    tips = (
        np.where(np.arange(count + 1) % 2, 0.12, 0.30) * h * (0.8 + 0.4 * random.random(count + 1))
    )
    tips[-1] = tips[0]
    low = np.stack([0.24 * w * np.cos(turn), 0 * turn, 0.24 * d * np.sin(turn)], axis=1)
    high = low * (1.35, 1, 1.35) + np.stack([0 * turn, tips, 0 * turn], axis=1)
    for k in range(count):
        corners = [low[k], low[k + 1], high[k + 1], high[k]]
        mesh.quad(corners, colour, both=True)
    for k in range(11):
        angle, away = 2.4 * k + random.random(), 0.30 + 0.16 * random.random()
        middle = np.array([away * w * cos(angle), 0.004, away * d * sin(angle)])
        long = min(w, d) * (0.10 + 0.08 * random.random())
        out = np.array([cos(angle + k), 0.0, sin(angle + k)])
        side = np.array([-out[2], 0.0, out[0]])
        tip = middle + 0.8 * long * out + (0, 0.05 * h * (k % 3), 0)
        base = middle - 0.5 * long * out
        corners = [base - 0.5 * long * side, base + 0.6 * long * side, tip, tip]
        mesh.quad(corners, mixed(colour, (1, 1, 1), 0.3 * (k % 2)), both=True)
    return mesh


# -- statues -------------------------------------------------------------------------------------


@shape("Statue")
def statue(appearance: Appearance) -> Mesh:
    """A carved figure of one colour on a dark base: a dog, a hand, a person or a head of stone."""
    stone = appearance.pick(*_STONES)
    if appearance.broken:
        return _rubble(appearance.size, stone)
    return STATUES.get(appearance.asset.split("_")[0], STATUES["Towel"])(appearance.size, stone)


def _rubble(size: Triple, stone: Colour) -> Mesh:
    """A broken statue: its base and chunks of the figure."""
    w, h, d = size
    mesh, random = Mesh(), np.random.default_rng(9)
    base(mesh, size, 0.4)
    for k in range(9):
        angle, side = 2.4 * k, min(w, d, h) * (0.16 + 0.16 * random.random())
        chunk = Mesh()
        chunk.box((0, 0, 0), (side, 0.8 * side, 1.1 * side), stone, taper=0.5)
        at = (0.36 * w * cos(angle), 0.4 * side, 0.36 * d * sin(angle))
        tipped = Mesh()
        tipped.add(chunk, turn=("z", 80 * random.random()))
        mesh.add(tipped, at=at, turn=("y", 137.0 * k))
    return mesh


# -- plants --------------------------------------------------------------------------------------


@shape("HousePlant")
def house_plant(appearance: Appearance) -> Mesh:
    """A pot with earth and a plant: a bush, blades, hanging fronds, or a tree."""
    w, h, d = appearance.size
    mesh, random = Mesh(), appearance.random()
    pot, green = _POTS[random.integers(len(_POTS))], _GREENS[random.integers(len(_GREENS))]
    number = appearance.asset.rpartition("_")[2]
    habit = _HABITS[int(number) % len(_HABITS)] if number.isdigit() else _bush
    tall = min(0.36 * h, 0.34)
    r = min(0.32 * min(w, d), 0.16)
    line = [(0, 0), (0.70 * r, 0), (0.95 * r, 0.80 * tall)]
    mesh.lathe(line, pot, segments=12)
    rim = [(1.08 * r, 0.80 * tall), (1.10 * r, tall), (0.92 * r, tall), (0.92 * r, 0.88 * tall)]
    mesh.lathe([(0.95 * r, 0.80 * tall), *rim], shaded(pot, 1.1), segments=12, smooth=False)
    soil = _WET_SOIL if appearance.filled else _DRY_SOIL
    mesh.lathe([(0.93 * r, 0.90 * tall), (0, 0.94 * tall)], soil, segments=12)
    habit(mesh, appearance.size, 0.9 * tall, r, green, random)
    return mesh


def _leaf(
    mesh: Mesh, path: Sequence[np.ndarray], wide: float, colour: Colour, flat: bool = True
) -> None:
    """A leaf along a path: widest in its middle, pointed at its tip."""
    points = np.asarray(path, dtype=np.float64)
    along = points[-1] - points[0]
    side = np.cross(along, (0.0, 1.0, 0.0)) if flat else np.cross(along, (along[2], 0.1, -along[0]))
    side *= wide / 2 / max(float(np.linalg.norm(side)), 1e-9)
    shares = np.sin(np.linspace(0.3, pi, len(points)))
    for k in range(len(points) - 1):
        a, b = points[k], points[k + 1]
        near, far = side * shares[k], side * shares[k + 1]
        tone = shaded(colour, 0.9 + 0.15 * k)
        mesh.quad([a - near, a + near, b + far, b - far], tone, "leaves", both=True)


Random = np.random.Generator


def _bush(mesh: Mesh, size: Triple, foot: float, r: float, green: Colour, random: Random) -> None:
    """Broad leaves to all sides."""
    w, h, d = size
    for k in range(24):
        angle, rise = 2.4 * k, (k + 0.5) / 24
        lean = (1 - rise**2.2) ** 0.5
        root = np.array([0.3 * r * cos(angle), foot, 0.3 * r * sin(angle)])
        reach = 0.92 + 0.08 * random.random()
        tip = np.array([w / 2 * cos(angle) * lean, 0, d / 2 * sin(angle) * lean]) * reach
        tip[1] = foot + (h - foot) * (0.12 + 0.86 * rise)
        bend = root + 0.55 * (tip - root) + (0, 0.10 * (h - foot), 0)
        bend[1] = min(bend[1], 0.97 * h)
        tone = shaded(green, 0.70 + 0.5 * random.random())
        path = [
            root + 0.35 * (bend - root),
            root + 0.75 * (bend - root),
            0.6 * bend + 0.4 * tip,
            tip,
        ]
        _leaf(mesh, path, 0.30 * min(w, d, h), tone)


def _blades(mesh: Mesh, size: Triple, foot: float, r: float, green: Colour, random: Random) -> None:
    """Stiff upright swords with pale edges."""
    w, h, d = size
    for k in range(13):
        angle, out = 2.4 * k, (k / 12) ** 0.7
        root = np.array([0.6 * r * cos(angle) * out, foot, 0.6 * r * sin(angle) * out])
        tip = np.array([0.46 * w * cos(angle) * out, 0, 0.46 * d * sin(angle) * out])
        tip[1] = foot + (h - foot) * (1.0 - 0.45 * out * random.random())
        middle = 0.5 * (root + tip) + (0, 0.04 * h, 0)
        tone = mixed(
            shaded(green, 0.75 + 0.3 * random.random()), (0.75, 0.75, 0.35), 0.25 * (k % 2)
        )
        _leaf(mesh, [root, middle, tip], 0.9 * r * (1 - 0.3 * out), tone, flat=k % 2 == 0)


def _fronds(mesh: Mesh, size: Triple, foot: float, r: float, green: Colour, random: Random) -> None:
    """Long leaves that rise and hang over."""
    w, h, d = size
    for k in range(18):
        angle, inner = 2.4 * k, k % 3
        reach = (1.0, 0.85, 0.5)[inner] * (0.9 + 0.1 * random.random())
        way = np.array([w / 2 * cos(angle), 0, d / 2 * sin(angle)]) * reach
        top = foot + (h - foot) * (0.72, 0.88, 1.0)[inner]
        root = np.array([0.2 * r * cos(angle), foot, 0.2 * r * sin(angle)])
        end = foot + (0.42, 0.62, 0.85)[inner] * (h - foot)
        path = [
            root,
            0.30 * way + np.array([root[0], foot + 0.62 * (top - foot), root[2]]),
            0.68 * way + np.array([0, top, 0]),
            way + np.array([0, end, 0]),
        ]
        tone = shaded(green, 0.75 + 0.45 * random.random())
        _leaf(mesh, path, 0.13 * min(w, d) + 0.02, tone)


def _tree(mesh: Mesh, size: Triple, foot: float, r: float, green: Colour, random: Random) -> None:
    """A slim trunk with a crown."""
    w, h, d = size
    crown = 0.50 * h
    trunk = [(0, foot, 0), (0.05 * w, 0.5 * (foot + h - crown), 0), (0, h - 0.6 * crown, 0)]
    mesh.tube(trunk, 0.14 * r, _TWIG, "bark", segments=6)
    mesh.ball(
        (0, h - 0.5 * crown, 0), (0.7 * w, 0.72 * crown, 0.7 * d), shaded(green, 0.7), "leaves"
    )
    middle = np.array([0, h - 0.5 * crown, 0])
    for k in range(26):
        angle, rise = 2.4 * k, -0.9 + 1.85 * (k + 0.5) / 26
        level = (1 - rise**2) ** 0.5
        out = np.array([w / 2 * level * cos(angle), crown / 2 * rise, d / 2 * level * sin(angle)])
        bend = middle + 0.75 * out + (0, 0.05 * crown, 0)
        path = [middle + 0.5 * out, bend, middle + 0.98 * out]
        _leaf(mesh, path, 0.20 * w, shaded(green, 0.8 + 0.5 * random.random()))


_HABITS = (_bush, _fronds, _tree, _blades)
"""Shapes by the number of the asset id."""


# -- watering cans and other ornaments -------------------------------------------------------------


@shape("WateringCan")
def watering_can(appearance: Appearance) -> Mesh:
    """A round can with a long spout that ends in a rose, and an arched handle."""
    w, h, d = appearance.size
    colour = appearance.pick((0.20, 0.48, 0.32), (0.20, 0.42, 0.62), (0.78, 0.25, 0.20))
    mesh, r, tall, z = Mesh(), 0.44 * w, 0.62 * h, -0.12 * d
    pale = mixed(colour, (1, 1, 1), 0.25)
    mesh.lathe(
        [(0, 0), (r, 0), (0.9 * r, tall), (0.74 * r, tall)], colour, at=(0, 0, z), smooth=False
    )
    mesh.lathe([(1.02 * r, 0.05 * h), (1.01 * r, 0.11 * h)], pale, at=(0, 0, z))
    mesh.lathe([(0.94 * r, tall - 0.05 * h), (0.92 * r, tall)], pale, at=(0, 0, z))
    inside, level = (_WATER, 0.96) if appearance.filled else (_INSIDE, 0.90)
    mesh.lathe([(0.76 * r, level * tall), (0, level * tall)], inside, at=(0, 0, z))
    nose = (0, 0.84 * h, 0.40 * d)
    spout = [(0, 0.22 * h, z + 0.8 * r), (0, 0.40 * h, z + 1.35 * r), nose]
    mesh.tube(spout, 0.13 * w * 0.6, colour, segments=7)
    rose = Mesh()
    rose.cylinder((0, 0.02 * d, 0), 0.07 * w, 0.10 * d, pale, top=0.19 * w, segments=10)
    mesh.add(rose, at=nose, turn=("x", 50))
    back = 0.03 * d - d / 2
    bow = [
        (0, 0.62 * h, z + 0.55 * r), (0, 0.93 * h, z + 0.45 * r), (0, 0.96 * h, z - 0.35 * r),
        (0, 0.80 * h, back), (0, 0.50 * h, back), (0, 0.26 * h, z - 0.95 * r),
    ]  # fmt: skip
    mesh.tube(bow, 0.05 * w, pale, segments=6)
    return mesh


@shape("RoomDecor")
def room_decor(appearance: Appearance) -> Mesh:
    """A floor vase with bare twigs that carry pale tufts."""
    w, h, d = appearance.size
    mesh, random = Mesh(), appearance.random()
    clay = appearance.pick((0.25, 0.24, 0.26), (0.55, 0.30, 0.22), (0.82, 0.80, 0.74))
    wide, tall = 0.7 * min(w, d), 0.42 * h
    line = [(0, 0), (0.30, 0), (0.50, 0.40), (0.42, 0.70), (0.20, 0.90), (0.26, 1.0)]
    mesh.lathe([(r * wide, y * tall) for r, y in line], clay, segments=14)
    mesh.lathe([(0.26 * wide, tall), (0, 0.96 * tall)], _INSIDE)
    for y in (0.30, 0.42):
        mesh.lathe([(0.5 * wide, y * tall), (0.505 * wide, (y + 0.05) * tall)], _BRASS, segments=14)
    tuft = mixed((0.93, 0.86, 0.70), (0.90, 0.62, 0.60), float(random.random()))
    for k in range(8):
        angle, out = 2.4 * k, 0.45 * ((k + 0.6) / 8) ** 0.5
        top = h * (1 - 0.22 * random.random()) - 0.05
        tip = (out * w * cos(angle), top, out * d * sin(angle))
        mesh.tube([(0, 0.9 * tall, 0), tip], 0.006, _TWIG, "bark", segments=4)
        mesh.ball((tip[0], top - 0.06, tip[2]), (0.055, 0.22, 0.055), tuft, segments=6, rings=4)
    return mesh


@shape("TableTopDecor")
def table_top_decor(appearance: Appearance) -> Mesh:
    """A shallow tray with woven balls of several colours."""
    w, h, d = appearance.size
    mesh, tray = Mesh(), shaded(appearance.palette.wood, 0.7)
    rim = 0.32 * h
    side = [(0, 0), (0.40, 0), (0.50, 1), (0.46, 1), (0.38, 0.3), (0, 0.3)]
    line = [(r * w, y * rim) for r, y in side]
    mesh.lathe(line, tray, "wood", segments=16, squash=(1, d / w), smooth=False)
    r = 0.42 * h
    tones = ((0.85, 0.70, 0.45), appearance.palette.accent, (0.90, 0.88, 0.82), (0.45, 0.32, 0.22))
    spots = ((-0.20, 0.08, 1.0), (0.14, 0.17, 0.85), (0.06, -0.18, 1.0), (0.28, -0.06, 0.7))
    for (x, z, share), tone in zip(spots, tones, strict=True):
        at, wide = (x * w, 0.1 * h + share * r, z * d), 2 * share * r
        mesh.ball(at, (wide, wide, wide), tone, "wicker", segments=9, rings=5)
    return mesh
