"""Cleaning tools and bins."""

from __future__ import annotations

from dataclasses import replace
from functools import wraps
from math import pi

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.render.shapes.bathroom import outline
from er_gym.sim.render.shapes.registry import Shape, shape
from er_gym.sim.render.shapes.toiletries import AXES, odd_axis, roll

_WHITE, _DARK, _BLACK = (0.96, 0.96, 0.95), (0.15, 0.15, 0.16), (0.08, 0.08, 0.09)
_RUBBER, _HANDLE = ((0.68, 0.15, 0.12), (0.16, 0.16, 0.17), (0.55, 0.20, 0.14)), (0.80, 0.62, 0.40)
_BRISTLES, _STEEL, _FOIL = (0.25, 0.45, 0.70), (0.72, 0.74, 0.77), (0.84, 0.86, 0.89)
_SPRAYS = ((0.20, 0.52, 0.85), (0.25, 0.68, 0.42), (0.92, 0.55, 0.16), (0.62, 0.35, 0.75))
_TRIGGERS = ((0.90, 0.20, 0.18), (0.97, 0.97, 0.96), (0.95, 0.80, 0.15))
_SOAPS = (
    (0.94, 0.58, 0.30),
    (0.52, 0.78, 0.42),
    (0.85, 0.40, 0.52),
    (0.45, 0.70, 0.82),
    (0.93, 0.88, 0.76),
)
_BOXES = ((0.20, 0.60, 0.72), (0.85, 0.42, 0.58), (0.58, 0.45, 0.78), (0.35, 0.65, 0.45))
_SPONGE, _SCOUR = (0.97, 0.83, 0.22), (0.18, 0.45, 0.25)
_PAPER, _PRINT, _CARTON = (0.97, 0.97, 0.96), (0.55, 0.72, 0.90), (0.16, 0.35, 0.68)
_BINS = (
    (0.42, 0.46, 0.50),
    (0.68, 0.70, 0.73),
    (0.26, 0.27, 0.30),
    (0.32, 0.48, 0.42),
    (0.86, 0.85, 0.80),
)
_LINER = (0.92, 0.93, 0.94)
_BAG = (0.13, 0.14, 0.16)


def _also_lying(draw: Shape) -> Shape:
    """For standing shapes: lays the shape on its side if its box is not high."""

    @wraps(draw)
    def drawn(appearance: Appearance) -> Mesh:
        w, h, d = appearance.size
        if h >= 0.7 * max(w, d):
            return draw(appearance)
        mesh = Mesh()
        if d >= w:
            mesh.add(
                draw(replace(appearance, size=(w, d, h))), turn=("x", 90), at=(0, h / 2, -d / 2)
            )
        else:
            mesh.add(
                draw(replace(appearance, size=(h, w, d))), turn=("z", 90), at=(w / 2, h / 2, 0)
            )
        return mesh

    return drawn


def _oval(
    mesh: Mesh, line: list[tuple[float, float]], size: tuple[float, float], z: float, colour: Colour
) -> None:
    """A lathe with an oval cross-section; radii are shares of its width and depth."""
    most = max(size)
    profile = [(r * most, y) for r, y in line]
    squash = (size[0] / most, size[1] / most)
    mesh.lathe(profile, colour, squash=squash, at=(0, 0, z), segments=12)


def _labelled(
    mesh: Mesh,
    size: tuple[float, float],
    h: float,
    label: tuple[float, float],
    z: float,
    colour: Colour,
) -> None:
    """The lower part of a bottle with a white label that has a dark band."""
    low, high = label
    foot = [(0, 0), (0.44, 0), (0.5, 0.03 * h), (0.5, low * h)]
    _oval(mesh, foot, size, z, colour)
    cuts = [low + share * (high - low) for share in (0, 0.38, 0.66, 1)]
    for k, tint in enumerate((_WHITE, shaded(colour, 0.6), _WHITE)):
        _oval(mesh, [(0.5, cuts[k] * h), (0.5, cuts[k + 1] * h)], size, z, tint)


