"""Sports gear, toys and boots."""

from __future__ import annotations

from math import atan2, cos, degrees, pi

import numpy as np

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import mixed, shaded
from er_gym.sim.render.patch import Colour
from er_gym.sim.render.shapes.forms import leant
from er_gym.sim.render.shapes.registry import shape

_ORANGE, _SEAM = (0.86, 0.40, 0.13), (0.10, 0.08, 0.07)
_ASH, _GRIP, _ALUMINIUM = (0.85, 0.64, 0.38), (0.14, 0.13, 0.13), (0.72, 0.74, 0.78)
_STRINGS, _IRON, _CHROME = (0.95, 0.95, 0.80), (0.16, 0.16, 0.18), (0.80, 0.81, 0.84)
_SOLE, _LINING, _CREAM, _NOSE = (
    (0.12, 0.10, 0.09),
    (0.20, 0.14, 0.10),
    (0.93, 0.84, 0.68),
    (0.12, 0.08, 0.07),
)


@shape("BasketBall")
def basket_ball(appearance: Appearance) -> Mesh:
    """An orange ball with black seams."""
    _, h, _ = appearance.size
    mesh, r = Mesh(), min(appearance.size) / 2
    mesh.ball((0, h / 2, 0), (1.96 * r, 1.96 * r, 1.96 * r), _ORANGE, segments=14, rings=9)
    seam = 0.035 * r
    for axis, offset in (("y", 0.0), ("x", 0.0), ("z", 0.0), ("x", 0.62), ("x", -0.62)):
        around, at = r * (1 - offset**2) ** 0.5, [0.0, h / 2, 0.0]
        at["xyz".index(axis)] += offset * r
        band = [(around, -seam), (around, seam)]
        mesh.lathe(band, _SEAM, at=(at[0], at[1], at[2]), axis=axis, segments=20)  # type: ignore[arg-type]
    return mesh


@shape("BaseballBat")
def baseball_bat(appearance: Appearance) -> Mesh:
    """A baseball bat: a thick barrel, a wrapped grip and a knob."""
    thick = min(0.075, *appearance.size)
    metal = appearance.random().random() < 0.3
    colour, material = (_ALUMINIUM, "metal") if metal else (_ASH, "wood")
    grip = appearance.pick(_GRIP, (0.65, 0.14, 0.13), (0.14, 0.22, 0.50))

    def bat(length: float) -> Mesh:
        mesh = Mesh()
        r, y = thick / 2, length
        barrel = [
            (0.42 * r, 0.30 * y), (0.55 * r, 0.45 * y), (0.95 * r, 0.70 * y), (r, 0.93 * y),
            (0.75 * r, 0.99 * y), (0, y),
        ]  # fmt: skip
        mesh.lathe(barrel, colour, material, segments=10, turns=(1, 0.5))
        knob = [(0, 0), (0.7 * r, 0), (0.7 * r, 0.02 * y), (0.42 * r, 0.035 * y)]
        mesh.lathe(knob, colour, segments=10)
        mesh.lathe([(0.42 * r, 0.035 * y), (0.44 * r, 0.30 * y)], grip, segments=8)
        band = [(1.03 * r, 0.80 * y), (1.03 * r, 0.84 * y)]
        mesh.lathe(band, shaded(grip, 1.2), segments=10)
        return mesh

    return leant(appearance.size, thick, bat)


@shape("TennisRacket")
def tennis_racket(appearance: Appearance) -> Mesh:
    """An oval frame with strings on a long grip."""
    w, h, d = appearance.size
    frame = appearance.pick(
        (0.80, 0.15, 0.15), (0.10, 0.35, 0.70), (0.95, 0.75, 0.10), (0.15, 0.55, 0.3)
    )
    thick, turned = 0.035, w < d if h > min(w, d) else w > d
    width, run = (min(w, d), max(w, d)) if h <= min(w, d) else (max(w, d), min(w, d))
    width = min(width, 0.30)
    mesh, tilted = Mesh(), Mesh()
    if h <= min(w, d):
        tilted.add(_racket(run, width, frame), at=(0, h / 2, -run / 2), turn=("x", 90))
    else:
        tilt = atan2(max(run - thick, 0), h)
        length = min(h / cos(tilt), 0.69)
        upright = _racket(length, width, frame)
        at, middle = (0, (h - length) / 2, 0), (0, length / 2, 0)
        tilted.add(upright, at=at, turn=("x", -degrees(tilt)), about=middle)
    mesh.add(tilted, turn=("y", 90 if turned else 0))
    return mesh


def _racket(length: float, width: float, frame: Colour) -> Mesh:
    """Standing on its grip, its strings facing forwards."""
    mesh, tube, tall = Mesh(), 0.011, 1.28 * width
    a, b, middle = width / 2 - tube, tall / 2 - tube, length - tall / 2
    turn = np.linspace(0, 2 * pi, 15)
    oval = np.stack([a * np.cos(turn), middle + b * np.sin(turn), 0 * turn], axis=1)
    mesh.tube(oval, tube, frame, segments=4)
    throat = middle - 0.62 * b
    grip = 0.32 * length
    for side in (-1, 1):
        mesh.tube([(side * 0.78 * a, throat, 0), (0, grip, 0)], 0.9 * tube, frame, segments=5)
    mesh.cylinder((0, grip / 2, 0), 0.017, grip, _GRIP, segments=8)
    mesh.cylinder((0, 0.012, 0), 0.021, 0.024, frame, segments=8)
    string = 0.0022
    for k in range(-3, 4):
        x, y = 0.25 * k * a, 0.25 * k * b
        up, across = b * (1 - (x / a) ** 2) ** 0.5, a * (1 - (y / b) ** 2) ** 0.5
        mesh.quad(_strip(x - string, x + string, middle - up, middle + up), _STRINGS, both=True)
        low, high = middle + y - string, middle + y + string
        mesh.quad(_strip(-across, across, low, high), _STRINGS, both=True)
    return mesh


