"""Tables and desks."""

from __future__ import annotations

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.render.shapes.joinery import CLEAR, WALL, apron, case, legs
from er_gym.sim.render.shapes.registry import shape

_WHITE, _DARK = (0.88, 0.87, 0.84), (0.22, 0.16, 0.12)
_SLAB = 0.04
"""Thickness of a table's top, metres."""


def top_height(appearance: Appearance) -> float:
    """Height of the surface on which things stand, metres."""
    h = appearance.size[1]
    return h if appearance.surface is None else min(max(appearance.surface, 0.3 * h), h)


@shape("DiningTable")
def dining_table(appearance: Appearance) -> Mesh:
    """A plain top on four stout legs, as high as a dining table."""
    w, h, d = appearance.size
    random, wood = appearance.random(), appearance.palette.wood
    top, style = top_height(appearance), int(random.integers(3))
    slab, leg = min(_SLAB, 0.2 * h), min(0.075, w / 6, d / 6)
    frame = (wood, _WHITE, shaded(wood, 0.7))[style]
    mesh = Mesh()
    mesh.rounded((0, top - slab / 2, 0), (w, slab, d), wood, 0.008, "wood")
    inset = 0.02 + 0.02 * float(random.random())
    legs(mesh, (w, top - slab, d), leg, frame, inset=inset, taper=(1.0, 0.6, 0.75)[style])
    reach = 2 * inset + leg
    apron(mesh, (w - reach, d - reach), top - slab, min(0.09, 0.2 * h), shaded(frame, 0.85))
    return mesh


@shape("CoffeeTable")
def coffee_table(appearance: Appearance) -> Mesh:
    """Low and broad: a thick top on short legs, with a shelf under it."""
    w, _, d = appearance.size
    random, wood = appearance.random(), shaded(appearance.palette.wood, 0.9)
    top, panels = top_height(appearance), float(random.random()) < 0.4
    slab = min(0.055, 0.3 * top)
    mesh = Mesh()
    mesh.rounded((0, top - slab / 2, 0), (w, slab, d), wood, 0.01, "wood")
    under, side = top - slab, min(0.08, w / 6, d / 6)
    dark = shaded(wood, 0.75)
    if panels:
        for sign in (-1, 1):
            x = sign * (w / 2 - 0.05)
            mesh.box((x, under / 2, 0), (0.05, under, 0.86 * d), dark, "wood", faces="xXzZ")
    else:
        legs(mesh, (w, under, d), side, dark, inset=0.015)
    if not _pedestals(mesh, appearance, under, dark) and top > 0.25:
        shelf = (w - 2 * side, WALL, d - side)
        mesh.box((0, 0.3 * top, 0), shelf, wood, "wood")
    return mesh


@shape("SideTable")
def side_table(appearance: Appearance) -> Mesh:
    """Small: a top that juts out, an apron, slim legs and a shelf low between them."""
    w, h, d = appearance.size
    random, wood = appearance.random(), appearance.palette.wood
    colour = (wood, mixed(wood, _WHITE, 0.75), shaded(wood, 0.65))[int(random.integers(3))]
    top = top_height(appearance)
    slab, side = min(0.03, 0.15 * top), min(0.04, w / 6, d / 6)
    mesh = Mesh()
    mesh.rounded((0, top - slab / 2, 0), (w, slab, d), shaded(colour, 1.08), 0.006, "wood")
    legs(mesh, (w, top - slab, d), side, colour, inset=0.015, taper=0.8)
    reach = side + 0.03
    apron(mesh, (w - reach, d - reach), top - slab, min(0.1, 0.16 * top), shaded(colour, 0.85))
    low = _pedestals(mesh, appearance, top - slab, colour)
    for height in appearance.boards or ((0.22 * top,) if top > 0.35 and not low else ()):
        if height < 0.85 * top:
            at = max(height - CLEAR - WALL / 2, WALL / 2)
            mesh.box((0, at, 0), (w - 0.05, WALL, d - 0.05), shaded(colour, 0.92), "wood")
    if h - top > 0.1:
        _hutch(mesh, appearance, top, shaded(colour, 0.9))
    return mesh


