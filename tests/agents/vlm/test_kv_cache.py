"""A model goes on with a conversation where it left off, and says what it would have said."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from support import one_torch_thread

pytest.importorskip("torch", reason="needs the extra local")
pytest.importorskip("transformers", reason="needs the extra local")

import torch
from tiny_qwen import make_tiny_qwen

from agents.vlm.chat import LEFT_OUT, Message, Picture, Reply
from agents.vlm.clients.kv_cache import CachedTurns, ConversationCache, conversation_name
from agents.vlm.clients.local import LocalClient
from agents.vlm.clients.packed_rows import can_be_packed
from agents.vlm.pictures import encode
from agents.vlm.settings import AgentSettings, Pictures

LONG = 60.0  # seconds; only broken code waits so long
TURNS = 4


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    with one_torch_thread():
        yield


@pytest.fixture(scope="module")
def models(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("models")
    families = ("qwen2", "qwen2_vl", "qwen2_5_vl", "qwen3_vl")
    return {each: make_tiny_qwen(folder / each, family=each) for each in families}


def client(path: Path, **changes: Any) -> LocalClient:
    sees = "text" if path.name == "qwen2" else "pictures"
    local = {"dtype": "float32", "device_map": "cpu", "wait": LONG, **changes.pop("local", {})}
    given = {"sees": sees, "sampling": {"max_tokens": 12}, "local": local, **changes}
    return LocalClient(str(path), AgentSettings.model_validate(given))


def shown(number: int) -> Picture:
    random = np.random.default_rng(number)
    size = (28 * (2 + number % 3), 28 * (2 + number % 4), 3)
    return encode(random.integers(0, 256, size, dtype=np.uint8), Pictures(format="png"))


def told(conversation: int, turn: int, *, pictures: bool) -> Message:
    """What the user tells: of different lengths, with none to two pictures."""
    count = (conversation + turn) % 3 if turn else 1
    seen = [shown(100 * conversation + 10 * turn + number) for number in range(count)]
    words = f"It is {turn}. " * (1 + (conversation * turn) % 4)
    return Message("user", (*(seen if pictures else []), words))


def played(model: LocalClient, conversations: int, keep: int | None = None) -> list[list[Reply]]:
    """Some conversations at once, turn by turn, in batches of all of them."""
    pictures = model._image_processor is not None
    talks: list[list[Message]] = [
        [Message("system", ("Find it.",))] if number % 2 else [] for number in range(conversations)
    ]
    replies: list[list[Reply]] = [[] for _ in talks]

    def next_turn(number: int) -> Reply:
        return model.reply(_with_last(talks[number], keep), number)

    with ThreadPoolExecutor(conversations) as pool:
        for turn in range(TURNS):
            for number, talk in enumerate(talks):
                talk.append(told(number, turn, pictures=pictures))
            for number, reply in enumerate(pool.map(next_turn, range(conversations))):
                replies[number].append(reply)
                talks[number].append(Message("assistant", (reply.text,)))
    return replies


def _with_last(talk: Sequence[Message], keep: int | None) -> list[Message]:
    """The conversation with the pictures of its last message and ``keep`` messages before it."""
    if keep is None:
        return list(talk)
    return [
        message
        if place >= len(talk) - 1 - 2 * keep
        else Message(
            message.role,
            tuple(LEFT_OUT if isinstance(part, Picture) else part for part in message.parts),
        )
        for place, message in enumerate(talk)
    ]


def said(replies: Sequence[Sequence[Reply]]) -> list[list[Any]]:
    return [
        [(r.text, r.finish, r.usage.prompt, r.usage.completion) for r in one] for one in replies
    ]


@pytest.fixture
def padded(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whole batches, as for models that cannot be packed."""
    monkeypatch.setattr("agents.vlm.clients.local.can_be_packed", lambda model: False)