@shape("Plunger")
@_also_lying
def plunger(appearance: Appearance) -> Mesh:
    """A wooden stick on a wide rubber bell."""
    w, h, d = appearance.size
    mesh, rubber = Mesh(), appearance.pick(*_RUBBER)
    r = min(w, d) / 2
    bell = min(0.26 * h, 1.5 * r)
    line = [(0, 0.4 * bell), (0.7 * r, 0), (r, 0), (r, 0.12 * bell), (0.86 * r, 0.2 * bell),
            (0.84 * r, 0.35 * bell), (0.66 * r, 0.6 * bell), (0.34 * r, 0.78 * bell),
            (0.26 * r, bell), (0, bell)]  # fmt: skip
    mesh.lathe(line, rubber)
    stick = 0.15 * r + 0.004
    mesh.lathe([(stick, bell), (stick, h - 0.03), (0.8 * stick, h), (0, h)], _HANDLE, segments=9)
    return mesh


@shape("ScrubBrush")
@_also_lying
def scrub_brush(appearance: Appearance) -> Mesh:
    """A toilet brush: a white holder, blue bristles over its edge, a handle with a knob."""
    w, h, d = appearance.size
    mesh = Mesh()
    r, cup = min(w, d) / 2, 0.27 * h
    mesh.lathe([(0, 0), (r, 0), (0.92 * r, 0.04 * h), (0.72 * r, 0.09 * h), (0.88 * r, cup),
                (0.74 * r, cup), (0.6 * r, 0.12 * h), (0, 0.12 * h)], _WHITE)  # fmt: skip
    for k in range(4):
        y = 0.16 * h + k * 0.075 * h
        wide = (0.5, 0.68, 0.68, 0.5)[k] * r
        tint = shaded(_BRISTLES, 1.0 if k % 2 else 0.75)
        mesh.lathe([(0.3 * r, y), (wide, y + 0.03 * h), (0.3 * r, y + 0.085 * h)], tint,
                   segments=10, smooth=False)  # fmt: skip
    stick = 0.12 * r + 0.003
    grip = 1.7 * stick
    mesh.lathe([(stick, 0.4 * h), (stick, 0.78 * h), (grip, 0.84 * h), (grip, 0.97 * h),
                (0.8 * stick, h), (0, h)], _WHITE, segments=9)  # fmt: skip
    return mesh


def _standing(appearance: Appearance) -> tuple[float, float, float, bool]:
    """Width, height and depth with the depth as the longer level side, and whether they were
    swapped."""
    w, h, d = appearance.size
    return (d, h, w, True) if w > 1.05 * d else (w, h, d, False)


def _turned(mesh: Mesh, turn: bool) -> Mesh:
    found = Mesh()
    found.add(mesh, turn=("y", 90) if turn else None)
    return found


@shape("SprayBottle")
@_also_lying
def spray_bottle(appearance: Appearance) -> Mesh:
    """A waisted bottle with a spray head: nozzle, trigger, butt."""
    w, h, d, turn = _standing(appearance)
    mesh, random = Mesh(), appearance.random()
    colour = _SPRAYS[int(random.integers(len(_SPRAYS)))]
    head = _TRIGGERS[int(random.integers(len(_TRIGGERS)))]
    wide, deep = w, min(0.72 * d, 2.6 * w)
    z = -d / 2 + deep / 2
    _labelled(mesh, (wide, deep), h, (0.08, 0.34), z, colour)
    neck = [(0.5, 0.34 * h), (0.36, 0.46 * h), (0.42, 0.56 * h), (0.2, 0.68 * h), (0.16, 0.7 * h)]
    _oval(mesh, neck, (wide, deep), z, colour)
    _oval(mesh, [(0.25, 0.68 * h), (0.25, 0.78 * h), (0, 0.78 * h)], (wide, 0.7 * deep), z, head)
    thick = min(0.8 * w, 0.03)
    top = [(-d / 2, 0.80 * h), (-0.42 * d, h), (0.3 * d, h), (0.38 * d, 0.97 * h),
           (0.38 * d, 0.88 * h), (0, 0.84 * h), (-0.05 * d, 0.76 * h),
           (-0.3 * d, 0.76 * h)]  # fmt: skip
    mesh.prism(top, -thick / 2, thick / 2, head, axis="x")
    mesh.box((0, 0.925 * h, 0.44 * d), (0.7 * thick, 0.07 * h, 0.12 * d), shaded(head, 0.6))
    trigger = [
        (0.10 * d, 0.87 * h),
        (0.24 * d, 0.87 * h),
        (0.32 * d, 0.68 * h),
        (0.24 * d, 0.67 * h),
    ]
    mesh.prism(trigger, -0.35 * thick, 0.35 * thick, shaded(head, 0.75), axis="x")
    return _turned(mesh, turn)


