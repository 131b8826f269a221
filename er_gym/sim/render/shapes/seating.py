"""Chairs, sofas and stools."""

from __future__ import annotations

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.render.shapes.joinery import legs
from er_gym.sim.render.shapes.registry import shape

_LEATHERS = ((0.38, 0.22, 0.14), (0.22, 0.20, 0.20), (0.62, 0.45, 0.30))
_BLACK = (0.13, 0.12, 0.12)
_CREAM = (0.80, 0.74, 0.62)


def _seat_height(appearance: Appearance, share: float) -> float:
    """Height of the seat; ``share`` is its share of the height if the record does not show it."""
    h = appearance.size[1]
    shown = appearance.surface
    return share * h if shown is None or not 0.25 * h < shown < 0.85 * h else shown


@shape("Chair")
def chair(appearance: Appearance) -> Mesh:
    """A seat on four legs and an upright back of slats, rungs or a padded board."""
    w, _, d = appearance.size
    random, wood = appearance.random(), appearance.palette.wood
    style, seat = int(random.integers(3)), _seat_height(appearance, 0.5)
    cushion = (appearance.palette.accent, appearance.palette.fabric, _CREAM)[
        int(random.integers(3))
    ]
    frame = shaded(wood, (0.85, 1.0, 0.65)[style])
    side = min(0.045, w / 8)
    mesh = Mesh()
    legs(mesh, (w, seat - 0.05, d), side, frame, taper=0.75)
    mesh.box((0, seat - 0.06, 0), (w - 0.01, 0.05, d - 0.01), frame, "wood")
    mesh.rounded((0, seat - 0.023, 0.01), (w - 0.02, 0.046, d - 0.03), cushion, 0.02, "fabric")
    _chair_back(mesh, appearance, seat, side, frame, cushion if style == 2 else frame, style)
    return mesh


def _chair_back(
    mesh: Mesh,
    appearance: Appearance,
    seat: float,
    side: float,
    frame: Colour,
    filling: Colour,
    style: int,
) -> None:
    """Two posts at the back, a rail at the top, and slats (0), rungs (1) or a pad (2)."""
    w, h, d = appearance.size
    z, high = -d / 2 + side / 2, h - seat
    for sign in (-1, 1):
        at = (sign * (w - side) / 2, seat + high / 2 - 0.02, z)
        mesh.box(at, (side, high + 0.02, side), frame, "wood", faces="xXYzZ")
    rail = 0.16 * high
    inner = w - 2 * side
    mesh.box((0, h - rail / 2, z), (inner, rail, 0.6 * side), frame, "wood", faces="yYzZ")
    if style == 0:
        count = max(3, round(inner / 0.09))
        for k in range(count):
            x = inner * ((k + 0.5) / count - 0.5)
            at = (x, seat + (high - rail) / 2, z)
            mesh.box(at, (0.3 * inner / count, high - rail, 0.015), filling, "wood", faces="xXzZ")
    elif style == 1:
        for share in (0.25, 0.58):
            at = (0, seat + share * high, z)
            mesh.box(at, (inner, 0.17 * high, 0.5 * side), filling, "wood", faces="yYzZ")
    else:
        at = (0, seat + 0.5 * high, z + 0.01)
        mesh.rounded(at, (inner, 0.7 * high, side), filling, 0.02, "fabric")


@shape("Sofa")
def sofa(appearance: Appearance) -> Mesh:
    """Long and low between two arms, with two or three seat cushions and a back."""
    random, palette = appearance.random(), appearance.palette
    colour = (palette.fabric, shaded(palette.fabric, 0.8), *_LEATHERS)[int(random.integers(5))]
    w = appearance.size[0]
    return _upholstered(appearance, colour, max(2, min(4, round(0.76 * w / 0.68))))


@shape("ArmChair")
def arm_chair(appearance: Appearance) -> Mesh:
    """A sofa for one: a single broad cushion between two padded arms."""
    random, palette = appearance.random(), appearance.palette
    colours = (mixed(palette.accent, palette.fabric, 0.4), palette.fabric, *_LEATHERS[:2], _CREAM)
    return _upholstered(appearance, colours[int(random.integers(len(colours)))], 1)


