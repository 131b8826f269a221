"""What a local model cannot do, and what stops it in the middle."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from support import one_torch_thread

pytest.importorskip("torch", reason="needs the extra local")
pytest.importorskip("transformers", reason="needs the extra local")

import torch
from local_clients import (
    BOTH_WAYS,
    LONG,
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

from agents.vlm.chat import ModelError, Picture
from agents.vlm.clients.local import LocalClient
from agents.vlm.clients.supervisor import RequestSupervisor
from er_gym.rollout.agent import CannotGoOn


@pytest.fixture(scope="module", autouse=True)
def one_thread() -> Iterator[None]:
    with one_torch_thread():
        yield


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
    gathered(model, 4)
    talks = conversations("qwen2_5_vl")
    replies = at_once(model, talks)
    [failed] = [place for place, count in enumerate(sizes) if count > 2]  # 3, if a reply has ended
    assert max(sizes[failed + 1 :]) == sizes[failed] // 2
    alone = client(local={"batch": 1})
    assert same(replies, [alone.reply(talk, 0) for talk in talks])


@pytest.mark.parametrize(("free", "halves"), [(100 << 20, True), (8 << 30, False)])
def test_a_library_that_finds_no_memory_on_the_gpu_is_believed(
    client: Clients, monkeypatch: pytest.MonkeyPatch, free: int, halves: bool
) -> None:
    # The words are those of an H100 that several processes had filled.
    monkeypatch.setattr(torch.cuda, "mem_get_info", lambda device=None: (free, 80 << 30))
    model = client(local={"batch": 4, "wait": LONG})
    sizes: list[int] = []

    def cramped(count: int) -> None:
        sizes.append(count)
        if count > 2 and sizes[:-1].count(count) == 0:
            raise RuntimeError(
                "Expected mha_graph.execute(handle, variant_pack, workspace_ptr.get()).is_good() "
                "to be true, but got false."
            )

    watched(model, cramped)
    gathered(model, 4)
    at_once(model, conversations("qwen2_5_vl"))
    [failed] = [place for place, count in enumerate(sizes) if count > 2][:1]
    # Where memory is not short the batch is faulty, and its jobs begin anew one by one.
    assert sizes[failed + 1] == (sizes[failed] // 2 if halves else 1)


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
