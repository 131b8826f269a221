"""What a model has read in a batch of conversations, so that no token is read twice."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from transformers import DynamicCache


class Reading:
    """The keys and values of a batch of conversations, for ``generate`` of transformers.

    Each turn is as long as the longest of the batch; what pads the others is masked.

    Args:
        rows: how many conversations there are.
        pad: the id that pads.
    """

    def __init__(self, rows: int, pad: int) -> None:
        self._pad = pad
        self._lengths = [0] * rows  # of each conversation's ids, how many have been read
        self._ids = torch.zeros((rows, 0), dtype=torch.long)
        self._mask = self._ids
        self._cache: DynamicCache | None = None

    def inputs(self, rows: Sequence[Sequence[int]], model: Any) -> dict[str, Any]:
        """The arguments of ``generate`` for conversations, whose ids are given whole each time."""
        new = [row[length:] for row, length in zip(rows, self._lengths, strict=True)]
        self._lengths = list(map(len, rows))
        width = max(map(len, new))
        ids = torch.tensor([[self._pad] * (width - len(each)) + [*each] for each in new])
        mask = torch.tensor([[0] * (width - len(each)) + [1] * len(each) for each in new])
        self._ids = torch.cat([self._ids, ids], 1)
        self._mask = torch.cat([self._mask, mask], 1)
        if self._cache is None:
            self._cache = DynamicCache(config=model.config)
        return {
            "input_ids": self._ids.to(model.device),
            "attention_mask": self._mask.to(model.device),
            "past_key_values": self._cache,
        }

    def add(self, found: torch.Tensor, replies: Sequence[Sequence[int]]) -> None:
        """Note what ``generate`` has returned, and the ids of the replies in it.

        The model has not read the last token of the longest reply.
        """
        width = found.shape[1] - 1 - self._ids.shape[1]
        kept = [min(len(each), width) for each in replies]
        mask = torch.tensor([[1] * each + [0] * (width - each) for each in kept])
        self._ids = found[:, :-1].cpu()
        self._mask = torch.cat([self._mask, mask.reshape(len(kept), width)], 1)
        self._lengths = [a + b for a, b in zip(self._lengths, kept, strict=True)]

    def keep(self, stay: Sequence[bool]) -> None:
        """Forget the conversations that are over."""
        rows = [row for row, stays in enumerate(stay) if stays]
        if self._cache is None or len(rows) == len(stay) or not rows:
            return
        self._lengths = [self._lengths[row] for row in rows]
        self._ids, self._mask = self._ids[rows], self._mask[rows]
        self._cache.batch_select_indices(torch.tensor(rows))