def _upholstered(appearance: Appearance, colour: Colour, cushions: int) -> Mesh:
    """A seat between two arms, with a back and cushions, at the places of the solid's parts."""
    w, h, d = appearance.size
    seat = _seat_height(appearance, 0.5)
    arm, back, rest = 0.12 * w, 0.25 * d, min(h, seat + 0.4 * (h - seat))
    foot = min(0.09, 0.25 * seat)
    inner, thick = w - 2 * arm, min(0.17, 0.42 * seat)
    dark, light = shaded(colour, 0.85), shaded(colour, 1.12)
    mesh = Mesh()
    legs(mesh, (w, foot, d), 0.06, _BLACK, inset=0.04)
    base = seat - thick
    size = (w - arm, base - foot + 0.03, d - back - 0.02)
    mesh.box((0, (base + foot) / 2, back / 2), size, dark, "fabric", faces="yYZ")
    low_back = h - 0.03
    at = (0.0, (foot + low_back) / 2, -d / 2 + 0.35 * back)
    mesh.rounded(at, (w - 0.3 * arm, low_back - foot, 0.7 * back), colour, 0.05, "fabric")
    for sign in (-1, 1):
        x = sign * (w - arm) / 2
        at = (x, (foot + rest) / 2, 0.03 * d)
        mesh.rounded(at, (arm, rest - foot, 0.94 * d), colour, 0.045, "fabric")
    wide = inner / cushions
    for k in range(cushions):
        x = wide * (k + 0.5) - inner / 2
        deep = d - back - 0.02
        at = (x, seat - thick / 2, back / 2)
        mesh.rounded(at, (wide - 0.012, thick, deep + 0.03), light, 0.035, "fabric")
        high = h - seat + 0.02
        at = (x, seat + high / 2 - 0.02, -d / 2 + 0.8 * back)
        mesh.rounded(at, (wide - 0.02, high, 0.5 * back), light, 0.06, "fabric")
    return mesh


@shape("Stool")
def stool(appearance: Appearance) -> Mesh:
    """A small seat without a back, on four splayed legs with rungs."""
    w, h, d = appearance.size
    random, wood = appearance.random(), appearance.palette.wood
    seat = (wood, appearance.palette.accent, _BLACK)[int(random.integers(3))]
    frame = shaded(wood, 0.75)
    top = h if appearance.surface is None else min(max(appearance.surface, 0.7 * h), h)
    thick = min(0.06, 0.12 * h)
    mesh = Mesh()
    outline = [(0, top - thick), (0.44, top - thick), (0.5, top - 0.6 * thick)]
    outline += [(0.5, top - 0.3 * thick), (0.44, top), (0, top)]
    mesh.lathe(outline, seat, squash=(0.92 * w, 0.92 * d), segments=16)
    rungs = 0.38 * (top - thick)
    corners = [(a, b) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    radius = min(0.02, 0.06 * min(w, d))
    foot, head = (w / 2 - radius, d / 2 - radius), (0.27 * w, 0.27 * d)
    for a, b in corners:
        path = [(a * foot[0], 0, b * foot[1]), (a * head[0], top - thick, b * head[1])]
        mesh.tube(path, radius, frame, "wood", segments=6)
    share = rungs / (top - thick)
    x, z = (f + (g - f) * share for f, g in zip(foot, head, strict=True))
    for (a, b), (e, f) in zip(corners, corners[1:] + corners[:1], strict=True):
        ends = [(a * x, rungs, b * z), (e * x, rungs, f * z)]
        mesh.tube(ends, 0.6 * radius, frame, "wood", segments=5)
    return mesh


@shape("Ottoman")
def ottoman(appearance: Appearance) -> Mesh:
    """A low padded block for one's feet, with a seam and buttons on top."""
    w, h, d = appearance.size
    palette = appearance.palette
    colour = appearance.pick(
        mixed(palette.fabric, palette.accent, 0.5), palette.fabric, _LEATHERS[0]
    )
    top = h if appearance.surface is None else min(max(appearance.surface, 0.7 * h), h)
    foot, lid = 0.07, 0.32 * top
    mesh = Mesh()
    legs(mesh, (w, foot, d), 0.06, _BLACK, inset=0.03, taper=0.6)
    low = (foot + top - lid) / 2
    size = (w - 0.04, top - lid - foot + 0.04, d - 0.04)
    mesh.box((0, low + 0.02, 0), size, shaded(colour, 0.8), "fabric", faces="xXyzZ")
    mesh.rounded((0, top - lid / 2, 0), (w, lid, d), shaded(colour, 1.1), 0.05, "fabric")
    for a in (-0.25, 0.25):
        for b in (-0.25, 0.25):
            mesh.cylinder((a * w, top, b * d), 0.022, 0.012, shaded(colour, 0.55), segments=6)
    return mesh


@shape("Footstool")
def footstool(appearance: Appearance) -> Mesh:
    """A small round cushion on four short wooden legs."""
    w, h, d = appearance.size
    colour = appearance.pick(appearance.palette.accent, appearance.palette.fabric)
    thick, wood = min(0.45 * h, 0.14), shaded(appearance.palette.wood, 0.8)
    low = h - thick
    mesh = Mesh()
    outline = [(0, low), (0.46, low), (0.5, low + 0.3 * thick), (0.5, low + 0.6 * thick)]
    outline += [(0.42, h - 0.08 * thick), (0.2, h), (0, h)]
    mesh.lathe(outline, colour, "fabric", squash=(w, d), segments=16)
    band = [(0.462, low - 0.02), (0.462, low + 0.01)]
    mesh.lathe(band, wood, "wood", squash=(w, d), segments=16)
    legs(mesh, (0.72 * w, low, 0.72 * d), 0.12 * w, wood, taper=0.6)
    return mesh
