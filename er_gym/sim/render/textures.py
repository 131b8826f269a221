"""Textures made of noise and arithmetic: (128, 128, 3) uint8, multiplied with a colour.

Textures of surfaces are nearly white and tile. Those of :mod:`er_gym.sim.render.pictures` have
their own colours and are drawn on white.
"""

from __future__ import annotations

from functools import cache
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.pictures import PICTURES
from er_gym.sim.render.texture_drawing import (
    SIDE,
    Painter,
    Picture,
    X,
    Y,
    between,
    ground,
    noise,
    paint,
    rectangle,
    stretched,
)
from er_gym.sim.source_key import source_key
from er_gym.writing import kept

SURFACES: dict[str, Painter] = {}
"""Textures of surfaces: they are nearly white, and they tile."""


def _surface(function: Painter) -> Painter:
    SURFACES[function.__name__] = function
    return function


@cache
def texture(name: str) -> NDArray[np.uint8]:
    """(S, S, 3) a texture by name, top row first; S is a power of two."""
    drawn = kept("render", source_key(), f"{name}.texture", lambda: _drawn(name).tobytes())
    return np.frombuffer(drawn, np.uint8).reshape(SIDE, SIDE, 3)


VEIL_EDGE = 0.4
"""How far inside the veil's texture its shadow is whole."""


def veil() -> NDArray[np.uint8]:
    """(S, S) how dark a soft shadow is: whole in the middle, and none at the edge."""
    out = np.maximum(VEIL_EDGE - np.minimum(np.stack([X, Y]), 1.0 - np.stack([X, Y])), 0.0)
    away = np.clip(np.hypot(*out) / (VEIL_EDGE - 1.0 / SIDE), 0.0, 1.0)
    return np.asarray((1.0 - away) ** 2 * 255 + 0.5, dtype=np.uint8)


def _drawn(name: str) -> NDArray[np.uint8]:
    seed = int.from_bytes(blake2b(name.encode(), digest_size=8).digest(), "big")
    picture = TEXTURES[name](np.random.default_rng(seed))
    if picture.ndim == 2:
        picture = np.repeat(picture[..., None], 3, axis=2)
    return np.asarray(np.clip(picture, 0.0, 1.0) * 255 + 0.5, dtype=np.uint8)


