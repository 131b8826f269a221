"""Batches: the order of conversations, and their tokens and pictures as tensors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from PIL import Image
from torch.utils.data import Dataset, Sampler

from agents.finetune.tokens import EncodedChat, expanded
from agents.vlm.pictures import patches_of
from er_gym.data.pictures import open_picture
from er_gym.data.trajectory import PictureRecord

_POOL = 64
"""Batches among which conversations of similar length are found: the more, the less padding, and
the less random who meets whom."""


class EpochSampler(Sampler[int]):
    """The order of the conversations in an epoch: drawn from the seed and the epoch alone.

    Consecutive ``batch`` indices are a batch. With ``buckets``, they are of similar length; the
    batches themselves come in random order, an incomplete one last.

    Args:
        lengths: of the conversations.
        batch: conversations in a batch.
        seed: of the order.
        buckets: whether the conversations of a batch are of similar length.
    """

    def __init__(self, lengths: Sequence[int], batch: int, seed: int, buckets: bool) -> None:
        self._lengths = np.asarray(lengths)
        self._batch, self._seed, self._buckets = batch, seed, buckets
        self._epoch = 0

    def set_epoch(self, epoch: int) -> None:
        """Choose the epoch; the trainer calls it before each."""
        self._epoch = epoch

    def __len__(self) -> int:
        return len(self._lengths)

    def __iter__(self) -> Iterator[int]:
        draw = np.random.default_rng([self._seed, self._epoch])
        order = draw.permutation(len(self._lengths))
        if not self._buckets:
            return iter(order.tolist())
        last = order[len(order) - len(order) % self._batch :]
        pool = self._batch * _POOL
        batches: list[Any] = []
        for start in range(0, len(order) - len(last), pool):
            among = order[start : min(start + pool, len(order) - len(last))]
            by_length = among[np.argsort(self._lengths[among], kind="stable")]
            batches += by_length.reshape(-1, self._batch).tolist()
        mixed = [batches[i] for i in draw.permutation(len(batches))]
        return iter([each for batch in mixed for each in batch] + last.tolist())


class EncodedChats(Dataset[EncodedChat]):
    """The conversations, for a data loader."""

    def __init__(self, chats: Sequence[EncodedChat]) -> None:
        self._chats = chats

    def __len__(self) -> int:
        return len(self._chats)

    def __getitem__(self, index: int) -> EncodedChat:
        return self._chats[index]


@dataclass(frozen=True)
class Collator:
    """Makes a batch of conversations: reads their pictures and pads their tokens.

    Padding stands on the right, where no token of a causal model sees it; so the batch has no
    attention mask, without which attention is faster.

    Attributes:
        image_processor, image_token: the model's; None where it does not see.
        bounds: the least and the most pixels of a picture; one with fewer or more is scaled.
        padding: the token that fills rows up.
        multiple: the length of a batch is one of its multiples. On a CPU, libraries prepare for
            each length anew and keep that: with few lengths, they take less memory.
    """

    image_processor: Any
    image_token: int | None
    bounds: tuple[int, int]
    padding: int
    multiple: int = 1

    def __call__(self, chats: Sequence[EncodedChat]) -> dict[str, Any]:
        """A batch of conversations, whose pictures are read.

        Returns:
            as :meth:`of_rows`; and ``tokens``, how many are no padding.

        Raises:
            ValueError: a picture cannot be read, or is not of its record's size.
        """
        rows = [expanded(chat, self.image_token) for chat in chats]
        batch = self.of_rows(rows, [_read(each) for chat in chats for each in chat.pictures])
        if "image_grid_thw" in batch:
            ids, labels, grids = (batch[name] for name in ("input_ids", "labels", "image_grid_thw"))
            self._learn_cells(chats, ids, labels, grids)
        return {**batch, "tokens": sum(len(ids) for ids, _ in rows)}

    def of_rows(
        self,
        rows: Sequence[tuple[NDArray[np.int64], NDArray[np.int64]]],
        pictures: Sequence[Image.Image],
    ) -> dict[str, Any]:
        """A batch of rows of tokens; without rows, one of padding.

        Args:
            rows: (length,) ids and (length,) labels of each. A picture has all of its tokens.
            pictures: of all rows, in order, RGB.

        Returns:
            ``input_ids`` and ``labels`` (rows, longest), labels -100 where there is no loss; with
            pictures, ``pixel_values`` (patches, values of a patch), ``image_grid_thw`` (pictures,
            3) and ``mm_token_type_ids`` (rows, longest), 1 for a picture's token.
        """
        longest = max((len(ids) for ids, _ in rows), default=1)
        longest += -longest % self.multiple
        ids = torch.full((max(len(rows), 1), longest), self.padding)
        labels = torch.full_like(ids, -100)
        for row, (tokens, wanted) in enumerate(rows):
            ids[row, : len(tokens)] = torch.from_numpy(tokens)
            labels[row, : len(tokens)] = torch.from_numpy(wanted)
        batch: dict[str, Any] = {"input_ids": ids, "labels": labels}
        if pictures and self.image_token is not None:
            pixels, grids = patches_of(self.image_processor, pictures, self.bounds)
            batch |= {
                "pixel_values": pixels,
                "image_grid_thw": grids,
                "mm_token_type_ids": ids.eq(self.image_token).int(),
            }
        return batch

    def _learn_cells(
        self, chats: Sequence[EncodedChat], ids: torch.Tensor, labels: torch.Tensor, grids: Any
    ) -> None:
        """Add to the labels what covers each square of a picture, where that is known.

        The label of a picture's token stands one place later, as those of all tokens do: the token
        says what is in its square, not which token comes next.
        """
        assert self.image_token is not None
        sides = iter((grids[:, 1:] // self.image_processor.merge_size).tolist())
        for row, chat in enumerate(chats):
            places = ids[row].eq(self.image_token).nonzero()[:, 0]
            start = 0
            for count, cells in zip_longest(chat.picture_tokens, chat.cells):
                rows, columns = next(sides)
                if cells is not None:
                    said = torch.tensor(cells.on_grid(rows, columns))
                    labels[row, places[start : start + count] + 1] = said
                start += count


def _read(record: PictureRecord) -> Image.Image:
    """A picture of a record.

    Raises:
        ValueError: it cannot be read, or is not of the record's size.
    """
    image = open_picture(Path(record.path))
    if image.size != (record.width, record.height):
        raise ValueError(
            f"{record.path} is {image.width} × {image.height} pixels, but its record says "
            f"{record.width} × {record.height}; collect the data again"
        )
    return image
