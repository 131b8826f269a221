"""Cabinets, drawers, shelves, counters and boxes."""

from __future__ import annotations

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour, Triple
from er_gym.sim.render.shapes.joinery import (
    CLEAR,
    HANDLE,
    WALL,
    bar,
    carcass_colour,
    case,
    front,
    grain,
    legs,
    panels,
)
from er_gym.sim.render.shapes.registry import shape
from er_gym.sim.space.solids.carcass import LET_IN, LIP, SLAB, SUNK, TALL, without

_CARD, _TAPE = (0.72, 0.54, 0.34), (0.86, 0.76, 0.52)
_STEEL, _GUNMETAL, _DIAL = (0.30, 0.33, 0.35), (0.20, 0.24, 0.25), (0.85, 0.85, 0.82)
_BRASS, _CRACK = (0.78, 0.62, 0.30), (0.12, 0.11, 0.11)
_WICKERS = ((0.70, 0.54, 0.34), (0.50, 0.36, 0.22), (0.85, 0.80, 0.70))
_LINEN, _LAUNDRY = (0.90, 0.88, 0.82), (0.45, 0.58, 0.72)
_BACK = 0.03
"""How far the sides of a counter stand back from its edges, metres."""


def _fitted(appearance: Appearance) -> Colour:
    """The colour of a cabinet: that of kitchens and bathrooms, or that of the room's furniture."""
    return (
        appearance.palette.cabinet
        if appearance.room in ("kitchens", "bathrooms")
        else appearance.palette.wood
    )


@shape("Cabinet")
def cabinet(appearance: Appearance) -> Mesh:
    """A case with one door, or two if it is wide, with hinges at its sides and upright handles."""
    w, h, d = appearance.size
    colour, mesh = _fitted(appearance), Mesh()
    thick = min(WALL, 0.4 * d)
    face = d / 2 - min(HANDLE, 0.5 * d) - thick
    if d > 0.06:
        low, high = (-w / 2, 0.0, -d / 2), (w / 2, h, face - 0.002)
        case(mesh, low, high, shaded(colour, 0.92), shaded(mixed(colour, _LINEN, 0.3), 0.75))
        if not appearance.boards and h > 0.6:
            at, size = (0, h / 2, -0.08 * d), (w - 0.04, 0.016, 0.6 * d)
            mesh.box(at, size, shaded(colour, 0.8), faces="yYZ")
    doors, left = (2, True) if w > 0.7 else (1, bool(appearance.random().random() < 0.5))
    wide, turn = w / doors, 100.0 * appearance.openness
    for k in range(doors):
        hinge = -1 if (k == 0) == (doors == 2 or left) else 1
        x = wide * (k + 0.5) - w / 2
        door = _door(appearance, wide - 0.008, h - 0.008, thick, hinge)
        mesh.add(
            door, at=(x, h / 2, face), turn=("y", hinge * turn), about=(hinge * wide / 2, 0, 0)
        )
    return mesh


def _door(appearance: Appearance, w: float, h: float, thick: float, hinge: int) -> Mesh:
    """A cabinet's door around its middle; ``hinge`` is the side of its hinges, -1 or 1."""
    mesh = front((w, h), _fitted(appearance), thick)
    long = min(0.16, 0.4 * h)
    # The handle is in reach: near the lower edge of a high door, near the upper edge of a low one.
    y = -h / 2 + 0.06 + long / 2 if appearance.height > 1.2 else h / 2 - 0.06 - long / 2
    y = min(max(1.05 - appearance.height - h / 2, -h / 4), h / 4) if h > 1.4 else y
    mesh.add(
        bar((-hinge * (w / 2 - 0.035), y, thick), long, appearance.palette.metal, upright=True)
    )
    if appearance.broken:
        for a, b, c, e in ((-0.4, 0.1, 0.3, -0.3), (-0.1, 0.4, 0.05, -0.4), (-0.05, 0, 0.4, 0.3)):
            path = [(a * w, b * h, thick + 0.008), (c * w, e * h, thick + 0.008)]
            mesh.tube(path, 0.005, _CRACK, segments=4)
    return mesh


