"""The tools that textures are drawn with: noise that tiles, and soft shapes on a square.

A square is (SIDE, SIDE). x goes from 0 at its left to 1 at its right, y from 0 at its top to 1 at
its bottom. A mask is 1 inside a shape, 0 outside, and in between on its edge.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import ArrayLike, NDArray

SIDE = 128
Picture = NDArray[np.float64]
"""(S, S) or (S, S, 3), 0 to 1."""
Painter = Callable[[np.random.Generator], Picture]
Y, X = (np.mgrid[0:SIDE, 0:SIDE] + 0.5) / SIDE


def noise(random: np.random.Generator, cells: int, octaves: int = 1) -> Picture:
    """(S, S) smooth noise that tiles, 0 to 1."""
    found, weight = np.zeros((SIDE, SIDE)), 1.0
    for octave in range(octaves):
        n = cells * 2**octave
        grid = np.pad(random.random((n, n)), (0, 1), mode="wrap")
        at = np.arange(SIDE) / SIDE * n
        i, f = at.astype(int), at % 1.0
        f = f * f * (3 - 2 * f)
        upper = grid[np.ix_(i, i)] * (1 - f) + grid[np.ix_(i, i + 1)] * f
        lower = grid[np.ix_(i + 1, i)] * (1 - f) + grid[np.ix_(i + 1, i + 1)] * f
        found += weight * (upper * (1 - f)[:, None] + lower * f[:, None])
        weight /= 2
    return np.asarray((found - found.min()) / (np.ptp(found) or 1.0))


def between(low: float, high: float, picture: Picture) -> Picture:
    """Values from 0 to 1, scaled to the range from ``low`` to ``high``."""
    return low + (high - low) * picture


def stretched(picture: Picture) -> Picture:
    """Any values, scaled to the range from 0 to 1."""
    return np.asarray((picture - picture.min()) / (np.ptp(picture) or 1.0))


# -- masks ---------------------------------------------------------------------------------------


def soft(inside: Picture) -> Picture:
    """The mask of the area where a signed distance is positive."""
    return np.asarray(np.clip(inside * SIDE + 0.5, 0.0, 1.0))


def oval(x: float, y: float, radius: float, tall: float = 1.0) -> Picture:
    """An ellipse; ``tall`` is its height divided by its width."""
    return soft(radius - np.hypot(X - x, (Y - y) / tall))


def ring(x: float, y: float, radius: float, width: float) -> Picture:
    """A circle line."""
    return soft(width / 2 - np.abs(np.hypot(X - x, Y - y) - radius))


def rectangle(left: float, top: float, right: float, bottom: float) -> Picture:
    """A rectangle between its edges."""
    return soft(np.minimum(np.minimum(X - left, right - X), np.minimum(Y - top, bottom - Y)))


def line(ends: Iterable[float], width: float) -> Picture:
    """A line from (x, y) to (x, y) with round ends."""
    x0, y0, x1, y1 = ends
    dx, dy = x1 - x0, y1 - y0
    along = np.clip(((X - x0) * dx + (Y - y0) * dy) / max(dx * dx + dy * dy, 1e-9), 0.0, 1.0)
    return soft(width / 2 - np.hypot(X - x0 - along * dx, Y - y0 - along * dy))


def leaf(x: float, y: float, size: tuple[float, float], turn: float) -> Picture:
    """An ellipse with a length and a width, turned by an angle in radians."""
    c, s = np.cos(turn), np.sin(turn)
    along, aside = (X - x) * c + (Y - y) * s, (Y - y) * c - (X - x) * s
    return soft((1 - np.hypot(along / size[0], aside / size[1])) * min(size))


def polygon(*corners: tuple[float, float]) -> Picture:
    """A convex polygon; its corners go clockwise as seen."""
    inside = np.full((SIDE, SIDE), np.inf)
    for (x0, y0), (x1, y1) in zip(corners, (*corners[1:], corners[0]), strict=True):
        length = max(float(np.hypot(x1 - x0, y1 - y0)), 1e-9)
        inside = np.minimum(inside, ((x1 - x0) * (Y - y0) - (y1 - y0) * (X - x0)) / length)
    return soft(inside)


def below(curve: ArrayLike) -> Picture:
    """The area below a height (a number, (S,) or (S, S))."""
    return soft(Y - np.asarray(curve))


def waves(random: np.random.Generator, middle: float, height: float, turns: int = 2) -> Picture:
    """(S, S) a horizon of hills for :func:`below`."""
    x, found = X[:1], np.full((1, SIDE), middle)
    for k in range(1, 4):
        phase = random.random()
        found = found + height / k * np.sin(2 * np.pi * (turns * k * x / 2 + phase))
    return np.repeat(found, SIDE, axis=0)


# -- colours -------------------------------------------------------------------------------------


def ground(colour: ArrayLike) -> Picture:
    """(S, S, 3) of one colour, or of (S, S, 1) shares of it."""
    return np.broadcast_to(np.asarray(colour, dtype=np.float64), (SIDE, SIDE, 3)).copy()


def fade(top: ArrayLike, bottom: ArrayLike) -> Picture:
    """(S, S, 3) from one colour at the top to another at the bottom."""
    first = np.asarray(top, dtype=np.float64)
    return np.asarray(first + Y[..., None] * (np.asarray(bottom) - first))


def paint(picture: Picture, mask: Picture, colour: ArrayLike, strength: float = 1.0) -> None:
    """Paint a colour, or another picture, onto a picture where a mask is set."""
    picture += strength * mask[..., None] * (np.asarray(colour) - picture)
