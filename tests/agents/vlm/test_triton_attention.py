"""The kernels of attention for a GPU find what torch finds.

Where there is no GPU, Triton interprets them (tests/conftest.py), in float32 and float16.
"""

from __future__ import annotations

import pytest

pytest.importorskip("torch", reason="needs the extra local")
pytest.importorskip("triton", reason="needs Triton: make test-triton")

import torch
from torch.nn import functional

from agents.vlm.clients.next_tokens import addresses
from agents.vlm.clients.triton_attention import TritonAttention

DEVICE = "cuda" if torch.cuda.is_available() else "cpu"
TYPES = {"float32": 2e-6, "float16": 2e-3}
if DEVICE == "cuda":
    TYPES["bfloat16"] = 2e-2
BEFORE = [0, 1, 14, 15, 63, 64, 130]
"""Tokens of the conversations before the new ones: around the 64 that are read at once."""
NEW = [1, 2, 17, 1, 9, 33, 1]
"""New tokens of each: around the 16 that are done at once."""
ROOMS = [
    before + new + number % 3 for number, (before, new) in enumerate(zip(BEFORE, NEW, strict=True))
]
PLACES = [number + 1 + sum(NEW[:number]) for number in range(len(NEW))]
"""Where the new tokens of each are; others lie between."""
TOKENS = len(NEW) + 1 + sum(NEW)


def drawn(*shape: int, kind: torch.dtype) -> torch.Tensor:
    return torch.randn(shape).to(DEVICE, kind)


@pytest.mark.parametrize("name", TYPES)
@pytest.mark.parametrize(("heads", "groups", "size"), [(4, 4, 32), (6, 2, 20), (9, 3, 64)])
def test_each_conversation_attends_to_its_own_tokens(
    heads: int, groups: int, size: int, name: str
) -> None:
    torch.manual_seed(heads)
    kind = getattr(torch, name)
    memories = [
        [tuple(drawn(groups, room, size, kind=kind) for _ in range(2)) for _ in range(2)]
        for room in ROOMS
    ]
    before = [[part.clone() for part in memory[0]] for memory in memories]
    kept = [[part.clone() for part in memory[1]] for memory in memories]
    query = drawn(1, heads, TOKENS, size, kind=kind)
    key, value = (drawn(1, TOKENS, groups, size, kind=kind).transpose(1, 2) for _ in range(2))
    found = torch.full((1, TOKENS, heads, size), torch.nan, dtype=kind, device=DEVICE)
    ones = TritonAttention(PLACES, NEW, BEFORE, ROOMS, [addresses(each) for each in memories])
    ones.attend(1, query, key, value, found, 0.2)
    written = torch.zeros(TOKENS, dtype=torch.bool, device=DEVICE)
    for number, (place, count, old) in enumerate(zip(PLACES, NEW, BEFORE, strict=True)):
        new, end = slice(place, place + count), old + count
        written[new] = True
        for part, told, was in zip(memories[number][1], (key, value), kept[number], strict=True):
            was[:, old:end] = told[0, :, new]
            assert torch.equal(part, was)  # the new ones are written, and nothing else
        for part, was in zip(memories[number][0], before[number], strict=True):
            assert torch.equal(part, was)  # the other layer
        keys, values = (part[None, :, :end].float() for part in memories[number][1])
        wanted = functional.scaled_dot_product_attention(
            query[:, :, new].float(), keys, values, scale=0.2, enable_gqa=True,
            attn_mask=torch.ones(count, end, dtype=torch.bool, device=DEVICE).tril(old),
        )  # fmt: skip
        torch.testing.assert_close(
            found[:, new].float(), wanted.transpose(1, 2), rtol=TYPES[name], atol=TYPES[name]
        )
    assert torch.isnan(found[0, ~written]).all()  # nothing else is written


def test_scores_of_any_size_give_no_overflow() -> None:
    torch.manual_seed(0)
    memory = [tuple(drawn(1, 41, 32, kind=torch.float32) for _ in range(2))]
    query = drawn(1, 1, 1, 32, kind=torch.float32) * 1e4
    key, value = drawn(2, 1, 1, 1, 32, kind=torch.float32)
    found = torch.empty(1, 1, 1, 32, device=DEVICE)
    ones = TritonAttention([0], [1], [40], [41], [addresses(memory)])
    ones.attend(0, query, key, value, found, 1.0)
    keys, values = memory[0]
    wanted = functional.scaled_dot_product_attention(query, keys[None], values[None], scale=1.0)
    torch.testing.assert_close(found[:, 0], wanted[:, :, 0])
