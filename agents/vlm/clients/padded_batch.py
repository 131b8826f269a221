"""Conversations as the input of a model, several of them in one batch."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import torch
from transformers import DynamicCache

from agents.vlm.clients.kv_cache import (
    CachedTurns,
    Layers,
    copied,
    layers_of,
    positions_of,
)


@dataclass(frozen=True)
class EncodedPrompt:
    """A conversation as input of the model.

    Attributes:
        ids: token ids; a picture takes as many as it has merged patches.
        pictures: the digests of all pictures.
        grids: (pictures, 3): patches in time, height and width; None without pictures.
        new_pixels: (patches of the new pictures, values of a patch); None without new pictures.
        new_pictures: how many pictures, the last ones, have not been processed yet.
        seed: the seed for sampling the reply.
        thinking: whether the prompt ends inside a thought.
        name: of the conversation.
        kept: what an earlier turn has left, if any of it can be used.
        reused: how many of the first tokens that is.
    """

    ids: list[int]
    pictures: Sequence[str]
    grids: torch.Tensor | None
    new_pixels: torch.Tensor | None
    new_pictures: int
    seed: int
    thinking: bool
    name: str
    kept: CachedTurns | None = None
    reused: int = 0

    @property
    def new_grids(self) -> torch.Tensor:
        """(new pictures, 3)."""
        assert self.grids is not None
        return self.grids[len(self.grids) - self.new_pictures :]

    @property
    def past(self) -> Layers:
        """Keys and values of the tokens that are reused."""
        return self.kept.first(self.reused) if self.kept is not None else []


def new_pictures(
    prompts: Sequence[EncodedPrompt], ids: torch.Tensor, image_token: int
) -> dict[str, torch.Tensor]:
    """The pictures that have not been processed yet, as a model is given them.

    Args:
        prompts: the conversations.
        ids: their tokens.
        image_token: the token of a picture.
    """
    seen = [(each.new_pixels, each.new_grids) for each in prompts if each.new_pixels is not None]
    if not seen:
        return {}
    pixels, grids = zip(*seen, strict=True)
    return {
        "pixel_values": torch.cat(pixels),
        "image_grid_thw": torch.cat(grids),
        "mm_token_type_ids": ids.eq(image_token).int(),
    }


class PaddedBatch:
    """Conversations of different lengths, of which different parts are reused.

    Rows are padded on the left, twice: before what is reused, and between that and what is new.
    Padding is masked out, so any token will do.

    Args:
        rows: the conversations.

    Attributes:
        length: of the padded prompts, in tokens.
    """

    def __init__(self, rows: Sequence[EncodedPrompt]) -> None:
        self._rows = rows
        old = max(row.reused for row in rows)
        new = max(len(row.ids) - row.reused for row in rows)
        self._gaps = [(old - row.reused, new - len(row.ids) + row.reused) for row in rows]
        self.length = old + new

    def inputs(
        self, model: Any, image_token: int | None, *, positions: bool
    ) -> dict[str, torch.Tensor]:
        """What the model is given.

        Args:
            model: the model.
            image_token: the token of a picture; None for a model without pictures.
            positions: whether to give the positions of a model with pictures, which it finds itself
                only where nothing is reused.
        """
        ids, mask = [], []
        for row, (before, between) in zip(self._rows, self._gaps, strict=True):
            past, fresh, any_token = row.ids[: row.reused], row.ids[row.reused :], row.ids[:1]
            ids.append(any_token * before + past + any_token * between + fresh)
            mask.append([0] * before + [1] * len(past) + [0] * between + [1] * len(fresh))
        inputs = {"input_ids": torch.tensor(ids), "attention_mask": torch.tensor(mask)}
        if image_token is None:
            return inputs
        inputs |= new_pictures(self._rows, inputs["input_ids"], image_token)
        if positions:
            inputs["position_ids"] = self._positions(model, image_token)
        return inputs

    def turns(self, said: Sequence[list[int]], cache: DynamicCache) -> Iterator[CachedTurns]:
        """What the model has computed for each conversation and the reply to it.

        Args:
            said: the replies.
            cache: the keys and values of all padded tokens but the last of the replies.
        """
        kept = cache.get_seq_length()
        for number, (row, reply) in enumerate(zip(self._rows, said, strict=True)):
            before, between = self._gaps[number]
            start, end = before + row.reused + between, min(self.length + len(reply), kept)
            new = layers_of(cache, number, start, end)
            yield CachedTurns(
                [*row.ids, *reply[: end - self.length]],
                row.pictures,
                row.grids,
                row.kept.continued(row.reused, new) if row.kept is not None else copied(new),
            )

    def _positions(self, model: Any, image_token: int) -> torch.Tensor:
        """(4, rows, tokens)."""
        rows = []
        for row, (before, between) in zip(self._rows, self._gaps, strict=True):
            found = positions_of(model, row.ids, row.grids, image_token)
            past, fresh = found[:, : row.reused], found[:, row.reused :]
            parts = (found.new_zeros(4, before), past, found.new_zeros(4, between), fresh)
            rows.append(torch.cat(parts, dim=1))
        return torch.stack(rows, dim=1)
