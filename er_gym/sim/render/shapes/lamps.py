"""Lamps and candles."""

from __future__ import annotations

import numpy as np

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.render.shapes.forms import leant
from er_gym.sim.render.shapes.registry import shape

_SHADES: tuple[Colour, ...] = (
    (0.88, 0.83, 0.72), (0.72, 0.62, 0.48), (0.62, 0.66, 0.66), (0.80, 0.74, 0.66),
)  # fmt: skip
_STEMS: tuple[Colour, ...] = (
    (0.20, 0.19, 0.19), (0.68, 0.55, 0.28), (0.70, 0.71, 0.73), (0.42, 0.27, 0.16),
)  # fmt: skip
_GLOW, _CORE, _BULB_OFF = (1.0, 0.90, 0.58), (1.0, 0.98, 0.85), (0.80, 0.80, 0.78)
_WAXES: tuple[Colour, ...] = (
    (0.95, 0.91, 0.78), (0.78, 0.20, 0.20), (0.94, 0.93, 0.90), (0.55, 0.65, 0.45),
)  # fmt: skip
_WICK = (0.12, 0.10, 0.09)


@shape("FloorLamp")
def floor_lamp(appearance: Appearance) -> Mesh:
    """A floor lamp: a shade at the height of a person, on a thin pole with a round foot."""
    _, h, d = appearance.size
    mesh, stem = Mesh(), appearance.pick(*_STEMS)
    bottom = 0.77 * h
    mesh.lathe([(0.26 * d, 0), (0.26 * d, 0.018), (0.05, 0.04), (0, 0.04)], stem, segments=14)
    mesh.cylinder((0, 0.46 * h, 0), 0.016, 0.92 * h, stem, segments=6)
    mesh.ball((0, bottom - 0.05, 0), (0.06, 0.05, 0.06), stem, segments=8, rings=4)
    _shade(mesh, appearance, bottom, h)
    return mesh


@shape("DeskLamp")
def desk_lamp(appearance: Appearance) -> Mesh:
    """A wide shade on a turned or thin stem with a foot."""
    w, h, d = appearance.size
    mesh, stem = Mesh(), appearance.pick(*_STEMS)
    r, bottom = 0.26 * min(w, d), 0.52 * h
    mesh.lathe([(r, 0), (r, 0.02 * h), (0.5 * r, 0.06 * h), (0, 0.06 * h)], stem, segments=12)
    if appearance.random().random() < 0.5:
        belly = [(0.25, 0.05), (0.85, 0.20), (0.95, 0.30), (0.35, 0.46), (0.2, 0.50)]
        line = [(x * r, y * h) for x, y in belly]
        mesh.lathe(line, mixed(stem, appearance.palette.accent, 0.6), segments=12)
    mesh.cylinder((0, 0.45 * h, 0), 0.012, 0.86 * h, stem, segments=6)
    _shade(mesh, appearance, bottom, h)
    return mesh


def _shade(mesh: Mesh, appearance: Appearance, bottom: float, top: float) -> None:
    """A cloth shade around a bulb; it glows while the lamp is on."""
    w, _, d = appearance.size
    cloth = appearance.pick(*_SHADES)
    narrow = 0.5 * w * (0.55 + 0.3 * appearance.random().random())
    outside = [(0.5 * w, bottom), (narrow, top)]
    inside = [(0.96 * narrow, top), (0.48 * w, bottom)]
    edge = 0.03 * (top - bottom)
    around, squash = 16, (1.0, d / w)
    if appearance.on:
        fade = np.repeat([_GLOW, shaded(_GLOW, 0.82)], around + 1, axis=0)
        mesh.lathe(outside, fade, "glowing", segments=around, squash=squash)
        mesh.lathe(inside, _CORE, "glowing", segments=around, squash=squash)
        rings = mixed(cloth, _GLOW, 0.5)
    else:
        mesh.lathe(outside, cloth, "fabric", segments=around, squash=squash, turns=(6, 0.15))
        mesh.lathe(inside, shaded(cloth, 0.55), segments=around, squash=squash)
        rings = shaded(cloth, 0.65)
    for (r, y), sign in ((outside[0], 1), (outside[1], -1)):
        band = sorted([y, y + sign * edge])
        mesh.lathe(
            [(1.01 * r, band[0]), (1.01 * r, band[1])], rings, segments=around, squash=squash
        )
    bulb = (0.24 * w, 0.4 * (top - bottom), 0.24 * d)
    colour, material = (_CORE, "glowing") if appearance.on else (_BULB_OFF, "plain")
    mesh.ball((0, bottom + 0.32 * (top - bottom), 0), bulb, colour, material, segments=8, rings=5)


@shape("Candle")
def candle(appearance: Appearance) -> Mesh:
    """A wax rod with a dark wick, and a flame while it burns."""
    w, h, d = appearance.size
    wax = appearance.pick(*_WAXES)
    thick = sorted(appearance.size)[1] if max(w, d) <= h else min(appearance.size)
    return leant(
        appearance.size,
        min(thick, 0.06),
        lambda length: _candle(appearance, length, min(w, d, h, 0.06), wax),
    )


def _candle(appearance: Appearance, length: float, thick: float, wax: Colour) -> Mesh:
    mesh, r = Mesh(), thick / 2
    wick = min(0.10 * length, 0.012)
    top = length - wick
    rod = [
        (0, 0),
        (r, 0),
        (0.96 * r, top),
        (0.80 * r, top),
        (0.7 * r, top - 0.1 * r),
        (0, top - 0.1 * r),
    ]
    mesh.lathe(rod, wax, segments=12, smooth=False)
    mesh.cylinder((0, top + wick / 2, 0), max(0.0015, 0.06 * r), wick, _WICK, segments=5)
    if appearance.on:
        tall = max(0.035, 1.6 * thick)
        line = [(0, 0), (0.16, 0.12), (0.22, 0.30), (0.15, 0.60), (0, 1.0)]
        flame = [(x * tall, y * tall) for x, y in line]
        mesh.lathe(
            flame, (1, 1, 1), "flame", at=(0, top + 0.3 * wick, 0), segments=8, turns=(1, tall)
        )
    return mesh
