"""A real, tiny Qwen in this process: its inputs, its replies and its errors."""

from __future__ import annotations

import io
import json
import re
import shutil
import socket
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from support import one_torch_thread

pytest.importorskip("torch", reason="needs the extra local")
pytest.importorskip("transformers", reason="needs the extra local")

import torch
from PIL import Image
from tiny_qwen import make_tiny_qwen

from agents.vlm.chat import Message, ModelError, Picture, Reply
from agents.vlm.clients.local import LocalClient, _without_thought
from agents.vlm.clients.seeded_sampling import SeededSampling
from agents.vlm.clients.supervisor import RequestSupervisor
from agents.vlm.settings import AgentSettings
from er_gym.rollout.agent import CannotGoOn

LONG = 60.0  # seconds; only broken code waits so long
PATCH = {"qwen2_vl": 14, "qwen2_5_vl": 14, "qwen3_vl": 16}  # pixels a side; a token is 2 by 2
EYES = tuple(PATCH)

Conversation = tuple[Message, ...]
Models = Callable[[str], Path]
Clients = Callable[..., LocalClient]


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    with one_torch_thread():
        yield


@pytest.fixture(scope="session")
def models(tmp_path_factory: pytest.TempPathFactory) -> Models:
    """The directory of a family's model."""
    made: dict[str, Path] = {}

    def directory(family: str) -> Path:
        if family not in made:
            made[family] = make_tiny_qwen(tmp_path_factory.mktemp(family), family=family)
        return made[family]

    return directory


@pytest.fixture
def client(models: Models) -> Iterator[Clients]:
    """Makes clients, and closes them."""
    made: list[LocalClient] = []

    def make(family: str | Path = "qwen2_5_vl", /, **changes: Any) -> LocalClient:
        path = models(family) if isinstance(family, str) else family
        made.append(LocalClient(str(path), settings(family, **changes)))
        return made[-1]

    yield make
    for each in made:
        each.close()


def settings(family: str | Path = "qwen2_5_vl", /, **changes: Any) -> AgentSettings:
    given: dict[str, Any] = {
        "sees": "text" if family == "qwen2" else "pictures",
        "sampling": {"max_tokens": 16},
        **changes,
    }
    given["local"] = {"dtype": "float32", "device_map": "cpu", **changes.get("local", {})}
    return AgentSettings.model_validate(given)


def picture(width: int, height: int, seed: int = 0) -> Picture:
    pixels = np.random.default_rng(seed).integers(0, 256, (height, width, 3), dtype=np.uint8)
    file = io.BytesIO()
    Image.fromarray(pixels).save(file, "png")
    return Picture(file.getvalue(), "image/png", width, height)


def user(*parts: str | Picture) -> Message:
    return Message("user", parts)


def conversations(family: str) -> list[Conversation]:
    """Four that differ in length and in pictures, which a family without vision is not shown."""
    system = Message("system", ("Find it.",))
    talks: list[Conversation] = [
        (system, user("You see: ", picture(300, 300, 1), " What now?")),
        (user("Hello"),),
        (
            system,
            user("First", picture(120, 90, 2), "then", picture(56, 84, 3)),
            Message("assistant", ("open Fridge",)),
            user(picture(200, 100, 4), "That is all."),
        ),
        (user("Well, well. " * 9),),
    ]
    if family in EYES:
        return talks
    return [
        tuple(
            Message(turn.role, tuple(part for part in turn.parts if isinstance(part, str)))
            for turn in talk
        )
        for talk in talks
    ]


def at_once(client: LocalClient, talks: Sequence[Conversation]) -> list[Reply]:
    """What is said when each conversation has a thread of its own."""
    with ThreadPoolExecutor(len(talks)) as pool:
        replies = [pool.submit(client.reply, talk, seed) for seed, talk in enumerate(talks)]
        return [each.result(LONG) for each in replies]


