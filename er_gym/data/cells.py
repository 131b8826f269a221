"""What covers each square of a picture: labels for single places in it.

From sentences alone, a small model takes long to learn which part of the picture a word refers to.
The engine knows the object at each pixel, so a frame stores the type that covers each square of a
grid, and fine-tuning gives each picture token a loss for the type of its square.
"""

from __future__ import annotations

import string
from collections import Counter
from collections.abc import Sequence

import numpy as np

from er_gym.data.trajectory import PictureRecord
from er_gym.envs.perception import Perception
from er_gym.tasks import verbs
from er_gym.thor.objects import KIND_OF, TYPES

ROWS, COLUMNS = 12, 20
"""Squares of a picture."""
SYMBOLS = string.digits + string.ascii_letters
_SHARE = 1 / 6
"""A thing stands for a square if it covers at least this share of it."""
_ROOM = [KIND_OF[name] for name in sorted(verbs.NOWHERE) if name in KIND_OF]


class CoveredPicture(PictureRecord):
    """What covers the squares of a picture.

    Attributes:
        covers: what is in the picture, the room itself first.
        cells: for each of :data:`ROWS` × :data:`COLUMNS` squares, row by row, which of ``covers``
            it is, by one of :data:`SYMBOLS`.
    """

    covers: tuple[str, ...]
    cells: str


def cells_of(perception: Perception) -> tuple[tuple[str, ...], str]:
    """What covers the squares of a view, as :class:`CoveredPicture` has it; ``""`` is the room.

    If several objects cover enough of a square, the one with the fewest pixels in the whole picture
    labels it: a Mug rather than the CounterTop on which it stands.

    Args:
        perception: with instance masks.
    """
    instances = perception.instances
    assert instances is not None
    kinds = np.concatenate(([-1], perception.objects.kinds))[instances]
    kinds[np.isin(kinds, _ROOM)] = -1
    pixels = np.bincount(kinds.ravel() + 1, minlength=len(TYPES) + 1)
    pixels[0] = kinds.size  # the room comes last
    height, width = kinds.shape
    found: list[int] = []
    for row in range(ROWS):
        band = kinds[row * height // ROWS : (row + 1) * height // ROWS]
        for column in range(COLUMNS):
            square = band[:, column * width // COLUMNS : (column + 1) * width // COLUMNS]
            there, counts = np.unique(square, return_counts=True)
            enough = there[counts >= _SHARE * square.size].tolist()
            found.append(min(enough, key=lambda kind: pixels[kind + 1], default=-1))
    order = [kind for kind, _ in Counter(k for k in found if k >= 0).most_common(len(SYMBOLS) - 1)]
    symbol = {kind: SYMBOLS[place] for place, kind in enumerate(order, 1)}
    covers = ("", *(TYPES[kind] for kind in order))
    return covers, "".join(symbol.get(kind, SYMBOLS[0]) for kind in found)


def on_grid(cells: str, rows: int, columns: int) -> list[int]:
    """The label of each square of another grid, row by row: an index into ``covers``.

    Among the labels of the overlapping squares, it is the one with the fewest squares in the
    picture.
    """
    count = Counter(cells)
    count[SYMBOLS[0]] = len(cells) + 1  # the room comes last
    found = []
    for row in range(rows):
        for column in range(columns):
            there = (
                cells[k * COLUMNS + m]
                for k in _overlapping(row, rows, ROWS)
                for m in _overlapping(column, columns, COLUMNS)
            )
            found.append(SYMBOLS.index(min(there, key=lambda each: (count[each], each))))
    return found


def _overlapping(place: int, of: int, fine: int) -> Sequence[int]:
    """The parts of a line in ``fine`` parts that overlap with one of ``of`` parts."""
    return range(place * fine // of, -(-(place + 1) * fine // of))
