"""Generates replies to many conversations token by token, without padding.

``generate`` of transformers pads all conversations of a batch to the longest, and works until the
longest reply ends. Most of the time goes there: on a CPU, where memory moves slowly, and on a GPU,
where everybody waits for the longest reply. Here one step processes what is new of each
conversation (a turn, or the last token of its reply) side by side in one row, and attention reads
the keys and values of each conversation where they are kept: those of all in one call, with
:mod:`agents.vlm.clients.compiled_attention` on a CPU and
:mod:`agents.vlm.clients.triton_attention` on a GPU. A conversation can begin and end at any step.

With the last token of a reply goes a draft of the next ones
(:mod:`agents.vlm.clients.draft_tokens`). The model's scores after each of them say which token it
draws there, and the reply goes on as far as the draft was right: the same tokens as without one, in
fewer steps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

import numpy as np
import torch
import transformers
from numpy.typing import NDArray
from torch.nn import functional
from transformers import AttentionInterface

from agents.vlm.clients.compiled_attention import CompiledAttention, has_kernel
from agents.vlm.clients.draft_tokens import DraftTokens
from agents.vlm.clients.kv_cache import CachedTurns, grown, positions_of, whole_model
from agents.vlm.clients.next_tokens import NextTokens, addresses
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
        device: of the model.

    Attributes:
        prompt: as above.
        said: the tokens of the reply so far.
        scores: the logarithm of the probability with which each was drawn, if ``scored``.
        done: how many tokens have been processed.
        draft: a guess of the next tokens of the reply.
        source: of the random numbers by which tokens are drawn; None for the likeliest.
    """

    def __init__(
        self,
        prompt: EncodedPrompt,
        sampling: Sampling,
        *,
        scored: bool = False,
        device: torch.device | None = None,
    ) -> None:
        self.prompt, self.scored = prompt, scored
        self.said: list[int] = []
        self.scores: list[float] = []
        self.done = prompt.reused
        self.draft: Sequence[int] = ()
        self.source: torch.Generator | None = None
        if sampling.temperature > 0:
            self.source = torch.Generator(device or "cpu").manual_seed(prompt.seed)
        self._left = sampling.max_tokens
        self._most = len(prompt.ids) + sampling.max_tokens
        self._layers = list(prompt.kept.layers) if prompt.kept is not None else []
        self._addresses: NDArray[np.intp] | None = None
        self._after_prompt = torch.empty(0)
        self._noise: list[torch.Tensor] = []

    @property
    def new(self) -> list[int]:
        """The tokens to be processed next, the draft last."""
        return [*(self.said[-1:] or self.prompt.ids[self.done :]), *self.draft]

    def guess(self, drafts: DraftTokens) -> None:
        """Make a draft, after which there is still room for the token that the model adds."""
        self.draft = drafts.after(self.said, self._left - 1)

    def noise(self, words: int) -> Sequence[torch.Tensor]:
        """Random numbers, (words,) each, by which the next token is drawn and one for each of the
        draft. A token of the reply has the same ones whatever the drafts."""
        assert self.source is not None
        while len(self._noise) <= len(self.draft):
            empty = torch.empty(words, device=self.source.device)
            self._noise.append(empty.exponential_(generator=self.source))
        return self._noise[: len(self.draft) + 1]

    def go_on(self, drawn: Sequence[int], chances: Sequence[float]) -> None:
        """Add tokens to the reply, as far as the draft was right and one more.

        Args:
            drawn: after the reply so far, and after each token of the draft.
            chances: the logarithms of their probabilities; empty if they are not kept.
        """
        pairs = zip(self.draft, drawn, strict=False)
        wrong = (place for place, (guess, token) in enumerate(pairs) if guess != token)
        right = next(wrong, len(self.draft))
        self.done += len(self.new) - len(self.draft) + right
        self.draft = ()
        self.said += drawn[: right + 1]
        self.scores += chances[: right + 1]
        self._left -= right + 1
        del self._noise[: right + 1]

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

    def memory(self, count: int) -> tuple[int, NDArray[np.intp]]:
        """The memory of the conversation's keys and values, with room for so many more tokens at
        least: for how many tokens it has room, and its addresses."""
        room = self._layers[0][0].shape[1]
        if room < self.done + count:
            room = max(self._most, self.done + count)
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
        if self.said:
            start = self.done - len(self.prompt.ids)
            return self._after_prompt + torch.arange(start, start + count)
        found = positions_of(model, self.prompt.ids, self.prompt.grids, image_token)
        self._after_prompt = found.amax(dim=1, keepdim=True) + 1
        self._after_prompt[1:] = self._after_prompt[1:].max()
        drafted = self._after_prompt + torch.arange(len(self.draft))
        return torch.cat([found[:, self.done :], drafted], dim=1)


