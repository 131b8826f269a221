"""Unity's Euler angles as matrices."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def unity_rotation(rotation: ArrayLike) -> NDArray[np.float64]:
    """Turn Unity's Euler angles into rotation matrices, R = Ry @ Rx @ Rz.

    AI2-THOR's world is left-handed (x right, y up, z forward), so a positive angle about y turns
    clockwise seen from above: at y = 90 an object's own +z points along the world's +x.

    Args:
        rotation: (..., 3) angles about x, y and z in degrees, as ``rotation`` in the metadata.

    Returns:
        (..., 3, 3) matrices that take a vector of the object's own frame to the world's:
        ``world = position + R @ local``.
    """
    angles = np.radians(np.asarray(rotation, dtype=np.float64))
    turn_x, turn_y, turn_z = (
        _turn(angles[..., axis], (axis + 1) % 3, (axis + 2) % 3) for axis in range(3)
    )
    return turn_y @ turn_x @ turn_z


def _turn(angle: NDArray[np.float64], a: int, b: int) -> NDArray[np.float64]:
    """The turn by ``angle`` (radians) in the plane of axes ``a`` and ``b``, from a towards b."""
    matrix = np.zeros((*angle.shape, 3, 3))
    matrix[..., range(3), range(3)] = 1.0
    matrix[..., a, a] = matrix[..., b, b] = np.cos(angle)
    matrix[..., b, a] = np.sin(angle)
    matrix[..., a, b] = -matrix[..., b, a]
    return matrix
