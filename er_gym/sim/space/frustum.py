"""Which points are in a camera's picture."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

NEAR_PLANE = 0.1
"""Distance of the camera's near plane, metres."""

Lens = tuple[float, float, float, float]
"""Rotation, horizon and vertical field of view of a camera, degrees; width divided by height."""


def in_frustum(
    offsets: NDArray[np.float64],
    rotation: NDArray[np.float64] | float,
    horizon: NDArray[np.float64] | float,
    field_of_view: float,
    aspect: float,
) -> NDArray[np.bool_]:
    """Which points are in a camera's picture.

    Args:
        offsets: (..., 3) from the camera to the points, metres, world frame.
        rotation, horizon: degrees, broadcast against the points.
        field_of_view: vertical, degrees.
        aspect: width of the picture divided by its height.
    """
    yaw, pitch = np.radians(rotation), np.radians(horizon)
    x, y, z = offsets[..., 0], offsets[..., 1], offsets[..., 2]
    sin_yaw, cos_yaw, sin_pitch, cos_pitch = np.sin(yaw), np.cos(yaw), np.sin(pitch), np.cos(pitch)
    # Computing in place takes half the time.
    right, ahead = x * cos_yaw, x * sin_yaw
    right -= z * sin_yaw
    ahead += z * cos_yaw
    forward, up = ahead * cos_pitch, ahead * sin_pitch
    forward -= y * sin_pitch
    up += y * cos_pitch
    found = forward > NEAR_PLANE
    forward *= np.tan(np.radians(field_of_view) / 2)
    found &= np.abs(up, out=up) <= forward
    forward *= aspect
    found &= np.abs(right, out=right) <= forward
    return np.asarray(found)
