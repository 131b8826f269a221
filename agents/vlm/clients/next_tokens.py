"""Conversations of a batch that are some tokens longer: a kernel does a layer of all at once."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import ClassVar

import numpy as np
import torch
from numpy.typing import NDArray

from agents.vlm.clients.kv_cache import Layers


class NextTokens(ABC):
    """The conversations of a batch that are some tokens longer.

    Args:
        places: of the first token of each among the new ones of the batch.
        counts: how many new ones each has, side by side.
        before: how many tokens each had before.
        rooms: for how many tokens the memory of each has room: those before and the new ones at
            least.
        memories: the :func:`addresses` of each.

    Attributes:
        longest: how many new tokens of a conversation the kernel should be given before the reply;
            within one, it should be given all.
    """

    longest: ClassVar[int]

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

    @abstractmethod
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
            query: (1, heads, new tokens of the batch, size).
            key, value: the same with the heads of keys and values.
            found: (1, new tokens, heads, size), in one piece.
            scale: of the scores.

        Raises:
            MemoryError: there is none left.
        """


def addresses(layers: Layers) -> NDArray[np.intp]:
    """Where the keys and values of each layer are, (layers, 2)."""
    return np.array([[part.data_ptr() for part in layer] for layer in layers], np.intp)


def with_whole_heads(part: torch.Tensor) -> torch.Tensor:
    """With the numbers of a head side by side."""
    return part if part.stride(3) == 1 else part.contiguous()