@shape("Desk")
def desk(appearance: Appearance) -> Mesh:
    """A top between two upright sides with a board behind the knees; high desks have shelves."""
    w, h, d = appearance.size
    wood = appearance.palette.wood
    random, top = appearance.random(), top_height(appearance)
    frame = (shaded(wood, 0.8), _DARK, _WHITE)[int(random.integers(3))]
    slab = min(_SLAB, 0.8 * max(h, 0.01))
    mesh = Mesh()
    mesh.rounded((0, top - slab / 2, 0), (w, slab, d), wood, 0.006, "wood")
    under = top - slab
    if under < 0.1:
        return mesh
    for sign in (-1, 1):
        x = sign * (w / 2 - 0.035)
        mesh.box((x, under / 2, -0.01), (0.03, under, d - 0.04), frame, "wood", faces="xXzZ")
    high = 0.5 * under
    back = (0, under - high / 2, -d / 2 + 0.08)
    mesh.box(back, (w - 0.08, high, 0.02), frame, "wood", faces="yzZ")
    _pedestals(mesh, appearance, under, frame)
    if h - top > 0.1:
        _hutch(mesh, appearance, top, frame)
    return mesh


def _pedestals(mesh: Mesh, appearance: Appearance, under: float, colour: Colour) -> bool:
    """Cases around drawers and cabinets built in under a table; returns whether they reach low."""
    w, _, d = appearance.size
    fitted = [
        box for kind, box in appearance.built_in if kind != "Sink" and box[0][1] < under - 0.05
    ]
    stacks: list[list[float]] = []
    for low, high in sorted(fitted):
        if not stacks or low[0] > stacks[-1][1] - 0.02:
            stacks.append([low[0], high[0], low[1], high[1], low[2], high[2]])
        else:
            x0, x1, y0, y1, z0, z1 = stacks[-1]
            stacks[-1] = [x0, max(x1, high[0]), min(y0, low[1]), max(y1, high[1]),
                          min(z0, low[2]), max(z1, high[2])]  # fmt: skip
    for x0, x1, y0, y1, z0, z1 in stacks:
        # A table in the open has drawers at its back as well.
        back = (
            z0 + 0.055 if appearance.kind == "CoffeeTable" and z0 < -d / 2 + 0.05 else -d / 2 + 0.02
        )
        near = (max(x0 - 0.012, -w / 2 + 0.01), max(y0 - 0.012, 0.0), back)
        far = (min(x1 + 0.012, w / 2 - 0.01), min(y1 + 0.03, under), min(z1, d / 2) - 0.055)
        case(mesh, near, far, colour, shaded(colour, 0.4))
    return any(stack[2] < 0.4 * under for stack in stacks)


def _hutch(mesh: Mesh, appearance: Appearance, top: float, colour: Colour) -> None:
    """Shelves on the back of a table's top."""
    w, h, d = appearance.size
    deep, middle = min(0.4 * d, 0.3), (top + h) / 2
    z = -d / 2 + deep / 2
    dark = shaded(colour, 0.75)
    mesh.box((0, middle, -d / 2 + 0.01), (w - 0.01, h - top, 0.02), dark, "wood", faces="zZY")
    for sign in (-1, 1):
        x = sign * (w / 2 - 0.015)
        mesh.box((x, middle, z), (0.03, h - top, deep), colour, "wood", faces="xXzZ")
    heights = [b - CLEAR for b in appearance.boards if top + 0.1 < b < h - 0.05]
    for height in (*(heights or [(top + h) / 2]), h):
        at = (0, height - WALL / 2, z + 0.005)
        mesh.box(at, (w - 0.02, WALL, deep - 0.02), colour, "wood", faces="yYZ")
