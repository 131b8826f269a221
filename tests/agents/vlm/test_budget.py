"""The costs of replies are recorded, added up over restarts, and limited by the budget."""

from __future__ import annotations

import json
import math
import os
import resource
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import pytest
from naughty_server import MODEL, NaughtyServer
from support import lines_until_killed

from agents.vlm.chat import Message, Reply, Usage
from agents.vlm.clients.budget import Budget, Entry, Ledger, MeteredClient, Spent
from agents.vlm.clients.supervisor import RequestSupervisor
from agents.vlm.settings import AgentSettings, Prices
from er_gym.rollout.agent import CannotGoOn

HELLO = (Message("user", ("hello",)),)
UNLIMITED = Budget()


class Costly:
    """Each reply costs half a dollar and 12 tokens."""

    identity = "costly"
    prices = Prices(prompt=1.0)

    def __init__(self) -> None:
        self.asked = 0
        self._lock = threading.Lock()

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        with self._lock:
            self.asked += 1
        return Reply("end", usage=Usage(10, 2, 3, 1), cost=0.5, model="m", seconds=0.25)

    def close(self) -> None:
        pass


@dataclass
class Purse:
    """A client, and the ledger that it is metered by."""

    client: MeteredClient
    ledger: Ledger

    def reply(self, messages: Sequence[Message], seed: int) -> Reply:
        return self.client.reply(messages, seed)

    @property
    def spent(self) -> Spent:
        return self.ledger.spent

    def close(self) -> None:
        self.client.close()
        self.ledger.close()


def purse(client: Costly, budget: Budget, path: Path) -> Purse:
    ledger = Ledger(budget, client.prices)
    ledger.open(path)
    return Purse(MeteredClient(client, ledger, RequestSupervisor(budget.max_minutes)), ledger)


Make = Callable[..., Purse]


@pytest.fixture
def ledger(tmp_path: Path) -> Path:
    return tmp_path / "run" / "spending.jsonl"


@pytest.fixture
def make(ledger: Path) -> Iterator[Make]:
    """Opens the test's ledger around a client."""
    made = []

    def metered(client: Costly, budget: Budget = UNLIMITED) -> Purse:
        made.append(purse(client, budget, ledger))
        return made[-1]

    yield metered
    for each in made:
        each.close()


def test_a_line_for_each_reply(make: Make, ledger: Path) -> None:
    make(Costly()).reply(HELLO, seed=7)
    (line,) = ledger.read_text().splitlines()
    entry = json.loads(line)
    assert entry.pop("time").endswith("+00:00")
    assert entry == {
        "model": "m",
        "seed": 7,
        "prompt": 10,
        "completion": 2,
        "cached": 3,
        "reasoning": 1,
        "estimated": False,
        "cost": 0.5,
        "seconds": 0.25,
        "rejected": "",
    }


def test_a_kept_reply_is_not_paid_for(make: Make) -> None:
    class Remembering(Costly):
        def reply(self, messages: Sequence[Message], seed: int) -> Reply:
            return replace(super().reply(messages, seed), from_cache=True, cost=0.0)

    metered = make(Remembering())
    metered.reply(HELLO, seed=0)
    assert metered.spent == Spent()


def test_what_is_spent_is_added_up_over_restarts(make: Make) -> None:
    metered = make(Costly())
    assert metered.spent == Spent()
    metered.reply(HELLO, seed=0)
    metered.close()
    assert metered.spent == Spent(Usage(10, 2, 3, 1), 0.5, 1)
    again = make(Costly())
    again.reply(HELLO, seed=0)
    assert again.spent == Spent(Usage(20, 4, 6, 2), 1.0, 2)


def test_half_a_line_is_ignored_and_harms_no_other(make: Make, ledger: Path) -> None:
    make(Costly()).reply(HELLO, seed=0)
    with ledger.open("a") as file:
        file.write(ledger.read_text()[:40])
    make(Costly()).reply(HELLO, seed=0)
    with ledger.open("a") as file:
        file.write('{"cost": 100')
    assert make(Costly()).spent.requests == 2