@shape("SoapBottle")
@_also_lying
def soap_bottle(appearance: Appearance) -> Mesh:
    """A plump bottle with a pump: a thin stem and a nozzle to one side."""
    w, h, d, turn = _standing(appearance)
    mesh, random = Mesh(), appearance.random()
    colour = _SOAPS[int(random.integers(len(_SOAPS)))]
    slope = 0.5 + 0.1 * random.random()
    pump = shaded(_WHITE, 1.0) if random.random() < 0.6 else _DARK
    deep = min(d, 1.25 * w)
    z = -d / 2 + deep / 2
    _labelled(mesh, (w, deep), h, (0.14, 0.42), z, colour)
    neck = [(0.5, 0.42 * h), (0.5, slope * h), (0.42, 0.63 * h), (0.17, 0.68 * h), (0.17, 0.7 * h)]
    _oval(mesh, neck, (w, deep), z, colour)
    r = 0.5 * min(w, deep)
    stem = 0.14 * r
    mesh.lathe([(0.42 * r, 0.69 * h), (0.42 * r, 0.77 * h), (stem, 0.785 * h), (stem, 0.92 * h)],
               pump, at=(0, 0, z), segments=10)  # fmt: skip
    front = max(d / 2, z + 0.95 * r)
    front = min(front, d / 2)
    back = z - 0.32 * r
    mesh.box((0, 0.95 * h, (front + back) / 2), (0.34 * r + 0.006, 0.06 * h, front - back), pump)
    mesh.box((0, 0.9 * h, front - 0.1 * r), (0.24 * r, 0.08 * h, 0.2 * r), shaded(pump, 0.8))
    mesh.cylinder((0, 0.965 * h, z), 0.36 * r, 0.07 * h, pump, segments=9)
    return _turned(mesh, turn)


@shape("DishSponge")
def dish_sponge(appearance: Appearance) -> Mesh:
    """A yellow block with a green scouring side."""
    w, h, d = appearance.size
    mesh = Mesh()
    mesh.rounded((0, 0.64 * h, 0), (w, 0.72 * h, d), _SPONGE, 0.12 * h, "carpet", turns=0.08)
    mesh.box((0, 0.14 * h, 0), (w, 0.28 * h, d), _SCOUR, "carpet", faces="xXYzZ", turns=0.08)
    return mesh


@shape("PaperTowelRoll")
def paper_towel_roll(appearance: Appearance) -> Mesh:
    """A tall white roll with a blue print and a brown core."""
    mesh = roll(appearance, _PAPER, appearance.used_up)
    if appearance.used_up:
        return mesh
    axis = odd_axis(appearance.size)
    length, r = appearance.size[axis], min(appearance.size[k] for k in range(3) if k != axis) / 2
    for share in (-0.32, -0.02, 0.28):
        low, high = share * length, (share + 0.05) * length
        mesh.lathe([(1.06 * r, low), (1.06 * r, high)], _PRINT,
                   at=(0, appearance.size[1] / 2, 0), axis=AXES[axis], segments=16)  # fmt: skip
    return mesh


