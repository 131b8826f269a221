"""Beds and what lies on them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.render.shapes.joinery import legs
from er_gym.sim.render.shapes.registry import shape

_SHEET, _PILLOW = (0.93, 0.92, 0.89), (0.96, 0.95, 0.92)
_STAIN = (0.40, 0.28, 0.15)
_BROWN, _LINING = (0.45, 0.33, 0.24), (0.82, 0.74, 0.60)
_HEADBOARD = 0.08
"""Thickness of the headboard, metres. Like the solid's headboard, it is at the front."""


@shape("Bed")
def bed(appearance: Appearance) -> Mesh:
    """A mattress under a blanket, turned down in front of pillows and a headboard."""
    w, h, d = appearance.size
    random, palette = appearance.random(), appearance.palette
    colours = (palette.fabric, mixed(palette.accent, palette.fabric, 0.4), palette.accent)
    blanket = colours[int(random.integers(len(colours)))]
    material = ("fabric", "stripes")[int(random.integers(2))]
    wood = shaded(palette.wood, 0.85)
    top = 0.55 * h if appearance.surface is None else min(max(appearance.surface, 0.3 * h), h)
    rail = 0.42 * top if top < 1.0 else top - 0.35  # a high bed is a loft over a desk
    beam = min(0.5 * rail, 0.22)
    mesh = Mesh()
    legs(mesh, (w, rail, d), 0.08, wood)
    mesh.box((0, rail - beam / 2, 0), (w - 0.03, beam, d - 0.02), wood, "wood", faces="xXyYz")
    at, size = (0, h / 2, d / 2 - _HEADBOARD / 2), (w, h, _HEADBOARD)
    mesh.rounded(at, size, wood, 0.02, "wood")
    mesh.rounded((0, 0.62 * h, d / 2 - _HEADBOARD - 0.005), (0.86 * w, 0.62 * h, 0.03),
                 shaded(wood, 1.2), 0.02, "wood")  # fmt: skip
    if appearance.dirty:
        _unmade(mesh, appearance, top, rail, blanket, material)
    else:
        _made(mesh, appearance, top, rail, blanket, material)
    return mesh


def _mattress(mesh: Mesh, appearance: Appearance, top: float, rail: float) -> tuple[float, float]:
    """A mattress in a sheet; returns the z of its foot and its length."""
    w, _, d = appearance.size
    foot, head = -d / 2 + 0.02, d / 2 - _HEADBOARD
    thick = top - 0.015 - rail
    at = (0, rail + thick / 2, (head + foot) / 2)
    mesh.rounded(at, (w - 0.06, thick, head - foot), _SHEET, 0.04, "fabric")
    return foot, head - foot


def _made(
    mesh: Mesh, appearance: Appearance, top: float, rail: float, colour: Colour, material: str
) -> None:
    """A blanket, smooth, with its turned-down edge, and pillows side by side."""
    w = appearance.size[0]
    foot, long = _mattress(mesh, appearance, top, rail)
    covered, drop = 0.68 * long, 0.8 * (top - rail)
    z = foot + covered / 2 - 0.01
    mesh.rounded((0, top - drop / 2, z), (w, drop, covered), colour, 0.03, material, turns=0.5)
    at = (0, top - 0.35 * drop, foot + 0.73 * long - 0.02)
    mesh.rounded(at, (w, 0.7 * drop, 0.1 * long), shaded(_SHEET, 1.05), 0.02, "fabric")
    _pillows(mesh, w, top, foot + long, long, 0.0)


def _unmade(
    mesh: Mesh, appearance: Appearance, top: float, rail: float, colour: Colour, material: str
) -> None:
    """A blanket thrown back askew in folds, a stained sheet, and pillows at odds."""
    w = appearance.size[0]
    foot, long = _mattress(mesh, appearance, top, rail)
    for k, (z, turn, wide) in enumerate(((0.1, 4, 0.98), (0.27, -8, 0.94), (0.42, 13, 0.8))):
        heap = Mesh()
        high = 0.05 + 0.025 * k
        heap.rounded((0, 0, 0), (wide * w, high, 0.2 * long), shaded(colour, 1 - 0.07 * k), 0.03,
                     material, turns=0.5)  # fmt: skip
        mesh.add(heap, at=(0.03 * w * (k - 1), top + 0.3 * high, foot + z * long), turn=("y", turn))
    for x, z, r in ((-0.22, 0.66, 0.15), (0.2, 0.6, 0.1)):
        at = (x * w, top - 0.007, foot + z * long)
        mesh.lathe([(r, 0), (0, 0.006)], _STAIN, at=at, segments=9, squash=(1.0, 1.35))
    _pillows(mesh, w, top, foot + long, long, 24.0)