def recorded(client: LocalClient) -> list[list[int]]:
    """The tokens of every reply from now on."""
    replies: list[list[int]] = []
    reply = client._reply

    def noted(row: Any, said: Any) -> Reply:
        replies.append(list(said))
        return reply(row, said)

    client._reply = noted  # type: ignore[method-assign]
    return replies


def watched(client: LocalClient, before: Callable[[int], object]) -> None:
    """Call ``before`` with the number of conversations each time before the model works on some."""
    packed = client._packed
    if packed is not None:
        step = packed.step

        def stepped(rows: Any) -> None:
            before(len(rows))
            step(rows)

        packed.step = stepped  # type: ignore[method-assign]
        return
    generate = client._model.generate

    def generated(**inputs: Any) -> Any:
        before(len(inputs["input_ids"]))
        return generate(**inputs)

    client._model.generate = generated


BOTH_WAYS = pytest.mark.parametrize("reuse", [True, False], ids=["packed", "padded"])
"""Step by step in one row, as on a CPU; and by ``generate``, as without ``local.reuse``."""


def edited(
    models: Models, to: Path, edit: Callable[[Path], object], family: str = "qwen2_5_vl"
) -> Path:
    """A copy of a model with something done to it."""
    shutil.copytree(models(family), to)
    edit(to)
    return to


def same(replies: Sequence[Reply], others: Sequence[Reply]) -> bool:
    """Whether they are, but for the time that they took."""
    plain = [[(r.text, r.reasoning, r.usage, r.finish) for r in each] for each in (replies, others)]
    return plain[0] == plain[1]


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
    assert same(at_once(together, talks), replies)
    assert max(sizes) > 1 if reuse else sizes == [4]
    assert sorted(said) == sorted(singles)
    assert len({reply.usage.prompt for reply in replies}) == 4


def test_twelve_episodes_and_a_batch_of_four(client: Clients) -> None:
    talks = [(*talk, user(f"It is {n}.")) for n in range(3) for talk in conversations("qwen2_5_vl")]
    alone = client(local={"batch": 1})
    together = client(local={"batch": 4, "wait": 0.05})
    said, sizes = recorded(together), []
    watched(together, sizes.append)
    assert same(at_once(together, talks), [alone.reply(talk, s) for s, talk in enumerate(talks)])
    assert len(said) == 12
    assert 1 < max(sizes) <= 4


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


# -- what was saved years ago


def as_of_2024(directory: Path) -> None:
    """Lay a checkpoint out as transformers 4 did, and as most that can be had still are."""
    from safetensors.torch import load_file, save_file

    config = json.loads((directory / "config.json").read_text())
    words = config.pop("text_config")
    rope = words.pop("rope_parameters")
    words["rope_theta"] = rope["rope_theta"]
    words["rope_scaling"] = {"type": "mrope", "mrope_section": rope["mrope_section"]}
    del words["dtype"]
    config |= words | {"model_type": config["model_type"], "torch_dtype": config.pop("dtype")}
    (directory / "config.json").write_text(json.dumps(config))

    file = directory / "model.safetensors"
    save_file({old_name(name): each for name, each in load_file(file).items()}, file)

    template = directory / "chat_template.jinja"
    (directory / "chat_template.json").write_text(
        json.dumps({"chat_template": template.read_text()})
    )
    template.unlink()


def old_name(name: str) -> str:
    """Of a weight; that of an adapter begins with what peft puts before it."""
    return name.replace("model.language_model.", "model.").replace("model.visual.", "visual.")


@pytest.mark.parametrize("family", ["qwen2_vl", "qwen2_5_vl"])
def test_a_checkpoint_of_2024_says_the_same(
    models: Models, tmp_path: Path, client: Clients, family: str
) -> None:
    old = edited(models, tmp_path / "old", as_of_2024, family)
    talks = conversations(family)
    new = client(family)
    assert "text_config" not in json.loads((old / "config.json").read_text())
    assert same([client(old).reply(t, 0) for t in talks], [new.reply(t, 0) for t in talks])


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


# -- what goes wrong -------------------------------------------------------------------------------