@shape("AluminumFoil")
def aluminum_foil(appearance: Appearance) -> Mesh:
    """A long carton with a silver roll and a torn sheet at its opening."""
    w, h, d, turn = _standing(appearance)
    mesh = Mesh()
    mesh.box((0, 0.3 * h, 0), (w, 0.6 * h, d), _CARTON, faces="xXyzZ")
    for side in (-1, 1):
        at = (side * (w / 2 - 0.003), 0.3 * h, 0)
        mesh.box(at, (0.008, 0.38 * h, 0.7 * d), (0.95, 0.85, 0.2), faces="xX")
    r = 0.42 * min(w, 1.2 * h)
    mesh.lathe([(0.35 * r, -0.48 * d), (r, -0.48 * d), (r, 0.48 * d), (0.35 * r, 0.48 * d)], _FOIL,
               "metal", at=(-0.06 * w, h - r, 0), axis="z", segments=14)  # fmt: skip
    sheet = [[(0.2 * w, 0.85 * h, s * 0.47 * d), (0.5 * w, 0.62 * h, s * 0.47 * d),
              (0.5 * w, 0.2 * h, s * (0.47 - 0.06 * (s > 0)) * d)] for s in (-1, 1)]  # fmt: skip
    mesh.skin(sheet, _FOIL, "metal", closed=False, smooth=False, both=True)
    return _turned(mesh, turn)


@shape("TissueBox")
def tissue_box(appearance: Appearance) -> Mesh:
    """A patterned box with a white tissue in a slot."""
    w, h, d = appearance.size
    mesh, random = Mesh(), appearance.random()
    colour = mixed(_BOXES[int(random.integers(len(_BOXES)))], _WHITE, 0.3)
    top = 0.66 * h
    for low, high, tint in ((0, 0.25, 0.7), (0.25, 0.4, 2.0), (0.4, 1, 1.0)):
        at = (0, (low + high) / 2 * top, 0)
        mesh.box(at, (w, (high - low) * top, d), shaded(colour, tint), faces="xXYzZ")
    mesh.lathe([(0.30, top + 0.004), (0, top + 0.004)], _DARK, squash=(w, 0.8 * d), segments=12)
    if appearance.used_up:
        return mesh
    for k, light in enumerate((1.5, 1.25)):
        lean = (-1) ** k * 0.18
        rows = [[(x * w * wide, y, (lean * (y - top) / (h - top) + 0.06 * wave) * d)
                 for x, wave in ((-0.5, -1), (-0.25, 1), (0.0, -1), (0.25, 1), (0.5, -1))]
                for y, wide in ((top, 0.3), (0.85 * h, 0.42),
                                ((0.99 - 0.07 * k) * h, 0.56 - 0.2 * k))]  # fmt: skip
        tissue = [light * channel for channel in _PAPER]
        mesh.skin(rows, tissue, closed=False, smooth=False, both=True)
    return mesh


@shape("GarbageCan")
def garbage_can(appearance: Appearance) -> Mesh:
    """A bin that is wider at the top, open and dark inside, sometimes with a bag over the rim."""
    w, h, d = appearance.size
    mesh, random = Mesh(), appearance.random()
    colour = _BINS[int(random.integers(len(_BINS)))]
    power = 2.0 if random.random() < 0.5 else 5.0
    lined = random.random() < 0.45
    foot = 0.72

    def ring(share: float, y: float) -> NDArray[np.float64]:
        return outline((share * w, share * d, y), power)

    mesh.skin([ring(foot, 0), ring(0.95, 0.92 * h)], colour)
    mesh.skin([ring(0.92, h), ring(foot - 0.05, 0.05), ring(0, 0.04)], shaded(colour, 0.35))
    for y in (0.3, 0.6):
        share = foot + (0.95 - foot) * y / 0.92
        mesh.skin([ring(share + 0.020, (y - 0.015) * h), ring(share + 0.026, (y + 0.015) * h)],
                  shaded(colour, 0.7))  # fmt: skip
    rim = [ring(0.95, 0.92 * h), ring(1, 0.925 * h), ring(1, h), ring(0.92, h)]
    if lined:
        hem = ring(0.985, 0.74 * h)
        hem[::2, 1] -= 0.05 * h
        rim = [hem, ring(1, 0.93 * h), ring(1, h), ring(0.9, h), ring(0.86, 0.7 * h)]
    mesh.skin(rim, _LINER if lined else shaded(colour, 0.82))
    return mesh


