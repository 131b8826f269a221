"""A batch of conversations goes on as each would alone, and nothing is read twice."""

from __future__ import annotations

import random
from itertools import takewhile

import pytest

torch = pytest.importorskip("torch", reason="needs pip install 'er-gym[trl]'")
transformers = pytest.importorskip("transformers", reason="needs pip install 'er-gym[trl]'")
pytest.importorskip("trl", reason="needs pip install 'er-gym[trl]'")

END, PAD, LONGEST = 1, 0, 6


def test_replies_are_those_of_conversations_alone() -> None:
    from er_gym.integrations.trl_reading import Reading

    torch.manual_seed(3)
    config = transformers.Qwen3Config(
        vocab_size=12,
        hidden_size=16,
        intermediate_size=16,
        num_hidden_layers=2,
        num_attention_heads=2,
        num_key_value_heads=1,
        head_dim=8,
        initializer_range=1.0,
    )
    model = transformers.Qwen3ForCausalLM(config).eval()
    read: list[int] = []
    model.model.embed_tokens.register_forward_hook(
        lambda _, ids, __: read.append(ids[0].shape[1])  # how many columns
    )
    settings = transformers.GenerationConfig(
        max_new_tokens=LONGEST, do_sample=False, pad_token_id=PAD, eos_token_id=END
    )

    def alone(ids: list[int]) -> list[int]:
        given = torch.tensor([ids])
        found = model.generate(given, attention_mask=given * 0 + 1, generation_config=settings)
        return until_end(found[0, len(ids) :].tolist())

    draw = random.Random(0)
    rows = [heard(draw) for _ in range(5)]
    reading, lengths = Reading(len(rows), PAD), set()
    for turn in range(5):
        inputs = reading.inputs(rows, model)
        read.clear()
        found = model.generate(**inputs, generation_config=settings)
        if turn:
            assert sum(read) <= 9 + 2 * LONGEST  # the new columns alone
        replies = [until_end(each) for each in found[:, inputs["input_ids"].shape[1] :].tolist()]
        reading.add(found, replies)
        assert replies == [alone(row) for row in rows]
        lengths |= {len(each) for each in replies}
        rows = [[*row, *reply, *heard(draw)] for row, reply in zip(rows, replies, strict=True)]
        if turn % 2:
            reading.keep([place != 1 for place in range(len(rows))])
            del rows[1]
    assert len(lengths) > 2  # replies of several lengths, so that turns are padded


def heard(draw: random.Random) -> list[int]:
    """What the user says: two to nine ids."""
    return [draw.randrange(2, 12) for _ in range(draw.randrange(2, 10))]


def until_end(ids: list[int]) -> list[int]:
    """The ids up to the end of a reply, that one included."""
    said = list(takewhile(lambda each: each != END, ids))
    return ids[: len(said) + 1]
