"""Books, papers, pens and small things for a pocket."""

from __future__ import annotations

from itertools import pairwise
from math import asin, cos, degrees, pi, sin

import numpy as np

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import shaded
from er_gym.sim.render.patch import Colour, Triple
from er_gym.sim.render.shapes.forms import laid, leant, lying, roundel
from er_gym.sim.render.shapes.registry import shape

_COVERS: tuple[Colour, ...] = (
    (0.66, 0.13, 0.12), (0.13, 0.28, 0.58), (0.13, 0.43, 0.26), (0.85, 0.60, 0.16),
    (0.45, 0.20, 0.50), (0.10, 0.48, 0.52), (0.80, 0.36, 0.14),
)  # fmt: skip
_PAGES, _PRINT = (0.95, 0.92, 0.82), (0.55, 0.53, 0.50)
_WHITE, _INK, _STEEL, _BRASS = (
    (0.97, 0.97, 0.95), (0.10, 0.15, 0.50), (0.78, 0.79, 0.82), (0.85, 0.68, 0.30),
)  # fmt: skip
_YELLOW, _RAW_WOOD, _ERASER, _LEAD = (
    (0.95, 0.72, 0.10), (0.87, 0.68, 0.44), (0.93, 0.52, 0.55), (0.15, 0.15, 0.16),
)  # fmt: skip


# -- books and papers ----------------------------------------------------------------------------


@shape("Book")
def book(appearance: Appearance) -> Mesh:
    """A book: coloured covers around pale pages, with a title; open: two printed pages."""
    cover = appearance.pick(*_COVERS)
    if appearance.openness <= 0:
        return laid(appearance.size, lambda size: _shut_book(size, cover))
    return laid(appearance.size, lambda size: _open_book(size, cover, appearance.openness))


def _shut_book(size: Triple, cover: Colour) -> Mesh:
    w, h, d = size
    mesh, board = Mesh(), max(0.002, 0.14 * h)
    mesh.box((0, board / 2, 0), (w, board, d), cover, faces="xXYzZ")
    mesh.box((0, h - board / 2, 0), (w, board, d), shaded(cover, 0.8), faces="xXyzZ")
    _cover(mesh, size, cover)
    back = 0.05 * w
    mesh.box((w / 2 - back / 2, h / 2, 0), (back, h - 2 * board, d), cover, faces="XzZ")
    inset = 0.02 * w
    pages = (w - back - inset, h - 2 * board, d - 2 * inset)
    mesh.box(((inset - back) / 2, h / 2, 0), pages, _PAGES, faces="xzZ")
    return mesh


def _cover(mesh: Mesh, size: Triple, cover: Colour) -> None:
    """The front cover: a pale field with the title in a frame of the book's colour."""
    w, h, d = size
    left, right, near, far = 0.34 * w, -0.42 * w, 0.02 * d, -0.38 * d
    for x0, x1, z0, z1, pale in (
        (w / 2, -w / 2, d / 2, near, False), (w / 2, -w / 2, far, -d / 2, False),
        (w / 2, left, near, far, False), (right, -w / 2, near, far, False),
        (left, right, near, far, True),
    ):  # fmt: skip
        corners = [(x0, h, z0), (x1, h, z0), (x1, h, z1), (x0, h, z1)]
        uv = [(0.18, 0.54), (0.92, 0.54), (0.92, 0.86), (0.18, 0.86)]
        if pale:
            mesh.quad(corners, _PAGES, "book", uv=uv)
        else:
            mesh.quad(corners, cover)


def _open_book(size: Triple, cover: Colour, openness: float) -> Mesh:
    """The upper half, turned over the spine at its right; fully open it lies beside it."""
    w, h, d = size
    mesh, half = Mesh(), h / 2
    lower, upper = _half_book((w, half, d), cover), Mesh()
    upper.add(_half_book((w, half, d), cover), turn=("z", 180), at=(0, h, 0))
    spine, shift = (w / 2, half, 0.0), -0.5 * w * openness
    mesh.add(lower, at=(shift, 0, 0))
    mesh.add(upper, at=(shift, 0, 0), turn=("z", -180 * openness), about=spine)
    return mesh


