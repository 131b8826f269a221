"""Generates replies to many conversations on a CPU, token by token, without padding.

``generate`` of transformers pads all conversations of a batch to the longest, and works until the
longest reply ends. On a CPU, where memory moves slowly, most of the time goes there. Here one step
processes what is new of each conversation (a turn, or the last token of its reply) side by side in
one row, and attention reads the keys and values of each conversation where they are kept (with
:mod:`agents.vlm.clients.compiled_attention`, those of all in one call). A conversation can begin
and end at any step.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
import transformers
from numpy.typing import NDArray
from torch.nn import functional
from transformers import AttentionInterface

from agents.vlm.clients.compiled_attention import NextTokens, addresses, has_kernel
from agents.vlm.clients.kv_cache import CachedTurns, grown, positions_of, whole_model
from agents.vlm.clients.padded_batch import EncodedPrompt, new_pictures
from agents.vlm.clients.seeded_sampling import SampledScores, never_drawn, with_noise
from agents.vlm.settings import Sampling

_NAME = "er_gym_packed_rows"
_FAMILIES = ("llama", "qwen2", "qwen3", "qwen2_vl", "qwen2_5_vl", "qwen3_vl")
"""The models whose attention is what :func:`_attention` computes. Others have, for example, caps
on scores or sinks."""


class PackedRow:
    """A conversation whose reply is generated.

    Args:
        prompt: the conversation.
        sampling: how tokens are drawn.
        scored: whether to keep how likely each token of the reply was.

    Attributes:
        prompt: as above.
        said: the tokens of the reply so far.
        scores: the logarithm of the probability with which each was drawn, if ``scored``.
        done: how many tokens have been processed.
        source: of the random numbers by which tokens are drawn; None for the likeliest.
    """

    def __init__(self, prompt: EncodedPrompt, sampling: Sampling, *, scored: bool = False) -> None:
        self.prompt, self.scored = prompt, scored
        self.said: list[int] = []
        self.scores: list[float] = []
        self.done = prompt.reused
        self.source: torch.Generator | None = None
        if sampling.temperature > 0:
            self.source = torch.Generator().manual_seed(prompt.seed)
        self._most = len(prompt.ids) + sampling.max_tokens
        self._layers = list(prompt.kept.layers) if prompt.kept is not None else []
        self._addresses: NDArray[np.intp] | None = None
        self._after_prompt = torch.empty(0)

    @property
    def new(self) -> list[int]:
        """The tokens to be processed next."""
        return self.said[-1:] or self.prompt.ids[self.done :]

    def turns(self) -> CachedTurns:
        """What has been processed. This row must not be used afterwards."""
        ids = [*self.prompt.ids, *self.said][: self.done]
        return CachedTurns(ids, self.prompt.pictures, self.prompt.grids, self._layers)

    def with_new(
        self, layer: int, keys: torch.Tensor, values: torch.Tensor
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Keep the keys and values of the new tokens in a layer.

        Args:
            layer: its number.
            keys, values: (heads, tokens, size).

        Returns:
            Keys and values of all tokens.
        """
        if layer == len(self._layers):  # a new conversation
            self._layers.append((keys[:, :0], values[:, :0]))
        end = self.done + keys.shape[1]
        if end > self._layers[layer][0].shape[1]:
            old, room = self._layers[layer], max(self._most, end)
            self._layers[layer] = (grown(old[0], self.done, room), grown(old[1], self.done, room))
            self._addresses = None
        kept_keys, kept_values = self._layers[layer]
        kept_keys[:, self.done : end] = keys
        kept_values[:, self.done : end] = values
        return kept_keys[:, :end], kept_values[:, :end]

    def memory(self) -> tuple[int, NDArray[np.intp]]:
        """The memory of the conversation's keys and values, with room for one more token at least:
        for how many tokens it has room, and its addresses."""
        room = self._layers[0][0].shape[1]
        if room <= self.done:
            room = max(self._most, self.done + 1)
            self._layers = [
                (grown(keys, self.done, room), grown(values, self.done, room))
                for keys, values in self._layers
            ]
            room = self._layers[0][0].shape[1]
            self._addresses = None
        if self._addresses is None:
            self._addresses = addresses(self._layers)
        return room, self._addresses

    def positions(self, model: Any, image_token: int | None) -> torch.Tensor:
        """Of the new tokens: (1, tokens), for a model with pictures (4, tokens)."""
        count = len(self.new)
        if image_token is None:
            return torch.arange(self.done, self.done + count)[None]
        if not self.said:
            found = positions_of(model, self.prompt.ids, self.prompt.grids, image_token)
            self._after_prompt = found.amax(dim=1, keepdim=True) + 1
            self._after_prompt[1:] = self._after_prompt[1:].max()
            return found[:, self.done :]
        return self._after_prompt + self.done - len(self.prompt.ids)


