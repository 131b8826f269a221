"""Textures with their own colours: paintings, screens, the view from a window."""

from __future__ import annotations

import numpy as np

from er_gym.sim.render.texture_drawing import (
    SIDE,
    Painter,
    Picture,
    X,
    Y,
    below,
    between,
    fade,
    ground,
    leaf,
    line,
    noise,
    oval,
    paint,
    polygon,
    rectangle,
    ring,
    waves,
)

PICTURES: dict[str, Painter] = {}
_INK, _WHITE = (0.10, 0.10, 0.12), (1.0, 1.0, 1.0)
_SKIN, _HAIR = (0.88, 0.68, 0.54), (0.28, 0.16, 0.10)
_SEGMENTS = (
    "abcdef",
    "bc",
    "abdeg",
    "abcdg",
    "bcfg",
    "acdfg",
    "acdefg",
    "abc",
    "abcdefg",
    "abcdfg",
)
"""The lit segments of a seven-segment display for the digits 0 to 9."""


def _picture(function: Painter) -> Painter:
    PICTURES[function.__name__] = function
    return function


def _digit(value: int, x: float, y: float, width: float, height: float) -> Picture:
    """The mask of a seven-segment digit; x, y is its upper left corner."""
    left, right, top, low = x, x + width, y, y + height
    middle, pen = y + height / 2, width / 3.2
    ends = {
        "a": (left, top, right, top), "b": (right, top, right, middle),
        "c": (right, middle, right, low), "d": (left, low, right, low),
        "e": (left, middle, left, low), "f": (left, top, left, middle),
        "g": (left, middle, right, middle),
    }  # fmt: skip
    return np.asarray(np.max([line(ends[s], pen) for s in _SEGMENTS[value]], axis=0))


def _print(
    picture: Picture, box: tuple[float, float, float, float], lines: int, colour: float = 0.4
) -> None:
    """Lines of print within (left, top, right, bottom); the last line is short."""
    left, top, right, bottom = box
    step = (bottom - top) / lines
    for k in range(lines):
        end = right if k < lines - 1 else left + 0.6 * (right - left)
        mask = rectangle(left, top + k * step, end, top + (k + 0.5) * step)
        paint(picture, mask, (colour, colour, colour))


# -- paper and plastic ---------------------------------------------------------------------------


@_picture
def paper(random: np.random.Generator) -> Picture:
    """A page with some lines of writing."""
    picture = ground((0.98, 0.98, 0.96))
    for k in range(9):
        y, end = 0.14 + 0.085 * k, 0.6 + 0.28 * random.random()
        curl = y + 0.008 * np.sin(X * 90 + 9 * random.random())
        mask = rectangle(0.12, 0.0, end, 1.0) * np.clip(1.6 - np.abs(Y - curl) * SIDE, 0, 1)
        paint(picture, mask, (0.25, 0.28, 0.45))
    return picture


@_picture
def newspaper(random: np.random.Generator) -> Picture:
    """A title, a headline, a photograph and four columns of print."""
    picture = ground(between(0.88, 0.93, noise(random, 16, 2))[..., None] * (1.0, 0.99, 0.95))
    paint(picture, rectangle(0.12, 0.03, 0.88, 0.12), _INK)
    paint(picture, rectangle(0.04, 0.145, 0.96, 0.155), _INK)
    paint(picture, rectangle(0.05, 0.19, 0.95, 0.25), (0.22, 0.22, 0.24))
    for k in range(4):
        left = 0.05 + 0.235 * k
        _print(
            picture,
            (left, 0.66 if k in (1, 2) else 0.30, left + 0.195, 0.97),
            9 + 9 * (k % 3 == 0),
            0.5,
        )
    paint(picture, rectangle(0.285, 0.30, 0.715, 0.62), (0.72, 0.72, 0.70))
    paint(
        picture,
        rectangle(0.285, 0.30, 0.715, 0.62) * below(0.50 + 0.05 * np.sin(9 * X)),
        (0.4, 0.4, 0.4),
    )
    paint(picture, oval(0.42, 0.46, 0.06), (0.25, 0.25, 0.25))
    return picture


