"""Caches keys and values of the earlier turns of conversations, for their next turns.

What a transformer computes for a token are a key and a value in each layer; later tokens need
nothing else of it. A turn of a conversation repeats all turns before it, so their keys and values
are kept, and the model processes the new turns alone.

Keys and values of many conversations are hundreds of megabytes, and for a small model on a CPU to
move them takes longer than to compute. So each conversation has memory with room for its next
turns, to which new ones are appended.
"""

from __future__ import annotations

import hashlib
import inspect
import threading
from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import torch
from transformers import DynamicCache
from transformers.cache_utils import DynamicLayer

from agents.vlm.chat import LEFT_OUT, Message

MOST = 256
"""The most conversations that are kept."""
_ROOM = 64  # tokens by which a full layer of a batch grows
_NEXT_TURNS = 256
"""Tokens for which a conversation has room when its memory is full."""
_ON_CPU = 2 << 30  # bytes
_SHARE_OF_GPU = 0.25  # of the memory that is free once the model is loaded
_WITH_PICTURES = ("qwen2_vl", "qwen2_5_vl", "qwen3_vl", "qwen3_vl_moe")
"""The models with pictures whose positions :func:`positions_of` counts."""

Layers = list[tuple[torch.Tensor, torch.Tensor]]
"""Keys and values of each layer, (heads, tokens, size of a head)."""


@dataclass(frozen=True)
class CachedTurns:
    """The turns of a conversation that a model has processed.

    Attributes:
        ids: their tokens; a picture takes as many as it has merged patches.
        pictures: the digests of their pictures; ``grids``: (pictures, 3) patches in time, height
            and width.
        layers: keys and values of these tokens, and room for more.
    """

    ids: Sequence[int]
    pictures: Sequence[str]
    grids: torch.Tensor | None
    layers: Layers

    @property
    def size(self) -> int:
        """Bytes, the room included."""
        return sum(each.nbytes for layer in self.layers for each in layer)

    def usable(self, ids: Sequence[int], pictures: Sequence[str], places: Sequence[int]) -> int:
        """How many of the kept tokens a conversation begins with.

        At least one token of it is left, since the model must process one to say the next.

        Args:
            ids: its tokens.
            pictures: the digests of its pictures.
            places: where the tokens of each picture begin.
        """
        length = min(len(self.ids), len(ids) - 1)
        for place in range(length):
            if self.ids[place] != ids[place]:
                length = place
                break
        for number, (place, digest) in enumerate(zip(places, pictures, strict=True)):
            if place >= length:
                break
            if number >= len(self.pictures) or self.pictures[number] != digest:
                return place
        # A picture is processed as a whole, and its tokens end where the next text begins.
        for place, after in pairwise((*places, len(ids))):
            count = next((n for n, one in enumerate(ids[place:after]) if one != ids[place]), 0)
            if place < length < place + count:
                return place
        return length

    def first(self, length: int) -> Layers:
        """The keys and values of the first tokens."""
        return [(keys[:, :length], values[:, :length]) for keys, values in self.layers]

    def continued(self, length: int, new: Layers) -> Layers:
        """Keys and values of the first ``length`` tokens with those of new tokens after them, in
        the same memory where that has room. This object must not be used afterwards."""
        return [
            (_appended(keys, length, new_keys), _appended(values, length, new_values))
            for (keys, values), (new_keys, new_values) in zip(self.layers, new, strict=True)
        ]


