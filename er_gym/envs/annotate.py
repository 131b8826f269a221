"""Annotates pictures with a box and a type for each object, as set-of-marks prompting does."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

_LEAST = 40
"""Objects whose box has fewer pixels are not named."""
_COLOURS = (
    (230, 60, 60), (60, 120, 230), (30, 150, 70), (200, 120, 0), (150, 60, 190),
    (0, 150, 160), (190, 40, 120), (110, 110, 20),
)  # fmt: skip
_SKIPPED = frozenset({"Floor", "Wall", "Ceiling"})


def annotated(
    frame: NDArray[np.uint8], boxes: Mapping[str, tuple[int, int, int, int]]
) -> NDArray[np.uint8]:
    """A copy of a picture with object types written into it.

    Args:
        frame: (H, W, 3) uint8.
        boxes: object id to the box of its visible part, pixels (left, upper, right, lower), as in
            ``event.instance_detections2D``.

    Returns:
        A new (H, W, 3) uint8.
    """
    from PIL import Image, ImageDraw

    picture = Image.fromarray(np.ascontiguousarray(frame))
    pen = ImageDraw.Draw(picture)
    named = [
        (name.split("|")[0], tuple(map(int, box))) for name, box in boxes.items() if "|" in name
    ]
    # Large objects first, so that the names of small objects are on top.
    named.sort(key=lambda item: (_area(item[1]), item), reverse=True)
    for kind, box in named:
        if kind in _SKIPPED or _area(box) < _LEAST:
            continue
        colour = _COLOURS[sum(kind.encode()) % len(_COLOURS)]
        pen.rectangle(box, outline=colour)
        left, top, right, bottom = pen.textbbox((0, 0), kind)
        x = min(max(0, box[0]), picture.width - (right - left) - 2)
        y = min(max(0, box[1]), picture.height - (bottom - top) - 2)
        pen.rectangle((x, y, x + right - left + 2, y + bottom - top + 2), fill=colour)
        pen.text((x + 1 - left, y + 1 - top), kind, fill="white")
    return np.asarray(picture)


def _area(box: tuple[int, ...]) -> int:
    return (box[2] - box[0]) * (box[3] - box[1])
