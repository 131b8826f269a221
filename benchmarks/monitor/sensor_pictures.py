"""Depth and instances as pictures for people."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray


def depth_picture(depth: NDArray[np.float32]) -> NDArray[np.uint8]:
    """(height, width, 3) uint8: depths in metres as grey, the nearest surface white and the
    farthest nearly black."""
    near, far = float(depth.min()), float(depth.max())
    grey = 255.0 - 235.0 * (depth - near) / max(far - near, 1e-6)
    return np.repeat(grey.astype(np.uint8)[:, :, None], 3, axis=2)


def instance_picture(ids: NDArray[np.int32]) -> NDArray[np.uint8]:
    """(height, width, 3) uint8: a colour for each object, dark grey for the room."""
    numbers = np.arange(int(ids.max()) + 1)
    # Hues a golden angle apart, so that neighbours in the list of objects look different.
    hues = numbers[:, None] * 0.618034 + np.array([0.0, 2 / 3, 1 / 3])
    wheel = np.clip(np.abs((hues % 1.0) * 6 - 3) - 1, 0, 1)
    bright = (0.55 + 0.15 * (numbers % 4))[:, None]
    palette = (255 * bright * (0.25 + 0.75 * wheel)).astype(np.uint8)
    palette[0] = 40
    return palette[ids]


SHOWN: Mapping[str, Callable[[Any], NDArray[np.uint8]]] = {
    "depth": depth_picture,
    "instance": instance_picture,
}
"""How an observation that is no picture is shown as one."""
