"""Boxes from an object's own frame to the world's."""

from __future__ import annotations

from math import cos as cosine
from math import radians
from math import sin as sine

import numpy as np
from numpy.typing import NDArray

_TRIM = 0.03
"""Share of its width that is cut from each side of a hiding box: recorded boxes are generous."""


def turned(boxes: NDArray[np.float64], yaw: float) -> NDArray[np.float64]:
    """(K, 2, 3) axis-aligned boxes after a turn about the vertical through the origin.

    The result is exact for quarter turns. For other turns it is the axis-aligned box with the same
    middle and area.

    Args:
        boxes: (K, 2, 3) corners, metres.
        yaw: degrees, clockwise seen from above.
    """
    cos, sin = cosine(radians(yaw)), sine(radians(yaw))
    middle, half = (boxes[:, 0] + boxes[:, 1]) / 2, (boxes[:, 1] - boxes[:, 0]) / 2
    x, z = middle[:, 0], middle[:, 2]
    across = half[:, 0] * abs(cos) + half[:, 2] * abs(sin)
    along = half[:, 0] * abs(sin) + half[:, 2] * abs(cos)
    share = np.sqrt(half[:, 0] * half[:, 2] / np.maximum(across * along, 1e-12))
    middle[:, 0], middle[:, 2] = x * cos + z * sin, z * cos - x * sin
    half[:, 0], half[:, 2] = across * share, along * share
    found = np.empty_like(boxes)
    found[:, 0], found[:, 1] = middle - half, middle + half
    return found


def trimmed(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K, 2, 3) boxes, a little narrower and less deep."""
    inset = (boxes[:, 1] - boxes[:, 0]) * np.array([_TRIM, 0.0, _TRIM])
    found = boxes.copy()
    found[:, 0] += inset
    found[:, 1] -= inset
    return found
