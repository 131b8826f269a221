"""Objects on walls: windows, mirrors, pictures, switches."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import cos, pi, sin

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour, Triple
from er_gym.sim.render.shapes.registry import shape

_WHITE, _IVORY, _BLACK = (0.95, 0.95, 0.94), (0.90, 0.88, 0.82), (0.10, 0.10, 0.11)
_GILT, _WALNUT, _TAPE = (0.76, 0.58, 0.25), (0.33, 0.21, 0.13), (0.85, 0.80, 0.55)
_FULL: Colour = (1.0, 1.0, 1.0)
_GREY, _DARK, _CRACK = (0.45, 0.46, 0.48), (0.16, 0.18, 0.20), (0.97, 0.98, 1.0)
_GRIME, _LIT = (0.42, 0.33, 0.20), (0.35, 0.85, 0.40)
_PICTURES = 8
_APART = 0.006
"""Distance between two layers, metres."""


def across(appearance: Appearance) -> tuple[float, float, float, bool]:
    """Width, height and depth of a flat object, and whether it is along z instead of x."""
    w, h, d = appearance.size
    return (d, h, w, True) if d > w else (w, h, d, False)


def turned(mesh: Mesh, along_z: bool) -> Mesh:
    """A mesh made along x, turned along z if needed."""
    if not along_z:
        return mesh
    found = Mesh()
    found.add(mesh, turn=("y", 90))
    return found


def frame(
    mesh: Mesh, size: Triple, bar: float, colour: Colour, material: str = "plain", z: float = 0.0
) -> None:
    """Four bars around an upright rectangle; ``size`` is width, height and depth."""
    w, h, d = size
    for side in (-1, 1):
        mesh.box((side * (w - bar) / 2, h / 2, z), (bar, h, d), colour, material, turns=0.5)
        y = h / 2 + side * (h - bar) / 2
        mesh.box((0, y, z), (w - 2 * bar, bar, d), colour, material, faces="yYzZ", turns=0.5)


def pane(
    mesh: Mesh, size: tuple[float, float], y: float, z: float, material: str, apart: float = 0.0
) -> None:
    """An upright picture that is visible from both sides."""
    for facing, side in (("Z", 1), ("z", -1)):
        at = (0.0, y, z + side * apart)
        mesh.panel(at, size, _FULL, material, facing="Z" if facing == "Z" else "z")


def cracks(mesh: Mesh, size: tuple[float, float], y: float, z: float, apart: float) -> None:
    """A star of white cracks with a dark hole in its middle, on both sides."""
    w, h = size[0] / 2, size[1] / 2
    thick = 0.007 * min(1.0, min(size) / 0.5)
    jag = (0.30, 0.17, 0.34, 0.14, 0.27, 0.18, 0.32, 0.13, 0.29, 0.16, 0.25)
    steps = len(jag)
    for side in (-1, 1):
        at, top = z + side * apart, z + side * (apart + _APART)
        for k in range(steps):
            (a, r), (b, s) = ((2 * pi * n / steps, jag[n % steps]) for n in (k, k + 1))
            corner = [(0.0, y, at), (w * r * cos(a), y + h * r * sin(a), at)]
            corner.append((w * s * cos(b), y + h * s * sin(b), at))
            mesh.triangles("plain", corner, [(0, 0, side)] * 3, [(0, 0)] * 3, _DARK, [(0, 1, 2)])
            far, bend = 1.0 / max(abs(cos(a)), abs(sin(a))), 0.12 * (-1) ** k
            line = [(share * w * cos(a + turn), y + share * h * sin(a + turn))
                    for share, turn in ((r, 0), (0.6 * far, bend), (0.98 * far, 0))]  # fmt: skip
            nx, ny = -sin(a) * thick, cos(a) * thick
            for (x0, y0), (x1, y1) in pairwise(line):
                strip = [(x0 - nx, y0 - ny, top), (x1 - nx, y1 - ny, top),
                         (x1 + nx, y1 + ny, top), (x0 + nx, y0 + ny, top)]  # fmt: skip
                mesh.quad(strip, _CRACK, "glowing", both=True)


def _smears(mesh: Mesh, size: tuple[float, float], y: float, z: float) -> None:
    """Brown smears on a pane."""
    w, h = size
    for k, (x, up) in enumerate(
        ((-0.25, 0.2), (0.18, 0.28), (0.05, -0.1), (-0.2, -0.28), (0.3, -0.2))
    ):
        slant, wide, tall = (-1) ** k * 0.06 * w, 0.2 * w, 0.07 * h
        middle = y + up * h
        for at, tint in ((z, _GRIME), (-z, _GRIME)):
            mesh.quad(
                [(x * w - wide / 2, middle - tall - slant, at),
                 (x * w + wide / 2, middle - tall, at),
                 (x * w + 0.7 * wide, middle + tall + slant, at),
                 (x * w - wide / 3, middle + tall, at)],
                tint, both=True,
            )  # fmt: skip


_CORNER, _AT_THE_BACK = 0.5, 0.1
"""Windows deeper than the first value are in corners and drawn as deep as the second; metres."""


@shape("Window")
def window(appearance: Appearance) -> Mesh:
    """The sky behind cross bars, with a deep white frame and a sill."""
    w, h, d, along_z = across(appearance)
    if d > _CORNER:
        # The box of a window in a corner surrounds the corner; the window is at its back.
        thin = Mesh()
        wide, tall, _ = appearance.size
        flat = replace(appearance, size=(wide, tall, _AT_THE_BACK))
        thin.add(window(flat), at=(0.0, 0.0, (_AT_THE_BACK - appearance.size[2]) / 2))
        return thin
    mesh = Mesh()
    colour = appearance.pick(_WHITE, _IVORY, mixed(appearance.palette.wood, _WHITE, 0.25))
    bar = min(0.07, 0.14 * min(w, h))
    sill = min(0.05, 0.1 * h)
    inside = (w - 2 * bar, h - 2 * bar)
    z = 0.0 if d < 0.16 else -d / 2 + 0.05
    frame(mesh, (w, h, d), bar, colour)
    pane(mesh, inside, h / 2, z, "sky", 0.004)
    cross = 0.55 * bar
    columns = 1 if w < 0.6 else 2 if w < 1.7 else 3
    for k in range(1, columns):
        x = -w / 2 + w * k / columns
        mesh.box((x, h / 2, z), (cross, inside[1], 0.05), colour, faces="xXzZ")
    if h > 0.6:
        mesh.box((0, 0.55 * h, z), (inside[0], cross, 0.055), colour, faces="yYzZ")
    mesh.box((0, sill / 2, d / 2), (w, sill, 0.04), shaded(colour, 0.92))
    if appearance.broken:
        cracks(mesh, inside, h / 2, z, 0.034)
    return turned(mesh, along_z)


@shape("Mirror")
def mirror(appearance: Appearance) -> Mesh:
    """A pale, gleaming pane in a frame."""
    w, h, d, along_z = across(appearance)
    mesh = Mesh()
    colour = appearance.pick(
        _WALNUT, _BLACK, appearance.palette.metal, appearance.palette.wood, _GILT
    )
    bar = min(0.055, 0.1 * min(w, h))
    thick = min(d, 0.05)
    frame(mesh, (w, h, thick), bar, colour)
    inside = (w - 2 * bar, h - 2 * bar)
    pane(mesh, inside, h / 2, 0.0, "mirror", 0.2 * thick)
    if d > 0.15 and appearance.height < 0.1:  # a mirror on the floor
        for x in (-0.4 * w, 0.4 * w):
            mesh.box((x, 0.02, 0), (0.05, 0.04, d), colour)
    if appearance.dirty:
        _smears(mesh, inside, h / 2, 0.2 * thick + _APART)
    if appearance.broken:
        cracks(mesh, inside, h / 2, 0.0, 0.2 * thick + _APART)
    return turned(mesh, along_z)


@shape("Painting")
def painting(appearance: Appearance) -> Mesh:
    """A picture with a pale border in a wide frame."""
    w, h, d, along_z = across(appearance)
    mesh, random = Mesh(), appearance.random()
    picture = f"picture{int(random.integers(_PICTURES))}"
    colour = (_GILT, _WALNUT, _BLACK, _WHITE, appearance.palette.wood)[int(random.integers(5))]
    bordered = random.random() < 0.5
    bar, thick = min(0.06, 0.11 * min(w, h)), min(d, 0.1)
    frame(mesh, (w, h, thick), bar, colour)
    frame(mesh, (w - 1.2 * bar, h, thick), 0.3 * bar, shaded(colour, 0.7), z=-0.004)
    inside = (w - 2 * bar, h - 2 * bar)
    if bordered:
        mesh.box((0, h / 2, 0), (*inside, 0.3 * thick), _IVORY, faces="zZ")
        inside = (inside[0] - 1.6 * bar, inside[1] - 1.6 * bar)
    pane(mesh, inside, h / 2, 0.0, picture, 0.15 * thick + _APART)
    return turned(mesh, along_z)


@shape("Poster")
def poster(appearance: Appearance) -> Mesh:
    """A thin sheet without a frame: a white edge, taped at its corners, one of them curled."""
    w, h, d, along_z = across(appearance)
    mesh, random = Mesh(), appearance.random()
    picture = f"picture{int(random.integers(_PICTURES))}"
    edge, curl = 0.05 * min(w, h), 0.12 * min(w, h)
    z = -min(0.4 * d, 0.03)
    for side in (1, -1):
        at = z + side * 0.003
        outline = [(-w / 2, 0), (w / 2 - curl, 0), (w / 2, curl), (w / 2, h), (-w / 2, h)]
        points = [(x, y, at) for x, y in outline]
        fan = [(0, 1, 2), (0, 2, 3), (0, 3, 4)]
        mesh.triangles("plain", points, [(0, 0, side)] * 5, [(0, 0)] * 5, _WHITE, fan)
    size = (w - 2 * edge, h - 2 * edge - 0.09 * h)
    pane(mesh, size, h / 2 + 0.045 * h, z, picture, 0.003 + _APART)
    title = shaded(appearance.palette.accent, 0.8)
    mesh.box((-0.1 * w, edge + 0.035 * h, z), (0.6 * w, 0.035 * h, 0.02), title, faces="zZ")
    corner = [(w / 2 - curl, 0, z), (w / 2, curl, z), (w / 2 - 0.9 * curl, 0.9 * curl, 0.45 * d)]
    lifted = [corner[0], corner[1], corner[2], corner[2]]
    mesh.quad(lifted, shaded(_IVORY, 0.85), both=True)
    for x in (0.03 - w / 2, w / 2 - 0.03):
        mesh.box((x, h - 0.02, z), (0.06, 0.03, 0.03), _TAPE, faces="zZ")
    return turned(mesh, along_z)


@shape("LightSwitch")
def light_switch(appearance: Appearance) -> Mesh:
    """A white plate with a rocker or several, up and lit when on."""
    w, h, d, along_z = across(appearance)
    mesh = Mesh()
    rockers = 1 if w < 0.13 else 2 if w < 0.2 else 3
    plate = appearance.pick(_WHITE, _IVORY, _WHITE)
    thick = max(0.4 * d, 0.006)
    mesh.rounded((0, h / 2, -d / 2 + thick / 2), (w, h, thick), plate, 0.2 * thick)
    front = -d / 2 + thick
    wide, tall, deep = 0.5 * w / rockers, 0.5 * h, min(d - thick, 0.016)
    for k in range(rockers):
        x = (k - (rockers - 1) / 2) * w / rockers * 0.85
        mesh.box((x, h / 2, front + 0.002), (1.35 * wide, 1.2 * tall, 0.004), _GREY, faces="xXyYZ")
        up = 1 if appearance.on else -1
        for half in (-1, 1):  # press the half that sticks out
            out = deep if half == up else 0.35 * deep
            tint = _WHITE if half == up else shaded(plate, 0.72)
            at = (x, h / 2 + half * tall / 4, front + out / 2)
            mesh.box(at, (wide, tall / 2, out), tint, faces="xXyYZ")
        mark = _LIT if appearance.on else _DARK
        at = (x, h / 2 + up * 0.3 * tall, front + deep + 0.004)
        mesh.panel(at, (0.5 * wide, 0.07 * h), mark, "glowing" if appearance.on else "plain")
    return turned(mesh, along_z)
