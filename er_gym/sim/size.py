"""Which sizes pictures may have."""

from __future__ import annotations

import numpy as np

LARGEST_SIDE = 8192
MOST_PIXELS = 1 << 24
"""4096 by 4096. Drawing takes some thirty bytes for each."""


def check_size(width: int, height: int) -> None:
    """Refuse a size that no picture can have.

    Args:
        width, height: pixels.

    Raises:
        ValueError: a side is no whole number from 1 to :data:`LARGEST_SIDE`, or both together make
            more than :data:`MOST_PIXELS`.
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
