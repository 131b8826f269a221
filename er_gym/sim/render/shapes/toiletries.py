"""Rolls of paper, the hangers that they hang on, and soap."""

from __future__ import annotations

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Axis, Colour
from er_gym.sim.render.shapes.bathroom import vessel
from er_gym.sim.render.shapes.registry import shape

_CHROME: Colour = (0.88, 0.90, 0.94)
_PAPER, _CARD = (0.97, 0.97, 0.96), (0.62, 0.46, 0.30)
_SOAPS = ((0.95, 0.62, 0.68), (0.56, 0.80, 0.62), (0.96, 0.86, 0.55), (0.60, 0.72, 0.92))
AXES: tuple[Axis, ...] = ("x", "y", "z")


def odd_axis(size: tuple[float, float, float]) -> int:
    """The axis of a roll: its length along it differs from the other two."""
    middle = sorted(size)[1]
    return max(range(3), key=lambda k: abs(size[k] - middle))


def roll(appearance: Appearance, paper: Colour, used: bool, material: str = "plain") -> Mesh:
    """A roll of paper around a cardboard tube, or the bare tube."""
    axis = odd_axis(appearance.size)
    others = [appearance.size[k] for k in range(3) if k != axis]
    length, r = appearance.size[axis], min(others) / 2
    at, cut = (0.0, appearance.size[1] / 2, 0.0), AXES[axis]
    mesh, half = Mesh(), length / 2
    bore = min(0.42 * r, 0.024)
    if used:
        r = min(r, 0.024)
        bore = 0.86 * r
    skin = _CARD if used else paper
    inside = [(bore, half), (bore, -half)]
    outside = [(bore, -half), (r, -half), (r, half), (bore, half)]
    mesh.lathe(outside, skin, material, at=at, axis=cut, segments=16)
    mesh.lathe(inside, shaded(_CARD, 0.75), at=at, axis=cut, segments=12)
    if not used:
        for side in (-1, 1):
            ring = [(1.5 * bore, side * (half + 0.002)), (bore, side * (half + 0.002))]
            mesh.lathe(ring[::-side], _CARD, at=at, axis=cut, segments=12)
    return mesh


@shape("ToiletPaper")
def toilet_paper(appearance: Appearance) -> Mesh:
    """A short white roll with a brown core and a loose end."""
    used = appearance.used_up or "Used_Up" in appearance.asset
    mesh = roll(appearance, _PAPER, used)
    if used:
        return mesh
    w, h, d = appearance.size
    if odd_axis(appearance.size) == 1:
        mesh.box((0.16 * w, 0.5 * h, 0.49 * d), (0.32 * w, 0.97 * h, 0.02 * d), _PAPER)
    else:
        mesh.box((0, 0.24 * h, 0.48 * d), (0.98 * w, 0.48 * h, 0.03 * d), _PAPER)
    return mesh


@shape("ToiletPaperHanger")
def toilet_paper_hanger(appearance: Appearance) -> Mesh:
    """A bar between two arms from the wall; under a hood if its box is high."""
    w, h, d = appearance.size
    mesh, metal = Mesh(), mixed(_CHROME, appearance.palette.metal, 0.4)
    r = min(0.013, 0.3 * h)
    y, front = (0.5 * h if h < 0.1 else 0.03), d / 2 - 1.4 * r
    for side in (-1, 1):
        x = side * (w / 2 - 1.6 * r)
        plate = (min(0.05, 0.3 * w), max(2 * r, min(h, 2 * y)), 0.016)
        mesh.rounded((x * 0.93, y, -d / 2 + 0.008), plate, metal, 0.005)
        mesh.box((x, y, 0), (2.2 * r, 2.2 * r, d), shaded(metal, 0.85))
    if h >= 0.1:
        mesh.box((0, h / 2, -d / 2 + 0.006), (0.8 * w, h, 0.012), shaded(metal, 0.9), faces="xXYZ")
        hood = [
            [(x, h, -d / 2), (x, h, 0.2 * d), (x, 0.75 * h, d / 2)] for x in (-0.4 * w, 0.4 * w)
        ]
        mesh.skin(hood, metal, closed=False, smooth=False, both=True)
    mesh.tube([(-w / 2, y, front), (w / 2, y, front)], r, metal, segments=8)
    return mesh


@shape("SoapBar")
def soap_bar(appearance: Appearance) -> Mesh:
    """A pastel bar with round edges and a sunk oval."""
    w, h, d = appearance.size
    mesh, colour = Mesh(), appearance.pick(*_SOAPS)
    rings = [(0.7 * w, 0.8 * d, 0), (0.95 * w, 0.96 * d, 0.22 * h), (w, d, 0.5 * h),
             (0.95 * w, 0.96 * d, 0.78 * h), (0.75 * w, 0.82 * d, h),
             (0.62 * w, 0.66 * d, 0.97 * h)]  # fmt: skip
    vessel(mesh, rings, colour, 3.2, segments=12)
    vessel(mesh, [rings[-1], (0.54 * w, 0.58 * d, 0.8 * h)], shaded(colour, 0.7), 3.2, segments=12)
    vessel(
        mesh,
        [(0.54 * w, 0.58 * d, 0.8 * h), (0.0, 0.0, 0.85 * h)],
        mixed(colour, _PAPER, 0.25),
        3.2,
    )
    return mesh
