"""A real, tiny Qwen in this process: what it is shown and what it replies."""

from __future__ import annotations

import io
import json
import re
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

import pytest
from support import one_torch_thread

pytest.importorskip("torch", reason="needs the extra local")
pytest.importorskip("transformers", reason="needs the extra local")

import torch
from local_clients import (
    BOTH_WAYS,
    EYES,
    LONG,
    PATCH,
    Clients,
    Models,
    at_once,
    conversations,
    edited,
    gathered,
    picture,
    recorded,
    same,
    user,
    watched,
)
from PIL import Image

from agents.vlm.chat import Message, Picture
from agents.vlm.clients.local import _without_thought
from agents.vlm.clients.seeded_sampling import SeededSampling


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    with one_torch_thread():
        yield


# -- pictures --------------------------------------------------------------------------------------


SIZES = [(800, 450), (300, 300), (900, 600), (57, 33), (28, 28), (20, 400), (333, 77)]


@pytest.mark.parametrize("family", EYES)
def test_a_picture_takes_the_tokens_that_qwen_vl_utils_says(
    family: str, client: Clients, qwen_vl_utils: ModuleType
) -> None:
    model = client(family, sampling={"max_tokens": 1})
    without = model.reply([user("Look")], 0).usage.prompt
    marks = 2  # <|vision_start|>, <|vision_end|>
    bounds = {"min_pixels": 3_136, "max_pixels": 351_232}
    for width, height in SIZES:
        shown = picture(width, height)
        image = Image.open(io.BytesIO(shown.data))
        part = {"type": "image", "image": image, **bounds}
        [fetched], _ = qwen_vl_utils.process_vision_info(
            [{"role": "user", "content": [part]}], image_patch_size=PATCH[family]
        )
        tokens = fetched.width * fetched.height // (2 * PATCH[family]) ** 2
        usage = model.reply([user("Look", shown)], 0).usage
        assert usage.prompt == without + marks + tokens, (width, height)
        # Not only as many: what is seen is the same, pixel by pixel.
        seen = model._image_processor([fetched], do_resize=False, return_tensors="pt")
        pixels, grids = model._patches([shown])
        assert torch.equal(pixels, seen["pixel_values"])
        assert grids.prod() // 4 == tokens


@pytest.mark.parametrize(
    ("family", "width", "height", "tokens"),
    [
        ("qwen2_5_vl", 800, 450, 28 * 15),  # 812 x 448 would be too many pixels: 784 x 420
        ("qwen2_5_vl", 300, 300, 11 * 11),
        ("qwen3_vl", 800, 450, 24 * 13),
        ("qwen3_vl", 300, 300, 9 * 9),
    ],
)
def test_tokens_of_pictures(
    client: Clients, family: str, width: int, height: int, tokens: int
) -> None:
    model = client(family, sampling={"max_tokens": 1})
    both = [model.reply([user("Look", *more)], 0) for more in ((), (picture(width, height),))]
    assert both[1].usage.prompt - both[0].usage.prompt == tokens + 2


@pytest.mark.parametrize("prefix", ["", "model_"])
def test_bounds_of_pictures_are_the_settings(client: Clients, prefix: str) -> None:
    bounds = {f"{prefix}min_pixels": 784, f"{prefix}max_pixels": 7_840}
    model = client(sampling={"max_tokens": 1}, pictures=bounds)
    both = [model.reply([user("Look", *more)], 0) for more in ((), (picture(800, 450),))]
    assert both[1].usage.prompt - both[0].usage.prompt == 4 * 2 + 2


@pytest.mark.parametrize("family", EYES)
def test_what_is_seen_decides_what_is_said(client: Clients, family: str) -> None:
    model = client(family)
    first, second = picture(100, 100, 1), picture(100, 100, 2)
    talks = [(first, second), (second, first), (first, first)]
    said = [model.reply([user("a", *shown, "b")], 0).text for shown in talks]
    assert len(set(said)) == 3
    assert model.reply([user("a", first, second, "b")], 1).text == said[0]


