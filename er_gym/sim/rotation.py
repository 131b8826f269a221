"""Unity's Euler angles as matrices."""

from __future__ import annotations

from collections.abc import Iterable
from math import asin, atan2, cos, degrees, radians, sin
from typing import Any

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
    angles = np.asarray(rotation, dtype=np.float64)
    if angles.ndim == 1:  # plain numbers, ten times as fast as small arrays
        turns = [radians(angle) for angle in angles.tolist()]
        return np.array(_matrix([sin(a) for a in turns], [cos(a) for a in turns]))
    turned = np.moveaxis(np.radians(angles), -1, 0)
    return np.moveaxis(np.array(_matrix(np.sin(turned), np.cos(turned))), (0, 1), (-2, -1))


_POLE = 1.0 - 1e-9
"""The sine of an angle about x beyond which the angles about y and z are one."""


def unity_angles(matrix: NDArray[np.float64]) -> tuple[float, float, float]:
    """Unity's Euler angles of a (3, 3) rotation matrix, degrees from 0 to 360: what
    :func:`unity_rotation` turns into it. Straight up or down the angle about z is 0."""
    (m00, _, m02), (m10, m11, m12), (m20, _, m22) = matrix.tolist()
    if abs(m12) > _POLE:
        x, y, z = -90.0 if m12 > 0.0 else 90.0, degrees(atan2(-m20, m00)), 0.0
    else:
        x, y, z = degrees(asin(-m12)), degrees(atan2(m02, m22)), degrees(atan2(m10, m11))
    # A turn by a tiny negative angle is none, not one by 360 degrees.
    return round(x, 9) % 360.0, round(y, 9) % 360.0, round(z, 9) % 360.0


def _matrix(sines: Iterable[Any], cosines: Iterable[Any]) -> list[list[Any]]:
    """Ry @ Rx @ Rz, written out."""
    (sx, sy, sz), (cx, cy, cz) = sines, cosines
    return [
        [cy * cz + sy * sx * sz, sy * sx * cz - cy * sz, sy * cx],
        [cx * sz, cx * cz, -sx],
        [cy * sx * sz - sy * cz, sy * sz + cy * sx * cz, cy * cx],
    ]