@pytest.fixture
def torchs(monkeypatch: pytest.MonkeyPatch) -> None:
    """Packed rows where no kernel can be compiled."""
    monkeypatch.setattr("agents.vlm.clients.packed_rows.has_kernel", lambda: False)


@pytest.mark.parametrize("temperature", [0.0, 1.0])
@pytest.mark.parametrize("family", ["qwen2", "qwen2_vl", "qwen2_5_vl", "qwen3_vl"])
@pytest.mark.parametrize("way", ["packed", "torchs", "padded"])
def test_replies_are_those_of_a_model_that_begins_anew_each_turn(
    models: dict[str, Path],
    family: str,
    temperature: float,
    way: str,
    request: pytest.FixtureRequest,
) -> None:
    if way != "packed":
        request.getfixturevalue(way)
    check_goes_on(models[family], temperature)


@pytest.mark.parametrize(("family", "temperature"), [("qwen2", 1.0), ("qwen2_5_vl", 0.0)])
def test_replies_are_the_same_with_the_kernels_for_a_gpu(
    models: dict[str, Path], family: str, temperature: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    kernels = pytest.importorskip(
        "agents.vlm.clients.triton_attention", reason="needs Triton: make test-triton"
    )
    monkeypatch.setattr(
        "agents.vlm.clients.packed_rows._kernel_for", lambda model: kernels.TritonAttention
    )
    check_goes_on(models[family], temperature)


@pytest.mark.parametrize(
    ("device", "places", "triton", "packed"),
    [
        ("cpu", {}, False, True),
        ("cuda:0", {}, True, True),
        ("cuda:0", {"": 0}, True, True),
        ("cuda:0", {"model.layers.0": 0, "model.layers.1": 1}, True, False),
        ("cuda:0", {"model": 0, "lm_head": "cpu"}, True, False),
        ("cuda:0", {}, False, False),
        ("mps", {}, True, False),
    ],
)
def test_tokens_are_packed_on_a_cpu_and_whole_on_one_gpu_with_triton(
    device: str,
    places: dict[str, Any],
    triton: bool,
    packed: bool,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "agents.vlm.clients.packed_rows.find_spec", lambda name: object() if triton else None
    )
    config = SimpleNamespace(model_type="qwen2", _attn_implementation="sdpa")
    model = SimpleNamespace(config=config, device=torch.device(device), hf_device_map=places)
    assert can_be_packed(model) is packed
    config._attn_implementation = "eager"
    assert not can_be_packed(model)


def check_goes_on(path: Path, temperature: float) -> None:
    sampling = {"max_tokens": 12, "temperature": temperature, "top_p": 0.9}
    anew = client(path, sampling=sampling, local={"reuse": False, "batch": 3})
    goes_on = client(path, sampling=sampling, local={"batch": 3})
    expected, found = played(anew, 3), played(goes_on, 3)
    assert said(found) == said(expected)
    for replies in expected:
        assert all(reply.usage.cached == 0 for reply in replies)
    for replies in found:
        assert replies[0].usage.cached == 0
        for before, reply in pairwise(replies):
            # All but what the user has said since, and the words around it.
            assert reply.usage.cached >= before.usage.prompt
    for each in (anew, goes_on):
        each.close()


@pytest.mark.usefixtures("padded")
@pytest.mark.parametrize("family", ["qwen2", "qwen2_5_vl"])
def test_a_conversation_that_begins_among_others_is_processed_before_them(
    models: dict[str, Path], family: str
) -> None:
    replies, widths = {}, []
    for reuse in (False, True):
        model = client(models[family], local={"reuse": reuse, "batch": 3})
        pictures = model._image_processor is not None
        talks = [[told(number, 0, pictures=pictures)] for number in range(3)]
        with ThreadPoolExecutor(3) as pool:

            def all_reply() -> list[str]:
                found = pool.map(lambda n: model.reply(talks[n], n), range(3))  # noqa: B023
                return [each.text for each in found]

            for talk, text in zip(talks, all_reply(), strict=True):
                talk += [Message("assistant", (text,)), told(1, 1, pictures=pictures)]
            instructions = "Find the mug and put it away. " * 60
            talks[1] = [Message("user", (*([shown(7)] if pictures else []), instructions))]
            network = model._model.model

            def note(module: Any, args: Any, given: dict[str, Any]) -> None:
                ids = given.get("input_ids")
                widths.append(ids.shape if ids is not None else given["inputs_embeds"].shape[:2])

            handle = network.register_forward_pre_hook(note, with_kwargs=True)
            replies[reuse] = all_reply()
            handle.remove()
        model.close()
    assert replies[True] == replies[False]
    first = widths.index(max(widths, key=lambda each: each[1] * each[0]))
    assert widths[first][0] == 3  # without reuse, all are as long as the longest
    long = [rows for rows, tokens in widths[first + 1 :] if tokens > 200]
    assert long == [1]


def test_a_conversation_that_changes_goes_on_from_where_it_does(models: dict[str, Path]) -> None:
    path = models["qwen2_5_vl"]
    anew = client(path, local={"reuse": False, "batch": 3})
    goes_on = client(path, local={"batch": 3})
    found = played(goes_on, 3, keep=1)
    assert said(found) == said(played(anew, 3, keep=1))
    assert 0 < found[0][-1].usage.cached < found[0][-2].usage.prompt
    for each in (anew, goes_on):
        each.close()


def test_another_picture_is_looked_at(models: dict[str, Path]) -> None:
    """Two pictures take the same tokens; what follows them depends on what they show."""
    model = client(models["qwen2_5_vl"], local={"batch": 1, "wait": 0})
    one, other = shown(12), shown(24)
    assert (one.width, one.height) == (other.width, other.height)
    rest = (Message("assistant", ("x",)), Message("user", ("And now?",)))
    first = model.reply([Message("user", ("Look", one)), *rest], 1)
    other_first = model.reply([Message("user", ("Look", other)), *rest], 1)
    again = model.reply([Message("user", ("Look", one)), *rest], 1)
    assert first.text == again.text != other_first.text
    assert 0 < again.usage.cached < 40  # the words before the picture
    model.close()


def test_pictures_are_processed_once(
    models: dict[str, Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    model = client(models["qwen2_5_vl"], local={"batch": 2})
    processed: list[str] = []
    patches = model._patches

    def counted(pictures: Sequence[Picture]) -> Any:
        processed.extend(each.digest for each in pictures)
        return patches(pictures)

    monkeypatch.setattr(model, "_patches", counted)
    played(model, 2)
    assert len(processed) == len(set(processed)) > 4
    model.close()


def test_the_oldest_make_room() -> None:
    def turns(tokens: int) -> CachedTurns:
        return CachedTurns(range(tokens), (), None, [(torch.zeros(1, tokens, 4),) * 2])

    kept = ConversationCache(limit=turns(10).size)
    for name in "abc":
        kept.keep(name, turns(4))
    assert [kept.take(name) is not None for name in "abc"] == [False, True, True]
    kept.keep("large", turns(11))
    assert kept.take("large") is None
    kept.keep("a", turns(1))
    kept.clear()
    assert kept.take("a") is None


def test_conversations_are_told_apart() -> None:
    first = Message("user", ("Find a Mug.", shown(1)))
    left_out = Message("user", ("Find a Mug.", LEFT_OUT))
    more = (first, Message("assistant", ("go",)), Message("user", ("Well?",)))
    name = conversation_name([first], 1)
    assert conversation_name(more, 1) == conversation_name([left_out, *more[1:]], 1) == name
    assert conversation_name([first], 2) != name
    assert conversation_name([Message("user", ("Find a Cup.",))], 1) != name
    assert conversation_name([Message("system", ("Hm",)), first], 1) != name