class PackedModel:
    """A model that generates the replies to several conversations, step by step.

    It never says the token of a picture: with no picture there, the model cannot be given it.

    Args:
        model: the model; its attention is replaced.
        image_token: the token of a picture; None for a model without pictures.
        sampling: how tokens are drawn, the same for all rows.
    """

    def __init__(self, model: Any, image_token: int | None, sampling: Sampling) -> None:
        self._model, self._image_token, self._sampling = model, image_token, sampling
        self._sampled = SampledScores(sampling.temperature or 1.0, sampling.top_p)
        self._device = model.device  # which takes a model a while to find
        self._kernel = _kernel_for(model)
        whole = whole_model(model)
        if image_token is None:
            whole.set_attn_implementation(_NAME)
        else:
            whole.set_attn_implementation({"text_config": _NAME})
        penalty = model.generation_config.repetition_penalty
        self._penalty: Any = None
        if penalty is not None and penalty != 1:
            self._penalty = transformers.RepetitionPenaltyLogitsProcessor(penalty)
        # The penalty of a token depends on those before it; without the kernel, drafts cost more.
        self._drafts = DraftTokens() if self._kernel and self._penalty is None else None

    def begin(self, prompt: EncodedPrompt, *, scored: bool = False) -> PackedRow:
        """A conversation whose reply is to be generated; as :class:`PackedRow`."""
        return PackedRow(prompt, self._sampling, scored=scored, device=self._device)

    @torch.inference_mode()
    def step(self, rows: Sequence[PackedRow]) -> None:
        """Add a token to the reply of each row, or several where its draft was right."""
        if self._drafts is not None:
            for row in rows:
                row.guess(self._drafts)
        new = [row.new for row in rows]
        with _attended(_Attended.of(rows, [len(tokens) for tokens in new], self._kernel)):
            scores = self._model(**self._inputs(rows, new)).logits[0].float()  # (places, words)
        if self._penalty is not None:
            said = [torch.tensor([row.prompt.ids + row.said], device=scores.device) for row in rows]
            parts = zip(said, scores.split(1), strict=True)
            scores = torch.cat([self._penalty(ids, one) for ids, one in parts])
        if self._image_token is not None:
            never_drawn(scores, self._image_token)
        noisy = scores
        if rows[0].source is not None:  # all rows are drawn alike
            scores = self._sampled(scores)
            noise = [each for row in rows for each in row.noise(scores.shape[1])]
            noisy = with_noise(scores, torch.stack(noise))
        drawn = noisy.argmax(dim=1)
        chances: list[float] = []
        if rows[0].scored:
            chances = scores.log_softmax(dim=1).gather(1, drawn[:, None])[:, 0].tolist()
        tokens, start = drawn.tolist(), 0
        for row in rows:
            end = start + 1 + len(row.draft)
            row.go_on(tokens[start:end], chances[start:end])
            start = end

    def ended(self, row: PackedRow) -> None:
        """Learn from a reply that has ended what others will say."""
        if self._drafts is not None:
            self._drafts.learn(row.said[:-1])

    def _inputs(self, rows: Sequence[PackedRow], new: Sequence[Sequence[int]]) -> dict[str, Any]:
        ids = torch.tensor([[token for tokens in new for token in tokens]])
        places: list[int] = []  # of the tokens after which one is drawn
        end = 0
        for row, tokens in zip(rows, new, strict=True):
            end += len(tokens)
            places += range(end - 1 - len(row.draft), end)
        positions = torch.cat(
            [row.positions(self._model, self._image_token) for row in rows], dim=1
        )
        inputs = {"input_ids": ids, "position_ids": positions}
        inputs["logits_to_keep"] = torch.tensor(places)
        if self._image_token is not None:
            inputs["position_ids"] = positions[:, None]
            begun = [row.prompt for row in rows if not row.said]
            inputs |= new_pictures(begun, ids, self._image_token)
        told: dict[str, Any] = {name: each.to(self._device) for name, each in inputs.items()}
        return told | {"use_cache": False}


def can_be_packed(model: Any) -> bool:
    """Whether :class:`PackedModel` can run a model."""
    config = model.config
    usual = getattr(config, "text_config", config)._attn_implementation == "sdpa"
    return config.model_type in _FAMILIES and usual and _device_can(model)


def _device_can(model: Any) -> bool:
    """Whether a model is where its tokens can be packed: on a CPU, or whole on one GPU for which
    there is Triton."""
    if model.device.type != "cuda":
        return bool(model.device.type == "cpu")
    places = set(getattr(model, "hf_device_map", {}).values())
    return len(places) <= 1 and find_spec("triton") is not None


# -- attention -------------------------------------------------------------------------------------


def _kernel_for(model: Any) -> type[NextTokens] | None:
    """The kernel for a model; None if there is none."""
    if model.device.type == "cuda":
        from agents.vlm.clients.triton_attention import TritonAttention

        return TritonAttention
    if model.dtype == torch.float32 and has_kernel():
        return CompiledAttention
    return None


@dataclass(frozen=True)
class _Attended:
    """The conversations whose new tokens the model is given, one after another.

    Attributes:
        longer: those that torch does: each with the place of its first new token and their number.
        next: those that the kernel does; None if there are none.
    """

    longer: Sequence[tuple[PackedRow, int, int]]
    next: NextTokens | None

    @classmethod
    def of(
        cls, rows: Sequence[PackedRow], counts: Sequence[int], kernel: type[NextTokens] | None
    ) -> _Attended:
        """Those with so many new tokens each."""
        longer, chosen = [], []
        start = 0
        for row, count in zip(rows, counts, strict=True):
            if kernel is not None and row.done and (row.said or count <= kernel.longest):
                chosen.append((start, count, row.done, *row.memory(count)))
            else:
                longer.append((row, start, count))
            start += count
        if kernel is None or not chosen:
            return cls(longer, None)
        return cls(longer, kernel(*zip(*chosen, strict=True)))


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
            mask = None
            if old:
                mask = torch.ones(count, old + count, dtype=torch.bool, device=query.device)
                mask = mask.tril(old)
            one = functional.scaled_dot_product_attention(
                asked, keys[None], values[None],
                attn_mask=mask, is_causal=mask is None, scale=scaling, enable_gqa=groups < heads,
            )  # fmt: skip
            found[:, start:end] = one.transpose(1, 2)
    return found, None


AttentionInterface.register(_NAME, _attention)
