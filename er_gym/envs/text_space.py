"""A space of texts that ``AsyncVectorEnv`` can share.

For its own text space, Gymnasium decodes the shared memory only once, when it makes the vector
environment; every later observation would be that empty text. Here a batch of texts is a view of
the shared memory, as a batch of arrays is in Gymnasium.
"""

from __future__ import annotations

import multiprocessing
from collections.abc import Sequence
from typing import Any, overload

import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import (
    create_shared_memory,
    read_from_shared_memory,
    write_to_shared_memory,
)
from numpy.typing import NDArray


class TextSpace(spaces.Text):
    """``gymnasium.spaces.Text`` with ASCII characters only."""


class SharedTexts(Sequence[str]):
    """The texts of n environments, a view of shared memory: each access decodes the present text.

    ``copy.deepcopy`` returns the present texts as a tuple. ``AsyncVectorEnv`` does that unless it
    is made with ``copy=False``.

    Args:
        memory: (n, size) uint8: the ASCII characters of each text, then zeros.
    """

    def __init__(self, memory: NDArray[np.uint8]) -> None:
        self._memory = memory

    def __len__(self) -> int:
        return len(self._memory)

    @overload
    def __getitem__(self, place: int) -> str: ...
    @overload
    def __getitem__(self, place: slice) -> tuple[str, ...]: ...
    def __getitem__(self, place: int | slice) -> str | tuple[str, ...]:
        if isinstance(place, slice):
            return tuple(self[k] for k in range(len(self))[place])
        characters: bytes = self._memory[place].tobytes()
        return characters.partition(b"\0")[0].decode("ascii")

    def __deepcopy__(self, memo: Any) -> tuple[str, ...]:
        return tuple(self)


@create_shared_memory.register(TextSpace)
def _create(space: TextSpace, n: int = 1, ctx: Any = multiprocessing) -> Any:
    return ctx.Array("B", n * space.max_length)


@read_from_shared_memory.register(TextSpace)
def _read(space: TextSpace, shared_memory: Any, n: int = 1) -> SharedTexts:
    return SharedTexts(_rows(space, shared_memory, n))


@write_to_shared_memory.register(TextSpace)
def _write(space: TextSpace, index: int, value: str, shared_memory: Any) -> None:
    row = _rows(space, shared_memory)[index]
    text = np.frombuffer(value.encode("ascii"), np.uint8)
    row[: len(text)] = text
    row[len(text) : len(text) + 1] = 0


def _rows(space: TextSpace, shared_memory: Any, n: int = -1) -> NDArray[np.uint8]:
    """(n, space.max_length) uint8, a row for each environment."""
    return np.frombuffer(shared_memory.get_obj(), np.uint8).reshape(n, space.max_length)