@_picture
def card(random: np.random.Generator) -> Picture:
    """A credit card: blue, with a gold chip, a number and two circles."""
    picture = fade((0.16, 0.34, 0.78), (0.10, 0.20, 0.55))
    paint(picture, oval(0.9, 0.1, 0.55), (0.30, 0.52, 0.90), 0.6)
    paint(picture, rectangle(0.10, 0.26, 0.28, 0.48), (0.92, 0.78, 0.36))
    paint(picture, rectangle(0.10, 0.36, 0.28, 0.38), (0.6, 0.48, 0.2))
    for k in range(4):
        paint(picture, rectangle(0.10 + 0.2 * k, 0.58, 0.26 + 0.2 * k, 0.67), _WHITE)
    paint(picture, rectangle(0.10, 0.80, 0.50, 0.87), (0.85, 0.88, 0.95))
    paint(picture, oval(0.76, 0.83, 0.09), (0.90, 0.20, 0.15))
    paint(picture, oval(0.86, 0.83, 0.09), (0.97, 0.68, 0.15), 0.9)
    return picture


@_picture
def disc(random: np.random.Generator) -> Picture:
    """A compact disc: silver with the colours of the rainbow, and a hole."""
    x, y = X - 0.5, Y - 0.5
    angle = np.arctan2(y, x)
    hue = np.stack([np.cos(2 * angle + shift) for shift in (0.0, 2.1, 4.2)], axis=2)
    picture = np.asarray(0.80 + 0.17 * hue * np.abs(np.cos(angle))[..., None])
    paint(picture, oval(0.5, 0.5, 0.17), (0.92, 0.92, 0.93))
    paint(picture, ring(0.5, 0.5, 0.17, 0.02), (0.5, 0.5, 0.55))
    paint(picture, oval(0.5, 0.5, 0.06), (0.15, 0.15, 0.16))
    return picture


@_picture
def clock(random: np.random.Generator) -> Picture:
    """A clock face at ten past ten: twelve marks, two hands."""
    picture = ground((0.97, 0.96, 0.92))
    paint(picture, 1.0 - oval(0.5, 0.5, 0.485), (0.85, 0.84, 0.80))
    for k in range(12):
        a, b = np.sin(k * np.pi / 6), -np.cos(k * np.pi / 6)
        inner, pen = (0.36, 0.05) if k % 3 == 0 else (0.40, 0.03)
        ends = [0.5 + inner * a, 0.5 + inner * b, 0.5 + 0.44 * a, 0.5 + 0.44 * b]
        paint(picture, line(ends, pen), _INK)
    paint(picture, line((0.5, 0.5, 0.30, 0.37), 0.055), _INK)
    paint(picture, line((0.5, 0.5, 0.79, 0.31), 0.04), _INK)
    paint(picture, line((0.46, 0.58, 0.62, 0.22), 0.014), (0.80, 0.12, 0.10))
    paint(picture, oval(0.5, 0.5, 0.04), _INK)
    return picture


# -- screens, windows and other lights -----------------------------------------------------------


@_picture
def sky(random: np.random.Generator) -> Picture:
    """The view from a window: clouds, hills, a garden with trees."""
    picture = fade((0.52, 0.74, 0.98), (0.90, 0.96, 1.0))
    clouds = np.clip(noise(random, 4, 4) * 2.6 - 1.35, 0.0, 1.0) * (1.1 - Y)
    paint(picture, np.clip(clouds, 0, 1), _WHITE)
    paint(picture, below(waves(random, 0.62, 0.05)), (0.55, 0.70, 0.72))
    paint(picture, below(waves(random, 0.72, 0.03)), (0.45, 0.66, 0.36))
    for k in range(7):
        x, y, r = (k + random.random()) / 7, 0.68 + 0.05 * random.random(), 0.05
        paint(picture, rectangle(x - 0.01, y, x + 0.01, y + 0.12), (0.35, 0.26, 0.16))
        paint(picture, oval(x, y, r + 0.03 * random.random(), 1.2), (0.22, 0.48, 0.22))
    paint(picture, below(0.82 + 0.01 * np.sin(12 * X)), (0.52, 0.74, 0.34))
    return picture


