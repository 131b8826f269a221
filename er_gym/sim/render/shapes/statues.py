"""The figures of statues."""

from __future__ import annotations

from collections.abc import Callable

from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour, Triple

_BASE, _NOSE = (0.16, 0.14, 0.13), (0.10, 0.09, 0.09)


def base(mesh: Mesh, size: Triple, share: float = 1.0) -> float:
    """A plinth over a part of the footprint; returns the height of its top."""
    w, h, d = size
    tall = 0.07 * h
    mesh.box((0, tall / 2, 0), (share * w, tall, share * d), _BASE, faces="xXYzZ")
    return tall


def _dog(size: Triple, stone: Colour) -> Mesh:
    """A standing dog with its head to the right."""
    w, h, d = size
    mesh = Mesh()
    y = base(mesh, size)
    mesh.ball((-0.06 * w, 0.50 * h, 0), (0.62 * w, 0.34 * h, 0.56 * d), stone, segments=9, rings=6)
    mesh.ball((0.14 * w, 0.56 * h, 0), (0.28 * w, 0.40 * h, 0.56 * d), stone, segments=8, rings=6)
    neck = [(0.18 * w, 0.58 * h, 0), (0.28 * w, 0.82 * h, 0)]
    mesh.tube(neck, 0.16 * d, stone, segments=7)
    mesh.ball((0.29 * w, 0.84 * h, 0), (0.22 * w, 0.26 * h, 0.46 * d), stone, segments=8, rings=6)
    mesh.box((0.42 * w, 0.80 * h, 0), (0.15 * w, 0.12 * h, 0.26 * d), stone, taper=0.8)
    mesh.box((0.49 * w, 0.83 * h, 0), (0.02 * w, 0.05 * h, 0.14 * d), _NOSE)
    for side in (-1, 1):
        ear = (0.23 * w, 0.89 * h, side * 0.19 * d)
        mesh.box(ear, (0.08 * w, 0.20 * h, 0.08 * d), shaded(stone, 0.75), taper=0.4)
        for x in (-0.27, 0.17):
            leg = (x * w, (y + 0.5 * h) / 2, side * 0.16 * d)
            mesh.cylinder(leg, 0.045 * w, 0.5 * h - y, stone, segments=6)
    mesh.tube([(-0.33 * w, 0.58 * h, 0), (-0.46 * w, 0.86 * h, 0)], 0.06 * d, stone, segments=5)
    return mesh


def _hand(size: Triple, stone: Colour) -> Mesh:
    """A lying hand with its palm up; the fingers bend upwards."""
    w, h, d = size
    mesh = Mesh()
    mesh.ball((-0.14 * w, 0.24 * h, 0), (0.44 * w, 0.48 * h, 0.72 * d), stone, segments=9, rings=5)
    mesh.cylinder((-0.41 * w, 0.24 * h, 0), 0.20 * h, 0.18 * w, stone, axis="x", segments=8)
    for k, (z, long) in enumerate(((-0.28, 0.86), (-0.10, 1.0), (0.08, 0.97), (0.25, 0.8))):
        bend = 0.09 * w + 0.34 * long * w
        knuckles = [
            (0.04 * w, 0.28 * h, z * d), (0.6 * bend, (0.38 + 0.04 * k) * h, 1.15 * z * d),
            (bend, (0.62 + 0.05 * k) * h, 1.2 * z * d), (bend - 0.01 * w, 0.92 * h, 1.2 * z * d),
        ]  # fmt: skip
        mesh.tube(knuckles, 0.075 * d, stone, segments=6)
    thumb = [
        (-0.18 * w, 0.3 * h, 0.26 * d),
        (-0.06 * w, 0.5 * h, 0.42 * d),
        (0, 0.86 * h, 0.42 * d),
    ]
    mesh.tube(thumb, 0.08 * d, stone, segments=6)
    return mesh


def _head_of_stone(size: Triple, stone: Colour) -> Mesh:
    """A long face with a heavy brow and nose."""
    w, h, d = size
    mesh = Mesh()
    y = base(mesh, size)
    mesh.rounded(
        (0, 0.22 * h, 0), (0.80 * w, 2 * (0.22 * h - y), 0.70 * d), stone, 0.12 * w, "stone"
    )
    mesh.rounded((0, 0.68 * h, 0), (0.88 * w, 0.64 * h, 0.74 * d), stone, 0.16 * w, "stone")
    mesh.box((0, 0.80 * h, 0.34 * d), (0.84 * w, 0.06 * h, 0.24 * d), shaded(stone, 0.9))
    mesh.box((0, 0.66 * h, 0.40 * d), (0.22 * w, 0.26 * h, 0.20 * d), stone, taper=0.6)
    mesh.box((0, 0.47 * h, 0.36 * d), (0.46 * w, 0.035 * h, 0.12 * d), shaded(stone, 0.6))
    for side in (-1, 1):
        eye = (side * 0.26 * w, 0.735 * h, 0.37 * d + 0.004)
        mesh.panel(eye, (0.20 * w, 0.06 * h), shaded(stone, 0.3))
        ear = (side * 0.46 * w, 0.66 * h, 0)
        mesh.box(ear, (0.08 * w, 0.24 * h, 0.2 * d), shaded(stone, 0.85))
    return mesh


