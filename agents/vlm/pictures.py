"""Encodes pictures for a model: at a size that suits Qwen's models, as JPEG or PNG."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, floor, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from agents.vlm.chat import Picture
from agents.vlm.settings import Pictures
from er_gym.data.pictures import encode_picture, open_picture

FACTOR = 28
"""Qwen2-VL and Qwen2.5-VL divide a picture into squares of this side, in pixels: one token each."""
_LONGEST = 200
"""The largest aspect ratio that their processors accept."""


def fitted(width: int, height: int, settings: Pictures) -> tuple[int, int]:
    """The width and height at which a picture is sent, pixels.

    A picture within ``min_pixels`` and ``max_pixels`` keeps its size; the model's own processor
    rounds its sides. Any other picture gets sides that are multiples of :data:`FACTOR`. The sides
    are the nearest multiples if these are within the bounds; otherwise both are scaled until they
    are, at about the same aspect ratio. This is ``smart_resize`` of qwen-vl-utils, except that no
    side becomes 0.

    Raises:
        ValueError: a side is 0, or one side is more than 200 times as long as the other.
    """
    if min(width, height) < 1 or max(width, height) > _LONGEST * min(width, height):
        raise ValueError(
            f"a picture of {width} x {height} pixels cannot be shown: give it at least 1 x 1, and "
            f"no side more than {_LONGEST} times as long as the other"
        )
    pixels = width * height
    if settings.min_pixels <= pixels <= settings.max_pixels:
        return width, height
    sides = width, height
    wide, high = (round(side / FACTOR) or 1 for side in sides)
    if wide * high * FACTOR**2 > settings.max_pixels:
        shrink = sqrt(pixels / settings.max_pixels)
        wide, high = (floor(side / shrink / FACTOR) or 1 for side in sides)
    elif wide * high * FACTOR**2 < settings.min_pixels:
        grow = sqrt(settings.min_pixels / pixels)
        wide, high = (ceil(side * grow / FACTOR) for side in sides)
    return wide * FACTOR, high * FACTOR


def encode(rgb: NDArray[np.uint8], settings: Pictures) -> Picture:
    """Encode a picture as a file; equal pictures give equal bytes.

    Args:
        rgb: (height, width, 3) uint8.

    Raises:
        ValueError: the array has another shape or type, or the picture cannot be sent
            (:func:`fitted`).
    """
    if rgb.dtype != np.uint8 or rgb.ndim != 3 or rgb.shape[2] != 3:
        raise ValueError(
            f"a picture is (height, width, 3) of uint8, not {rgb.shape} of {rgb.dtype}"
        )
    height, width, _ = rgb.shape
    size = fitted(width, height, settings)
    data = encode_picture(rgb, size, form=settings.format, quality=settings.quality)
    return Picture(data, f"image/{settings.format}", *size)


def patches_of(
    image_processor: Any, images: Sequence[Image.Image], bounds: tuple[int, int]
) -> tuple[Any, Any]:
    """Pictures as models of Qwen's take them, at play and at learning alike.

    Args:
        image_processor: the model's.
        images: at least one, RGB.
        bounds: the least and the most pixels of a picture; one with fewer or more is scaled.

    Returns:
        (patches, values of a patch), and (pictures, 3): patches in time, height and width.

    Raises:
        ValueError: the model cannot take a picture of such a shape.
    """
    least, most = bounds
    size = {"shortest_edge": least, "longest_edge": most}
    seen = image_processor(images, size=size, return_tensors="pt")
    return seen["pixel_values"], seen["image_grid_thw"]


def noise_like(picture: Picture, settings: Pictures, seed: Sequence[int]) -> Picture:
    """A picture of noise of the size of another: each value is drawn on its own.

    Args:
        picture: the other.
        settings: the file format.
        seed: equal seeds give equal noise.
    """
    shape = picture.height, picture.width, 3
    rgb = np.random.default_rng(seed).integers(0, 256, shape, dtype=np.uint8)
    size = picture.width, picture.height
    data = encode_picture(rgb, size, form=settings.format, quality=settings.quality)
    return Picture(data, f"image/{settings.format}", *size)


def within_bounds(picture: Picture, settings: Pictures) -> Picture:
    """A picture, encoded anew if it has too many or too few pixels for the settings."""
    if fitted(picture.width, picture.height, settings) == (picture.width, picture.height):
        return picture
    return encode(np.asarray(open_picture(picture.data)), settings)