@_picture
def screen(random: np.random.Generator) -> Picture:
    """Television news: a speaker before a blue studio, a picture beside, a red banner."""
    picture = fade((0.10, 0.26, 0.72), (0.30, 0.62, 0.98))
    for k in range(5):
        paint(picture, line((0.1 + 0.25 * k, 0.0, -0.2 + 0.25 * k, 1.0), 0.03), _WHITE, 0.14)
    paint(picture, rectangle(0.06, 0.12, 0.48, 0.50), _WHITE)
    paint(picture, rectangle(0.08, 0.14, 0.46, 0.48), (0.98, 0.80, 0.25))
    paint(picture, polygon((0.27, 0.19), (0.42, 0.48), (0.12, 0.48)), (0.90, 0.35, 0.15))
    paint(picture, oval(0.72, 0.66, 0.22), (0.16, 0.16, 0.30))
    paint(picture, polygon((0.67, 0.46), (0.77, 0.46), (0.72, 0.72)), _WHITE)
    paint(picture, line((0.72, 0.50, 0.72, 0.66), 0.03), (0.8, 0.1, 0.1))
    paint(picture, oval(0.72, 0.28, 0.115, 1.2), _HAIR)
    paint(picture, oval(0.72, 0.32, 0.095, 1.25), _SKIN)
    paint(picture, rectangle(0.0, 0.76, 1.0, 0.90), (0.86, 0.10, 0.12))
    paint(picture, rectangle(0.03, 0.79, 0.20, 0.87), _WHITE)
    paint(picture, rectangle(0.24, 0.80, 0.92, 0.86), (1.0, 0.92, 0.92))
    paint(picture, rectangle(0.0, 0.90, 1.0, 1.0), (0.96, 0.96, 0.98))
    paint(picture, rectangle(0.05, 0.93, 0.80, 0.97), (0.25, 0.28, 0.35))
    return picture


@_picture
def desktop(random: np.random.Generator) -> Picture:
    """A computer's screen: a wallpaper, two windows, a bar of buttons."""
    picture = fade((0.08, 0.42, 0.62), (0.24, 0.72, 0.70))
    paint(picture, below(waves(random, 0.75, 0.10)), (0.14, 0.55, 0.50))
    for k in range(4):
        paint(picture, rectangle(0.04, 0.06 + 0.17 * k, 0.12, 0.16 + 0.17 * k), (0.98, 0.85, 0.4))
    paint(picture, rectangle(0.18, 0.08, 0.78, 0.70), (0.97, 0.97, 0.98))
    paint(picture, rectangle(0.18, 0.08, 0.78, 0.15), (0.30, 0.36, 0.50))
    for k, colour in enumerate(((0.95, 0.3, 0.3), (0.98, 0.8, 0.3), (0.4, 0.85, 0.4))):
        paint(picture, oval(0.66 + 0.04 * k, 0.115, 0.014), colour)
    _print(picture, (0.22, 0.20, 0.74, 0.64), 9, 0.62)
    paint(picture, rectangle(0.50, 0.40, 0.94, 0.84), (0.14, 0.16, 0.22))
    for k, colour in enumerate(((0.5, 0.9, 0.5), (0.9, 0.7, 0.4), (0.5, 0.7, 1.0)) * 2):
        top = 0.46 + 0.06 * k
        paint(picture, rectangle(0.54, top, 0.66 + 0.22 * random.random(), top + 0.025), colour)
    paint(picture, rectangle(0.0, 0.92, 1.0, 1.0), (0.12, 0.14, 0.20))
    for k in range(6):
        colour = (0.3 + 0.6 * random.random(3)).tolist()
        paint(picture, rectangle(0.30 + 0.07 * k, 0.935, 0.35 + 0.07 * k, 0.985), colour)
    return picture