def test_who_writes_to_the_same_ledger_spends_the_same_money(make: Make) -> None:
    mine, other = make(Costly(), Budget(max_usd=0.9)), make(Costly())
    mine.reply(HELLO, seed=0)
    other.reply(HELLO, seed=0)
    with pytest.raises(CannotGoOn, match=r"\$1\.00 of \$0\.90"):
        mine.reply(HELLO, seed=0)


@pytest.mark.parametrize(
    ("budget", "words"),
    [
        (
            Budget(max_usd=5.0),
            r"the budget is spent: \$\d\.\d\d of \$5\.00; raise --max-usd and run",
        ),
        (Budget(max_tokens=120), r"the budget is spent: 1\d\d of 120 tokens; raise --max-tokens"),
    ],
)
def test_it_stops_within_the_replies_under_way(make: Make, budget: Budget, words: str) -> None:
    client = Costly()
    metered = make(client, budget)
    together = threading.Barrier(8)

    def play(_: int) -> str:
        together.wait(30)
        for seed in range(100):
            try:
                metered.reply(HELLO, seed)
            except CannotGoOn as error:
                return str(error)
        raise AssertionError("it went on")

    with ThreadPoolExecutor(8) as pool:
        messages = list(pool.map(play, range(8)))
    assert 10 <= client.asked <= 10 + 7
    assert metered.spent.requests == client.asked
    spent = client.asked

    again = make(client, budget)
    with pytest.raises(CannotGoOn, match=words):
        again.reply(HELLO, seed=0)
    assert client.asked == spent
    assert all("the same command again to continue" in message for message in messages)

    more = make(client, Budget(max_usd=50.0, max_tokens=1000))
    more.reply(HELLO, seed=0)
    assert client.asked == spent + 1


def test_minutes_are_of_this_process(make: Make) -> None:
    client = Costly()
    late = make(client, Budget(max_minutes=1e-9))
    with pytest.raises(CannotGoOn, match="the 1e-09 minutes are over; run the same command again"):
        late.reply(HELLO, seed=0)
    make(client, Budget(max_minutes=60)).reply(HELLO, seed=0)
    assert client.asked == 1


@pytest.mark.parametrize("limit", ["max_usd", "max_tokens", "max_minutes"])
@pytest.mark.parametrize("given", [0, -1, math.nan, math.inf, True, "5", 1e400])
def test_a_budget_is_finite_and_positive(limit: str, given: float) -> None:
    with pytest.raises(ValueError, match=rf"^{limit} is .*; give a .* number above 0") as caught:
        Budget(**{limit: given})  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_a_link_is_not_written_to(make: Make, ledger: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.txt"
    other.write_text("mine")
    ledger.parent.mkdir()
    for link in (os.symlink, os.link):
        link(other, ledger)
        with pytest.raises(ValueError, match=r"spending\.jsonl is a link, or not a regular file"):
            make(Costly())
        ledger.unlink()
    os.mkfifo(ledger)
    with pytest.raises(ValueError, match="not a regular file"):
        make(Costly())
    assert other.read_text() == "mine"


def test_lines_that_would_give_money_back_say_nothing(make: Make, ledger: Path) -> None:
    make(Costly()).reply(HELLO, seed=0)
    good = json.loads(ledger.read_text())
    with ledger.open("a") as file:
        for wrong in ({"cost": -100.0}, {"prompt": -5}, {"cost": math.nan}, {"cost": math.inf}):
            file.write(json.dumps({**good, **wrong}) + "\n")
    assert make(Costly()).spent == Spent(Usage(10, 2, 3, 1), 0.5, 1)


def test_dollars_need_prices(make: Make) -> None:
    client = Costly()
    client.prices = Prices()
    with pytest.raises(ValueError, match=r"--max-usd needs prices: .* or use --max-tokens"):
        make(client, Budget(max_usd=1))
    make(client, Budget(max_tokens=1))


def test_a_ledger_that_cannot_be_written_stops_the_run(make: Make) -> None:
    metered = make(Costly())
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, before[1]))  # as if the disk were full
    try:
        with pytest.raises(CannotGoOn, match=r"spending\.jsonl cannot be written"):
            metered.reply(HELLO, seed=0)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


