"""The compiled kernel of attention finds what torch finds."""

from __future__ import annotations

import pytest

pytest.importorskip("torch", reason="needs the extra local")

import torch
from torch.nn import functional

from agents.vlm.clients.compiled_attention import CompiledAttention, has_kernel
from agents.vlm.clients.kv_cache import CachedTurns
from agents.vlm.clients.next_tokens import addresses
from agents.vlm.clients.packed_rows import PackedRow
from agents.vlm.clients.padded_batch import EncodedPrompt
from agents.vlm.settings import Sampling

pytestmark = pytest.mark.skipif(not has_kernel(), reason="this machine has no C compiler")

BEFORE = [0, 1, 14, 15, 16, 17, 40, 99]
"""Tokens of the conversations before the new ones: around the 16 that are done at once."""
NEW = [1, 2, 3, 1, 9, 1, 20, 2]
"""New tokens of each."""


def kept(generator: torch.Generator, groups: int, before: int, room: int, size: int):
    """Two layers' keys and values."""
    shape = (groups, before + room, size)
    return [tuple(torch.randn(shape, generator=generator) for _ in range(2)) for _ in range(2)]


@pytest.mark.parametrize("size", [20, 32, 64, 128])
@pytest.mark.parametrize(("heads", "groups"), [(4, 4), (6, 2)])
@pytest.mark.parametrize("threads", [1, 3])
def test_each_conversation_attends_to_its_own_tokens(
    size: int, heads: int, groups: int, threads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(torch, "get_num_threads", lambda: threads)
    generator = torch.Generator().manual_seed(size + heads)
    rooms = [count + number % 3 for number, count in enumerate(NEW)]
    memories = [
        kept(generator, groups, before, room, size)
        for before, room in zip(BEFORE, rooms, strict=True)
    ]
    places = [number + 1 + sum(NEW[:number]) for number in range(len(NEW))]  # others lie between
    tokens = len(NEW) + 1 + sum(NEW)
    query = torch.randn(1, heads, tokens, size, generator=generator)
    key, value = (
        torch.randn(1, tokens, groups, size, generator=generator).transpose(1, 2) for _ in range(2)
    )
    found = torch.full((1, tokens, heads, size), torch.nan)
    whole = [before + room for before, room in zip(BEFORE, rooms, strict=True)]
    ones = CompiledAttention(places, NEW, BEFORE, whole, [addresses(each) for each in memories])
    before = [[part.clone() for part in memory[0]] for memory in memories]
    ones.attend(1, query, key, value, found, size**-0.5)
    written = torch.zeros(tokens, dtype=torch.bool)
    for number, (place, count, old) in enumerate(zip(places, NEW, BEFORE, strict=True)):
        keys, values = memories[number][1]
        new = slice(place, place + count)
        written[new] = True
        assert torch.equal(keys[:, old : old + count], key[0, :, new])
        assert torch.equal(values[:, old : old + count], value[0, :, new])
        wanted = functional.scaled_dot_product_attention(
            query[:, :, new], keys[None, :, : old + count], values[None, :, : old + count],
            attn_mask=torch.ones(count, old + count, dtype=torch.bool).tril(old), enable_gqa=True,
        )  # fmt: skip
        torch.testing.assert_close(found[:, new], wanted.transpose(1, 2), rtol=1e-5, atol=1e-6)
        for part, same in zip(memories[number][0], before[number], strict=True):
            assert torch.equal(part, same)  # the other layer
    assert torch.isnan(found[0, ~written]).all()  # nothing else is written


def test_scores_of_any_size_give_no_overflow() -> None:
    generator = torch.Generator().manual_seed(0)
    memory = kept(generator, 1, 40, 1, 32)
    query = torch.randn(1, 1, 1, 32, generator=generator) * 1e4
    key, value = torch.randn(2, 1, 1, 1, 32, generator=generator)
    found = torch.empty(1, 1, 1, 32)
    CompiledAttention([0], [1], [40], [41], [addresses(memory)]).attend(
        0, query, key, value, found, 1.0
    )
    keys, values = memory[0]
    wanted = functional.scaled_dot_product_attention(query, keys[None], values[None], scale=1.0)
    torch.testing.assert_close(found[:, 0], wanted[:, :, 0])


def test_the_kernel_follows_a_memory_that_has_moved_since_it_was_full() -> None:
    layers = [(torch.zeros(2, 12, 16), torch.zeros(2, 12, 16)) for _ in range(3)]
    ids = list(range(10))
    prompt = EncodedPrompt(
        ids=ids, pictures=[], grids=None, new_pixels=None, new_pictures=0, seed=0, thinking=False,
        name="", kept=CachedTurns(ids[:9], [], None, layers), reused=9,
    )  # fmt: skip
    row = PackedRow(prompt, Sampling(max_tokens=8))
    rooms = []
    for done in range(10, 18):
        row.done = done
        count = 1 + done % 2
        room, places = row.memory(count)
        assert room >= done + count
        assert (places == addresses(row.turns().layers)).all()
        rooms.append(room)
    assert rooms[0] == 12 < rooms[-1]  # it was full in between