@shape("GarbageBag")
def garbage_bag(appearance: Appearance) -> Mesh:
    """A full black sack, wrinkled, tied at the top with two ears."""
    w, h, d = appearance.size
    mesh, random = Mesh(), appearance.random()
    n, rings, tints = 16, [], []
    angle = np.arange(n) / n * 2 * pi
    for y, r in ((0, 0.62), (0.06, 0.88), (0.25, 0.98), (0.42, 0.92), (0.58, 0.72), (0.70, 0.38),
                 (0.76, 0.14), (0.80, 0.12)):  # fmt: skip
        bump = 1 - (0.14 if r > 0.3 else 0.3) * random.random(n)
        rings.append(np.stack([np.cos(angle) * r * bump * w / 2, np.full(n, y * h),
                               np.sin(angle) * r * bump * d / 2], axis=1))  # fmt: skip
        gleam = np.where(bump > 0.955, 2.6, 1.0)[:, None]
        tints.append(np.array(_BAG) * gleam)
    mesh.skin(rings, np.array(tints), smooth=False)
    mesh.lathe([(0.09 * w, 0.76 * h), (0.09 * w, 0.80 * h)], (0.85, 0.25, 0.2), segments=8)
    for side in (-1, 1):
        ear = [(0, 0.79 * h, 0), (side * 0.20 * w, 0.9 * h, 0.05 * d),
               (side * 0.13 * w, h, 0), (side * 0.01 * w, 0.96 * h, -0.05 * d)]  # fmt: skip
        mesh.quad(ear, shaded(_BAG, 1.8), both=True)
    return mesh


@shape("VacuumCleaner")
def vacuum_cleaner(appearance: Appearance) -> Mesh:
    """An upright vacuum cleaner: flat head on the floor, round dust tank, long handle."""
    w, h, d = appearance.size
    mesh = Mesh()
    colour = appearance.pick((0.78, 0.16, 0.18), (0.42, 0.22, 0.62), (0.15, 0.42, 0.70))
    mesh.rounded((0, 0.045 * h, 0.22 * d), (w, 0.09 * h, 0.55 * d), colour, 0.03)
    mesh.box((0, 0.05 * h, d / 2 - 0.004), (0.9 * w, 0.03 * h, 0.008), _DARK, faces="Z")
    for side in (-1, 1):
        mesh.cylinder((side * 0.34 * w, 0.07 * h, -0.25 * d), 0.07 * h, 0.1 * w, _DARK, axis="x")
    lean = Mesh()
    tank = [
        (0.16 * w, 0.10 * h),
        (0.3 * w, 0.14 * h),
        (0.3 * w, 0.5 * h),
        (0.2 * w, 0.58 * h),
        (0, 0.6 * h),
    ]
    lean.lathe(tank, mixed(colour, _DARK, 0.15))
    lean.lathe([(0.315 * w, 0.2 * h), (0.315 * w, 0.38 * h)], (0.70, 0.78, 0.82))
    lean.lathe([(0.32 * w, 0.4 * h), (0.32 * w, 0.43 * h)], _DARK)
    lean.tube([(0, 0.55 * h, 0), (0, 0.9 * h, 0)], 0.017, _STEEL, segments=8)
    lean.tube([(0, 0.86 * h, 0), (0, 0.98 * h, -0.02), (0, 0.985 * h, 0.10), (0, 0.9 * h, 0.12)],
              0.02, _DARK, segments=7)  # fmt: skip
    mesh.add(lean, turn=("x", 4), at=(0, 0, -0.16 * d))
    hose = [(0.3 * w, 0.2 * h, -0.2 * d), (0.46 * w, 0.4 * h, -0.3 * d),
            (0.42 * w, 0.62 * h, -0.3 * d), (0.2 * w, 0.56 * h, -0.16 * d)]  # fmt: skip
    mesh.tube(hose, 0.018, _BLACK, segments=6)
    return mesh
