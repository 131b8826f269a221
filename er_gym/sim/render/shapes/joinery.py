"""The parts of furniture: cases, fronts, handles and legs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import Palette, shaded
from er_gym.sim.render.patch import Colour, Triple
from er_gym.sim.space.solids.built_in import Box

WALL = 0.02
"""Thickness of boards, metres."""
HANDLE = 0.025
"""How far handles stick out, metres."""
_PLINTH = (0.16, 0.14, 0.13)
CLEAR = 0.008
"""How far a board lies below the Shelf object's board at the same height, metres."""

Rectangle = tuple[float, float, float, float]
"""Two lower ends and two upper ends, metres."""


def grain(colour: Colour) -> str:
    """The material of a colour: brown wood has grain, paint has none."""
    return "wood" if colour[0] - colour[2] > 0.15 else "plain"


def legs(
    mesh: Mesh,
    size: tuple[float, float, float],
    side: float,
    colour: Colour,
    material: str = "wood",
    *,
    inset: float = 0.0,
    taper: float = 1.0,
) -> None:
    """Four legs under a box; ``taper`` is their width at the floor, as a share."""
    w, h, d = size
    x, z = (w - side) / 2 - inset, (d - side) / 2 - inset
    for a in (-x, x):
        for b in (-z, z):
            leg = Mesh()
            # A box tapers at its top, so the leg is made upside down.
            leg.box((0, 0, 0), (side, h, side), colour, material, faces="xXzZ", taper=taper)
            mesh.add(leg, at=(a, h / 2, b), turn=("x", 180.0))


def apron(mesh: Mesh, size: tuple[float, float], under: float, high: float, colour: Colour) -> None:
    """The rails that join a table's legs under its top: width and depth, top and height."""
    w, d = size
    middle = under - high / 2
    # Drawers may come through at the front, so the rail stands well back there.
    for z in (-d / 2, d / 2 - 0.06):
        mesh.box((0, middle, z), (w, high, 0.02), colour, "wood", faces="zZy")
    for sign in (-1, 1):
        mesh.box((sign * w / 2, middle, 0), (0.02, high, d), colour, "wood", faces="xXy")


def case(mesh: Mesh, low: Triple, high: Triple, colour: Colour, inner: Colour) -> None:
    """A box that is open at its front, with another colour inside."""
    material = grain(colour)
    (x0, y0, z0), (x1, y1, z1) = low, high
    middle = ((x0 + x1) / 2, (y0 + y1) / 2, (z0 + z1) / 2)
    w, h, d = x1 - x0, y1 - y0, z1 - z0
    mesh.box(middle, (w, h, d), colour, material, faces="xXyYz")
    t = min(WALL, 0.2 * w, 0.2 * h)
    for x in (x0 + t / 2, x1 - t / 2):
        mesh.box((x, middle[1], z1 - 0.005), (t, h, 0.01), colour, material, faces="Z")
    for y in (y0 + t / 2, y1 - t / 2):
        mesh.box((middle[0], y, z1 - 0.005), (w - 2 * t, t, 0.01), colour, material, faces="Z")
    mesh.panel((x0 + t, middle[1], middle[2]), (d, h), inner, facing="X")
    mesh.panel((x1 - t, middle[1], middle[2]), (d, h), inner, facing="x")
    mesh.panel((middle[0], y0 + t, middle[2]), (w, d), shaded(inner, 0.8), facing="Y")
    mesh.panel((middle[0], y1 - t, middle[2]), (w, d), shaded(inner, 0.8), facing="y")
    mesh.panel((middle[0], middle[1], z0 + t), (w, h), shaded(inner, 0.9), facing="Z")


