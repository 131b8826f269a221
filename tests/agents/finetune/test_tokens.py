"""Tokens and masks, compared with what is put together by hand and with what is read at play."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from agents.finetune.batches import Collator, EpochSampler
from agents.finetune.feedback import add_feedback
from agents.finetune.model_files import open_model
from agents.finetune.new_model import make_tokenizer
from agents.finetune.settings import DataSettings
from agents.finetune.tokens import FEEDBACK, EncodedChat, Encoder, check_lengths, expanded
from agents.vlm.chat import Message, Picture
from agents.vlm.clients.local import LocalClient
from agents.vlm.settings import AgentSettings
from er_gym.data.cells import COLUMNS, ROWS, SYMBOLS, CoveredPicture, on_grid
from er_gym.data.chat import Chat, ChatTurn
from er_gym.data.collection import Collection

BOUNDS = {"min_pixels": 784, "max_pixels": 4_704}


def encoder(path: Path, **changes: Any) -> Encoder:
    files = open_model(path)
    add_feedback(files.tokenizer)
    image_token = getattr(files.config, "image_token_id", None)
    settings = DataSettings(**BOUNDS, **changes)
    return Encoder(files.tokenizer, files.template, files.image_processor, image_token, settings)


def by_hand(made: Encoder, chat: Chat, learnt: Sequence[bool]) -> tuple[list[int], list[bool]]:
    """Tokens and mask put together piece by piece, in Qwen's format."""
    special = made.tokenizer.convert_tokens_to_ids
    start, stop, (line,) = special("<|im_start|>"), special("<|im_end|>"), made.tokens("\n")
    look = [special(f"<|{each}|>") for each in ("vision_start", "image_pad", "vision_end")]
    ids: list[int] = []
    wanted: list[bool] = []
    flags = iter(learnt)
    for turn in chat.turns:
        head = [start, *made.tokens(turn.role), line]
        said: list[int] = []
        for part in turn.parts:
            said += made.tokens(part) if isinstance(part, str) else look
        flag = next(flags) if turn.role == "assistant" else False
        ids += [*head, *said, stop, line]
        wanted += [*[False] * len(head), *[flag] * (len(said) + 1), False]
    return ids, wanted


def test_the_turns_that_are_marked_get_loss_and_nothing_else(
    models: Any, chats: tuple[Chat, ...]
) -> None:
    made = encoder(models())
    assert not all(chat.trains_all for chat in chats)
    for chat in chats:
        ids, wanted = by_hand(made, chat, chat.train)
        found = made.encode(chat)
        assert found.ids.tolist() == ids
        assert found.learnt.tolist() == wanted


def test_the_released_mask_learns_all_that_is_said_after_the_first_feedback(
    models: Any, chats: tuple[Chat, ...]
) -> None:
    made = encoder(models(), mask="released")
    feedback = made.tokenizer.convert_tokens_to_ids(FEEDBACK)
    told = 0
    for chat in chats:
        ids, wanted = by_hand(made, chat, [True] * len(chat.train))
        if feedback in ids:
            told += 1
            until = ids.index(feedback) + 1
            assert any(wanted[:until])
            wanted[:until] = [False] * until
        found = made.encode(chat)
        assert (found.ids.tolist(), found.learnt.tolist()) == (ids, wanted)
    assert 0 < told < len(chats)


def test_the_mask_all_learns_all_but_pictures_and_turns_that_are_not_marked(
    models: Any, chats: tuple[Chat, ...]
) -> None:
    made = encoder(models(), mask="all")
    pictures = 0
    for chat in chats:
        ids, refused = by_hand(made, chat, [not each for each in chat.train])
        pictures += len(chat.pictures)
        wanted = [
            not each and one != made.tokenizer.convert_tokens_to_ids("<|image_pad|>")
            for each, one in zip(refused, ids, strict=True)
        ]
        found = made.encode(chat)
        assert (found.ids.tolist(), found.learnt.tolist()) == (ids, wanted)
    assert pictures
    assert not all(all(chat.train) for chat in chats)


