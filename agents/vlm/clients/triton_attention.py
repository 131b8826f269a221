"""Attention of conversations that are some tokens longer on a GPU, by a kernel in Triton.

It does on a GPU what attention.c does on a CPU: one call for a layer of all conversations, which
reads their keys and values where they are kept, by address. Torch's own would take calls for each
of them, and starting a call on a GPU takes longer than the work of a small model.

Triton comes with torch for GPUs, and is imported by nothing but this module.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
import triton
import triton.language as tl

from agents.vlm.clients.next_tokens import NextTokens, with_whole_heads

_QUERIES = 16  # of a tile: new tokens times the heads that share keys. Matrix units take no fewer.
_KEYS = 64  # that are read at once


@triton.jit(do_not_specialize=["rows", "tiles"])  # others in each step
def _keep(
    key, value, numbers, memories, rows, tiles, key_head, key_token, value_head, value_token,
    TOKENS: tl.constexpr, SIZE: tl.constexpr, WIDTH: tl.constexpr,
):  # fmt: skip
    """Write the new keys and values of a tile's tokens, of a group of heads, to their memory."""
    tile, group = tl.program_id(0), tl.program_id(1)
    row = tl.load(numbers + 4 * rows + tile)
    new = tl.load(numbers + 4 * rows + tiles + tile) + tl.arange(0, TOKENS)
    place, count = tl.load(numbers + row), tl.load(numbers + rows + row)
    before, room = tl.load(numbers + 2 * rows + row), tl.load(numbers + 3 * rows + row)
    keys = tl.load(memories + row).to(tl.pointer_type(key.dtype.element_ty))
    values = tl.load(memories + rows + row).to(tl.pointer_type(value.dtype.element_ty))
    part = tl.arange(0, WIDTH)[None, :]
    there = (new < count)[:, None] & (part < SIZE)
    to = (group * room + before + new)[:, None] * SIZE + part
    source = (place + new)[:, None]
    found = tl.load(key + group * key_head + source * key_token + part, mask=there, other=0)
    tl.store(keys + to, found, mask=there)
    found = tl.load(value + group * value_head + source * value_token + part, mask=there, other=0)
    tl.store(values + to, found, mask=there)


@triton.jit(do_not_specialize=["rows", "tiles"])  # others in each step
def _attend(
    query, found, numbers, memories, rows, tiles, query_head, query_token, heads, scale,
    TOKENS: tl.constexpr, SHARED: tl.constexpr, EACH: tl.constexpr, SIZE: tl.constexpr,
    WIDTH: tl.constexpr, KEYS: tl.constexpr,
):  # fmt: skip
    """Attention of a tile's tokens in the heads that share a group of keys: EACH places for a
    token, of which SHARED are used."""
    tile, group = tl.program_id(0), tl.program_id(1)
    row = tl.load(numbers + 4 * rows + tile)
    first = tl.load(numbers + 4 * rows + tiles + tile)
    place, count = tl.load(numbers + row), tl.load(numbers + rows + row)
    before, room = tl.load(numbers + 2 * rows + row), tl.load(numbers + 3 * rows + row)
    one = tl.arange(0, TOKENS * EACH)
    new, head = first + one // EACH, group * SHARED + one % EACH
    part = tl.arange(0, WIDTH)[None, :]
    asked = ((new < count) & (one % EACH < SHARED))[:, None] & (part < SIZE)
    source = (place + new)[:, None]
    wanted = tl.load(
        query + source * query_token + head[:, None] * query_head + part, mask=asked, other=0
    )
    kept = group * room * SIZE
    keys = tl.load(memories + row).to(tl.pointer_type(query.dtype.element_ty)) + kept
    values = tl.load(memories + rows + row).to(tl.pointer_type(query.dtype.element_ty)) + kept
    most = tl.full((TOKENS * EACH,), float("-inf"), tl.float32)
    total = tl.zeros((TOKENS * EACH,), tl.float32)
    sums = tl.zeros((TOKENS * EACH, WIDTH), tl.float32)
    end = before + tl.minimum(count, first + TOKENS)
    for start in range(0, end, KEYS):
        old = start + tl.arange(0, KEYS)
        at = old[:, None] * SIZE + part
        there = (old < end)[:, None] & (part < SIZE)
        some = tl.load(keys + at, mask=there, other=0)
        scores = tl.dot(wanted, tl.trans(some), input_precision="ieee") * scale
        scores = tl.where(old[None, :] <= before + new[:, None], scores, float("-inf"))
        higher = tl.maximum(most, tl.max(scores, axis=1))
        weights = tl.exp(scores - higher[:, None])
        fade = tl.exp(most - higher)
        total = total * fade + tl.sum(weights, axis=1)
        some = tl.load(values + at, mask=there, other=0)
        sums = sums * fade[:, None] + tl.dot(weights.to(some.dtype), some, input_precision="ieee")
        most = higher
    to = (source * heads + head[:, None]) * SIZE + part
    tl.store(found + to, (sums / total[:, None]).to(found.dtype.element_ty), mask=asked)


class TritonAttention(NextTokens):
    """On one GPU."""

    # Turns, but not instructions: the kept keys and values are read once for every few new tokens,
    # which torch does not do. Chosen without a measurement.
    longest = 256

    _on_device: tuple[torch.Tensor, torch.Tensor] | None = None

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
        _, heads, _, size = query.shape
        groups = key.shape[1]
        shared = heads // groups
        each = triton.next_power_of_2(shared)
        tokens = max(1, _QUERIES // each)
        numbers, memories = self._told(tokens, query.device)
        rows = self._numbers.shape[1]
        tiles = (len(numbers) - 4 * rows) // 2
        grid = (tiles, groups)
        sizes: dict[str, Any] = {
            "TOKENS": tokens, "SIZE": size, "WIDTH": max(16, triton.next_power_of_2(size)),
        }  # fmt: skip
        strides = [part.stride(axis) for part in (key, value) for axis in (1, 2)]
        _keep[grid](key, value, numbers, memories[layer], rows, tiles, *strides, **sizes)
        _attend[grid](
            query, found, numbers, memories[layer], rows, tiles,
            query.stride(1), query.stride(2), heads, scale,
            **sizes, SHARED=shared, EACH=each, KEYS=_KEYS,
        )  # fmt: skip

    def _told(self, tokens: int, device: torch.device) -> tuple[torch.Tensor, torch.Tensor]:
        """What the kernels read: the numbers of the conversations, then for each tile of so many
        tokens its conversation and its first token; and addresses, (layers, 2 × conversations)."""
        if self._on_device is None:
            tiles = [
                (row, first)
                for row, count in enumerate(self._numbers[1])
                for first in range(0, count, tokens)
            ]
            numbers = np.concatenate([self._numbers.ravel(), np.array(tiles, np.intp).T.ravel()])
            memories = self._memories.reshape(len(self._memories), -1)
            self._on_device = (
                torch.from_numpy(numbers).to(device), torch.from_numpy(memories).to(device)
            )  # fmt: skip
        return self._on_device