def front(size: tuple[float, float], colour: Colour, thick: float = WALL) -> Mesh:
    """A door or a drawer front: a frame around a panel; its back is at z = 0."""
    w, h = size
    mesh, material = Mesh(), grain(colour)
    mesh.box((0, 0, thick / 2), (w, h, thick), shaded(colour, 0.8), material)
    rim = min(0.055, 0.2 * w, 0.22 * h)
    z, proud = thick + 0.003, 0.006
    for sign in (-1, 1):
        at = (sign * (w - rim) / 2, 0.0, z)
        mesh.box(at, (rim - 0.006, h - 0.006, proud), colour, material, faces="xXZ")
        at = (0.0, sign * (h - rim) / 2, z)
        mesh.box(at, (w - 2 * rim, rim - 0.006, proud), colour, material, faces="yYZ")
    return mesh


def bar(at: Triple, long: float, colour: Colour, *, upright: bool) -> Mesh:
    """A handle on two feet in front of a point."""
    mesh, (x, y, z) = Mesh(), at
    half = long / 2 - 0.008
    for sign in (-1, 1):
        foot = (x, y + sign * half, z + 0.008) if upright else (x + sign * half, y, z + 0.008)
        mesh.box(foot, (0.012, 0.012, 0.016), colour, faces="xXyY")
    size = (0.014, long, 0.01) if upright else (long, 0.014, 0.01)
    mesh.box((x, y, z + 0.018), size, colour, faces="xXyYZ")
    return mesh


def carcass_colour(palette: Palette) -> Colour:
    """The colour of counters' carcasses."""
    return shaded(palette.cabinet, 0.85)


def panels(
    mesh: Mesh,
    footprint: Sequence[Rectangle],
    ends: tuple[float, float],
    fitted: Sequence[Box],
    colour: Colour,
) -> None:
    """Upright panels around a carcass, except where a cabinet or a drawer is built in.

    Args:
        footprint: its rectangles on the floor.
        ends: its lowest and highest height, metres.
        fitted: low and high corners of the built-in objects.
    """
    floor, top = ends
    for k, part in enumerate(footprint):
        # An edge that touches another part gets no panel.
        others = [
            ((a[0], floor, a[1]), (a[2], top, a[3])) for j, a in enumerate(footprint) if j != k
        ]
        for axis, sign, facing in ((0, -1, "x"), (0, 1, "X"), (2, -1, "z"), (2, 1, "Z")):
            edge = part[axis // 2 + (2 if sign > 0 else 0)]
            along = 2 - axis
            near = [
                (low[along], high[along], low[1], high[1])
                for boxes, reach in ((others, 0.05), (fitted, 0.12))
                for low, high in boxes
                if low[axis] - reach < edge < high[axis] + reach
            ]
            inner = (part[along // 2], part[along // 2 + 2])
            for a, b, y0, y1 in _gaps((*inner, floor, top), near):
                low = y1 - floor < 0.16
                at, size = [0.0, (y0 + y1) / 2, 0.0], [0.01, y1 - y0, 0.01]
                at[axis], at[along] = edge - sign * (0.06 if low else 0.005), (a + b) / 2
                size[along] = b - a
                mesh.box(
                    (at[0], at[1], at[2]),
                    (size[0], size[1], size[2]),
                    _PLINTH if low else colour,
                    "plain" if low else grain(colour),
                    faces=facing,
                )


def _gaps(wall: Rectangle, taken: Sequence[Rectangle]) -> Iterator[Rectangle]:
    """The free parts of an upright rectangle: along from and to, height from and to, metres."""
    first, last, floor, top = wall
    ends = {first, last}
    ends.update(min(max(end, first), last) for rectangle in taken for end in rectangle[:2])
    for a, b in pairwise(sorted(ends)):
        middle, y = (a + b) / 2, floor
        spans = [(y0, y1) for x0, x1, y0, y1 in taken if x0 <= middle <= x1]
        for y0, y1 in [*sorted(spans), (top, top)]:
            if y0 - y > 0.04 and b - a > 0.005:
                yield a, b, y, min(y0, top)
            y = max(y, y1)