class ConversationCache:
    """The cached turns of the most recently used conversations; thread-safe.

    Args:
        limit: the most bytes.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._lock = threading.Lock()
        self._kept: OrderedDict[str, CachedTurns] = OrderedDict()

    def take(self, name: str) -> CachedTurns | None:
        """Take the turns of a conversation out; None if they are not here."""
        with self._lock:
            return self._kept.pop(name, None)

    def keep(self, name: str, turns: CachedTurns) -> None:
        """Keep the turns of a conversation; the least recently used conversations are dropped."""
        with self._lock:
            self._kept.pop(name, None)
            self._kept[name] = turns
            total = sum(each.size for each in self._kept.values())
            while self._kept and (total > self._limit or len(self._kept) > MOST):
                total -= self._kept.popitem(last=False)[1].size

    def clear(self) -> None:
        """Drop all conversations."""
        with self._lock:
            self._kept.clear()


def conversation_name(messages: Sequence[Message], seed: int) -> str:
    """The same for all turns of a conversation: its seed and the texts of its first user turn."""
    told = hashlib.sha256(str(seed).encode())
    for message in messages[: 1 + (messages[0].role == "system")]:
        for part in message.parts:
            if isinstance(part, str) and part != LEFT_OUT:  # which stands for a picture
                told.update(part.encode(errors="surrogatepass") + b"\0")
    return told.hexdigest()


def memory_for(model: Any) -> int:
    """How many bytes of keys and values may be kept beside a model; 0 if its turns cannot be.

    They cannot where a layer keeps something else than all keys and values, such as the state of a
    recurrence or a sliding window, or where positions cannot be given.
    """
    config = model.config
    if hasattr(config, "vision_config"):
        positions = config.model_type in _WITH_PICTURES
    else:
        positions = "position_ids" in inspect.signature(whole_model(model).forward).parameters
    layers = [] if config.is_encoder_decoder else DynamicCache(config=config).layers
    if not positions or not layers or any(type(layer) is not DynamicLayer for layer in layers):
        return 0
    if model.device.type != "cuda":
        return _ON_CPU
    return int(torch.cuda.mem_get_info(model.device)[0] * _SHARE_OF_GPU)


def positions_of(
    model: Any, ids: Sequence[int], grids: torch.Tensor | None, image_token: int
) -> torch.Tensor:
    """The positions of a conversation's tokens as Qwen's models count them: in the text, then in
    time, height and width; (4, tokens).

    Args:
        model: one with pictures.
        ids: the tokens of the conversation.
        grids: of its pictures.
        image_token: the token of a picture.
    """
    tokens = torch.tensor([ids])
    kinds = tokens.eq(image_token).int()
    inner = whole_model(model).model  # the part without an output layer
    seen, _ = inner.get_rope_index(tokens, mm_token_type_ids=kinds, image_grid_thw=grids)
    return torch.cat([torch.arange(len(ids))[None], seen[:, 0]])


def _appended(memory: torch.Tensor, length: int, new: torch.Tensor) -> torch.Tensor:
    """Write (heads, tokens, size) after the first ``length`` tokens of a memory, which grows if it
    is full."""
    end = length + new.shape[1]
    if end > memory.shape[1]:
        memory = grown(memory, length, end)
    memory[:, length:end] = new
    return memory


def grown(memory: torch.Tensor, length: int, tokens: int) -> torch.Tensor:
    """A larger memory with the first ``length`` tokens of one, and room for the next turns."""
    larger = memory.new_zeros((memory.shape[0], tokens + _NEXT_TURNS, memory.shape[2]))
    larger[:, :length] = memory[:, :length]
    return larger


def joined_past(model: Any, pasts: Sequence[Layers], room: int = _ROOM) -> DynamicCache:
    """The keys and values of several conversations as one cache, padded on the left.

    Args:
        model: whose they are.
        pasts: of each conversation; empty for a new one.
        room: how many tokens will follow, at most; more make the cache move.
    """
    cache = DynamicCache(config=model.config)
    layers = [_RoomyLayer(room) for _ in cache.layers]
    cache.layers = [*layers]
    longest = max(past[0][0].shape[1] if past else 0 for past in pasts)
    if longest:
        for number, layer in enumerate(layers):
            layer.begin([past[number] if past else None for past in pasts], longest)
    return cache


class _RoomyLayer(DynamicLayer):
    """A layer with room for tokens to come. The library's copies all keys and values of all
    conversations for each token, which takes a quarter of the time of a small model.

    Args:
        room: for how many tokens, beside those with which it begins.
    """

    def __init__(self, room: int) -> None:
        super().__init__()
        self._room = room
        self._stores: list[torch.Tensor] = []
        self._length = 0

    def begin(
        self, pasts: Sequence[tuple[torch.Tensor, torch.Tensor] | None], longest: int
    ) -> None:
        """Take in what conversations have left, at the right end of the first tokens."""
        like = next(past for past in pasts if past)
        self.lazy_initialization(*like)
        for part, one in enumerate(like):
            shape = (len(pasts), one.shape[0], longest + self._room, one.shape[2])
            store = one.new_empty(shape)
            for row, past in enumerate(pasts):
                start = longest - (past[part].shape[1] if past else 0)
                store[row, :, :start] = 0  # masked, but it must be finite
                if past:
                    store[row, :, start:longest] = past[part]
            self._stores.append(store)
        self._show(longest)

    def update(
        self, key_states: torch.Tensor, value_states: torch.Tensor, *args: Any, **kwargs: Any
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Add keys and values of new tokens; returns all."""
        if not self.is_initialized:
            self.lazy_initialization(key_states, value_states)
        before, after = self._length, self._length + key_states.shape[-2]
        for part, new in enumerate((key_states, value_states)):
            if part == len(self._stores):
                room = max(self._room, after)
                shape = (*new.shape[:-2], room, new.shape[-1])
                self._stores.append(new.new_empty(shape))
            if after > self._stores[part].shape[-2]:
                larger = new.new_empty((*new.shape[:-2], after + _ROOM, new.shape[-1]))
                larger[..., :before, :] = self._stores[part][..., :before, :]
                self._stores[part] = larger
            self._stores[part][..., before:after, :] = new
        return self._show(after)

    def _show(self, length: int) -> tuple[torch.Tensor, torch.Tensor]:
        """Let the model see so many tokens."""
        self._length = length
        keys, values = (store[..., :length, :] for store in self._stores)
        self.keys, self.values = keys, values
        return keys, values


def layers_of(cache: DynamicCache, row: int, start: int, end: int) -> Layers:
    """The keys and values of some tokens of a row of a cache, in the cache's memory."""
    layers: Any = cache.layers
    return [(layer.keys[row, :, start:end], layer.values[row, :, start:end]) for layer in layers]


def copied(layers: Layers) -> Layers:
    """The same in memory of their own, with room for the next turns."""
    return [
        (_appended(keys[:, :0], 0, keys), _appended(values[:, :0], 0, values))
        for keys, values in layers
    ]


def whole_model(model: Any) -> Any:
    """The model without an adapter around it."""
    return model.get_base_model() if hasattr(model, "get_base_model") else model
