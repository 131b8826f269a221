"""Attention of conversations that are a few tokens longer by a compiled kernel, where there is one.

The kernel is attention.c: one call for a layer of all conversations, which reads their keys and
values where they are kept. Torch takes calls and views for each of them, and half as long again.
"""

from __future__ import annotations

import ctypes
from functools import cache
from pathlib import Path
from typing import Any

import torch

from agents.vlm.clients.next_tokens import NextTokens, with_whole_heads
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


class CompiledAttention(NextTokens):
    """On a CPU, in float32. The time is that of as many conversations as there are new tokens."""

    longest = 0  # torch is faster with what is not within a reply

    def attend(
        self,
        layer: int,
        query: torch.Tensor,
        key: torch.Tensor,
        value: torch.Tensor,
        found: torch.Tensor,
        scale: float,
    ) -> None:
        """As :meth:`NextTokens.attend`."""
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