def without_a_weight(directory: Path) -> None:
    from safetensors.torch import load_file, save_file

    weights = load_file(directory / "model.safetensors")
    del weights["lm_head.weight"]
    save_file(weights, directory / "model.safetensors", {"format": "pt"})


def with_other_eyes(directory: Path) -> None:
    file = directory / "preprocessor_config.json"
    file.write_text(json.dumps({"image_processor_type": "CLIPImageProcessor"}))


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda d: (d / "config.json").unlink(), "cannot be loaded: "),
        (lambda d: (d / "model.safetensors").unlink(), "cannot be loaded: OSError"),
        (lambda d: (d / "model.safetensors").write_bytes(b"?" * 99), "cannot be loaded: "),
        (lambda d: (d / "tokenizer.json").unlink(), "cannot be loaded: "),
        (lambda d: (d / "preprocessor_config.json").unlink(), "cannot be loaded: "),
        (lambda d: (d / "chat_template.jinja").unlink(), "has no chat template"),
        (with_other_eyes, "does not process pictures as Qwen's models do (CLIPImageProcessorPil)"),
        (without_a_weight, "1 of its weights are missing, such as lm_head.weight"),
    ],
)
def test_a_broken_model(
    models: Models, tmp_path: Path, edit: Callable[[Path], object], message: str
) -> None:
    path = edited(models, tmp_path / "broken", edit)
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        LocalClient(str(path), settings())
    assert str(caught.value).startswith(str(path))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"decide": "tools"}, "decide: tools needs a server"),
        ({"local": {"dtype": "float33"}}, "cannot be loaded: "),
        ({"local": {"attention": "none at all"}}, "cannot be loaded: "),
        ({"local": {"device_map": "cuda:77"}}, "cannot be loaded: "),
        ({"local": {"adapter": "nowhere"}}, "local.adapter nowhere is not an adapter"),
    ],
)
def test_settings_that_do_not_fit(models: Models, changes: dict[str, Any], message: str) -> None:
    if "adapter" in changes.get("local", {}):
        pytest.importorskip("peft")
    with pytest.raises(ValueError, match=re.escape(message)) as caught:
        LocalClient(str(models("qwen2_5_vl")), settings(**changes))
    assert "\n" not in str(caught.value)


def test_a_model_without_vision_refuses_pictures(models: Models, client: Clients) -> None:
    with pytest.raises(ValueError, match="has no vision; set the agent's setting sees to text"):
        LocalClient(str(models("qwen2")), settings())
    for family in ("qwen2", "qwen2_5_vl"):
        with pytest.raises(CannotGoOn, match="without vision"):
            client(family, sees="text").reply([user(picture(56, 56))], 0)


@pytest.mark.parametrize("path", ["/nowhere/at/all", "./nowhere", "a/b/c"])
def test_a_directory_that_is_not_there(path: str) -> None:
    with pytest.raises(ValueError, match=f"there is no directory {path}; give one with a model"):
        LocalClient(path, settings())


def test_conversations_that_cannot_be_had(client: Clients) -> None:
    model = client(local={"batch": 1})
    broken = Picture(picture(56, 56).data[:40], "image/png", 56, 56)
    thin = picture(3, 900)
    cases = [
        (user(broken), "a picture cannot be processed: "),
        (user(thin), "a picture cannot be processed: ValueError: absolute aspect ratio"),
        (user("x" * 16_384), "more than the 16384 of .*; lower pictures.keep"),
        (user("<|image_pad|>"), "has 0 pictures and 1 places for them"),
    ]
    for message, words in cases:
        with pytest.raises(ModelError, match=words) as caught:
            model.reply([message], 0)
        assert "\n" not in str(caught.value)
    assert model.reply([user("Hello")], 0).text  # the next conversation still works