@shape("Drawer")
def drawer(appearance: Appearance) -> Mesh:
    """A broad front with a level handle, and behind it a box that is open at its top."""
    w, h, d = appearance.size
    colour = _fitted(appearance)
    mesh, thick = Mesh(), min(WALL, 0.3 * d)
    face = d / 2 - min(HANDLE, 0.4 * d) - thick
    mesh.add(front((w - 0.004, h - 0.006), shaded(colour, 1.08), thick), at=(0, h / 2, face))
    count = 2 if w > 0.85 else 1
    for k in range(count):
        at = (w / count * (k + 0.5) - w / 2, h / 2, face + thick)
        mesh.add(bar(at, min(0.16, 0.4 * w), appearance.palette.metal, upright=False))
    _tray(
        mesh, (w - 0.03, 0.75 * h, face + d / 2), -d / 2, shaded(mixed(colour, _LINEN, 0.45), 0.9)
    )
    return mesh


def _tray(mesh: Mesh, size: Triple, back: float, colour: Colour) -> None:
    """A drawer's box: thin walls around a bottom."""
    w, h, d = size
    z = back + d / 2
    mesh.box((0, 0.004, z), (w, 0.008, d), colour, faces="yY")
    for sign in (-1, 1):
        mesh.box((sign * (w / 2 - 0.006), h / 2, z), (0.012, h, d), colour, "wood", faces="xXY")
    at = (0, h / 2, back + 0.006)
    mesh.box(at, (w, h, 0.012), shaded(colour, 0.9), "wood", faces="zZY")


@shape("CounterTop")
def counter_top(appearance: Appearance) -> Mesh:
    """A slab of stone with holes for sinks. One that extends to the floor has sides as well.

    :mod:`er_gym.sim.render.carcasses` draws the carcasses of other counters, which are not objects.
    """
    h = appearance.size[1]
    stone, mesh = appearance.palette.counter, Mesh()
    top = min(max(h if appearance.surface is None else appearance.surface, 0.0), h) - SUNK
    # The rim of a sink lies on the slab.
    holes = [
        (low[0] + LIP, low[2] + LIP, high[0] - LIP, high[2] - LIP)
        for kind, (low, high) in appearance.built_in
        if kind in LET_IN and low[1] < top - 0.05 < high[1]
    ]
    for low, high in appearance.parts:
        for x0, z0, x1, z1 in without((low[0], low[2], high[0], high[2]), holes):
            at, size = ((x0 + x1) / 2, top - SLAB / 2, (z0 + z1) / 2), (x1 - x0, SLAB, z1 - z0)
            mesh.box(at, size, stone, "stone")
    if h > TALL:
        fitted = [box for kind, box in appearance.built_in if kind not in LET_IN]
        footprint = [
            (low[0] + _BACK, low[2] + _BACK, high[0] - _BACK, high[2] - _BACK)
            for low, high in appearance.parts
        ]
        panels(
            mesh,
            footprint,
            (-appearance.height, top - SLAB),
            fitted,
            carcass_colour(appearance.palette),
        )
    return mesh


@shape("Shelf")
def shelf(appearance: Appearance) -> Mesh:
    """The board under the space that the record calls a shelf."""
    w, _, d = appearance.size
    mesh = Mesh()
    mesh.box((0, -0.006, 0), (w, WALL, d), shaded(appearance.palette.wood, 1.05), "wood")
    return mesh