def _pillows(mesh: Mesh, w: float, top: float, head: float, long: float, askew: float) -> None:
    """One pillow or two before the headboard, in a row or turned by some degrees."""
    count = 2 if w > 1.25 else 1
    wide, deep = min(0.8 * w / count, 0.72), min(0.19 * long, 0.42)
    for k in range(count):
        at = (w / count * (k + 0.5) - w / 2, top + 0.01, head - deep / 2 - 0.03 - 0.002 * askew)
        cushion = _cushion((wide, 0.15, deep), _PILLOW, "fabric")
        mesh.add(cushion, at=at, turn=("y", askew * (1 - 1.7 * k)))


@shape("Pillow")
def pillow(appearance: Appearance) -> Mesh:
    """A pillow, thick in its middle and thin at its corners."""
    size, palette = appearance.size, appearance.palette
    colour = appearance.pick(
        _PILLOW, palette.accent, palette.fabric, mixed(palette.accent, _PILLOW, 0.5)
    )
    thin = size.index(min(size))
    w, h, d = size
    mesh = Mesh()
    if thin == 1:
        mesh.add(_cushion((w, h, d), colour, "fabric"), at=(0, h / 2, 0))
    elif thin == 2:
        mesh.add(_cushion((w, d, h), colour, "fabric"), at=(0, h / 2, 0), turn=("x", 90.0))
    else:
        mesh.add(_cushion((h, w, d), colour, "fabric"), at=(0, h / 2, 0), turn=("z", 90.0))
    return mesh


def _cushion(size: tuple[float, float, float], colour: Colour, material: str) -> Mesh:
    """A lying pillow about its middle point."""
    count = 7
    t = np.linspace(-1.0, 1.0, count)
    u, v = np.meshgrid(t, t, indexing="ij")
    # The stuffing draws the seam in towards the middle of each side.
    x = u * (1.0 - 0.1 * (1.0 - v**2) * np.abs(u) ** 3)
    z = v * (1.0 - 0.1 * (1.0 - u**2) * np.abs(v) ** 3)
    y = ((1.0 - u**4) * (1.0 - v**4)) ** 0.6
    half = np.array(size) / 2
    first = (np.arange(count - 1)[:, None] * count + np.arange(count - 1)).ravel()
    faces = np.concatenate(
        [
            np.stack([first, first + 1, first + count], axis=1),
            np.stack([first + 1, first + count + 1, first + count], axis=1),
        ]
    )
    mesh = Mesh()
    for sign in (1.0, -1.0):
        points = np.stack([x, sign * y, z], axis=-1) * half
        normals = _normals(points) * sign
        uv = np.stack([u, v], axis=-1) * half[[0, 2]]
        mesh.triangles(material, points, normals, uv, colour, faces)
    return mesh


def _normals(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """(N, N, 3) upward normals of a height field (N, N, 3)."""
    along, across = np.gradient(points, axis=0), np.gradient(points, axis=1)
    normals = np.cross(across, along)
    return np.asarray(np.where(normals[..., 1:2] < 0, -normals, normals))


@shape("DogBed")
def dog_bed(appearance: Appearance) -> Mesh:
    """A round padded rim about a soft pale cushion, open at the front."""
    w, h, d = appearance.size
    colour = appearance.pick(_BROWN, shaded(appearance.palette.fabric, 0.8), (0.35, 0.36, 0.40))
    rim = min(0.14, 0.5 * h / min(w, d) + 0.03)
    mesh = Mesh()
    outline = [(0.46, 0), (0.5, 0.2 * h), (0.5, 0.75 * h), (0.5 - 0.3 * rim, h)]
    outline += [(0.5 - 0.8 * rim, 0.95 * h), (0.5 - rim, 0.7 * h), (0.5 - rim, 0.3 * h)]
    mesh.lathe(outline, colour, "carpet", squash=(w, d), segments=18, turns=(4.0, 0.3))
    inside = [(0.5 - rim, 0.3 * h), (0.3, 0.45 * h), (0, 0.5 * h)]
    mesh.lathe(inside, _LINING, "fabric", squash=(w, d), segments=18, turns=(3.0, 0.3))
    return mesh