def test_what_is_learnt_is_what_is_read_at_play(
    models: Any, played: Collection, chats: tuple[Chat, ...]
) -> None:
    """Token for token and pixel for pixel, at every turn, as the agent's client makes them."""
    path = models()
    made = encoder(path)
    local = {"dtype": "float32", "device_map": "cpu"}
    settings = AgentSettings.model_validate({"pictures": BOUNDS, "local": local})
    client = LocalClient(str(path), settings)
    files = open_model(path)
    image_token = files.config.image_token_id
    collate = Collator(files.image_processor, image_token, DataSettings(**BOUNDS).bounds, 0)
    for chat in (each for each in chats if FEEDBACK not in " ".join(t.text for t in each.turns)):
        encoded = made.encode(chat)
        ids, labels = expanded(encoded, image_token)
        batch = collate([encoded])
        assert batch["input_ids"].tolist() == [ids.tolist()]
        longer = replace(collate, multiple=32)([encoded])
        assert longer["input_ids"].shape[1] == len(ids) + -len(ids) % 32
        assert longer["labels"][0, len(ids) :].eq(-100).all()
        messages = [_message(turn, played.path) for turn in chat.turns]
        for place, turn in enumerate(chat.turns):
            if turn.role != "assistant":
                continue
            row = client._row(messages[:place], 0)
            assert row.ids == ids[: len(row.ids)].tolist()
            said = made.tokens(turn.text + "<|im_end|>")
            after = slice(len(row.ids), len(row.ids) + len(said))
            assert ids[after].tolist() == said
            assert labels[after].tolist() == (said if turn.train else [-100] * len(said))
            assert row.new_pixels is not None
            assert torch.equal(row.new_pixels, batch["pixel_values"][: len(row.new_pixels)])
    client.close()


def _message(turn: ChatTurn, folder: Path) -> Message:
    parts = [
        part
        if isinstance(part, str)
        else Picture((folder / part.path).read_bytes(), "image/jpeg", part.width, part.height)
        for part in turn.parts
    ]
    return Message(turn.role, tuple(parts))


def test_the_length_is_known_without_reading_pictures(
    models: Any, played: Collection, chats: tuple[Chat, ...]
) -> None:
    made = encoder(models())
    files = open_model(models())
    image_token = files.config.image_token_id
    collate = Collator(files.image_processor, image_token, DataSettings(**BOUNDS).bounds, 0)
    encoded = [made.encode(chat) for chat in chats]
    assert [collate([each])["tokens"] for each in encoded] == [each.length for each in encoded]
    grids = collate(encoded)["image_grid_thw"].prod(dim=1) // 4
    assert grids.tolist() == [count for each in encoded for count in each.picture_tokens]


def test_what_is_too_long_is_named(models: Any, chats: tuple[Chat, ...]) -> None:
    encoded = [encoder(models()).encode(chat) for chat in chats]
    lengths = sorted(each.length for each in encoded)
    longest = max(encoded, key=lambda each: each.length)
    check_lengths(encoded, lengths[-1], "data")
    with pytest.raises(ValueError, match=r"has .* tokens") as error:
        check_lengths(encoded, lengths[-1] - 3, "data")
    assert f"{longest.id} has {longest.length:,} tokens" in str(error.value)
    assert ": 3 more than data.max_length" in str(error.value)
    assert f"set data.max_length={longest.length} " in str(error.value)
    assert "others" not in str(error.value)
    with pytest.raises(ValueError, match=f"and {len(chats) - 2} others"):
        check_lengths(encoded, lengths[1] - 1, "data")


def test_a_template_that_rewrites_earlier_turns_is_refused(models: Any) -> None:
    files = open_model(models("qwen2"))
    forgetful = files.template.replace(
        "{{ message.content }}",
        "{{ message.content if loop.last or message.role == 'user' else '…' }}",
    )
    assert forgetful != files.template
    with pytest.raises(ValueError, match="writes a turn otherwise once the conversation goes on"):
        Encoder(files.tokenizer, forgetful, None, None, DataSettings())