@shape("ShelvingUnit")
def shelving_unit(appearance: Appearance) -> Mesh:
    """An open frame of four posts with boards above each other."""
    w, h, d = appearance.size
    wood, mesh = appearance.palette.wood, Mesh()
    frame = appearance.pick(shaded(wood, 0.8), (0.24, 0.25, 0.27))
    post = min(0.04, w / 8, d / 5)
    material = grain(frame)
    legs(mesh, (w, h, d), post, frame, material)
    for height in _boards(appearance):
        at = (0.0, height - WALL / 2, 0.0)
        mesh.box(at, (w - 0.02, WALL, d - 0.02), wood, "wood")
    for sign in (-1, 1):
        for height in (0.12 * h, 0.9 * h):
            at = (sign * (w - post) / 2, height, 0.0)
            mesh.box(at, (0.6 * post, post, d - post), frame, material, faces="xXyY")
    ends = ((-w / 2 + post, 0.08 * h), (w / 2 - post, 0.92 * h))
    z = -d / 2 + 0.012
    for (x0, y0), (x1, y1) in (ends, ((ends[0][0], ends[1][1]), (ends[1][0], ends[0][1]))):
        mesh.tube([(x0, y0, z), (x1, y1, z)], 0.008, frame, material, segments=4)
    return mesh


def _boards(appearance: Appearance) -> list[float]:
    """Heights of the upper sides of a unit's boards, metres."""
    h = appearance.size[1]
    top = h if appearance.surface is None or appearance.surface < 0.5 * h else appearance.surface
    asked = [max(b - CLEAR, WALL) for b in appearance.boards]
    if not asked:
        count = max(2, round(h / 0.4))
        asked = [0.06 + (top - 0.06) * k / count for k in range(count)]
    heights: list[float] = []
    for height in sorted([*asked, *([0.06] if asked[0] > 0.3 else []), top]):
        if not heights or height - heights[-1] > 0.05:
            heights.append(height)
    return heights


@shape("Dresser")
def dresser(appearance: Appearance) -> Mesh:
    """A chest: a top that juts out over a case full of drawers, on short feet."""
    w, h, d = appearance.size
    wood, mesh = appearance.palette.wood, Mesh()
    top = h if appearance.surface is None else min(max(appearance.surface, 0.6 * h), h)
    body = shaded(wood, 0.72)
    foot, slab = 0.03 * min(h, 1.0), 0.022
    case(mesh, (-w / 2 + 0.004, foot, -d / 2), (w / 2 - 0.004, top - 0.01, d / 2 - 0.03), body,
         shaded(wood, 0.35))  # fmt: skip
    mesh.rounded((0, top - slab / 2, 0), (w, slab, d), shaded(wood, 0.95), 0.006, "wood")
    legs(mesh, (w - 0.02, foot, d - 0.05), 0.05, body)
    if h - top > 0.03:
        at, size = (0, (top + h) / 2, -d / 2 + 0.015), (w, h - top, 0.03)
        mesh.box(at, size, body, "wood", faces="xXYzZ")
    return mesh


@shape("TVStand")
def tv_stand(appearance: Appearance) -> Mesh:
    """Low and wide with open bays for boxes and cables under a broad top."""
    w, h, d = appearance.size
    wood, mesh = appearance.palette.wood, Mesh()
    colour = appearance.pick(
        shaded(wood, 0.75), (0.20, 0.18, 0.17), mixed(wood, (1.0, 1.0, 1.0), 0.5)
    )
    top = h if appearance.surface is None else min(max(appearance.surface, 0.6 * h), h)
    foot = 0.1 * top if appearance.height < 0.1 else 0.0
    dark = shaded(colour, 0.55)
    case(
        mesh, (-w / 2 + 0.01, foot, -d / 2), (w / 2 - 0.01, top - 0.01, d / 2 - 0.03), colour, dark
    )
    mesh.rounded((0, top - 0.015, 0), (w, 0.03, d), shaded(colour, 1.1), 0.006, "wood")
    if foot:
        legs(mesh, (w - 0.06, foot, d - 0.06), 0.06, dark, taper=0.6)
    middle = (foot + top) / 2
    at, size = (0, middle, -0.02), (WALL, top - foot - 0.02, d - 0.05)
    mesh.box(at, size, colour, "wood", faces="xXZ")
    heights = [b - CLEAR for b in appearance.boards if foot + 0.06 < b < top - 0.06] or [middle]
    for height in heights:
        at, size = (0, height - WALL / 2, -0.02), (w - 0.05, WALL, d - 0.06)
        mesh.box(at, size, colour, "wood", faces="yYZ")
    return mesh