class PackedModel:
    """A model on a CPU that generates the replies to several conversations, step by step.

    It never says the token of a picture: with no picture there, the model cannot be given it.

    Args:
        model: the model; its attention is replaced.
        image_token: the token of a picture; None for a model without pictures.
        sampling: how tokens are drawn, the same for all rows.
    """

    def __init__(self, model: Any, image_token: int | None, sampling: Sampling) -> None:
        self._model, self._image_token = model, image_token
        self._sampled = SampledScores(sampling.temperature or 1.0, sampling.top_p)
        self._compiled = model.dtype == torch.float32 and has_kernel()
        whole = whole_model(model)
        if image_token is None:
            whole.set_attn_implementation(_NAME)
        else:
            whole.set_attn_implementation({"text_config": _NAME})
        penalty = model.generation_config.repetition_penalty
        self._penalty: Any = None
        if penalty is not None and penalty != 1:
            self._penalty = transformers.RepetitionPenaltyLogitsProcessor(penalty)

    @torch.inference_mode()
    def step(self, rows: Sequence[PackedRow]) -> None:
        """Add a token to the reply of each row."""
        new = [row.new for row in rows]
        with _attended(_Attended.of(rows, [len(tokens) for tokens in new], self._compiled)):
            scores = self._model(**self._inputs(rows, new)).logits[0].float()  # (rows, words)
        for row, tokens in zip(rows, new, strict=True):
            row.done += len(tokens)
        if self._penalty is not None:
            said = [torch.tensor([row.prompt.ids + row.said]) for row in rows]
            parts = zip(said, scores.split(1), strict=True)
            scores = torch.cat([self._penalty(ids, one) for ids, one in parts])
        if self._image_token is not None:
            never_drawn(scores, self._image_token)
        noisy = scores
        sources = [row.source for row in rows if row.source is not None]
        if sources:  # all rows are drawn alike
            scores = self._sampled(scores)
            noisy = with_noise(scores, sources)
        drawn = noisy.argmax(dim=1)
        for row, token in zip(rows, drawn.tolist(), strict=True):
            row.said.append(token)
        if rows[0].scored:
            chances = scores.log_softmax(dim=1).gather(1, drawn[:, None])[:, 0]
            for row, chance in zip(rows, chances.tolist(), strict=True):
                row.scores.append(chance)

    def _inputs(self, rows: Sequence[PackedRow], new: Sequence[Sequence[int]]) -> dict[str, Any]:
        ids = torch.tensor([[token for tokens in new for token in tokens]])
        lasts = torch.tensor([len(tokens) for tokens in new]).cumsum(0) - 1
        positions = torch.cat(
            [row.positions(self._model, self._image_token) for row in rows], dim=1
        )
        inputs: dict[str, Any] = {
            "input_ids": ids,
            "position_ids": positions,
            "logits_to_keep": lasts,
            "use_cache": False,
        }
        if self._image_token is None:
            return inputs
        inputs["position_ids"] = positions[:, None]
        begun = [row.prompt for row in rows if not row.said]
        return inputs | new_pictures(begun, ids, self._image_token)


def can_be_packed(model: Any) -> bool:
    """Whether :class:`PackedModel` can run a model."""
    config = model.config
    usual = getattr(config, "text_config", config)._attn_implementation == "sdpa"
    return model.device.type == "cpu" and config.model_type in _FAMILIES and usual


# -- attention -------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Attended:
    """The conversations whose new tokens the model is given, one after another.

    Attributes:
        longer: those that torch does: each with the place of its first new token and their number.
        next: those that are one token longer and that the kernel does; None if there are none.
    """

    longer: Sequence[tuple[PackedRow, int, int]]
    next: NextTokens | None

    @classmethod
    def of(cls, rows: Sequence[PackedRow], counts: Sequence[int], kernel: bool) -> _Attended:
        """Those with so many new tokens each; ``kernel`` says whether there is one."""
        longer, chosen = [], []
        start = 0
        for row, count in zip(rows, counts, strict=True):
            if kernel and row.said:
                chosen.append((start, row.done, *row.memory()))
            else:
                longer.append((row, start, count))
            start += count
        return cls(longer, NextTokens(*zip(*chosen, strict=True)) if chosen else None)


_now: ContextVar[_Attended] = ContextVar("now")


@contextmanager
def _attended(these: _Attended) -> Iterator[None]:
    """The conversations whose new tokens the model gets within the context."""
    token = _now.set(these)
    try:
        yield
    finally:
        _now.reset(token)


def _attention(
    module: Any,
    query: torch.Tensor,
    key: torch.Tensor,
    value: torch.Tensor,
    attention_mask: None,
    *,
    scaling: float | None = None,
    **more: Any,
) -> tuple[torch.Tensor, None]:
    """Attention of each conversation's new tokens to all its tokens.

    Args:
        module: the layer.
        query: (1, heads, tokens of all conversations, size).
        key, value: the same with the heads of keys and values.
        scaling: of the scores.

    Returns:
        (1, tokens, heads, size).
    """
    _, heads, tokens, size = query.shape
    groups = key.shape[1]
    found = query.new_empty(1, tokens, heads, size)
    now = _now.get()
    if now.next is not None:
        scale = size**-0.5 if scaling is None else scaling
        now.next.attend(module.layer_idx, query, key, value, found, scale)
    for row, start, count in now.longer:
        end = start + count
        keys, values = row.with_new(module.layer_idx, key[0, :, start:end], value[0, :, start:end])
        asked = query[:, :, start:end]
        if count == 1:  # the heads of a group as the places of one
            one = functional.scaled_dot_product_attention(
                asked.reshape(1, groups, heads // groups, size), keys[None], values[None],
                scale=scaling,
            )  # fmt: skip
            found[0, start] = one.reshape(heads, size)
        else:
            old = keys.shape[1] - count
            mask = torch.ones(count, old + count, dtype=torch.bool).tril(old) if old else None
            one = functional.scaled_dot_product_attention(
                asked, keys[None], values[None],
                attn_mask=mask, is_causal=mask is None, scale=scaling, enable_gqa=groups < heads,
            )  # fmt: skip
            found[:, start:end] = one.transpose(1, 2)
    return found, None


AttentionInterface.register(_NAME, _attention)