@_picture
def phone(random: np.random.Generator) -> Picture:
    """A telephone's screen: the time, and rows of coloured buttons."""
    picture = fade((0.50, 0.20, 0.62), (0.98, 0.52, 0.40))
    for value, x in ((1, 0.18), (0, 0.34), (4, 0.56), (2, 0.70)):
        paint(picture, _digit(value, x, 0.10, 0.09, 0.14), _WHITE)
    colours = ((0.2, 0.75, 0.4), (0.2, 0.55, 0.95), (0.98, 0.8, 0.25), (0.95, 0.95, 0.95))
    for row in range(4):
        for column in range(4):
            x, y = 0.09 + 0.22 * column, 0.36 + 0.15 * row
            colour = colours[int(random.integers(4))] if row < 3 else colours[column]
            paint(picture, rectangle(x, y, x + 0.15, y + 0.10), colour)
    return picture


@_picture
def mirror(random: np.random.Generator) -> Picture:
    """Bluish glass with slanting gleams."""
    picture = fade((0.70, 0.82, 0.90), (0.50, 0.63, 0.74))
    for at, width, strength in ((0.28, 0.10, 0.55), (0.44, 0.03, 0.45), (0.90, 0.05, 0.30)):
        gleam = np.clip(1.5 - np.abs(X * 0.8 + Y * 0.6 - at) / width * 1.5, 0.0, 1.0)
        paint(picture, gleam, (0.95, 0.98, 1.0), strength)
    return picture


@_picture
def flame(random: np.random.Generator) -> Picture:
    """From blue at the bottom over white and yellow to orange at the top."""
    stops = (
        (1.0, 0.45, 0.10),
        (1.0, 0.70, 0.15),
        (1.0, 0.93, 0.50),
        (1.0, 0.98, 0.85),
        (0.35, 0.5, 1.0),
    )
    at = [0.0, 0.35, 0.6, 0.85, 1.0]
    column = np.stack([np.interp(Y[:, 0], at, [s[c] for s in stops]) for c in range(3)], axis=1)
    return np.repeat(column[:, None], SIDE, axis=1)


@_picture
def digits(random: np.random.Generator) -> Picture:
    """A digital clock: 10:42 in red on black."""
    picture = ground((0.05, 0.02, 0.02))
    for value, x in ((1, 0.01), (0, 0.24), (4, 0.56), (2, 0.79)):
        paint(picture, _digit(value, x, 0.22, 0.13, 0.56), (1.0, 0.22, 0.15))
    for y in (0.38, 0.62):
        paint(picture, oval(0.485, y, 0.028), (1.0, 0.22, 0.15))
    return picture


# -- paintings and posters -----------------------------------------------------------------------


@_picture
def picture0(random: np.random.Generator) -> Picture:
    """A landscape: mountains, meadows and a low sun."""
    picture = fade((0.40, 0.62, 0.88), (1.0, 0.86, 0.62))
    paint(picture, oval(0.72, 0.34, 0.09), (1.0, 0.95, 0.70))
    for x, y, colour in ((0.30, 0.22, (0.50, 0.52, 0.66)), (0.62, 0.36, (0.42, 0.46, 0.60))):
        paint(picture, polygon((x, y), (x + 0.45, 0.8), (x - 0.45, 0.8)), colour)
        paint(picture, polygon((x, y), (x + 0.08, y + 0.1), (x - 0.08, y + 0.1)), _WHITE)
    paint(picture, below(waves(random, 0.64, 0.04)), (0.32, 0.52, 0.30))
    paint(picture, below(waves(random, 0.80, 0.04)), (0.56, 0.66, 0.26))
    return picture * between(0.9, 1.05, noise(random, 8, 3))[..., None]