@shape("Safe")
def safe(appearance: Appearance) -> Mesh:
    """A steel box with a thick door that has a dial and a three-armed handle."""
    w, h, d = appearance.size
    mesh, steel = Mesh(), appearance.pick(_STEEL, _GUNMETAL, (0.24, 0.30, 0.26))
    proud = 0.1 * d
    face, rim = d / 2 - proud, 0.07 * w
    case(mesh, (-w / 2, 0, -d / 2), (w / 2, h, face - 0.002), steel, (0.34, 0.34, 0.36))
    for sign in (-1, 1):
        at = (sign * (w - rim) / 2, h / 2, face)
        mesh.box(at, (rim, h, 0.02), shaded(steel, 0.9), faces="xXYyZ")
        at = (0, h / 2 + sign * (h - rim) / 2, face)
        mesh.box(at, (w - 2 * rim, rim, 0.02), shaded(steel, 0.9), faces="yYZ")
    wide, high = w - 2.3 * rim, h - 2.3 * rim
    door = Mesh()
    door.rounded((0, 0, 0.005), (wide, high, 0.07 * d), shaded(steel, 1.35), 0.01)
    z = 0.035 * d + 0.005
    door.cylinder((0.12 * wide, 0.14 * high, z), 0.17 * w, 0.012, _GUNMETAL, axis="z")
    door.cylinder((0.12 * wide, 0.14 * high, z + 0.008), 0.12 * w, 0.016, _DIAL, axis="z")
    door.box((0.12 * wide, 0.14 * high + 0.07 * w, z + 0.017), (0.02 * w, 0.08 * w, 0.006), _CRACK)
    hub = (0.12 * wide, -0.26 * high)
    for x, y in ((0.0, 1.0), (-0.87, -0.5), (0.87, -0.5)):
        end = (hub[0] + 0.13 * w * x, hub[1] + 0.13 * w * y, z + 0.012)
        door.tube([(*hub, z + 0.012), end], 0.018 * w, _BRASS, segments=6)
    hinge = (-wide / 2, 0, 0)
    mesh.add(door, at=(0, h / 2, face), turn=("y", -105.0 * appearance.openness), about=hinge)
    for share in (0.25, 0.75):
        at = (-w / 2 + 0.8 * rim, share * h, face + 0.012)
        mesh.cylinder(at, 0.03 * w, 0.14 * h, _STEEL, segments=8)
    return mesh


@shape("Box")
def cardboard_box(appearance: Appearance) -> Mesh:
    """Brown cardboard, taped along its top, or with its four flaps thrown open."""
    w, h, d = appearance.size
    mesh, card = Mesh(), shaded(_CARD, 0.9 + 0.2 * float(appearance.random().random()))
    lip, skin = h - 0.012, 0.004
    size = (w - 2 * skin, lip, d - 2 * skin)
    mesh.box((0, lip / 2, 0), size, card, "cardboard", faces="xXyzZ", turns=0.5)
    at = (-0.22 * w, 0.62 * h, d / 2)
    mesh.panel(at, (0.3 * w, 0.34 * h), _LINEN, "label")
    if appearance.openness:
        inside = shaded(card, 0.7)
        mesh.panel((-w / 2 + 0.01, lip / 2, 0), (d, lip), inside, "cardboard", facing="X")
        mesh.panel((w / 2 - 0.01, lip / 2, 0), (d, lip), inside, "cardboard", facing="x")
        mesh.panel((0, lip / 2, -d / 2 + 0.01), (w, lip), inside, "cardboard", facing="Z")
        mesh.panel((0, lip / 2, d / 2 - 0.01), (w, lip), inside, "cardboard", facing="z")
        mesh.panel((0, 0.012, 0), (w, d), inside, "cardboard", facing="Y")
    turned = Mesh()
    _flaps(turned, max(w, d) - 2 * skin, min(w, d) - 2 * skin, h, card, appearance.openness)
    mesh.add(turned, turn=("y", 0.0 if w >= d else 90.0))
    return mesh