def test_a_template_that_does_not_take_it(models: Models, tmp_path: Path, client: Clients) -> None:
    def edit(directory: Path) -> None:
        template = "{{ raise_exception('no system, please') }}"
        (directory / "chat_template.jinja").write_text(template)

    path = edited(models, tmp_path / "strict", edit)
    with pytest.raises(CannotGoOn, match=r"does not accept this conversation: .*no system, please"):
        client(path).reply([user("Hello")], 0)


@BOTH_WAYS
def test_what_does_not_fit_into_memory_is_halved(client: Clients, reuse: bool) -> None:
    model = client(local={"batch": 4, "wait": LONG, "reuse": reuse})
    sizes: list[int] = []

    def cramped(count: int) -> None:
        sizes.append(count)
        if count > 2:
            raise torch.cuda.OutOfMemoryError("CUDA out of memory")

    watched(model, cramped)
    talks = conversations("qwen2_5_vl")
    replies = at_once(model, talks)
    [failed] = [place for place, count in enumerate(sizes) if count > 2]
    assert max(sizes[failed + 1 :]) == sizes[failed] // 2
    alone = client(local={"batch": 1})
    assert same(replies, [alone.reply(talk, 0) for talk in talks])


@BOTH_WAYS
def test_a_device_that_fails_ends_the_run(client: Clients, reuse: bool) -> None:
    if not hasattr(torch, "AcceleratorError"):
        pytest.skip("this torch has no error of its own for devices")
    model = client(local={"reuse": reuse})

    def fails(count: int) -> None:
        raise torch.AcceleratorError("CUDA error: device-side assert triggered\nmore")

    watched(model, fails)
    with pytest.raises(CannotGoOn, match=r"the device failed, .*device-side assert triggered more"):
        model.reply([user("Hello")], 0)


@pytest.fixture
def talkative(client: Clients) -> Callable[[bool], LocalClient]:
    """Makes a model that talks for a minute."""

    def make(reuse: bool) -> LocalClient:
        model = client(sampling={"max_tokens": 16_000}, local={"reuse": reuse})
        model._model.generation_config.eos_token_id, model._end_tokens = None, frozenset()
        return model

    return make


@BOTH_WAYS
def test_closing_stops_it_in_the_middle_of_a_reply(
    talkative: Callable[[bool], LocalClient], reuse: bool
) -> None:
    model = talkative(reuse)
    begun, said = threading.Event(), recorded(model)
    watched(model, lambda count: begun.set())
    with ThreadPoolExecutor(1) as pool:
        reply = pool.submit(model.reply, [user("Hello")], 0)
        assert begun.wait(LONG)
        model.close()
        with pytest.raises(CannotGoOn, match="closed"):
            reply.result(LONG)
    assert not said
    with pytest.raises(CannotGoOn, match="closed"):
        model.reply([user("Hello")], 0)


@BOTH_WAYS
def test_the_minutes_stop_it_in_the_middle_of_a_reply(
    talkative: Callable[[bool], LocalClient], reuse: bool
) -> None:
    model = talkative(reuse)
    model._supervisor = RequestSupervisor(max_minutes=0.5 / 60)
    said = recorded(model)
    with pytest.raises(CannotGoOn, match="the minutes are over; run the same command again"):
        model.reply([user("Hello")], 0)
    assert not said


def test_a_directory_needs_no_network(client: Clients, monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*where: Any) -> None:
        raise AssertionError(f"a connection to {where[1:]}")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    monkeypatch.setattr(socket, "getaddrinfo", refuse)
    assert client().reply([user("Hello", picture(56, 56))], 0).usage.completion


# -- identity and adapters -------------------------------------------------------------------------


def test_identity(models: Models, client: Clients, tmp_path: Path) -> None:
    mine = client().identity
    assert json.loads(mine)["dtype"] == "torch.float32"
    assert client(local={"batch": 3, "wait": 1.0}).identity == mine
    others = [
        client(seed=1).identity,
        client(sampling={"max_tokens": 17}).identity,
        client(pictures={"max_pixels": 100_000}).identity,
        client(local={"dtype": "bfloat16"}).identity,
        client("qwen2_vl").identity,
    ]
    copy = edited(models, tmp_path / "copy", lambda directory: None)
    others.append(client(copy).identity)
    (copy / "generation_config.json").touch()
    others.append(client(copy).identity)
    assert len({mine, *others}) == 1 + len(others)


