"""The client for OpenAI-compatible servers, against a server on a real socket that misbehaves."""

from __future__ import annotations

import gc
import gzip
import json
import logging
import math
import os
import socket
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from naughty_server import HUGE, MODEL, NaughtyServer, Raw, completion
from support import in_one_test, run_python

pytest.importorskip("openai", reason="needs pip install 'er-gym[vlm]'")

import openai

from agents.vlm.chat import ConversationRefused, Message, ModelError, Picture, Reply, Usage
from agents.vlm.clients import chat_completions, supervisor
from agents.vlm.clients.budget import Budget, Ledger
from agents.vlm.clients.openai_server import OpenAIClient
from agents.vlm.clients.supervisor import RequestSupervisor
from agents.vlm.clients.tokens import RequestSize, picture_at_most, usage_of
from agents.vlm.clients.transport import LARGEST_ANSWER, RateLimiter
from agents.vlm.settings import AgentSettings, Prices, Server
from benchmarks.checks.refusals import REFUSALS, Refused
from er_gym.rollout.agent import CannotGoOn

KEY = "sk-test-4f1c9e0b7a2d"
HELLO = (Message("user", ("hello",)),)

Make = Callable[..., OpenAIClient]


@pytest.fixture(autouse=True)
def key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OUR_TEST_KEY", KEY)
    for name in ("HTTP_PROXY", "http_proxy", "ALL_PROXY", "all_proxy"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def make() -> Iterator[Make]:
    """Makes clients of a URL, the settings of the server by name, and others as ``settings``."""
    made = []

    def client(url: str, settings: dict[str, Any] | None = None, **server: Any) -> OpenAIClient:
        server = {"key_from": "OUR_TEST_KEY", "tries": 2, "timeout": 20, **server}
        given = {"server": {"base_url": url, **server}, **(settings or {})}
        made.append(OpenAIClient(MODEL, AgentSettings.model_validate(given)))
        return made[-1]

    yield client
    for each in made:
        each.close()


# -- what is sent --------------------------------------------------------------------------------

CONVERSATION = (
    Message("system", ("You are a robot.",)),
    Message("user", ("Find the mug.", Picture(b"\xff\xd8one", "image/jpeg", 28, 28), "Go „on“.")),
    Message("assistant", ("open Fridge",), reasoning="It may be cold."),
    Message("user", ("It is open.", "[picture no longer shown]")),
    Message("user", (Picture(b"\x89PNGtwo", "image/png", 28, 28),)),
)
GOLDEN = [
    {"role": "system", "content": "You are a robot."},
    {
        "role": "user",
        "content": [
            {"type": "text", "text": "Find the mug."},
            {"type": "image_url", "image_url": {"url": "data:image/jpeg;base64,/9hvbmU="}},
            {"type": "text", "text": "Go „on“."},
        ],
    },
    {"role": "assistant", "content": "open Fridge"},
    {"role": "user", "content": "It is open.\n[picture no longer shown]"},
    {
        "role": "user",
        "content": [
            {"type": "image_url", "image_url": {"url": "data:image/png;base64,iVBOR3R3bw=="}}
        ],
    },
]


def test_the_request_is_as_written_down(naughty: NaughtyServer, make: Make) -> None:
    make(naughty.url).reply(CONVERSATION, seed=7)
    (seen,) = naughty.seen
    assert seen.path == "/v1/chat/completions"
    assert seen.headers["authorization"] == f"Bearer {KEY}"
    assert seen.headers["content-type"] == "application/json"
    assert seen.json == {
        "model": MODEL,
        "temperature": 0.0,
        "top_p": 1.0,
        "max_tokens": 1024,
        "seed": 7,
        "messages": GOLDEN,
    }


def test_the_same_request_is_the_same_bytes(naughty: NaughtyServer, make: Make) -> None:
    again = tuple(Message(each.role, each.parts, each.reasoning) for each in CONVERSATION)
    make(naughty.url).reply(CONVERSATION, seed=7)
    make(naughty.url).reply(again, seed=7)
    first, second = naughty.seen
    assert first.body == second.body


def test_what_the_sdk_itself_would_send_means_the_same(naughty: NaughtyServer) -> None:
    with openai.OpenAI(base_url=naughty.url, api_key=KEY) as sdk:
        sdk.chat.completions.create(model=MODEL, messages=GOLDEN)
    assert naughty.seen[0].json["messages"] == GOLDEN
    assert json.loads(chat_completions.request_body({"model": MODEL}, CONVERSATION, False)) == (
        naughty.seen[0].json
    )


def test_thoughts_are_given_back_where_asked(naughty: NaughtyServer, make: Make) -> None:
    make(naughty.url, {"reasoning": {"in_history": True}}).reply(CONVERSATION, seed=0)
    turn = naughty.seen[0].json["messages"][2]
    assert turn == {**GOLDEN[2], "reasoning_content": "It may be cold."}


def test_a_picture_is_put_into_letters_once_and_forgotten_with_its_conversation() -> None:
    picture = Picture(os.urandom(1000), "image/jpeg", 28, 28)
    message = Message("user", (picture,))
    gc.collect()
    before = len(chat_completions._ENCODED)
    first = chat_completions.request_body({"model": "m"}, [message, message], False)
    assert chat_completions.request_body({"model": "m"}, [message, message], False) == first
    assert len(chat_completions._ENCODED) == before + 1
    assert chat_completions._part(picture) is chat_completions._part(picture)
    del picture, message
    gc.collect()
    assert len(chat_completions._ENCODED) == before


@pytest.mark.parametrize(
    ("settings", "server", "has", "lacks"),
    [
        ({"seed": None}, {}, {}, {"seed"}),
        ({"seed": 2**31 - 1}, {}, {"seed": 4}, set()),
        ({"sampling": {"temperature": 0.5}}, {}, {"temperature": 0.5, "top_p": 1.0}, ()),
        (
            {"sampling": {"max_tokens": 9}},
            {"max_tokens_field": "max_completion_tokens"},
            {"max_completion_tokens": 9},
            {"max_tokens"},
        ),
        ({"reasoning": {"effort": "low"}}, {}, {"reasoning_effort": "low"}, ()),
        ({}, {"extra": {"top_k": 5, "temperature": None}}, {"top_k": 5}, {"temperature"}),
        ({}, {}, {}, {"tools", "tool_choice", "response_format", "reasoning_effort"}),
    ],
)  # fmt: skip
def test_fields(
    naughty: NaughtyServer,
    make: Make,
    settings: dict[str, Any],
    server: dict[str, Any],
    has: dict[str, Any],
    lacks: set[str],
) -> None:
    make(naughty.url, settings, **server).reply(HELLO, seed=5)
    sent = naughty.seen[0].json
    assert has.items() <= sent.items()
    assert not sent.keys() & set(lacks)


def test_a_decision_by_tool_or_in_json_is_asked_for(naughty: NaughtyServer, make: Make) -> None:
    make(naughty.url, {"decide": "tools"}).reply(HELLO, seed=0)
    make(naughty.url, {"decide": "json"}).reply(HELLO, seed=0)
    tools, in_json = (seen.json for seen in naughty.seen)
    (tool,) = tools["tools"]
    parameters = tool["function"]["parameters"]
    assert tools["tool_choice"]["function"]["name"] == tool["function"]["name"] == "act"
    assert list(parameters["properties"]) == ["action", "object"]
    assert {"navigate to", "observe", "end"} < set(parameters["properties"]["action"]["enum"])
    schema = in_json["response_format"]["json_schema"]
    assert list(schema["schema"]["properties"]) == ["thoughts", "action", "object"]
    assert schema["strict"]
    assert schema["schema"]["required"] == ["thoughts", "action", "object"]


def test_without_a_key_none_is_sent(
    naughty: NaughtyServer, make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OUR_TEST_KEY")
    make(naughty.url).reply(HELLO, seed=0)
    assert "authorization" not in naughty.seen[0].headers


def test_azure(naughty: NaughtyServer, make: Make) -> None:
    place = naughty.url.removesuffix("/v1")
    make(place, api_version="2026-01-01").reply(HELLO, seed=0)
    (seen,) = naughty.seen
    assert seen.path == f"/openai/deployments/{MODEL}/chat/completions?api-version=2026-01-01"
    assert seen.headers["api-key"] == KEY


def test_a_proxy_of_the_environment_is_used(
    naughty: NaughtyServer, make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HTTP_PROXY", naughty.url.removesuffix("/v1"))
    monkeypatch.setenv("NO_PROXY", "127.0.0.1")
    assert make("http://nowhere.invalid/v1").reply(HELLO, seed=0).text == "observe"
    assert naughty.seen[0].path == "http://nowhere.invalid/v1/chat/completions"
    make(naughty.url).reply(HELLO, seed=0)
    assert naughty.seen[1].path == "/v1/chat/completions"


# -- what comes back -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("message", "text", "reasoning", "call"),
    [
        ({"content": "end"}, "end", "", ""),
        ({"content": "end", "reasoning_content": "so"}, "end", "so", ""),
        ({"content": "end", "reasoning": "so"}, "end", "so", ""),
        ({"content": " <think>\nso\n</think>\n\nend"}, "end", "so", ""),
        ({"content": "so</think>end"}, "end", "so", ""),
        ({"content": "<think>so and s"}, "", "so and s", ""),
        ({"content": "a <think>b</think> end"}, "a <think>b</think> end", "", ""),
        ({"content": None}, "", "", ""),
        ({"content": None, "refusal": "I cannot."}, "I cannot.", "", ""),
        (
            {
                "content": None,
                "tool_calls": [
                    {
                        "id": "1",
                        "type": "function",
                        "function": {"name": "act", "arguments": '{"action": "end"}'},
                    },
                    {
                        "id": "2",
                        "type": "function",
                        "function": {"name": "act", "arguments": "{}"},
                    },
                ],
            },
            "",
            "",
            '{"action": "end"}',
        ),
        ({"content": "end", "tool_calls": None, "reasoning": None, "audio": None}, "end", "", ""),
    ],
)
def test_a_message_becomes_a_reply(
    naughty: NaughtyServer,
    make: Make,
    message: dict[str, Any],
    text: str,
    reasoning: str,
    call: str,
) -> None:
    naughty.then(Raw(completion(message)))
    reply = make(naughty.url).reply(HELLO, seed=0)
    assert (reply.text, reply.reasoning, reply.call) == (text, reasoning, call)
    assert (reply.finish, reply.model, reply.from_cache) == ("stop", MODEL, False)
    assert reply.seconds > 0


def test_tokens_and_cost(naughty: NaughtyServer, make: Make) -> None:
    usage = {
        "prompt_tokens": 1000,
        "completion_tokens": 100,
        "prompt_tokens_details": {"cached_tokens": 400, "audio_tokens": None},
        "completion_tokens_details": {"reasoning_tokens": 60},
    }
    naughty.then(*(Raw({**completion({"content": "end"}), "usage": usage}) for _ in range(3)))
    prices = {"prompt": 2.0, "completion": 10.0}
    reply = make(naughty.url, {"prices": prices}).reply(HELLO, seed=0)
    assert reply.usage == Usage(prompt=1000, completion=100, cached=400, reasoning=60)
    assert reply.cost == pytest.approx(1000 * 2e-6 + 100 * 10e-6)
    cheaper = make(naughty.url, {"prices": {**prices, "cached_prompt": 0.5}})
    assert cheaper.reply(HELLO, seed=0).cost == pytest.approx(600 * 2e-6 + 400 * 5e-7 + 1e-3)
    assert make(naughty.url).reply(HELLO, seed=0).cost == 0


@pytest.mark.parametrize(
    "usage",
    [
        None,
        "many",
        [],
        {},
        {"prompt_tokens": 5},
        {"prompt_tokens": 5, "completion_tokens": None},
        {"prompt_tokens": 5, "completion_tokens": -3_360_000},
        {"prompt_tokens": 5, "completion_tokens": 0},
        {"prompt_tokens": 5, "completion_tokens": 10**12},
        {"prompt_tokens": 5, "completion_tokens": 1.5},
        {"prompt_tokens": 5, "completion_tokens": "1"},
        {"prompt_tokens": 5, "completion_tokens": True},
        {"prompt_tokens": 5, "completion_tokens": math.nan},
        {"prompt_tokens": -5, "completion_tokens": 1},
        {"prompt_tokens": 0, "completion_tokens": 1},
        {"prompt_tokens": 10**9, "completion_tokens": 1},
        {"prompt_tokens": 5, "completion_tokens": 1, "prompt_tokens_details": {"cached_tokens": 6}},
        {
            "prompt_tokens": 5,
            "completion_tokens": 1,
            "prompt_tokens_details": {"cached_tokens": -6},
        },
        {
            "prompt_tokens": 5,
            "completion_tokens": 1,
            "completion_tokens_details": {"reasoning_tokens": 70},
        },
    ],
)
def test_tokens_that_the_server_does_not_tell_or_cannot_have_counted(
    naughty: NaughtyServer, make: Make, usage: Any
) -> None:
    naughty.then(Raw({**completion({"content": "end"}), "usage": usage, "model": 7}))
    client = make(naughty.url, {"prices": {"prompt": 2, "cached_prompt": 1, "completion": 10}})
    reply = client.reply(HELLO, seed=0)
    assert reply.usage.estimated
    assert reply.usage.prompt >= 5
    assert 0 <= reply.usage.cached <= reply.usage.prompt
    assert 1 <= reply.usage.completion < 2000
    assert 0 < reply.cost < 0.05
    assert reply.model == ""


def test_reported_token_counts_are_used(naughty: NaughtyServer, make: Make) -> None:
    usage = {"prompt_tokens": 5, "prompt_tokens_details": None, "completion_tokens_details": {}}
    naughty.then(
        Raw({**completion({"content": "end"}), "usage": {**usage, "completion_tokens": 2}})
    )
    assert make(naughty.url).reply(HELLO, seed=0).usage == Usage(prompt=5, completion=2)


@pytest.mark.parametrize(
    "text", ["我看见一个冰箱。", "🧊" * 50, "𒀀ᚠ" * 20, "plain words", '\x00\t"\\']
)
def test_an_estimate_is_from_above_in_any_script(text: str) -> None:
    """No tokenizer makes more tokens of a text than it has bytes; so many letters are more."""
    picture = Picture(b"jpeg", "image/jpeg", 784, 420)
    messages = (Message("user", (text, picture)),)
    body = chat_completions.request_body({"model": "m", "max_tokens": 9}, messages, False)
    asked = RequestSize.of(
        body, messages, chat_completions.picture_bytes(messages), {"max_tokens": 9}
    )
    assert len(text.encode()) + picture_at_most(784, 420) <= asked.prompt_at_most
    assert asked.prompt_at_most < 6 * len(text.encode()) + picture_at_most(784, 420) + 700
    assert picture_at_most(784, 420) > 1105  # GPT-4o's; Qwen takes 420
    usage = usage_of(None, asked, len(text.encode()))
    assert usage.completion >= len(text.encode())


def test_a_filtered_answer_is_a_reply(naughty: NaughtyServer, make: Make) -> None:
    naughty.then("refusal", Raw(completion({"content": None}, finish_reason="content_filter")))
    client = make(naughty.url)
    assert client.reply(HELLO, seed=0).text == "I cannot help with that."
    assert client.reply(HELLO, seed=0).finish == "content_filter"


def test_answers_may_be_long_but_not_endless(naughty: NaughtyServer, make: Make) -> None:
    client = make(naughty.url)
    naughty.then("huge", "endless")
    assert client.reply(HELLO, seed=0).text == "x" * HUGE
    with pytest.raises(ModelError, match=f"more than {LARGEST_ANSWER:,} bytes$"):
        client.reply(HELLO, seed=0)
    assert naughty.count == 2
    assert client.reply(HELLO, seed=0).text == "observe"


# -- what passes ---------------------------------------------------------------------------------

SLOW = ("drip", "drip_head", "stall")


@pytest.mark.parametrize(
    ("behaviour", "words"),
    [
        ("429", "429, slow down"),
        ("500", "500, something broke"),
        ("reset", "reset"),
        ("half", "incomplete|closed"),
        ("truncated", "Invalid JSON"),
        ("empty_choices", "choices: .*at least 1"),
        ("html", "Invalid JSON.*<html>Welcome</html>"),
        *((slow, "no whole answer within 1.5 s") for slow in SLOW),
    ],
)
def test_temporary_failures_are_tried_again(
    naughty: NaughtyServer, make: Make, behaviour: str, words: str
) -> None:
    client = make(naughty.url, timeout=1.5 if behaviour in SLOW else 20)
    client.reply(HELLO, seed=0)
    naughty.seen.clear()
    naughty.then(behaviour, behaviour)
    began = time.monotonic()
    with pytest.raises(ModelError, match=words) as caught:
        client.reply(HELLO, seed=0)
    # Two tries of a second and a half and a pause; a drip would take half a minute.
    assert time.monotonic() - began < 20
    assert naughty.count == 2
    assert str(caught.value).endswith("(tried 2 times)")
    assert "\n" not in str(caught.value)


def test_the_server_is_a_program_too(make: Make, repository: Path) -> None:
    program = repository / "tests" / "agents" / "vlm" / "naughty_server.py"
    command = [sys.executable, str(program), "--latency", "0.1", "--mixture", "ok=1,429=1"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        client = make(process.stdout.readline().strip(), tries=20)
        assert client.reply(HELLO, seed=0).seconds >= 0.1
        process.kill()


@pytest.mark.parametrize("behaviour", ["429", "reset", "truncated"])
def test_what_passes_does_no_harm(naughty: NaughtyServer, make: Make, behaviour: str) -> None:
    naughty.then(behaviour)
    assert make(naughty.url).reply(HELLO, seed=0).text == "observe"
    assert naughty.count == 2
    assert naughty.seen[0].body == naughty.seen[1].body


def test_an_error_in_a_good_answer_is_told(naughty: NaughtyServer, make: Make) -> None:
    naughty.then(Raw({"error": {"message": "upstream is down", "code": 502}}))
    with pytest.raises(ModelError, match=r"choices: Field required; it says: upstream is down$"):
        make(naughty.url, tries=1).reply(HELLO, seed=0)


@pytest.mark.parametrize("status", [200, 500])
def test_an_answer_that_is_hard_to_read(naughty: NaughtyServer, make: Make, status: int) -> None:
    naughty.then(Raw(b"[" * 200_000, status), Raw(b"\xff\x00\xfe", status))
    client = make(naughty.url, tries=1)
    for words in (r": .*\[\[\[.*…$", "\ufffd"):
        with pytest.raises(ModelError, match=words) as caught:
            client.reply(HELLO, seed=0)
        assert len(str(caught.value)) < 500


def test_the_server_says_how_long_to_wait(make: Make) -> None:
    with NaughtyServer(script=["429"], retry_after="1.2") as server:
        make(server.url).reply(HELLO, seed=0)
        first, second = server.seen
        assert second.at - first.at >= 1.2  # the SDK alone would wait half a second


@pytest.mark.parametrize("pause", [0.1, 600])
def test_who_listens_slowly_or_not_at_all_is_not_waited_for(make: Make, pause: float) -> None:
    done = threading.Event()

    def listen() -> None:
        connection, _ = server.accept()
        with connection:
            while not done.wait(pause) and connection.recv(65_536):
                pass

    much = Picture(bytes(30_000_000), "image/png", 1, 1)
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 65_536)
        threading.Thread(target=listen, daemon=True).start()
        client = make(f"http://127.0.0.1:{server.getsockname()[1]}/v1", timeout=0.5, tries=1)
        began = time.monotonic()
        with pytest.raises(CannotGoOn, match=r"no whole answer within 0.5 s; nothing has answered"):
            client.reply((Message("user", (much,)),), seed=0)
        assert time.monotonic() - began < 30  # at 64 KiB each tenth of a second: a minute
        done.set()


# -- what does not pass --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("behaviour", "words"),
    [
        ("401", "401, incorrect key; the server does not accept the key of OUR_TEST_KEY"),
        ("403", "403, not for you; the server does not allow the key of OUR_TEST_KEY to do this"),
        ("404", "404, the model does not exist; the server has no such model"),
        ("quota", "429, you exceeded your current quota"),
    ],
)
@pytest.mark.parametrize("answered", [False, True])
def test_what_ends_the_run(
    naughty: NaughtyServer, make: Make, behaviour: str, words: str, answered: bool
) -> None:
    client = make(naughty.url, tries=6)
    if answered:
        client.reply(HELLO, seed=0)
    naughty.then(behaviour)
    with pytest.raises(CannotGoOn, match=words):
        client.reply(HELLO, seed=0)
    assert naughty.count == 1 + answered


def test_a_request_that_is_wrong_in_itself_ends_the_run(naughty: NaughtyServer, make: Make) -> None:
    client = make(naughty.url)
    for answers in (["400", "400"], ["ok", "400", "400"]):
        naughty.then(*answers)
        if answers[0] == "ok":
            client.reply(HELLO, seed=0)
        with pytest.raises(CannotGoOn, match="400, unknown parameter 'top_p'; every request"):
            client.reply(HELLO, seed=0)


def test_a_request_that_is_refused_where_others_are_not_is_only_one(
    naughty: NaughtyServer, make: Make
) -> None:
    client = make(naughty.url)
    picture = Picture(b"\xff\xd8one", "image/jpeg", 28, 28)
    for _ in range(5):
        naughty.then("400", "ok")
        with pytest.raises(ConversationRefused, match="400, unknown parameter 'top_p'") as caught:
            client.reply([Message("user", ("hello", picture))], seed=0)
        assert caught.value.cause == "request"
    assert naughty.count == 10
    asked = naughty.seen[-1].json  # short, and with a picture, which this model may not take
    assert [part["type"] for part in asked["messages"][0]["content"]] == ["text", "image_url"]


@in_one_test("refusal", REFUSALS)
def test_a_conversation_that_is_refused_is_only_one(
    naughty: NaughtyServer, make: Make, refusal: Refused
) -> None:
    """The words of many servers, before and after the server has answered anything: the kind is
    told, and no number of them in a row stops the run."""
    kind, status = refusal.kind, refusal.status
    client = make(naughty.url)
    before, sure = naughty.count, status in (400, 413, 422)
    for time_ in range(4):
        probed = ["ok"] * (not sure or time_ == 0)
        naughty.then(Raw(refusal.body, status), *probed)
        with pytest.raises(ConversationRefused, match=f"{status}, ") as caught:
            client.reply(HELLO, seed=0)
        assert caught.value.cause == kind
    assert naughty.count - before == (5 if sure else 8)


@in_one_test("refusal", REFUSALS)
def test_a_refusal_of_all_is_none_of_one(
    naughty: NaughtyServer, make: Make, refusal: Refused
) -> None:
    naughty.then(*[Raw(refusal.body, refusal.status)] * 2)
    with pytest.raises(CannotGoOn, match="every request like this will fail"):
        make(naughty.url).reply(HELLO, seed=0)


@in_one_test(
    "words",
    [
        "Rate limit reached: limit 30000 tokens per min exceeded",
        "too many requests",
        "You exceeded your requests per minute limit",
    ],
)
def test_a_limit_of_requests_is_no_refusal(naughty: NaughtyServer, make: Make, words: str) -> None:
    naughty.then(Raw({"error": {"message": words}}, 429), "ok")
    assert make(naughty.url).reply(HELLO, seed=0).text == "observe"


def test_no_server(naughty: NaughtyServer, make: Make) -> None:
    never, once = make(naughty.url, tries=1), make(naughty.url, tries=1)
    once.reply(HELLO, seed=0)
    naughty.close()
    with pytest.raises(CannotGoOn, match=r"refused; nothing has answered yet: check that the serv"):
        never.reply(HELLO, seed=0)
    with pytest.raises(ModelError):
        once.reply(HELLO, seed=0)


@pytest.mark.parametrize(
    ("server", "error", "words"),
    [
        ({"base_url": "", "key_from": "NO_SUCH"}, CannotGoOn, "there is no key: set NO_SUCH,"),
        (
            {"base_url": "https://api.openai.com/v1", "key_from": "NO_SUCH"},
            CannotGoOn,
            "set NO_SUCH,",
        ),
        (
            {"base_url": "https://x.openai.azure.com", "api_version": "1", "key_from": "NO_SUCH"},
            CannotGoOn,
            "set NO_SUCH,",
        ),
        ({"base_url": "", "key_from": "ODD"}, CannotGoOn, "ODD holds characters that no"),
        (
            {"base_url": "localhost:8000"},
            ValueError,
            "'localhost:8000' is not an address; give one",
        ),
        ({"base_url": "http://me:sk-2@host:x/v1"}, ValueError, "'host:x/v1' is not an address"),
        ({"base_url": "", "api_version": "1"}, ValueError, "give server.base_url too, such as"),
    ],
)
def test_what_cannot_begin(
    make: Make,
    monkeypatch: pytest.MonkeyPatch,
    server: dict[str, str],
    error: type[Exception],
    words: str,
) -> None:
    monkeypatch.setenv("ODD", "sk-1…9")
    with pytest.raises(error, match=words) as caught:
        make(server.pop("base_url"), **server)
    assert "sk-" not in str(caught.value)


# -- threads, pace, secrets ----------------------------------------------------------------------


def test_threads_get_the_replies_to_their_own_conversations(make: Make) -> None:
    def echo(messages: list[dict[str, Any]]) -> str:
        said: str = messages[-1]["content"]
        return said

    with NaughtyServer(echo, mixture={"ok": 9, "429": 1}, retry_after="0.01") as server:
        client = make(server.url, tries=10)

        def ask(number: int) -> Reply:
            return client.reply((Message("user", (f"I am {number}",)),), seed=0)

        with ThreadPoolExecutor(8) as pool:
            replies = list(pool.map(ask, range(80)))
        assert [reply.text for reply in replies] == [f"I am {number}" for number in range(80)]
        assert server.count > 80


def test_requests_are_spread(naughty: NaughtyServer, make: Make) -> None:
    client = make(naughty.url, requests_per_minute=600)
    began = time.monotonic()
    with ThreadPoolExecutor(4) as pool:
        list(pool.map(lambda _: client.reply(HELLO, seed=0), range(6)))
    assert naughty.seen[-1].at - began >= 0.5  # five gaps of a tenth


def test_who_waits_for_a_turn_is_let_go() -> None:
    pace, run = RateLimiter(1), RequestSupervisor()
    pace.wait(run.request(0))
    raised: list[BaseException] = []

    def wait() -> None:
        try:
            pace.wait(run.request(0))
        except ModelError as error:
            raised.append(error)

    waiting = threading.Thread(target=wait)
    waiting.start()
    run.close()
    waiting.join(60)
    assert str(raised[0]) == "the client has been closed"


def test_the_key_never_appears(
    naughty: NaughtyServer, make: Make, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.DEBUG)
    caplog.set_level(logging.DEBUG, logger="openai")
    client = make(naughty.url)
    gossip = f"I got 'Authorization: Bearer {KEY}' " * 50  # so long that it is cut somewhere
    naughty.then(
        *[
            Raw({"error": {"message": gossip}}, status, {"x-request-id": KEY, KEY: "x"})
            for status in (500, 500, 401, 400, 400)
        ],
        *[Raw(gossip.encode())] * 2,
    )
    told = [repr(client), repr(vars(client._endpoints._all[0].endpoint)), client.identity]
    for _ in range(4):
        with pytest.raises((ModelError, CannotGoOn), match=r"I got 'Auth.* \*\*\*'") as caught:
            client.reply(HELLO, seed=0)
        told += [repr(caught.value), "".join(traceback.format_exception(caught.value))]
    client.reply(HELLO, seed=0)
    told += [record.getMessage() + repr(record.args) for record in caplog.records]
    assert naughty.count == 8
    assert any("try 1 of 2" in line for line in told)  # it does log
    assert any("receive_response_headers.complete" in line for line in told)
    assert not [line for line in told if KEY[:10] in line]


def test_the_sdks_own_log_does_not_tell_the_key_either(naughty: NaughtyServer) -> None:
    program = (
        "from agents.vlm.chat import Message\n"
        "from agents.vlm.clients.openai_server import OpenAIClient\n"
        "from agents.vlm.settings import AgentSettings, Server\n"
        f"server = Server(base_url={naughty.url!r}, key_from='OUR_TEST_KEY')\n"
        "OpenAIClient('m', AgentSettings(server=server)).reply((Message('user', ('x',)),), 0)\n"
    )
    naughty.then("500")
    done = run_python(program, OPENAI_LOG="debug")
    assert "Sending HTTP Request" in done.stderr
    assert KEY not in done.stderr + done.stdout


def test_identity_is_what_replies_depend_on(naughty: NaughtyServer, make: Make) -> None:
    assert make(naughty.url).identity == make(naughty.url, tries=5, timeout=3).identity
    others = [
        make(naughty.url),
        make(naughty.url + "/other"),
        make(naughty.url, {"sampling": {"temperature": 1}}),
        make(naughty.url, {"decide": "json"}),
        make(naughty.url, {"seed": 1}),
        make(naughty.url, extra={"top_k": 1}),
    ]
    assert len({client.identity for client in others}) == len(others)
    with NaughtyServer() as same:  # started again, on another port
        assert make(same.url).identity == make(naughty.url).identity
    assert "tenant" not in make(naughty.url + "?tenant=a").identity


def test_a_query_is_sent_with_each_request(naughty: NaughtyServer, make: Make) -> None:
    make(naughty.url + "?tenant=a&tenant=b%20c").reply(HELLO, seed=0)
    assert naughty.seen[0].path == "/v1/chat/completions?tenant=a&tenant=b%20c"
    place = naughty.url.removesuffix("/v1")
    make(place + "?tenant=a", api_version="1").reply(HELLO, seed=0)
    assert naughty.seen[1].path.endswith("/chat/completions?api-version=1&tenant=a")


@pytest.mark.parametrize("status", [301, 307, 308])
def test_requests_are_not_sent_on(naughty: NaughtyServer, make: Make, status: int) -> None:
    naughty.then(Raw({}, status, {"Location": f"http://elsewhere.invalid/?key={KEY}"}))
    words = r"redirects to http://elsewhere\.invalid/\?key=\*\*\*; if the server is there"
    with pytest.raises(CannotGoOn, match=words):
        make(naughty.url).reply(HELLO, seed=0)
    assert naughty.count == 1


def test_compressed_answers_are_bounded(naughty: NaughtyServer, make: Make) -> None:
    good = gzip.compress(json.dumps(completion({"content": "end"})).encode())
    bomb = gzip.compress(bytes(LARGEST_ANSWER + 1))
    for body in (good, good[:-9], bomb):
        naughty.then(Raw(body, headers={"Content-Encoding": "gzip"}))
    client = make(naughty.url, tries=1)
    assert client.reply(HELLO, seed=0).text == "end"
    with pytest.raises(ModelError, match="a gzip answer that is cut off"):
        client.reply(HELLO, seed=0)
    with pytest.raises(ModelError, match="more than 20,000,000 bytes"):
        client.reply(HELLO, seed=0)


def test_each_answer_is_entered_before_it_is_judged(naughty: NaughtyServer) -> None:
    server = Server(base_url=naughty.url, key_from="OUR_TEST_KEY", tries=3)
    settings = AgentSettings(server=server, prices=Prices(prompt=2, completion=10))
    ledger = Ledger(Budget(), settings.prices)
    client = OpenAIClient(MODEL, settings, ledger)
    naughty.then("empty_choices", "half", "500", "html", "ok", "429")
    with pytest.raises(ModelError, match="something broke"):
        client.reply(HELLO, seed=0)
    assert ledger.spent.requests == 2  # the server may charge for what it began to answer
    before = ledger.spent.cost
    reply = client.reply(HELLO, seed=0)
    assert ledger.spent.requests == 4
    assert ledger.spent.usage.estimated
    assert ledger.spent.cost > before + reply.cost > before > 0
    client.close()


def test_a_budget_is_looked_at_before_each_try(naughty: NaughtyServer) -> None:
    server = Server(base_url=naughty.url, key_from="OUR_TEST_KEY", tries=9)
    ledger = Ledger(Budget(max_tokens=1000), Prices())
    client = OpenAIClient(MODEL, AgentSettings(server=server), ledger)
    naughty.then(*["html"] * 9)
    with pytest.raises(CannotGoOn, match="the budget is spent"):
        client.reply(HELLO, seed=0)
    assert naughty.count == 1
    client.close()


def test_a_server_that_refuses_again_and_again_stops_the_run(
    naughty: NaughtyServer, make: Make
) -> None:
    client = make(naughty.url, tries=1)
    naughty.then("500", "500", "ok")
    for _ in range(2):
        with pytest.raises(ModelError):
            client.reply(HELLO, seed=0)
    client.reply(HELLO, seed=0)
    naughty.then("500", "500", "500", "500", "ok")  # the last one of four is the short one
    for kind in (ModelError, ModelError, CannotGoOn):
        with pytest.raises(kind, match="500, something broke"):
            client.reply(HELLO, seed=0)
    assert client.reply(HELLO, seed=0).text == "observe"  # later requests are sent again


def test_requests_that_fail_while_others_are_answered_stop_no_run(
    naughty: NaughtyServer, make: Make
) -> None:
    client = make(naughty.url, tries=1)
    for answers in (["500"], ["500"], ["500", "ok"]) * 3:
        naughty.then(*answers)
        with pytest.raises(ModelError, match="500, something broke"):
            client.reply(HELLO, seed=0)


def test_those_who_wait_are_let_go_when_the_run_stops(
    make: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(supervisor, "_GRACE", 0.2)
    with NaughtyServer(script=["429", "stall", "401"], retry_after="60") as server:
        client = make(server.url, timeout=60)
        began = time.monotonic()
        with ThreadPoolExecutor(3) as pool:
            asked = []
            for _ in range(3):
                asked.append(pool.submit(client.reply, HELLO, 0))
                time.sleep(0.2)
            for each in asked:
                with pytest.raises(CannotGoOn, match="401, incorrect key"):
                    each.result()
        assert time.monotonic() - began < 50  # else it waits for a minute
