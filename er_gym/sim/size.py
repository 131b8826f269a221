"""The allowed sizes of pictures."""

from __future__ import annotations

import numpy as np

LARGEST_SIDE = 8192
MOST_PIXELS = 1 << 24
"""4096 by 4096 pixels. Drawing takes some thirty bytes for each pixel."""


def check_size(width: int, height: int) -> None:
    """Refuse a size that a picture cannot have.

    Args:
        width, height: pixels.

    Raises:
        ValueError: a side is not a whole number from 1 to :data:`LARGEST_SIDE`, or the picture has
            more than :data:`MOST_PIXELS` pixels.
    """
    for name, side in (("width", width), ("height", height)):
        whole = isinstance(side, (int, np.integer)) and not isinstance(side, bool)
        if not whole or not 1 <= side <= LARGEST_SIDE:
            raise ValueError(f"{name} {side!r:.40} is not from 1 to {LARGEST_SIDE} pixels")
    if width * height > MOST_PIXELS:
        raise ValueError(
            f"{width} x {height} pixels are {width * height:,}; a picture has at most "
            f"{MOST_PIXELS:,}, such as 4096 x 4096"
        )