def _strip(left: float, right: float, low: float, high: float) -> list[tuple[float, float, float]]:
    return [(left, low, 0), (right, low, 0), (right, high, 0), (left, high, 0)]


@shape("Dumbbell")
def dumbbell(appearance: Appearance) -> Mesh:
    """Two heavy heads on a short bright bar."""
    w, h, d = appearance.size
    mesh, bar = Mesh(), Mesh()
    long, r, y = max(w, d), min(min(w, d), h) / 2, h / 2
    bar.cylinder((0, y, 0), 0.24 * r, 0.5 * long, _CHROME, "metal", axis="z", segments=8)
    for side in (-1, 1):
        at = (0, y, side * 0.36 * long)
        bar.cylinder(at, r, 0.2 * long, _IRON, axis="z", segments=8)
        bar.cylinder((0, y, side * 0.47 * long), 0.7 * r, 0.06 * long, (0.3, 0.3, 0.33), axis="z")
        bar.cylinder((0, y, side * 0.245 * long), 0.7 * r, 0.03 * long, (0.3, 0.3, 0.33), axis="z")
    mesh.add(bar, turn=("y", 90 if w > d else 0))
    return mesh


@shape("TeddyBear")
def teddy_bear(appearance: Appearance) -> Mesh:
    """A sitting bear: a round head with ears and a snout, a pale belly, arms and legs stretched
    out."""
    w, h, d = appearance.size
    fur = appearance.pick((0.58, 0.36, 0.18), (0.72, 0.50, 0.28), (0.45, 0.27, 0.14))
    mesh, pale = Mesh(), mixed(fur, _CREAM, 0.75)

    def ball(x: float, y: float, z: float, a: float, b: float, c: float, colour: Colour) -> None:
        segments, rings = (5, 3) if a < 0.18 else (7, 4) if a < 0.3 else (9, 6)
        size = (a * w, b * h, c * d)
        mesh.ball((x * w, y * h, z * d), size, colour, segments=segments, rings=rings)

    ball(0, 0.29, -0.10, 0.52, 0.58, 0.66, fur)
    ball(0, 0.28, 0.10, 0.36, 0.40, 0.34, pale)
    ball(0, 0.73, -0.06, 0.50, 0.46, 0.60, fur)
    ball(0, 0.67, 0.20, 0.24, 0.19, 0.26, pale)
    ball(0, 0.715, 0.33, 0.085, 0.06, 0.09, _NOSE)
    for side in (-1, 1):
        ball(side * 0.20, 0.91, -0.08, 0.19, 0.18, 0.16, fur)
        ball(side * 0.20, 0.91, -0.02, 0.11, 0.11, 0.10, pale)
        ball(side * 0.10, 0.79, 0.21, 0.055, 0.055, 0.07, _NOSE)
        ball(side * 0.36, 0.40, 0.04, 0.27, 0.19, 0.32, fur)
        ball(side * 0.28, 0.11, 0.20, 0.26, 0.22, 0.58, fur)
        ball(side * 0.28, 0.12, 0.44, 0.17, 0.18, 0.10, pale)
    return mesh


@shape("Boots")
def boots(appearance: Appearance) -> Mesh:
    """A pair of tall boots, toes to the front."""
    w, h, d = appearance.size
    leather = appearance.pick((0.42, 0.25, 0.13), (0.25, 0.17, 0.12), (0.55, 0.36, 0.18))
    mesh = Mesh()
    for side in (-1, 1):
        mesh.add(_boot(0.46 * w, h, d, leather), at=(side * 0.26 * w, 0, 0))
    return mesh


def _boot(w: float, h: float, d: float, leather: Colour) -> Mesh:
    mesh, sole = Mesh(), 0.06 * h
    squash, toe = (1.0, 1.02 * d / w), (0, 0, 0.01 * d)
    mesh.lathe([(0.48 * w, 0), (0.48 * w, sole)], _SOLE, at=toe, segments=12, squash=squash)
    mesh.box((0, 0.7 * sole, -0.30 * d), (0.8 * w, 1.4 * sole, 0.36 * d), _SOLE, faces="xXzZ")
    foot = [
        (0.47, 0), (0.49, 0.10), (0.40, 0.18), (0.2, 0.24), (0, 0.25),
    ]  # fmt: skip
    ring = [(0.96 * r * w, sole + y * h) for r, y in foot]
    mesh.lathe(ring, shaded(leather, 1.1), at=toe, segments=12, squash=squash)
    tube = [
        (0.42, 0.10), (0.40, 0.30), (0.44, 0.65), (0.50, 1.0), (0.44, 1.0), (0.38, 0.6), (0, 0.6),
    ]  # fmt: skip
    shaft = [(r * w, y * h) for r, y in tube]
    squash = (1.0, 0.62 * d / w)
    mesh.lathe(shaft[:4], leather, at=(0, 0, -0.19 * d), segments=12, squash=squash)
    mesh.lathe(shaft[3:5], shaded(leather, 1.5), at=(0, 0, -0.19 * d), segments=12, squash=squash)
    mesh.lathe(shaft[4:], _LINING, at=(0, 0, -0.19 * d), segments=12, squash=squash)
    cuff = [(0.51 * w, 0.90 * h), (0.515 * w, 0.955 * h)]
    mesh.lathe(cuff, shaded(leather, 0.55), at=(0, 0, -0.19 * d), segments=12, squash=squash)
    return mesh
