"""Lines of sight against axis-aligned boxes: one vectorised kernel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

_EPSILON = 1e-3


def blocked_by(
    origins: NDArray[np.float32],
    targets: NDArray[np.float32],
    box_min: NDArray[np.float32],
    box_max: NDArray[np.float32],
) -> NDArray[np.bool_]:
    """Which boxes stand between each origin and its target (slab method).

    A box in which the origin or the target itself lies does not count: recorded boxes of concave
    things (a chair, an L-shaped counter) contain air.

    Args:
        origins: (R, 3) or (1, 3), metres, world frame.
        targets: (R, 3).
        box_min, box_max: (M, 3) corners.

    Returns:
        (R, M) bool.
    """
    direction = targets - origins
    direction = np.where(np.abs(direction) < 1e-9, np.float32(1e-9), direction)
    inverse = 1.0 / direction
    enter = np.full((len(targets), len(box_min)), -np.inf, dtype=np.float32)
    leave = np.full_like(enter, np.inf)
    for axis in range(3):
        scale = inverse[:, axis, None]
        first = (box_min[None, :, axis] - origins[:, axis, None]) * scale
        second = (box_max[None, :, axis] - origins[:, axis, None]) * scale
        np.maximum(enter, np.minimum(first, second), out=enter)
        np.minimum(leave, np.maximum(first, second), out=leave)
    return (enter > _EPSILON) & (enter <= leave) & (leave < 1.0 - _EPSILON)