def _half_book(size: Triple, cover: Colour) -> Mesh:
    """A cover with printed pages, which bulge beside the spine at +x."""
    w, h, d = size
    mesh, board = Mesh(), max(0.002, 0.28 * h)
    mesh.box((0, board / 2, 0), (w, board, d), cover)
    left, right, deep = -0.47 * w, 0.5 * w, 0.95 * d
    line = [(left, 0.8 * h), (0.1 * w, h), (0.38 * w, h), (right, 0.6 * h)]
    for (x0, y0), (x1, y1) in pairwise(line):
        corners = [(x1, y1, deep / 2), (x0, y0, deep / 2), (x0, y0, -deep / 2), (x1, y1, -deep / 2)]
        mesh.quad(corners, _PAGES)
    edge = [(left, board, deep / 2), (left, 0.8 * h, deep / 2)]
    mesh.quad([*edge, *((x, y, -z) for x, y, z in reversed(edge))], shaded(_PAGES, 0.9), both=True)
    for side in (-1, 1):
        z = side * deep / 2
        ring = [(left, board, z), (right, board, z), *((x, y, z) for x, y in reversed(line))]
        out = np.tile((0, 0, side), (len(ring), 1))
        fan = [(0, k, k + 1) for k in range(1, len(ring) - 1)]
        mesh.triangles("plain", ring, out, np.zeros((len(ring), 2)), _PAGES, fan)
    for k in range(6):
        z, long = (-0.36 + 0.14 * k) * d, (0.68, 0.62, 0.70, 0.40, 0.66, 0.55)[k]
        at = ((-0.38 + long / 2) * w, h + 0.003, z)
        mesh.panel(at, (long * w, 0.05 * d), _PRINT, facing="Y")
    return mesh


@shape("Newspaper")
@lying
def newspaper(size: Triple) -> Mesh:
    """Grey-white and folded, its sheets fanned out, with a headline and columns of print."""
    w, h, d = size
    if w >= d:
        return _wide_newspaper(size)
    mesh = Mesh()
    mesh.add(_wide_newspaper((d, h, w)), turn=("y", 90))
    return mesh


def _wide_newspaper(size: Triple) -> Mesh:
    """A folded newspaper: thick at the fold on its far side, thinner towards the open side."""
    w, h, d = size
    mesh, back, thin = Mesh(), 0.5 * h - d / 2, 0.35 * h
    for k, (low, high, slip) in enumerate(((0.0, 0.45, 0.0), (0.5, 1.0, 0.03))):
        y0, y1, wide = low * h, high * h, (1 - 2 * slip) * w
        edge = d / 2 - 0.08 * d * k
        outline = [(back, y0), (edge, low * thin), (edge, high * thin), (back, y1)]
        mesh.prism(
            outline, slip * w - wide / 2, slip * w + wide / 2, shaded(_WHITE, 0.85), axis="x"
        )
    turn = np.linspace(pi / 2, 3 * pi / 2, 6)
    outline = [(back + 0.5 * h * cos(a), h / 2 + 0.5 * h * sin(a)) for a in turn]
    mesh.prism(outline, -w / 2, w / 2, shaded(_WHITE, 0.92), axis="x")
    lift, edge = 0.003, 0.42 * d
    top = [
        (w / 2, thin + lift, edge),
        (-w / 2, thin + lift, edge),
        (-w / 2, h, back),
        (w / 2, h, back),
    ]
    mesh.quad(top, _WHITE, "newspaper", uv=[(0, 0.36), (1, 0.36), (1, 1), (0, 1)])
    return mesh


# -- pens ----------------------------------------------------------------------------------------


@shape("Pen")
def pen(appearance: Appearance) -> Mesh:
    """A dark blue rod with a steel tip and a cap with a clip."""
    thick = sorted(appearance.size)[0]
    body = appearance.pick(_INK, (0.08, 0.20, 0.62), (0.12, 0.12, 0.30))
    return leant(appearance.size, thick, lambda length: _pen(length, thick, body))


def _pen(length: float, thick: float, body: Colour) -> Mesh:
    mesh, r = Mesh(), thick / 2
    cone = [(0, 0), (0.25 * r, 0), (0.8 * r, 0.10 * length)]
    mesh.lathe(cone, _STEEL, segments=8)
    rod = [(0.8 * r, 0.10 * length), (0.85 * r, 0.60 * length), (0, 0.60 * length)]
    mesh.lathe(rod, body, segments=8)
    cap = [(0, 0.60 * length), (r, 0.60 * length), (0.95 * r, length), (0, length)]
    mesh.lathe(cap, shaded(body, 0.55), segments=8)
    band = [(1.06 * r, 0.60 * length), (1.06 * r, 0.65 * length)]
    mesh.lathe(band, _BRASS, segments=8)
    for x, z, size in ((0, r, (0.8 * r, 0.6 * r)), (r, 0, (0.6 * r, 0.8 * r))):
        clip = (size[0], 0.28 * length, size[1])
        mesh.box((x, 0.84 * length, z), clip, _STEEL)
    return mesh


@shape("Pencil")
def pencil(appearance: Appearance) -> Mesh:
    """Yellow and six-sided, with a wooden point and a pink eraser."""
    thick = sorted(appearance.size)[0]
    return leant(appearance.size, thick, lambda length: _pencil(length, thick))


