"""Several servers of one model, over real sockets: who gets a request, who is set aside, who is
back."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from typing import Any

import pytest
from naughty_server import MODEL, NaughtyServer

pytest.importorskip("openai", reason="needs pip install 'er-gym[vlm]'")

from agents.factory import comparable_settings
from agents.vlm.chat import Message, ModelError, Reply
from agents.vlm.clients import endpoints
from agents.vlm.clients.budget import Budget, Ledger
from agents.vlm.clients.failures import Failure
from agents.vlm.clients.openai_server import OpenAIClient
from agents.vlm.clients.supervisor import RequestSupervisor, ServerEvent
from agents.vlm.record import settings_to_record
from agents.vlm.settings import AgentSettings, Prices
from er_gym.rollout.agent import CannotGoOn

HELLO = (Message("user", ("hello",)),)
_LONG = 20.0  # seconds after which a test that waits gives up


class Asker:
    """A client of several servers, and what its user sees."""

    def __init__(self, servers: list[NaughtyServer], budget: Budget, **server: Any) -> None:
        self.shown: list[ServerEvent] = []
        self.logged: list[ServerEvent] = []
        self.supervisor = RequestSupervisor()
        self.supervisor.show, self.supervisor.log_event = self.shown.append, self.logged.append
        self.ledger = Ledger(budget, Prices())
        given = {"base_url": [each.url for each in servers], "key_from": "NO_SUCH_KEY", **server}
        settings = AgentSettings.model_validate({"server": given})
        self.client = OpenAIClient(MODEL, settings, self.ledger, self.supervisor)

    def __call__(self, said: int | str = "hello") -> Reply:
        return self.client.reply((Message("user", (str(said),)),), seed=0)

    def lines(self, event: str) -> list[str]:
        """What was shown of an event."""
        return [str(each) for each in self.shown if each.event == event]


Make = Callable[..., Asker]


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(endpoints, "_FIRST_REST", 0.05)
    for name in ("HTTP_PROXY", "http_proxy", "ALL_PROXY", "all_proxy"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def make() -> Iterator[Make]:
    made = []

    def asker(*servers: NaughtyServer, budget: Budget = Budget(), **server: Any) -> Asker:  # noqa: B008
        made.append(Asker(list(servers), budget, **server))
        return made[-1]

    yield asker
    for each in made:
        each.client.close()


@pytest.fixture
def pair() -> Iterator[tuple[NaughtyServer, NaughtyServer]]:
    with NaughtyServer(echo) as one, NaughtyServer(echo) as other:
        yield one, other


Pair = tuple[NaughtyServer, NaughtyServer]


def echo(messages: list[dict[str, Any]]) -> str:
    said: str = messages[-1]["content"]
    return said


def port_of(server: NaughtyServer) -> int:
    return int(server.url.rpartition(":")[2].partition("/")[0])


def until(true: Callable[[], object]) -> None:
    """Wait until it is true."""
    ends = time.monotonic() + _LONG
    while not true():
        assert time.monotonic() < ends
        time.sleep(0.005)


class Gate:
    """An answer that comes once the gate is opened."""

    def __init__(self) -> None:
        self.opened = threading.Event()

    def __call__(self, messages: list[dict[str, Any]]) -> str:
        self.opened.wait(_LONG)
        return echo(messages)


# -- balance -------------------------------------------------------------------------------------


def test_requests_are_shared_out(make: Make, pair: Pair) -> None:
    one, other = pair
    ask, gate = make(one, other), Gate()
    for number in range(6):
        ask(number)
    assert (one.count, other.count) == (3, 3)  # in turns, where none is busier
    one.answer = other.answer = gate
    with ThreadPoolExecutor(8) as pool:
        replies = pool.map(ask, range(8))
        until(lambda: one.count + other.count == 6 + 8)
        assert (one.count, other.count) == (3 + 4, 3 + 4)
        gate.opened.set()
        assert [reply.text for reply in replies] == [str(number) for number in range(8)]
    assert ask.shown == []


def test_a_slow_server_gets_fewer(make: Make, pair: Pair) -> None:
    slow, fast = pair
    ask, gate = make(slow, fast), Gate()
    slow.answer = gate
    with ThreadPoolExecutor(2) as pool:
        waiting = [pool.submit(ask)]
        until(lambda: slow.count == 1)
        for number in range(10):
            ask(number)
        assert (slow.count, fast.count) == (1, 10)
        gate.opened.set()
        waiting[0].result()


# -- failures that may pass ------------------------------------------------------------------------


def test_a_server_dies_and_comes_back(make: Make, pair: Pair) -> None:
    one, other = pair
    one.then(*["ok"] * 5, *["stall"] * 100)
    ask = make(one, other, tries=3)
    with ThreadPoolExecutor(8) as pool:
        replies = pool.map(ask, range(60))
        until(lambda: one.count == 5 + 4 and other.count > 20)
        one.close()
        assert [reply.text for reply in replies] == [str(number) for number in range(60)]
    assert ask.ledger.spent.requests == 60  # each is paid for once
    assert (one.count, other.count) == (9, 55)
    (line,) = ask.lines("aside")
    assert line.startswith(f"{MODEL} at {one.url}: ")
    assert line.endswith("; set aside; 1 of 2 servers left")
    assert len(ask.shown) == 1
    retries = [each for each in ask.logged if each.event == "retry"]
    assert len(retries) >= 4
    assert {each.wait for each in retries} == {0.0}

    with NaughtyServer(echo, port=port_of(one)) as again:
        until(lambda: ask() and again.count)
        before = again.count, other.count
        for number in range(10):
            ask(number)
        assert (again.count, other.count) == (before[0] + 5, before[1] + 5)
    assert ask.lines("back") == [f"{MODEL} at {one.url} answers again; 2 of 2 servers in use"]
    assert len(ask.lines("aside")) == 1


def test_one_request_tries_whether_a_server_is_back(make: Make, pair: Pair) -> None:
    one, other = pair
    one.then("500")
    ask, gate = make(one, other), Gate()
    ask()
    assert (one.count, other.count) == (1, 1)
    assert ask.lines("aside")[0].endswith("500, something broke; set aside; 1 of 2 servers left")
    one.answer = other.answer = gate
    until(lambda: ask.client._endpoints._all[0].state == "trial")
    with ThreadPoolExecutor(6) as pool:
        asked = [pool.submit(ask) for _ in range(6)]
        until(lambda: one.count + other.count == 2 + 6)
        assert (one.count, other.count) == (2, 1 + 5)
        assert not ask.lines("back")
        gate.opened.set()
        for each in asked:
            each.result()
    assert len(ask.lines("back")) == 1
    assert ask.client._endpoints._all[0].rests == 0


def test_what_fails_late_does_not_set_a_server_aside_again(make: Make, pair: Pair) -> None:
    one, other = pair
    ask = make(one, other)
    servers = ask.client._endpoints
    late = Failure("reset", retryable=True, server="down")
    with servers.use() as first, servers.use(), servers.use() as third:
        assert first.endpoint is third.endpoint
    servers.failed(first, late, "x")
    until(lambda: ask() and ask.lines("back"))
    servers.failed(third, late, "y")
    assert servers._all[0].state == "used"
    assert ask.lines("aside") == ["x; set aside; 1 of 2 servers left"]


def test_a_server_that_fails_each_trial_is_told_once(make: Make, pair: Pair) -> None:
    one, other = pair
    one.then(*["500"] * 1000)
    ask = make(one, other)
    until(lambda: ask() and one.count >= 4)
    assert len(ask.shown) == len(ask.lines("aside")) == 1
    assert ask.ledger.spent.requests == other.count


def test_a_rate_limit_is_for_one_server(make: Make) -> None:
    with NaughtyServer(script=["429"], retry_after="0.6") as limited, NaughtyServer() as other:
        ask = make(limited, other)
        ask()
        assert [each.wait for each in ask.logged if each.event == "retry"] == [0.0]
        until(lambda: ask() and limited.count > 1)
        assert limited.seen[1].at - limited.seen[0].at >= 0.6
        assert other.count > 1
        assert ask.lines("aside")[0].endswith("slow down; set aside for 0.6 s; 1 of 2 servers left")
        assert len(ask.lines("aside")) == len(ask.lines("back")) == 1


def test_the_longest_wait_that_a_server_asks_for_counts(make: Make, pair: Pair) -> None:
    ask = make(*pair)
    servers = ask.client._endpoints
    with ExitStack() as under_way:
        first, _, second, _, third = [under_way.enter_context(servers.use()) for _ in range(5)]
        assert first.endpoint is second.endpoint is third.endpoint
    for used, seconds in ((first, 0.01), (second, 60.0)):
        servers.failed(used, Failure("429", True, retry_after=seconds, server="busy"), "x")
    servers.replied(third)  # was under way before
    time.sleep(0.02)
    for _ in range(3):
        ask()
    assert [each.count for each in pair] == [0, 3]
    assert len(ask.shown) == 1


def test_if_all_ask_to_wait_the_shortest_wait_counts(make: Make) -> None:
    with (
        NaughtyServer(mixture={"429": 1}, retry_after="90") as long,
        NaughtyServer(script=["429"], retry_after="0.3") as short,
    ):
        ask = make(long, short)
        ask()
        assert (long.count, short.count) == (1, 2)
        assert short.seen[1].at - short.seen[0].at >= 0.3
        first, second = [each.wait for each in ask.logged if each.event == "retry"]
        assert first == 0 < second <= 0.3


def test_a_server_that_comes_back_ends_a_wait(make: Make, pair: Pair) -> None:
    limited, down = pair
    limited.retry_after = "90"
    limited.then("429")
    down.close()
    ask = make(limited, down)
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(ask)
        until(lambda: ask.lines("retry"))
        with NaughtyServer(echo, port=port_of(down)) as again:
            assert waiting.result(_LONG)
            assert again.count == 1
    assert limited.count == 1


def test_all_are_down_and_one_comes_back(make: Make, pair: Pair) -> None:
    one, other = pair
    ask = make(one, other, tries=20)
    ask()
    one.close()
    other.close()
    with ThreadPoolExecutor(1) as pool:
        waiting = pool.submit(ask, "still there?")
        until(lambda: ask.lines("retry"))
        with NaughtyServer(echo, port=port_of(other)):
            assert waiting.result().text == "still there?"
    assert [line.rpartition("; ")[2] for line in ask.lines("aside")] == [
        "1 of 2 servers left",
        "0 of 2 servers left",
    ]
    assert len(ask.lines("back")) == 1


def test_no_server_at_all(make: Make, pair: Pair) -> None:
    for each in pair:
        each.close()
    ask = make(*pair, tries=2)
    with pytest.raises(CannotGoOn, match=r"refused \(tried 2 times\); nothing has answered yet"):
        ask()
    assert len(ask.lines("aside")) == 2


def test_one_that_is_down_from_the_start(make: Make, pair: Pair) -> None:
    down, up = pair
    down.close()
    ask = make(down, up)
    for number in range(3):
        assert ask(number).text == str(number)
    assert up.count == 3
    assert len(ask.shown) == 1


def test_one_that_is_down_is_not_all_that_there_is(make: Make, pair: Pair) -> None:
    up, down = pair
    down.close()
    ask = make(up, down, tries=1)
    ask()
    with pytest.raises(ModelError, match="refused"):
        ask()
    ask()


def test_a_late_answer_is_asked_for_twice_at_most(make: Make, pair: Pair) -> None:
    one, other = pair
    ask = make(one, other, timeout=1.5)
    ask()
    ask()
    one.then("stall")
    other.then("stall")
    with pytest.raises(ModelError, match=r"no whole answer within 1.5 s \(tried 2 times\)"):
        ask()
    assert (one.count, other.count) == (2, 2)


def test_the_budget_holds(make: Make) -> None:
    mixture = {"ok": 3, "500": 1, "reset": 1}
    with NaughtyServer(mixture=mixture, seed=3) as one, NaughtyServer(latency=0.01) as other:
        ask = make(one, other, budget=Budget(max_tokens=2000), tries=20)

        def play(number: int) -> bool:
            try:
                return bool(ask(number))
            except CannotGoOn:
                return False

        with ThreadPoolExecutor(4) as pool:
            replies = sum(pool.map(play, range(100)))
    spent = ask.ledger.spent
    assert replies == spent.requests < 100
    stopped = [each.what for each in ask.logged if each.event == "stopped"]
    assert all(what.startswith("the budget is spent") for what in stopped)
    assert stopped
    each = spent.usage.total / spent.requests
    assert 2000 <= spent.usage.total <= 2000 + 4 * each  # four at once


# -- failures that do not pass -------------------------------------------------------------------


@pytest.mark.parametrize("behaviour", ["401", "403", "404"])
def test_a_server_that_refuses_at_the_start_ends_the_run(
    make: Make, pair: Pair, behaviour: str
) -> None:
    one, other = pair
    other.then(behaviour)
    ask = make(one, other)
    ask()
    with pytest.raises(CannotGoOn, match=f"{MODEL} at {other.url}: {behaviour}, .*; the server "):
        ask()
    assert (one.count, other.count) == (1, 1)


def test_a_server_that_refuses_later_is_not_asked_again(make: Make, pair: Pair) -> None:
    one, other = pair
    ask = make(one, other)
    ask()
    ask()
    other.then("404", "404")
    for number in range(6):
        assert ask(number).text == str(number)
    assert (one.count, other.count) == (1 + 6, 1 + 1)
    (line,) = [str(each) for each in ask.shown]
    assert f"{other.url}: 404, the model does not exist; the server has no such model" in line
    assert line.endswith("; not asked again; 1 of 2 servers left")
    one.then("401")
    with pytest.raises(CannotGoOn, match=f"{one.url}: 401, incorrect key; the server does not"):
        ask()


# -- settings ------------------------------------------------------------------------------------

A, B = "http://a:8000/v1", "http://me:pass-word-1@b:8000/v1?code=long-enough-1"


def settings(base_url: Any) -> AgentSettings:
    return AgentSettings.model_validate({"server": {"base_url": base_url}})


def test_addresses_do_not_decide_whether_runs_are_the_same() -> None:
    one, several = settings(A), settings([A, B])
    assert comparable_settings(one, "") == comparable_settings(several, "")
    keys = OpenAIClient("m", one), OpenAIClient("m", several)
    assert keys[0].identity == keys[1].identity  # so that kept replies count
    for each in keys:
        each.close()


def test_a_record_has_the_addresses_and_no_secrets() -> None:
    assert settings_to_record(settings(A))["server"]["base_url"] == A
    several = settings_to_record(settings([A, B]))["server"]["base_url"]
    assert several == [A, "http://b:8000/v1"]


@pytest.mark.parametrize("base_url", [[], 5, [A, 5], [A, ""], {"a": A}])
def test_what_is_no_address(base_url: Any) -> None:
    with pytest.raises(ValueError, match="give the address of a server, or a list of addresses"):
        settings(base_url)


@pytest.mark.parametrize(
    ("base_url", "words"),
    [
        ([A, "nonsense"], "'nonsense' is not an address"),
        ([A, B, A + "/"], "server.base_url names 'http://a:8000/v1/' twice; name each"),
        ([B, B], "names 'b:8000/v1' twice"),
    ],
)
def test_what_cannot_begin(base_url: Any, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        OpenAIClient("m", settings(base_url))