@pytest.mark.parametrize("family", EYES)
def test_it_is_what_the_whole_processor_makes(models: Models, client: Clients, family: str) -> None:
    pytest.importorskip("torchvision", reason="AutoProcessor needs torchvision")
    from transformers import AutoProcessor

    processor = AutoProcessor.from_pretrained(models(family))
    model = client(family, pictures={"max_pixels": 12_845_056})
    for talk in conversations(family):
        turns = [model._turn(message) for message in talk]
        shown = [part for each in talk for part in each.parts if isinstance(part, Picture)]
        whole = processor(
            text=[processor.apply_chat_template(turns, add_generation_prompt=True)],
            images=[Image.open(io.BytesIO(each.data)) for each in shown] or None,
            return_tensors="pt",
        )
        row = model._row(talk, 0)
        assert row.ids == whole["input_ids"][0].tolist()
        if shown:
            assert row.grids is not None
            assert row.new_pixels is not None
            assert torch.equal(row.grids, whole["image_grid_thw"])
            # Another resampling, by another library.
            assert (row.new_pixels - whole["pixel_values"]).abs().mean() < 0.02


# -- conversations ---------------------------------------------------------------------------------


@pytest.mark.parametrize("in_history", [False, True])
def test_a_conversation_in_the_models_format(client: Clients, in_history: bool) -> None:
    model = client(reasoning={"in_history": in_history})
    talk = (
        Message("system", ("Be brief.",)),
        user("One", picture(56, 56), "and"),
        Message("assistant", ("open Fridge",), "It may be cold."),
        user(picture(84, 56), "two", picture(56, 84)),
        Message("assistant", ("navigate to", "Sofa")),
        user("What", "now?"),
    )
    row = model._row(talk, 0)
    text = model._tokenizer.decode(row.ids)
    assert [
        len(pads) // len("<|image_pad|>") for pads in re.findall(r"(?:<\|image_pad\|>)+", text)
    ] == [4, 6, 6]
    shown = "<|vision_start|><|image_pad|><|vision_end|>"
    thought = "<think>\nIt may be cold.\n</think>\n\n" if in_history else ""
    assert re.sub(r"(<\|image_pad\|>)+", "<|image_pad|>", text) == (
        "<|im_start|>system\nBe brief.<|im_end|>\n"
        f"<|im_start|>user\nOne{shown}and<|im_end|>\n"
        f"<|im_start|>assistant\n{thought}open Fridge<|im_end|>\n"
        f"<|im_start|>user\n{shown}two{shown}<|im_end|>\n"
        "<|im_start|>assistant\nnavigate to\nSofa<|im_end|>\n"
        "<|im_start|>user\nWhat\nnow?<|im_end|>\n"
        "<|im_start|>assistant\n"
    )
    reply = model.reply(talk, 0)
    assert reply.usage.prompt == len(row.ids)
    assert (reply.cost, reply.model) == (0.0, model._name)
    assert reply.seconds > 0


@pytest.mark.parametrize("temperature", [0.0, 1.0])
@pytest.mark.parametrize("family", ["qwen2", *EYES])
@BOTH_WAYS
def test_a_batch_of_four_gives_the_replies_of_each_alone(
    client: Clients, reuse: bool, family: str, temperature: float
) -> None:
    sampling = {"max_tokens": 24, "temperature": temperature, "top_p": 0.9}
    talks = conversations(family)
    alone = client(family, sampling=sampling, local={"batch": 1, "reuse": reuse})
    singles = recorded(alone)
    replies = [alone.reply(talk, seed) for seed, talk in enumerate(talks)]
    together = client(family, sampling=sampling, local={"batch": 4, "wait": LONG, "reuse": reuse})
    assert (together._packed is not None) == reuse
    said, sizes = recorded(together), []
    watched(together, sizes.append)
    gathered(together, 4)
    assert same(at_once(together, talks), replies)
    assert max(sizes) == 4 if reuse else sizes == [4]
    assert sorted(said) == sorted(singles)
    assert len({reply.usage.prompt for reply in replies}) == 4


def test_twelve_episodes_and_a_batch_of_four(client: Clients) -> None:
    talks = [(*talk, user(f"It is {n}.")) for n in range(3) for talk in conversations("qwen2_5_vl")]
    alone = client(local={"batch": 1})
    together = client(local={"batch": 4, "wait": 0.05})
    said, sizes = recorded(together), []
    watched(together, sizes.append)
    gathered(together, 12)
    assert same(at_once(together, talks), [alone.reply(talk, s) for s, talk in enumerate(talks)])
    assert len(said) == 12
    assert max(sizes) == 4


def test_seeds(client: Clients) -> None:
    model = client(sampling={"max_tokens": 24, "temperature": 1.0})
    before = torch.get_rng_state()
    talk = (user("Go"),)
    said = [model.reply(talk, seed).text for seed in (3, 3, 4)]
    assert said[0] == said[1] != said[2]
    # Two turns of an episode are not drawn by the same numbers.
    assert model._row(talk, 3).seed != model._row((*talk, Message("assistant", ("",))), 3).seed
    assert client(seed=1)._row(talk, 3).seed != model._row(talk, 3).seed
    unseeded = client(seed=None, sampling={"max_tokens": 24, "temperature": 1.0})
    assert unseeded.reply(talk, 3).text != unseeded.reply(talk, 3).text
    assert torch.equal(torch.get_rng_state(), before)  # other code's random numbers do not change


