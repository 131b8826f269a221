"""From a thing's own frame to the world's."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_TRIM = 0.03
"""Share of its width by which a hiding box is cut at each side: recorded boxes are generous."""


def turned(boxes: NDArray[np.float64], yaw: float) -> NDArray[np.float64]:
    """(K, 2, 3) axis-aligned boxes after a turn about the vertical through the origin.

    Exact for quarter turns; otherwise each is the box of the same middle and area.

    Args:
        boxes: (K, 2, 3) corners, metres. yaw: degrees, clockwise from above.
    """
    angle = np.radians(yaw)
    cos, sin = np.cos(angle), np.sin(angle)
    middle, half = boxes.mean(axis=1), (boxes[:, 1] - boxes[:, 0]) / 2
    x, z = middle[:, 0], middle[:, 2]
    centre = np.stack([x * cos + z * sin, middle[:, 1], z * cos - x * sin], axis=1)
    across = half[:, 0] * abs(cos) + half[:, 2] * abs(sin)
    along = half[:, 0] * abs(sin) + half[:, 2] * abs(cos)
    area = np.maximum(across * along, 1e-12)
    share = np.sqrt(half[:, 0] * half[:, 2] / area)
    reach = np.stack([across * share, half[:, 1], along * share], axis=1)
    return np.stack([centre - reach, centre + reach], axis=1)


def trimmed(boxes: NDArray[np.float64]) -> NDArray[np.float64]:
    """(K, 2, 3) boxes made a little narrower and less deep."""
    inset = (boxes[:, 1] - boxes[:, 0]) * np.array([_TRIM, 0.0, _TRIM])
    return np.stack([boxes[:, 0] + inset, boxes[:, 1] - inset], axis=1)