@_picture
def picture1(random: np.random.Generator) -> Picture:
    """Abstract: black lines between fields of red, blue and yellow."""
    picture = ground((0.95, 0.94, 0.90))
    for box, colour in (
        ((0.32, 0.0, 1.0, 0.55), (0.82, 0.14, 0.12)), ((0.0, 0.70, 0.32, 1.0), (0.12, 0.25, 0.65)),
        ((0.78, 0.72, 1.0, 1.0), (0.96, 0.80, 0.16)), ((0.0, 0.0, 0.32, 0.20), (0.95, 0.80, 0.2)),
    ):  # fmt: skip
        paint(picture, rectangle(*box), colour)
    for ends in (
        (0.32, 0.0, 0.32, 1.0), (0.0, 0.55, 1.0, 0.55), (0.78, 0.55, 0.78, 1.0),
        (0.0, 0.20, 0.32, 0.20), (0.0, 0.70, 0.32, 0.70), (0.78, 0.72, 1.0, 0.72),
    ):  # fmt: skip
        paint(picture, line(ends, 0.035), _INK)
    return picture


@_picture
def picture2(random: np.random.Generator) -> Picture:
    """A portrait: a lady in green before a dark brown ground."""
    picture = fade((0.30, 0.21, 0.14), (0.18, 0.12, 0.09))
    paint(picture, oval(0.5, 0.40, 0.23, 1.35), _HAIR)
    paint(picture, oval(0.5, 1.02, 0.40, 1.0), (0.16, 0.36, 0.28))
    paint(picture, rectangle(0.43, 0.50, 0.57, 0.72), (0.80, 0.60, 0.46))
    paint(picture, oval(0.5, 0.66, 0.13, 0.7), (0.84, 0.64, 0.50))
    paint(picture, oval(0.5, 0.40, 0.15, 1.32), _SKIN)
    paint(picture, oval(0.5, 0.22, 0.16, 0.5), _HAIR)
    for x in (0.44, 0.56):
        paint(picture, oval(x, 0.38, 0.018), (0.15, 0.1, 0.08))
    paint(picture, line((0.5, 0.40, 0.495, 0.46), 0.015), (0.70, 0.48, 0.38))
    paint(picture, line((0.46, 0.51, 0.54, 0.51), 0.022), (0.72, 0.25, 0.22))
    return picture * between(0.88, 1.08, noise(random, 16, 3))[..., None]


@_picture
def picture3(random: np.random.Generator) -> Picture:
    """One large flower on pale pink."""
    picture = fade((0.98, 0.90, 0.88), (0.95, 0.82, 0.80))
    paint(picture, line((0.5, 0.45, 0.46, 1.0), 0.03), (0.25, 0.50, 0.22))
    for x, turn in ((0.36, 0.5), (0.60, -0.5)):
        paint(picture, leaf(x, 0.80, (0.13, 0.05), turn), (0.34, 0.60, 0.28))
    for k in range(8):
        a = k * np.pi / 4 + 0.2
        colour = (0.86, 0.16, 0.38) if k % 2 else (0.94, 0.32, 0.48)
        paint(picture, oval(0.5 + 0.19 * np.cos(a), 0.38 + 0.19 * np.sin(a), 0.115), colour)
    paint(picture, oval(0.5, 0.38, 0.10), (0.98, 0.80, 0.22))
    paint(picture, ring(0.5, 0.38, 0.07, 0.02), (0.80, 0.50, 0.12))
    return picture