def test_a_text_only_model_refuses_pictures(models: Any, chats: tuple[Chat, ...]) -> None:
    with pytest.raises(ValueError, match="no vision: give one that has"):
        encoder(models("qwen2")).encode(chats[0])


# -- batches ---------------------------------------------------------------------------------------


def test_batches_are_of_similar_length_and_hold_everything_once() -> None:
    lengths = np.random.default_rng(0).integers(100, 1_000, 203)
    order = EpochSampler(lengths.tolist(), 4, seed=0, buckets=True)
    first = list(order)
    assert sorted(first) == list(range(203))
    assert first == list(EpochSampler(lengths.tolist(), 4, seed=0, buckets=True))
    order.set_epoch(1)
    assert list(order) != first
    plain = list(EpochSampler(lengths.tolist(), 4, seed=0, buckets=False))
    assert _padding(lengths, first) < 0.1 < _padding(lengths, plain)


def _padding(lengths: Any, order: list[int]) -> float:
    """The share of padding in batches of four."""
    batches = [lengths[order[start : start + 4]] for start in range(0, len(order), 4)]
    return 1 - sum(each.sum() for each in batches) / sum(each.max() * len(each) for each in batches)


def test_a_picture_of_another_size_than_its_record_is_refused(
    models: Any, played: Collection, chats: tuple[Chat, ...]
) -> None:
    files = open_model(models())
    collate = Collator(files.image_processor, files.config.image_token_id, DataSettings().bounds, 0)
    encoded = encoder(models()).encode(chats[0])
    wrong = [each.model_copy(update={"width": 99}) for each in encoded.pictures]
    with pytest.raises(ValueError, match="128 × 72 pixels, but its record says 99 × 72"):
        collate(
            [EncodedChat("x", encoded.ids, encoded.learnt, tuple(wrong), encoded.picture_tokens)]
        )


def test_the_tokens_of_a_covered_picture_learn_what_is_in_their_square(
    models: Any, chats: tuple[Chat, ...]
) -> None:
    files = open_model(models())
    image = files.config.image_token_id
    collate = Collator(files.image_processor, image, DataSettings(**BOUNDS).bounds, 0)
    plain = next(each for each in chats if len(each.pictures) > 1)
    cells = "".join(SYMBOLS[k % 3] for k in range(ROWS * COLUMNS))
    names = ("nothing", "Fridge", "Mug")
    first, *_ = plain.pictures
    covered = CoveredPicture(**first.model_dump(), covers=names, cells=cells)
    turns = tuple(
        replace(turn, parts=tuple(covered if part is first else part for part in turn.parts))
        for turn in plain.turns
    )
    with_cells = encoder(models()).encode(replace(plain, turns=turns))
    without = encoder(models()).encode(plain)
    count = with_cells.picture_tokens[0]
    assert with_cells.learnt_tokens == without.learnt_tokens + count
    batch = collate([without, with_cells])
    ids, labels = batch["input_ids"][1].tolist(), batch["labels"][1].tolist()
    places = [k for k, each in enumerate(ids) if each == image]
    rows, columns = (batch["image_grid_thw"][0, 1:] // files.image_processor.merge_size).tolist()
    assert rows * columns == count
    first_tokens = [files.tokenizer(f" {each}")["input_ids"][0] for each in names]
    wanted = [first_tokens[each] for each in on_grid(cells, rows, columns)]
    assert [labels[k + 1] for k in places[:count]] == wanted
    # All others are as without.
    rest = [k for k in range(len(labels)) if k - 1 not in places[:count]]
    assert [labels[k] for k in rest] == [batch["labels"][0].tolist()[k] for k in rest]


def test_in_a_new_models_tokenizer_a_tag_and_a_role_are_a_token_each() -> None:
    words = ["assistant\n<Planning>goal</Planning>\n<DecisionMaking>end</DecisionMaking>"] * 9
    tokenizer = make_tokenizer([*words, "user\nsee Mug"], 400)
    told = tokenizer.tokenize(words[0])
    assert {"assistant", "<Planning>", "</Planning>", "<DecisionMaking>"} <= set(told)
    assert tokenizer.decode(tokenizer(words[0])["input_ids"]) == words[0]
