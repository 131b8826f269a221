"""Samples of tasks, and sheets of pictures."""

from __future__ import annotations

import random
from collections import defaultdict
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from er_gym.tasks.task import Task

_LABEL = 15
"""Pixels below a picture, for its name."""


def sample_of_types(
    tasks: Iterable[Task], types: Sequence[str], each: int, seed: str = ""
) -> list[Task]:
    """A number of tasks of each type, the same for the same seed; all types if none is named."""
    by_type: dict[str, list[Task]] = defaultdict(list)
    for task in tasks:
        if not types or task.type.name in types:
            by_type[task.type.name].append(task)
    return [
        task
        for name, of_type in sorted(by_type.items())
        for task in random.Random(f"{name}{seed}").sample(of_type, min(each, len(of_type)))
    ]


def sheet(pictures: Sequence[tuple[str, NDArray[np.uint8]]], columns: int) -> Image.Image:
    """Pictures (S, S, 3) in rows, each with its name under it."""
    side = len(pictures[0][1])
    rows = -(-len(pictures) // columns)
    page = Image.new("RGB", (columns * side, rows * (side + _LABEL)), "white")
    pen = ImageDraw.Draw(page)
    for k, (name, picture) in enumerate(pictures):
        x, y = k % columns * side, k // columns * (side + _LABEL)
        page.paste(Image.fromarray(picture), (x, y))
        pen.text((x + 4, y + side + 1), name, fill="black")
    return page