@_picture
def picture4(random: np.random.Generator) -> Picture:
    """Sailing boats on a turquoise sea."""
    picture = fade((0.72, 0.90, 0.98), (0.96, 0.98, 0.96))
    sea = fade((0.20, 0.62, 0.70), (0.06, 0.32, 0.52))
    paint(picture, below(0.55), sea)
    for k in range(9):
        x, y = random.random(), 0.60 + 0.045 * k
        paint(picture, line((x, y, x + 0.16, y), 0.012), (0.75, 0.92, 0.92), 0.7)
    for x, y, s, colour in ((0.34, 0.66, 0.30, _WHITE), (0.74, 0.58, 0.18, (0.95, 0.45, 0.2))):
        paint(picture, polygon((x, y - 1.5 * s), (x + 0.6 * s, y), (x, y)), colour)
        paint(picture, polygon((x - 0.04, y - 1.2 * s), (x - 0.04, y), (x - 0.5 * s, y)), colour)
        hull = (
            (x - 0.6 * s, y),
            (x + 0.7 * s, y),
            (x + 0.45 * s, y + 0.25 * s),
            (x - 0.4 * s, y + 0.25 * s),
        )
        paint(picture, polygon(*hull), (0.45, 0.22, 0.14))
    return picture


@_picture
def picture5(random: np.random.Generator) -> Picture:
    """Geometric: arches and circles of ochre, rust, green and cream."""
    picture = ground((0.93, 0.87, 0.76))
    for k, colour in enumerate(
        ((0.72, 0.34, 0.20), (0.90, 0.66, 0.28), (0.24, 0.40, 0.36), (0.93, 0.87, 0.76))
    ):
        r = 0.36 - 0.085 * k
        arch = np.maximum(oval(0.40, 0.55, r), rectangle(0.40 - r, 0.55, 0.40 + r, 1.0))
        paint(picture, arch, colour)
    paint(picture, oval(0.78, 0.22, 0.15), (0.80, 0.40, 0.22))
    paint(picture, oval(0.86, 0.80, 0.20), (0.16, 0.26, 0.34))
    return picture


@_picture
def picture6(random: np.random.Generator) -> Picture:
    """A city by night: dark towers with lit windows under a moon."""
    picture = fade((0.04, 0.05, 0.20), (0.30, 0.16, 0.42))
    paint(picture, oval(0.78, 0.18, 0.09), (0.98, 0.96, 0.82))
    for k in range(9):
        left, top = k / 9, 0.30 + 0.35 * random.random()
        paint(
            picture,
            rectangle(left, top, left + 0.12, 1.0),
            np.array((0.07, 0.08, 0.16)) * (1 + k % 2),
        )
        for row in range(int((1 - top) / 0.07)):
            for column in range(3):
                if random.random() > 0.45:
                    x, y = left + 0.02 + 0.033 * column, top + 0.03 + 0.07 * row
                    paint(picture, rectangle(x, y, x + 0.018, y + 0.03), (1.0, 0.85, 0.40))
    return picture


@_picture
def picture7(random: np.random.Generator) -> Picture:
    """A still life: a jug, an orange and a pear on a table."""
    picture = fade((0.42, 0.48, 0.44), (0.58, 0.60, 0.52))
    paint(picture, below(0.68), (0.62, 0.40, 0.24))
    paint(picture, below(0.90), (0.90, 0.88, 0.82))
    paint(picture, ring(0.44, 0.44, 0.09, 0.035), (0.20, 0.34, 0.60))
    paint(picture, rectangle(0.25, 0.24, 0.41, 0.45), (0.24, 0.40, 0.68))
    paint(picture, oval(0.33, 0.57, 0.17, 1.15), (0.24, 0.40, 0.68))
    paint(picture, oval(0.27, 0.52, 0.04, 2.0), (0.62, 0.74, 0.92))
    paint(picture, oval(0.60, 0.70, 0.11), (0.95, 0.55, 0.12))
    paint(picture, oval(0.57, 0.66, 0.03), (1.0, 0.80, 0.45))
    paint(picture, oval(0.80, 0.70, 0.10), (0.72, 0.74, 0.24))
    paint(picture, oval(0.80, 0.58, 0.06, 1.4), (0.72, 0.74, 0.24))
    paint(picture, line((0.80, 0.52, 0.82, 0.45), 0.018), (0.3, 0.2, 0.1))
    return picture * between(0.88, 1.06, noise(random, 16, 3))[..., None]