def _flaps(mesh: Mesh, w: float, d: float, h: float, colour: Colour, openness: float) -> None:
    """The flaps of a box that is longer in x: the long ones meet in the middle, under a tape."""
    for sign in (-1, 1):
        flap = Mesh()
        corners = [(x, h - 0.004, z) for x, z in _corners(w, 0.0, sign * d / 2)]
        flap.quad(corners, shaded(colour, 1.08), "cardboard", both=True)
        hinge = (0.0, h - 0.004, sign * d / 2)
        mesh.add(flap, turn=("x", sign * 220.0 * openness), about=hinge)
        flap, long = Mesh(), min(d / 2, 0.45 * w)
        inner = sign * (w / 2 - long)
        corners = [(x, h - 0.012, z) for z, x in _corners(d, inner, sign * w / 2)]
        flap.quad(corners, shaded(colour, 0.95), "cardboard", both=True)
        hinge = (sign * w / 2, h - 0.012, 0.0)
        mesh.add(flap, turn=("z", -sign * 205.0 * openness), about=hinge)
        if not openness:
            at, size = (sign * (w / 2 + 0.002), h - 0.05, 0.0), (0.004, 0.1, 0.06)
            mesh.box(at, size, _TAPE, faces="xXyzZ")
    if not openness:
        mesh.box((0, h - 0.002, 0), (w, 0.004, 0.06), _TAPE, faces="xXYzZ")


def _corners(long: float, near: float, far: float) -> list[tuple[float, float]]:
    """A rectangle: half its length to both sides, and from one place across to another."""
    half = long / 2
    return [(-half, near), (half, near), (half, far), (-half, far)]


@shape("LaundryHamper")
def laundry_hamper(appearance: Appearance) -> Mesh:
    """A tall oval wicker basket with a lid; the laundry shows when it is open."""
    w, h, d = appearance.size
    mesh, wicker = Mesh(), appearance.pick(*_WICKERS)
    rim, turns = 0.88 * h, (8.0, 0.2)
    outline = [(0, 0.01), (0.38, 0), (0.46, rim), (0.47, rim + 0.02), (0.43, rim + 0.02)]
    outline += [(0.42, rim - 0.02), (0.37, 0.3 * h)]
    mesh.lathe(outline, wicker, "wicker", squash=(w, d), segments=18, turns=turns)
    for height in (0.3 * h, 0.62 * h):
        r = 0.38 + 0.08 * height / rim
        band = [(r, height - 0.015), (r + 0.015, height), (r, height + 0.015)]
        mesh.lathe(band, shaded(wicker, 0.75), squash=(w, d), segments=18)
    heap = [(0.37, 0.3 * h), (0.3, 0.5 * h), (0.12, 0.58 * h), (0, 0.56 * h)]
    mesh.lathe(heap, appearance.pick(_LINEN, _LAUNDRY), "fabric", squash=(w, d), segments=12)
    lid = Mesh()
    top = h - rim - 0.02
    cover = [(0.42, 0), (0.5, 0), (0.5, 0.35 * top), (0.4, 0.75 * top), (0, 0.8 * top)]
    lid.lathe(cover, shaded(wicker, 1.1), "wicker", squash=(w, d), segments=18, turns=turns)
    lid.lathe([(0, 0), (0.42, 0)], shaded(wicker, 0.6), squash=(w, d), segments=18)
    lid.ball(
        (0, 0.8 * top, 0), (0.1 * w, 0.4 * top, 0.1 * w), shaded(wicker, 0.6), segments=8, rings=4
    )
    hinge = (0, 0, -0.46 * d)
    mesh.add(lid, at=(0, rim + 0.02, 0), turn=("x", -100.0 * appearance.openness), about=hinge)
    return mesh