# -- with the others -----------------------------------------------------------------------------


def test_all_together(
    naughty: NaughtyServer, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Kept, metered and asked over HTTP, from 8 threads: the ledger is what the server answered,
    two broken answers included; what is kept is not paid again, and the key is nowhere."""
    pytest.importorskip("openai", reason="needs pip install 'er-gym[vlm]'")
    pytest.importorskip("diskcache", reason="needs pip install 'er-gym[vlm]'")
    from agents.vlm.clients.openai_server import OpenAIClient
    from agents.vlm.clients.reply_cache import ReplyCache

    key = "sk-test-4f1c9e0b7a2d"
    monkeypatch.setenv("OUR_TEST_KEY", key)
    server = {"base_url": naughty.url, "key_from": "OUR_TEST_KEY"}
    prices = {"prompt": 1000.0, "completion": 2000.0}
    settings = AgentSettings.model_validate({"server": server, "prices": prices})
    naughty.then(*["ok", "429", "truncated"] * 2)

    def play() -> tuple[list[Reply], Spent]:
        ledger = Ledger(Budget(max_usd=100.0), settings.prices)
        ledger.open(tmp_path / "spending.jsonl")
        kept = ReplyCache(OpenAIClient(MODEL, settings, ledger), tmp_path / "replies")
        with ThreadPoolExecutor(8) as pool:
            replies = list(pool.map(lambda seed: kept.reply(HELLO, seed), range(80)))
        kept.close()
        ledger.close()
        return replies, ledger.spent

    first, spent = play()
    assert naughty.count == 84
    assert spent.requests == 82
    lines = (tmp_path / "spending.jsonl").read_text().splitlines()
    entries = [Entry.model_validate_json(line) for line in lines]
    good = [each for each in entries if not each.rejected]
    assert sorted(each.seed for each in good) == list(range(80))
    assert sum(each.cost for each in good) == pytest.approx(sum(each.cost for each in first))
    assert sum(each.prompt for each in good) == sum(each.usage.prompt for each in first)
    assert all(each.estimated and each.cost > 0 for each in entries if each.rejected)

    second, still = play()
    assert naughty.count == 84
    assert still == spent
    assert all(reply.from_cache for reply in second)
    assert [reply.text for reply in second] == [reply.text for reply in first]

    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(files) >= 2
    assert not [path for path in files if key.encode() in path.read_bytes()]


PROGRAM = """
import sys
from pathlib import Path
from agents.vlm.chat import Message, Reply, Usage
from agents.vlm.clients.budget import Budget, Ledger, MeteredClient
from agents.vlm.clients.supervisor import RequestSupervisor
from agents.vlm.settings import Prices

class Saying:
    def reply(self, messages, seed):
        return Reply("end", usage=Usage(10, 2), model="m")

ledger = Ledger(Budget(max_tokens=1_000_000), Prices())
ledger.open(Path(sys.argv[1]))
metered = MeteredClient(Saying(), ledger, RequestSupervisor())
while True:
    metered.reply((Message("user", ("hello",)),), 0)
    print(flush=True)
"""


def test_a_budget_holds_over_a_killed_process(make: Make, ledger: Path) -> None:
    assert lines_until_killed(PROGRAM, ledger, 20) == ["\n"] * 20
    metered = make(Costly(), Budget(max_tokens=20 * 12))
    assert metered.spent.requests >= 20
    with pytest.raises(CannotGoOn, match="of 240 tokens"):
        metered.reply(HELLO, seed=0)