def _torso(mesh: Mesh, size: Triple, stone: Colour, top: float) -> None:
    """Shoulders, neck and head of a person up to ``top`` of the height."""
    w, h, d = size
    mesh.ball((0, (top - 0.30) * h, 0), (0.70 * w, 0.20 * h, 0.5 * d), stone, segments=9, rings=5)
    mesh.cylinder((0, (top - 0.19) * h, 0), 0.10 * w, 0.1 * h, stone, segments=7)
    head = (0.40 * w, 0.20 * h, 0.42 * d)
    mesh.ball((0, (top - 0.10) * h, 0), head, stone, segments=9, rings=6)


def _fertile(size: Triple, stone: Colour) -> Mesh:
    """A squat figure with a round belly, its hands on it."""
    w, h, d = size
    mesh = Mesh()
    base(mesh, size, 0.8)
    for side in (-1, 1):
        leg = [(side * 0.18 * w, 0.06 * h, 0), (side * 0.20 * w, 0.3 * h, 0)]
        mesh.tube(leg, 0.15 * w, stone, segments=7)
        arm = [(side * 0.34 * w, 0.68 * h, 0), (side * 0.44 * w, 0.5 * h, 0.05 * d),
               (side * 0.14 * w, 0.44 * h, 0.44 * d)]  # fmt: skip
        mesh.tube(arm, 0.06 * w, stone, segments=5)
        breast = (side * 0.16 * w, 0.60 * h, 0.22 * d)
        mesh.ball(breast, (0.28 * w, 0.13 * h, 0.26 * d), stone, segments=7, rings=5)
    mesh.ball((0, 0.40 * h, 0.05 * d), (0.80 * w, 0.42 * h, 0.84 * d), stone, rings=6)
    _torso(mesh, size, stone, 1.0)
    return mesh


def _draped(size: Triple, stone: Colour) -> Mesh:
    """A person in a cloth that falls to the ground."""
    w, h, d = size
    mesh = Mesh()
    base(mesh, size)
    robe = [(0.44, 0.07), (0.34, 0.30), (0.26, 0.50), (0.33, 0.70), (0.1, 0.78), (0, 0.78)]
    cloth = mixed(stone, (1, 1, 1), 0.35)
    line = [(r * w, y * h) for r, y in robe]
    mesh.lathe(line, cloth, segments=9, squash=(1, d / w), smooth=False)
    _torso(mesh, size, stone, 1.0)
    for side in (-1, 1):
        arm = [(side * 0.32 * w, 0.70 * h, 0), (side * 0.42 * w, 0.54 * h, 0.1 * d),
               (side * 0.10 * w, 0.50 * h, 0.38 * d)]  # fmt: skip
        mesh.tube(arm, 0.06 * w, stone, segments=5)
    return mesh


def _waving(size: Triple, stone: Colour) -> Mesh:
    """A person who lifts an arm."""
    w, h, d = size
    mesh = Mesh()
    base(mesh, size, 0.8)
    for side in (-1, 1):
        leg = [(side * 0.14 * w, 0.06 * h, 0), (side * 0.10 * w, 0.45 * h, 0)]
        mesh.tube(leg, 0.085 * w, stone, segments=6)
    mesh.ball((0, 0.54 * h, 0), (0.42 * w, 0.34 * h, 0.40 * d), stone, segments=9, rings=6)
    _torso(mesh, (0.78 * w, h, d), stone, 0.95)
    lifted = [(0.24 * w, 0.66 * h, 0), (0.42 * w, 0.74 * h, 0), (0.42 * w, 0.97 * h, 0)]
    mesh.tube(lifted, 0.055 * w, stone, segments=6)
    mesh.ball((0.42 * w, 0.95 * h, 0), (0.15 * w, 0.10 * h, 0.1 * d), stone, segments=7, rings=4)
    hanging = [(-0.24 * w, 0.66 * h, 0), (-0.42 * w, 0.52 * h, 0), (-0.26 * w, 0.40 * h, 0.2 * d)]
    mesh.tube(hanging, 0.055 * w, stone, segments=6)
    return mesh


STATUES: dict[str, Callable[[Triple, Colour], Mesh]] = {
    "Dog": _dog,
    "Hand": _hand,
    "Stone": _head_of_stone,
    "Fertility": _fertile,
    "Towel": _draped,
    "Waving": _waving,
}
"""Figures by the first word of the asset id."""