def _pencil(length: float, thick: float) -> Mesh:
    mesh, r = Mesh(), thick / 2
    point, ferrule = 2.6 * thick, length - 1.9 * thick
    for low, high, colour in (
        ((0.0, 0.0), (0.35 * r, 0.35 * point), _LEAD),
        ((0.35 * r, 0.35 * point), (r, point), _RAW_WOOD),
        ((r, point), (r, ferrule - thick), _YELLOW),
        ((1.04 * r, ferrule - thick), (1.04 * r, ferrule), _STEEL),
    ):
        mesh.lathe([low, high], colour, segments=6, smooth=False)
    mesh.lathe([(r, ferrule), (r, length - 0.4 * r), (0, length)], _ERASER, segments=8)
    return mesh


# -- pockets -------------------------------------------------------------------------------------


@shape("CreditCard")
def credit_card(appearance: Appearance) -> Mesh:
    """A bright card with a golden chip and rows of figures."""
    colour = appearance.pick(
        (0.12, 0.36, 0.75), (0.80, 0.14, 0.20), (0.90, 0.65, 0.15), (0.10, 0.55, 0.45)
    )
    return laid(appearance.size, lambda size: _card(size, colour))


def _card(size: Triple, edge: Colour) -> Mesh:
    w, h, d = size
    mesh, flat = Mesh(), Mesh()
    long, short = max(w, d), min(w, d)
    flat.box((0, h / 2, 0), (long, h, short), edge, faces="xXzZ")
    flat.panel((0, h, 0), (long, short), (1, 1, 1), "card", facing="Y")
    mesh.add(flat, turn=("y", 90 if d > w else 0))
    return mesh


@shape("KeyChain")
def key_chain(appearance: Appearance) -> Mesh:
    """A ring with keys that spread out, and a coloured tag."""
    tag = appearance.pick((0.80, 0.15, 0.15), (0.15, 0.40, 0.75), (0.20, 0.60, 0.30))
    return laid(appearance.size, lambda size: _keys(size, tag))


def _keys(size: Triple, tag: Colour) -> Mesh:
    w, h, d = size
    mesh, flat = Mesh(), Mesh()
    long, wide = max(w, d), min(w, d)
    ring, thick = 0.34 * wide, 0.4 * h
    tall = min(h, 0.008)
    hoop = [(ring, 0), (ring, tall), (0.78 * ring, tall), (0.78 * ring, 0), (ring, 0)]
    middle = (ring - long / 2, 0.0, 0.0)
    flat.lathe(hoop, _STEEL, at=middle, segments=12, smooth=False)
    reach, bow = long - 1.85 * ring, 0.30 * wide
    spread = degrees(asin(max(0.06, min(0.5, (0.5 * wide - 0.62 * bow) / (long - ring)))))
    for k, (angle, colour) in enumerate(((-spread, _BRASS), (0.0, _STEEL), (spread, _BRASS))):
        length = reach * (1.0 if k == 1 else 0.97)
        key = Mesh()
        key.add(_key(length, bow, thick, colour), at=(0.85 * ring, 0.2 * h * k, 0))
        flat.add(key, at=middle, turn=("y", angle))
    leaf = Mesh()
    leaf.box((0, h / 2, 0), (0.55 * ring, 0.9 * h, 0.9 * ring), tag)
    flat.add(leaf, at=(middle[0] + 0.2 * ring, 0, wide / 2 - 0.45 * ring))
    mesh.add(flat, turn=("y", 90 if d > w else 0))
    return mesh


def _key(length: float, bow: float, thick: float, colour: Colour) -> Mesh:
    """A key along x from its round bow."""
    mesh, y = Mesh(), thick / 2
    mesh.cylinder((bow / 2, y, 0), bow / 2, thick, colour, segments=9)
    mesh.panel((0.35 * bow, thick + 0.002, 0), (0.22 * bow, 0.22 * bow), _LEAD, facing="Y")
    shaft = length - bow
    mesh.box((bow + shaft / 2, y, 0), (shaft, thick, 0.28 * bow), colour, faces="XYzZ")
    for x, deep in ((0.45, 0.22), (0.68, 0.32), (0.9, 0.24)):
        at = (bow + x * shaft, y, (0.14 + deep / 2) * bow)
        mesh.box(at, (0.13 * shaft, thick, deep * bow), colour, faces="xXYZ")
    return mesh


@shape("CD")
@lying
def cd(size: Triple) -> Mesh:
    """A silver disc with a hole, which shimmers in all colours."""
    w, h, d = size
    mesh = Mesh()
    mesh.lathe([(w / 2, 0), (w / 2, h)], _STEEL, segments=20, squash=(1, d / w))
    mesh.add(roundel(w, d, (1, 1, 1), "disc", segments=20), at=(0, h, 0), turn=("x", -90))
    return mesh