def _rows(values: NDArray[np.float64], count: int) -> Picture:
    """(S, 1) values, each repeated on the same number of rows."""
    return np.repeat(values, SIDE // count)[:, None]


# -- walls and floors ----------------------------------------------------------------------------


@_surface
def plaster(random: np.random.Generator) -> Picture:
    """Painted walls."""
    return between(0.95, 1.0, noise(random, 8, 4))


@_surface
def planks(random: np.random.Generator) -> Picture:
    """Eight floorboards that run across, with their ends here and there."""
    boards, side = 8, SIDE // 8
    picture = between(0.86, 1.0, stretched(_grain(random).T))
    picture *= _rows(0.90 + 0.10 * random.random(boards), boards)
    picture[np.arange(SIDE) % side == 0] *= 0.62
    for k, end in enumerate(random.integers(SIDE, size=boards)):
        picture[k * side : (k + 1) * side, end] *= 0.62
    return picture


@_surface
def tiles(random: np.random.Generator) -> Picture:
    """Four by four floor tiles."""
    return _tiled(random, 4, 2, 0.62)


@_surface
def wall_tiles(random: np.random.Generator) -> Picture:
    """Eight by eight glazed tiles with white joints, each with a sheen."""
    picture, side = _tiled(random, 8, 1, 0.78), SIDE // 8
    at = np.arange(SIDE) % side
    picture[np.ix_((at > 1) & (at < 4), (at > 1) & (at < 6))] = 1.0
    return picture


def _tiled(random: np.random.Generator, count: int, joint: int, dark: float) -> Picture:
    picture, side = between(0.93, 1.0, noise(random, 4, 3)), SIDE // count
    shades = 0.94 + 0.06 * random.random((count, count))
    picture *= np.repeat(np.repeat(shades, side, 0), side, 1)
    gap = np.arange(SIDE) % side < joint
    picture[gap] = dark
    picture[:, gap] = dark
    return picture


@_surface
def carpet(random: np.random.Generator) -> Picture:
    """A soft pile."""
    return between(0.80, 1.0, stretched(0.7 * random.random((SIDE, SIDE)) + noise(random, 16, 2)))


# -- materials of objects ------------------------------------------------------------------------


def _grain(random: np.random.Generator) -> Picture:
    across = np.arange(SIDE) / SIDE
    rings = np.sin((10 * across + 0.8 * noise(random, 4, 4)) * 2 * np.pi)
    grain = 0.25 * rings + 0.4 * random.random((1, SIDE)) + 0.3 * noise(random, 8, 3)
    return np.asarray(grain)


@_surface
def wood(random: np.random.Generator) -> Picture:
    """Grain that runs upwards."""
    return between(0.8, 1.0, stretched(_grain(random)))


@_surface
def bark(random: np.random.Generator) -> Picture:
    """Deep furrows that run upwards."""
    furrows = np.abs(np.sin((6 * X + 0.6 * noise(random, 4, 3)) * 2 * np.pi))
    return between(0.62, 1.0, stretched(furrows + 0.6 * noise(random, 16, 2)))


@_surface
def fabric(random: np.random.Generator) -> Picture:
    """A plain weave."""
    weave = np.sin(64 * np.pi * X) + np.sin(64 * np.pi * Y)
    return between(0.80, 1.0, stretched(weave / 8 + 0.6 * noise(random, 16, 3)))


@_surface
def stripes(random: np.random.Generator) -> Picture:
    """Cloth with upright stripes, wide and narrow."""
    picture = ground(between(0.92, 1.0, noise(random, 16, 3))[..., None])
    at = X * 4 % 1.0
    paint(picture, np.where(at < 0.34, 1.0, 0.0), (0.62, 0.66, 0.74))
    paint(picture, np.where(np.abs(at - 0.67) < 0.05, 1.0, 0.0), (0.72, 0.62, 0.62))
    return picture


@_surface
def stone(random: np.random.Generator) -> Picture:
    """Granite: clouds with light and dark specks."""
    specks = random.random((SIDE, SIDE))
    clouds = noise(random, 16, 3) + 0.3 * (specks > 0.94) - 0.3 * (specks < 0.06)
    return between(0.70, 1.0, stretched(clouds))


@_surface
def marble(random: np.random.Generator) -> Picture:
    """White with slanting veins."""
    bent = 2 * (X + Y) + 1.3 * noise(random, 4, 4)
    veins = np.exp(-np.abs(np.sin(np.pi * bent)) * 9)
    return np.asarray(between(0.94, 1.0, noise(random, 4, 3)) - 0.3 * veins * noise(random, 4, 2))


@_surface
def metal(random: np.random.Generator) -> Picture:
    """Brushed upwards."""
    brushed = np.repeat(random.random((1, SIDE)), SIDE, axis=0)
    return between(0.88, 1.0, stretched(brushed + 0.3 * noise(random, 4, 4)))


@_surface
def cardboard(random: np.random.Generator) -> Picture:
    """Fibres, and the ridges of a corrugated layer."""
    ridges = 0.5 + 0.5 * np.sin(32 * np.pi * X)
    return between(0.86, 1.0, stretched(0.35 * ridges + noise(random, 8, 4)))


@_surface
def wicker(random: np.random.Generator) -> Picture:
    """Wicker rods over and under upright stakes."""
    column, row = np.floor(X * 8), np.floor(Y * 16)
    over = (column + row) % 2 == 0
    bulge = np.where(over, np.abs(np.sin(np.pi * X * 8)) ** 0.7, 0.55)
    round_withe = np.abs(np.sin(np.pi * Y * 16)) ** 0.5
    return between(0.62, 1.05, stretched(bulge * round_withe + 0.15 * noise(random, 16, 2)))


@_surface
def leaves(random: np.random.Generator) -> Picture:
    """Leaves on leaves, each with its rib."""
    picture = np.full((SIDE, SIDE), 0.62)
    for k in range(110):
        x, y, angle = random.random(3) * (1, 1, 2 * np.pi)
        dx, dy = (X - x + 0.5) % 1.0 - 0.5, (Y - y + 0.5) % 1.0 - 0.5
        along, aside = np.cos(angle) * dx + np.sin(angle) * dy, np.cos(angle) * dy
        aside = aside - np.sin(angle) * dx
        inside = 0.05 * (1 - (along / 0.11) ** 2) - np.abs(aside)
        shade = 0.80 + 0.25 * (k / 110) - 0.1 * random.random()
        picture = np.where(inside > 0, shade - 0.16 * (np.abs(aside) < 0.007), picture)
    return picture


@_surface
def bread(random: np.random.Generator) -> Picture:
    """Crumb, with holes."""
    holes = noise(random, 16, 2) > 0.72
    return between(0.92, 1.0, noise(random, 8, 3)) - 0.16 * holes


@_surface
def crust(random: np.random.Generator) -> Picture:
    """Baked: darker in patches, dusted with flour."""
    flour = 0.12 * (random.random((SIDE, SIDE)) > 0.9)
    return between(0.72, 0.96, noise(random, 4, 4)) + flour


@_surface
def basketball(random: np.random.Generator) -> Picture:
    """Pimples, and black seams: four that run upwards, one across at the edge."""
    picture = between(0.86, 1.0, random.random((SIDE, SIDE)))
    seam = (np.abs((X * 4 + 0.5) % 1.0 - 0.5) < 0.045) | (np.minimum(Y, 1 - Y) < 0.02)
    picture[seam] = 0.12
    return picture


# -- prints, for objects of any colour -----------------------------------------------------------


@_surface
def book(random: np.random.Generator) -> Picture:
    """A cover: a title in a pale panel, a rule, a darker hinge at its left."""
    picture = ground(between(0.93, 1.0, noise(random, 16, 2))[..., None])
    for top, bottom, left, right in ((0.70, 0.73, 0.3, 0.8), (0.78, 0.81, 0.38, 0.72)):
        paint(picture, rectangle(left, top, right, bottom), (1.0, 0.92, 0.55))
    paint(picture, rectangle(0.0, 0.0, 0.09, 1.0), (0.62, 0.62, 0.62))
    paint(picture, rectangle(0.18, 0.14, 0.92, 0.46), (1.0, 1.0, 0.96))
    for top, left, right in ((0.20, 0.26, 0.84), (0.32, 0.34, 0.76)):
        paint(picture, rectangle(left, top, right, top + 0.07), (0.28, 0.28, 0.28))
    return picture


@_surface
def keys(random: np.random.Generator) -> Picture:
    """A keyboard: five rows of keys, and the space bar."""
    picture = np.full((SIDE, SIDE), 0.5)
    for row in range(5):
        edges = np.arange(15) / 15 + 0.02 * (row % 3)
        for left in edges if row < 4 else (0.02, 0.1, 0.18, 0.74, 0.82, 0.9):
            mask = rectangle(left + 0.008, row / 5 + 0.02, left + 0.06, row / 5 + 0.18)
            picture = np.maximum(picture, mask)
    return np.asarray(np.maximum(picture, rectangle(0.27, 0.82, 0.70, 0.98)))


@_surface
def label(random: np.random.Generator) -> Picture:
    """A band with a badge and some lines of print."""
    picture = ground((1.0, 1.0, 1.0))
    paint(picture, rectangle(-1.0, 0.0, 2.0, 0.10), (0.70, 0.70, 0.70))
    paint(picture, rectangle(-1.0, 0.90, 2.0, 1.0), (0.70, 0.70, 0.70))
    for left in (0.0, 0.5):
        paint(picture, rectangle(left + 0.08, 0.24, left + 0.42, 0.48), (0.35, 0.35, 0.42))
        for top in (0.58, 0.67, 0.76):
            right = left + 0.3 + 0.12 * random.random()
            paint(picture, rectangle(left + 0.1, top, right, top + 0.035), (0.55, 0.55, 0.58))
    return picture


TEXTURES: dict[str, Painter] = {**SURFACES, **PICTURES}
