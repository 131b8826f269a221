"""Attention of conversations that are a few tokens longer by a compiled kernel, where there is one.

The kernel is attention.c: one call for a layer of all conversations, which reads their keys and
values where they are kept. Torch takes calls and views for each of them, and half as long again.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray

from agents.vlm.clients.kv_cache import Layers
from er_gym.shared_library import compiled

_SOURCE = Path(__file__).with_name("attention.c")


class _Layer(ctypes.Structure):
    """The kernel's ``Layer``."""

    _fields_ = (
        *((name, ctypes.c_ssize_t) for name in ("rows", "heads", "groups", "size")),
        *((name, ctypes.c_void_p) for name in ("query", "key", "value")),
        *(
            (f"{part}_{stride}", ctypes.c_ssize_t)
            for part in ("query", "key", "value")
            for stride in ("head", "token")
        ),
        *((name, ctypes.c_void_p) for name in ("found", "place", "count", "before", "room")),
        *((name, ctypes.c_void_p) for name in ("keys", "values")),
        ("scale", ctypes.c_float),
        ("threads", ctypes.c_ssize_t),
    )


@cache
def _kernel() -> Any:
    """The compiled function, None if there is none here; a process asks once. Calls release the
    GIL."""
    library = compiled(_SOURCE, exact=False)
    if library is None:
        return None
    address = ctypes.cast(library.er_gym_attend, ctypes.c_void_p).value
    assert address is not None
    function = ctypes.CFUNCTYPE(ctypes.c_int, ctypes.POINTER(_Layer))(address)
    function.library = library  # type: ignore[attr-defined]
    return function


def has_kernel() -> bool:
    """Whether there is a kernel here."""
    return _kernel() is not None


def addresses(layers: Layers) -> NDArray[np.intp]:
    """Where the keys and values of each layer are, (layers, 2)."""
    return np.array([[part.data_ptr() for part in layer] for layer in layers], np.intp)


class NextTokens:
    """The conversations of a batch that are a few tokens longer.

    Args:
        places: of the first token of each among the new ones of the batch.
        counts: how many new ones each has, side by side; the time is that of as many conversations.
        before: how many tokens each had before.
        rooms: for how many tokens the memory of each has room: those before and the new ones at
            least.
        memories: the :func:`addresses` of each.
    """

    longest = 0  # torch is faster with what is not within a reply

    def __init__(
        self,
        places: Sequence[int],
        counts: Sequence[int],
        before: Sequence[int],
        rooms: Sequence[int],
        memories: Sequence[NDArray[np.intp]],
    ) -> None:
        self._numbers = np.array([places, counts, before, rooms], np.intp)
        self._memories = np.stack(memories, axis=-1)  # (layers, 2, conversations)

    def attend(
        self,
        layer: int,
        query: torch.Tensor,
        key: torch.Tensor,
        value: torch.Tensor,
        found: torch.Tensor,
        scale: float,
    ) -> None:
        """Keep the new keys and values in a layer, and write what attention finds.

        Args:
            layer: its number.
            query: (1, heads, new tokens of the batch, size), float32.
            key, value: the same with the heads of keys and values.
            found: (1, new tokens, heads, size), in one piece.
            scale: of the scores.

        Raises:
            MemoryError: there is none left.
        """
        query, key, value = (with_whole_heads(part) for part in (query, key, value))
        strides = [part.stride(axis) for part in (query, key, value) for axis in (1, 2)]
        told = _Layer(
            self._numbers.shape[1], query.shape[1], key.shape[1], query.shape[3],
            query.data_ptr(), key.data_ptr(), value.data_ptr(), *strides, found.data_ptr(),
            *(each.ctypes.data for each in (*self._numbers, *self._memories[layer])),
            scale, torch.get_num_threads(),
        )  # fmt: skip
        if _kernel()(told):
            raise MemoryError("no memory is left for attention")


def with_whole_heads(part: torch.Tensor) -> torch.Tensor:
    """With the numbers of a head side by side."""
    return part if part.stride(3) == 1 else part.contiguous()