@pytest.mark.parametrize(
    ("top_p", "odds"), [(1.0, [0.5, 0.25, 0.15, 0.1]), (0.7, [2 / 3, 1 / 3, 0, 0])]
)
def test_words_are_drawn_as_likely_as_they_are(top_p: float, odds: list[float]) -> None:
    count = 20_000
    scores = torch.tensor([0.5, 0.25, 0.15, 0.1]).log().mul(2).repeat(count, 1)
    draw = SeededSampling(2.0, top_p, range(count))
    drawn = draw(torch.zeros(count, 1, dtype=torch.long), scores).argmax(dim=1)
    shares = drawn.bincount(minlength=4) / count
    assert shares.tolist() == pytest.approx(odds, abs=0.012)


@BOTH_WAYS
def test_replies_end_at_the_models_end_or_at_the_limit(client: Clients, reuse: bool) -> None:
    """So hot that any token may come, the end among them: some end early, some are cut."""
    sampling = {"max_tokens": 150, "temperature": 30.0}
    model = client(sampling=sampling, local={"batch": 8, "wait": LONG, "reuse": reuse})
    said = recorded(model)
    ends = set(model._tokenizer.convert_tokens_to_ids(["<|im_end|>", "<|endoftext|>"]))
    replies = at_once(model, [(user("Go", str(number)),) for number in range(8)])
    assert sorted(map(len, said)) == sorted(reply.usage.completion for reply in replies)
    assert not any(ends.intersection(each[:-1]) for each in said)
    assert model._image_token not in {token for each in said for token in each}
    assert {(each[-1] in ends, len(each) < 150) for each in said} == {(True, True), (False, False)}
    assert {(reply.finish, reply.usage.completion < 150) for reply in replies} == {
        ("stop", True),
        ("length", False),
    }
    assert not any("<|im_end|>" in reply.text for reply in replies)
    alone = client(sampling=sampling, local={"batch": 1, "reuse": reuse})
    assert same([alone.reply((user("Go", "5"),), 5)], [replies[5]])


@BOTH_WAYS
def test_the_models_own_repetition_penalty_holds(
    models: Models, tmp_path: Path, client: Clients, reuse: bool
) -> None:
    def strict(directory: Path) -> None:
        file = directory / "generation_config.json"
        theirs = json.loads(file.read_text())
        file.write_text(json.dumps(theirs | {"repetition_penalty": 1e6}))

    for path, often in (
        (models("qwen2_5_vl"), True),
        (edited(models, tmp_path / "x", strict), False),
    ):
        model = client(path, sampling={"max_tokens": 60}, local={"reuse": reuse})
        replies = recorded(model)
        model.reply([user("Well. " * 9)], 0)
        [said] = replies
        assert (len(set(said)) < len(said)) == often


# -- thoughts --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "thinking", "expected"),
    [
        ("go", False, ("", "go")),
        (" go\n", False, ("", " go\n")),
        ("<think>\nhm\n</think>\n\ngo", False, ("hm", "go")),
        ("hm</think>go", True, ("hm", "go")),
        ("hm</think>go", False, ("hm", "go")),
        ("<think>hm", False, ("hm", "")),
        ("hm", True, ("hm", "")),
        ("<think></think>go", False, ("", "go")),
        ("I <think> so", False, ("", "I <think> so")),
    ],
)
def test_thoughts_and_words(text: str, thinking: bool, expected: tuple[str, str]) -> None:
    assert _without_thought(text, thinking) == expected


def test_effort(client: Clients) -> None:
    prompts = {
        effort: client(reasoning={"effort": effort})._prompt([user("Go")])
        for effort in ("", "none", "high")
    }
    assert prompts["none"] == prompts[""] + "<think>\n\n</think>\n\n"
    assert prompts["high"] == prompts[""] + "<think>\n"


def test_a_thought_that_is_cut_short_is_no_reply(client: Clients) -> None:
    reply = client(reasoning={"effort": "high"}).reply([user("Go")], 0)
    assert (reply.text, reply.finish) == ("", "length")
    assert reply.reasoning
    assert 0 < reply.usage.reasoning <= reply.usage.completion