def adapter(base: Path, to: Path) -> Path:
    """A LoRA adapter that is not without effect."""
    import peft
    from transformers import AutoModelForImageTextToText

    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(0)
        model = AutoModelForImageTextToText.from_pretrained(base)
        config = peft.LoraConfig(
            r=4,
            target_modules=["q_proj", "v_proj"],
            init_lora_weights=False,
            task_type="CAUSAL_LM",
        )
        peft.get_peft_model(model, config).save_pretrained(to)
    return to


def test_an_adapter_changes_what_is_said(models: Models, client: Clients, tmp_path: Path) -> None:
    pytest.importorskip("peft", reason="adapters need peft")
    path = adapter(models("qwen2_5_vl"), tmp_path / "adapter")
    talks = conversations("qwen2_5_vl")
    plain = client(local={"batch": 1})
    tuned = client(local={"batch": 1, "adapter": str(path)})
    assert tuned.identity != plain.identity
    replies = [tuned.reply(talk, 0) for talk in talks]
    for talk, reply in zip(talks, replies, strict=True):
        assert plain.reply(talk, 0).text != reply.text
    together = client(local={"batch": 4, "wait": LONG, "adapter": str(path)})
    assert same(at_once(together, talks), replies)


def test_an_adapters_directory_is_a_model(models: Models, client: Clients, tmp_path: Path) -> None:
    pytest.importorskip("peft", reason="adapters need peft")
    (tmp_path / "run").mkdir()
    (tmp_path / "run" / "finetune.json").write_text("{}")
    path = adapter(models("qwen2_5_vl"), tmp_path / "run" / "model")
    talk = conversations("qwen2_5_vl")[2]
    said = [client(local={"adapter": str(path)}).reply(talk, 0)]
    assert same([client(path).reply(talk, 0)], said)
    assert same([client(tmp_path / "run").reply(talk, 0)], said)


def test_an_adapter_of_2024_says_the_same(models: Models, client: Clients, tmp_path: Path) -> None:
    pytest.importorskip("peft", reason="adapters need peft")
    from safetensors.torch import load_file, save_file

    path = adapter(models("qwen2_5_vl"), tmp_path / "adapter")
    talk = conversations("qwen2_5_vl")[2]
    said = [client(local={"adapter": str(path)}).reply(talk, 0)]
    file = path / "adapter_model.safetensors"
    weights = load_file(file)
    save_file({old_name(name): each for name, each in weights.items()}, file)
    assert set(load_file(file)).isdisjoint(weights)
    assert same([client(local={"adapter": str(path)}).reply(talk, 0)], said)


def test_an_adapter_that_does_not_fit(models: Models, tmp_path: Path) -> None:
    pytest.importorskip("peft", reason="adapters need peft")
    from safetensors.torch import load_file, save_file

    path = adapter(models("qwen2_5_vl"), tmp_path / "adapter")
    file = path / "adapter_model.safetensors"
    weights = load_file(file)
    name = next(iter(weights))
    cases = {
        "size": weights | {name: torch.zeros(4, 99)},
        "absent": {each: weight for each, weight in weights.items() if each != name},
    }
    for case, changed in cases.items():
        save_file(changed, file)
        with pytest.raises(ValueError, match="does not fit the model: ") as caught:
            LocalClient(str(models("qwen2_5_vl")), settings(local={"adapter": str(path)}))
        assert "\n" not in str(caught.value), case
    config = json.loads((path / "adapter_config.json").read_text())
    (path / "adapter_config.json").write_text(json.dumps(config | {"target_modules": ["no_proj"]}))
    with pytest.raises(ValueError, match=r"does not fit the model: .*no_proj"):
        LocalClient(str(models("qwen2_5_vl")), settings(local={"adapter": str(path)}))
