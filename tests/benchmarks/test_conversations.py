"""Vision-language agents, end to end: the command, a faulty server, engines in processes."""

from __future__ import annotations

import html
import importlib.util
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("openai", reason="needs the extra vlm")
pytest.importorskip("fastapi", reason="needs the extra ui")

from click.testing import CliRunner
from fastapi.testclient import TestClient

from agents.vlm.record import ConversationRecord
from benchmarks.cli.main import cli
from benchmarks.monitor.app import make_app
from er_gym.rollout.run_directory import RunDirectory
from er_gym.tasks import load_suite

_HELPERS = Path(__file__).parents[1] / "agents" / "vlm"
_spec = importlib.util.spec_from_file_location("naughty", _HELPERS / "naughty_server.py")
assert _spec is not None
assert _spec.loader is not None
naughty = importlib.util.module_from_spec(_spec)
sys.modules["naughty"] = naughty
_spec.loader.exec_module(naughty)

TASKS = load_suite("er-1k").tasks[:200]
PRICES = ("--set", "prices.prompt=1", "--set", "prices.completion=10")
PATIENCE = ("--set", "server.timeout=60", "--set", "server.tries=12")
"""An answer that is late where the machine is busy is asked for once all the same."""


def short(messages: list[dict[str, Any]]) -> str:
    """Looks round once, says something in vain, and ends."""
    said = sum(message["role"] == "assistant" for message in messages)
    actions = ("observe", "fly", "end")
    return f"<Planning>{said}</Planning><DecisionMaking>{actions[min(said, 2)]}</DecisionMaking>"


def command(url: str, out: Path, *more: str) -> list[str]:
    return [
        "bench", "--suite", "er-1k", "--agent", "openai:naughty-1", "--base-url", url,
        "--agent-config", "text", "--out", str(out), *PATIENCE, *more,
    ]  # fmt: skip


def bench(url: str, out: Path, *more: str) -> Any:
    return CliRunner().invoke(cli, command(url, out, *more), standalone_mode=False)


def ledger(out: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (out / "spending.jsonl").read_text().splitlines()]


def conversations(out: Path) -> list[ConversationRecord]:
    return [
        ConversationRecord.model_validate_json(file.read_bytes())
        for file in sorted((out / "conversations").glob("*.json"))
    ]


def assert_whole(out: Path, tasks: int, paid_again: int = 0) -> None:
    """As many episodes and conversations as tasks, none crashed, and the costs of all that was no
    rejected answer add up.

    An answer is entered in the ledger before it is kept. So where the runner was killed, as many
    may have been paid for again as there were conversations at once.
    """
    episodes = list(RunDirectory.open(out).episodes())
    assert len(episodes) == tasks
    assert {each.error for each in episodes} == {""}
    talks = conversations(out)
    assert [each.task_id for each in talks] == [each.task_id for each in episodes]
    for talk, episode in zip(talks, episodes, strict=True):
        assert len(talk.rounds) == len(episode.steps) - 1
        assert [each.feedback for each in talk.rounds] == [s.feedback for s in episode.steps[1:]]
    good = [entry for entry in ledger(out) if not entry["rejected"]]
    again = len(good) - sum(len(talk.rounds) for talk in talks)
    assert 0 <= again <= paid_again
    cost, prompts = (sum(entry[name] for entry in good) for name in ("cost", "prompt"))
    if again:
        assert sum(talk.cost for talk in talks) <= cost
        assert sum(talk.prompt_tokens for talk in talks) < prompts
    else:
        assert sum(talk.cost for talk in talks) == pytest.approx(cost)
        assert sum(talk.prompt_tokens for talk in talks) == prompts


def test_two_hundred_episodes_with_a_server_that_misbehaves(tmp_path: Path) -> None:
    mixture = {
        "ok": 60, "429": 3, "500": 3, "503": 1, "reset": 3, "half": 1, "truncated": 2, "html": 1,
        "empty_choices": 2, "refusal": 2, "no_content": 2, "wrong_tags": 2, "huge": 1, "drip": 0.3,
    }  # fmt: skip
    more = ("--set", "server.timeout=2")  # of those that drip
    with naughty.NaughtyServer(short, mixture=mixture, seed=1, keep_bodies=False) as server:
        result = bench(server.url, tmp_path, "--limit", "200", "--workers", "2", *PRICES, *more)
    assert result.return_value == 0, result.output
    assert_whole(tmp_path, len(TASKS))
    entries = ledger(tmp_path)
    assert server.count > len(entries)  # failed requests were sent again
    rejected = [entry for entry in entries if entry["rejected"]]
    assert len(rejected) > 5
    assert all(entry["cost"] > 0 for entry in rejected)
    assert {entry["estimated"] for entry in rejected} == {True, False}  # some have a count
    events = (tmp_path / "server-events.jsonl").read_text().splitlines()
    tries = [json.loads(line)["event"] for line in events]
    assert tries.count("retry") == server.count - (len(entries) - len(rejected))
    ends = Counter(each.end_reason for each in RunDirectory.open(tmp_path).episodes())
    assert set(ends) <= {"end", "no known action"}
    assert ends["end"] > 150


def test_two_servers_one_of_which_dies(tmp_path: Path) -> None:
    dying = naughty.NaughtyServer(short, ["ok"] * 6, {"reset": 1}, keep_bodies=False)
    with dying, naughty.NaughtyServer(short, keep_bodies=False) as other:
        urls = ("--base-url", other.url)
        result = bench(dying.url, tmp_path, "--limit", "12", *PRICES, *urls)
        assert result.return_value == 0, result.output
        assert_whole(tmp_path, 12)
        assert len(ledger(tmp_path)) == 6 + other.count == 12 * 3  # each turn is paid for once
        assert result.output.count("; set aside; 1 of 2 servers left") == 1
        events = (tmp_path / "server-events.jsonl").read_text().splitlines()
        kinds = Counter(json.loads(line)["event"] for line in events)
        assert kinds == {"aside": 1, "retry": dying.count - 6}
        before = other.count
        again = bench(other.url, tmp_path, "--limit", "12", *PRICES)
        assert again.return_value == 0, again.output  # it is the same run
        assert other.count == before


def test_a_budget_stops_within_the_replies_under_way(tmp_path: Path) -> None:
    with naughty.NaughtyServer(short, keep_bodies=False) as server:
        more = ("--limit", "12", "--concurrency", "3")
        result = bench(server.url, tmp_path, *more, *PRICES, "--max-usd", "0.01")
        assert result.return_value == 3
        entries = ledger(tmp_path)
        within = [sum(entry["cost"] for entry in entries[:n]) for n in range(len(entries) + 1)]
        first_over = next(n for n, cost in enumerate(within) if cost >= 0.01)
        assert len(entries) <= first_over + 2  # three at once
        assert server.count == len(entries)
        again = bench(server.url, tmp_path, *more, *PRICES, "--max-usd", "0.01")
        assert again.return_value == 3
        assert server.count == len(entries)  # no request was sent

        done = bench(server.url, tmp_path, *more, *PRICES, "--max-usd", "10")
        assert done.return_value == 0, done.output
        assert server.count == len(ledger(tmp_path)) == 12 * 3  # and nothing was paid for twice
    assert_whole(tmp_path, 12)


def test_conversations_that_overflow_end_their_episodes_and_not_the_run(tmp_path: Path) -> None:
    """Three conversations are too long for the server, later a budget ends the run: the same
    command goes on to the end, and plays none of the three again."""
    tasks = load_suite("mini").tasks[:8]
    long = {each.instruction for each in tasks[:3]}

    def answer(messages: list[dict[str, Any]]) -> Any:
        said = sum(message["role"] == "assistant" for message in messages)
        if said and any(words in str(messages) for words in long):
            error = {"message": "maximum context length is 9 tokens", "code": 400}
            return naughty.Raw({"error": error}, 400)
        return short(messages)

    with naughty.NaughtyServer(answer) as server:
        more = ("--suite", "mini", "--limit", "8", "--concurrency", "1", *PRICES)
        first = bench(server.url, tmp_path, *more, "--max-usd", "0.014")
        assert first.return_value == 3, first.output
        assert "the budget is spent" in first.output
        played = [*RunDirectory.open(tmp_path).episodes()]
        assert 3 <= len(played) < 8
        before = server.count
        rest = bench(server.url, tmp_path, *more)
        assert rest.return_value == 0, rest.output
        left = 8 - len(played)
        assert server.count - before <= left * 3
    episodes = [*RunDirectory.open(tmp_path).episodes()]
    gone = {each.instruction: each for each in episodes if each.gave_up}
    assert set(gone) == long
    for each in gone.values():
        assert (each.error, each.end_reason, each.cause) == ("", "gave up", "context")
        assert "400, maximum context length is 9 tokens" in each.gave_up
        assert len(each.steps) == 2
    assert len(episodes) == 8


def test_a_run_of_nothing_but_refused_conversations_ends(tmp_path: Path) -> None:
    """Continued when only refused conversations are left, and in words that nobody knows."""

    def answer(messages: list[dict[str, Any]]) -> Any:
        if "Say OK." in str(messages[-1]):
            return "OK"
        return naughty.Raw({"error": {"message": "computer says no"}}, 400)

    with naughty.NaughtyServer(answer) as server:
        result = bench(server.url, tmp_path, "--limit", "7")
    assert result.return_value == 0, result.output
    causes = [each.cause for each in RunDirectory.open(tmp_path).episodes()]
    assert causes == ["request"] * 7


def ended(content: str | None, finish: str = "stop", **message: Any) -> Any:
    return naughty.Raw(
        {"choices": [{"message": {"content": content, **message}, "finish_reason": finish}]}
    )


CUT = ended("<Planning>First I", "length")
AMISS = {
    "2 of 9 replies were cut at the most tokens of a reply (in 1 episodes, 2 of them named no "
    "action): raise sampling.max_tokens, or": CUT,
    "2 of 9 replies ended within their thoughts": ended("<think>Well, I", "length"),
    "3 of 9 replies were empty": ended(None),
    "1 of 9 replies were refusals": ended(None, refusal="No."),
    "1 of 9 replies were withheld or cut by the server's content filter": ended(
        "", "content_filter"
    ),
    "2 of 9 replies named no action": ended("Hm."),
}


def test_what_was_amiss_with_replies_is_told(tmp_path: Path) -> None:
    """At the end of the run, by the report in every layout, and by the monitor."""
    hm, *_ = [answer for words, answer in AMISS.items() if "named no action" in words[:40]]
    script = [*AMISS.values(), ended("<think>Well, I"), ended(""), hm]
    with naughty.NaughtyServer(script=script) as server:
        result = bench(server.url, tmp_path, "--limit", "3", "--concurrency", "1")
    assert result.return_value == 0, result.output
    told = {"at the end": " ".join(result.output.split())}
    for layout in ("table", "md", "json", "csv"):
        report = ["report", str(tmp_path), "--format", layout]
        said = CliRunner().invoke(cli, report, standalone_mode=False).output
        told[layout] = " ".join(said.split())
    client = TestClient(make_app([tmp_path]), base_url="http://127.0.0.1:8010")
    (link,) = set(re.findall(r"/runs/\w+", client.get("/").text))
    told["monitor"] = html.unescape(client.get(link).text)
    missing = [(where, words) for where in told for words in AMISS if words not in told[where]]
    assert not missing, told["at the end"]


def test_what_was_amiss_is_told_of_a_run_that_a_budget_ends(tmp_path: Path) -> None:
    with naughty.NaughtyServer(script=[CUT] * 99) as server:
        more = ("--limit", "2", "--concurrency", "1", *PRICES)
        result = bench(server.url, tmp_path, *more, "--max-usd", "0.04")
    assert result.return_value == 3
    assert "replies were cut at the most tokens of a reply" in result.output
    assert "sampling.max_tokens=512" in result.output


def test_a_key_that_is_refused_stops_the_run(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "sk-very-secret")
    with naughty.NaughtyServer(script=["401"] * 50) as server:
        result = bench(server.url, tmp_path, "--limit", "6")
    assert result.return_value == 3
    assert "nothing is left in" in result.output
    everything = b"".join(file.read_bytes() for file in tmp_path.rglob("*") if file.is_file())
    assert b"very-secret" not in everything
    assert "very-secret" not in result.output


def test_pictures_are_kept_beside_the_conversation(tmp_path: Path) -> None:
    size = ("--set", "sees=pictures", "--set", "pictures.width=64", "--set", "pictures.height=48")
    with naughty.NaughtyServer(short) as server:
        result = bench(server.url, tmp_path, "--limit", "2", *size)
    assert result.return_value == 0, result.output
    for talk in conversations(tmp_path):
        shown = [p for m in talk.messages for p in m.parts if not isinstance(p, str)]
        assert len(shown) == 1 + 4  # at first, and after looking round
        assert all((tmp_path / each.path).read_bytes()[:2] == b"\xff\xd8" for each in shown)
    bodies = [seen.json for seen in server.seen]
    assert sum("data:image/jpeg;base64," in json.dumps(body) for body in bodies) == len(bodies)


def test_the_words_of_a_training_file_are_used(tmp_path: Path) -> None:
    def sample(task: str) -> dict[str, Any]:
        return {
            "messages": [
                {"role": "system", "content": "You were trained."},
                {"role": "user", "content": f"<image>Look. Your job: {task} Go."},
                {
                    "role": "assistant",
                    "content": "<DecisionMaking>navigate to Bed</DecisionMaking>",
                },
                {"role": "user", "content": "<image>That was: navigate to Bed. And now?"},
                {"role": "assistant", "content": "<DecisionMaking>end</DecisionMaking>"},
            ]
        }

    dataset = tmp_path / "train.json"
    dataset.write_text(
        json.dumps([sample("Find the Mug."), sample("Open a Fridge."), sample("X.")])
    )
    size = ("--set", "pictures.width=64", "--set", "pictures.height=48", "--set", "sees=pictures")
    with naughty.NaughtyServer("<DecisionMaking>end</DecisionMaking>") as server:
        more = ("--limit", "1", "--prompts-from", str(dataset), *size)
        result = bench(server.url, tmp_path / "run", *more)
    assert result.return_value == 0, result.output
    system, user = server.seen[0].json["messages"]
    assert system["content"] == "You were trained."
    picture, words = user["content"]
    assert picture["type"] == "image_url"
    assert words["text"] == f"Look. Your job: {TASKS[0].instruction} Go."


def test_a_recorded_run_is_played_again_without_a_server(tmp_path: Path) -> None:
    with naughty.NaughtyServer(short) as server:
        bench(server.url, tmp_path / "a", "--limit", "4")
    again = command("", tmp_path / "b", "--limit", "4")
    again[again.index("--agent") + 1] = f"recorded:{tmp_path / 'a'}"
    del again[again.index("--base-url") : again.index("--base-url") + 2]
    result = CliRunner().invoke(cli, again, standalone_mode=False)
    assert result.return_value == 0, result.output
    played = [
        [
            [step.text for step in episode.steps]
            for episode in RunDirectory.open(tmp_path / x).episodes()
        ]
        for x in "ab"
    ]
    assert played[0] == played[1]
    assert ledger(tmp_path / "b") == []  # replayed replies have been paid for


def test_a_hanging_server_is_reported_and_left_in_time(tmp_path: Path) -> None:
    with naughty.NaughtyServer(script=["stall"] * 50) as server:
        began = time.monotonic()
        hangs = bench(server.url, tmp_path, "--limit", "6", "--set", "server.timeout=0.5")
        assert hangs.return_value == 3
        assert "no whole answer within 0.5 s (try 1 of 2); trying again in" in hangs.output
        assert "(tried 2 times); nothing has answered yet: check that the server" in hangs.output
        over = bench(server.url, tmp_path, "--limit", "6", "--max-minutes", "0.01")
        assert over.return_value == 3
        assert "the 0.01 minutes are over" in over.output
        assert time.monotonic() - began < 120
    assert list(tmp_path.glob("run.*")) == []


def test_how_long_a_server_may_ask_to_wait(tmp_path: Path) -> None:
    with naughty.NaughtyServer(script=["429"] * 50, retry_after="300") as server:
        result = bench(server.url, tmp_path, "--limit", "2")
        assert result.return_value == 3
        assert "the server asks to wait 5 min: run the same command again" in result.output
        assert "or give --max-minutes" in result.output
        result = bench(server.url, tmp_path, "--limit", "2", "--max-minutes", "4")
        assert result.return_value == 3
        assert "asks to wait 5 min, and 4 min of --max-minutes are left" in result.output


def test_ctrl_c_works_while_a_long_wait_is_allowed(tmp_path: Path) -> None:
    with naughty.NaughtyServer(script=["429"] * 50, retry_after="300") as server:
        waiting = run(server.url, tmp_path, "--limit", "2", "--max-minutes", "90").process
        assert waiting.stdout is not None
        assert "slow down (try 1 of 12); trying again in 5 min" in waiting.stdout.readline()
        waiting.send_signal(signal.SIGINT)
        waiting.communicate(timeout=60)  # and not five minutes
        assert waiting.returncode == 130


def test_tokens_that_are_not_counted_are_estimated_and_marked(tmp_path: Path) -> None:
    said = naughty.completion({"content": "<DecisionMaking>end</DecisionMaking>"})
    with naughty.NaughtyServer(script=[naughty.Raw({**said, "usage": None})] * 9) as server:
        more = ("--limit", "3", "--concurrency", "1", *PRICES)
        result = bench(server.url, tmp_path, *more, "--max-tokens", "100")
    assert result.return_value == 3
    assert "the budget is spent: at most " in result.output
    assert server.count == 1
    (entry,) = ledger(tmp_path)
    (talk,) = conversations(tmp_path)
    assert entry["estimated"]
    assert talk.estimated
    assert talk.rounds[0].estimated
    assert talk.prompt_tokens == entry["prompt"] > len(server.seen[0].body) - 100
    assert talk.cost == pytest.approx(entry["cost"])
    assert talk.cost > 0


def test_a_key_that_is_repeated_is_nowhere(tmp_path: Path, monkeypatch: Any) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "sk-very-secret")
    said = "<Thinking>It is sk-very-secret.</Thinking><DecisionMaking>end</DecisionMaking>"
    extra = ("--set", 'server.extra={"user": "sk-very-secret"}')
    with naughty.NaughtyServer(said) as server:
        url = f"{server.url}?tenant=mine&code=also-very-secret"
        result = bench(url, tmp_path, "--limit", "2", *extra)
    assert result.return_value == 0, result.output
    assert {seen.path.partition("?")[2] for seen in server.seen} == {
        "tenant=mine&code=also-very-secret"
    }
    everything = b"".join(file.read_bytes() for file in tmp_path.rglob("*") if file.is_file())
    assert b"It is ***." in everything
    assert b"very-secret" not in everything
    assert "very-secret" not in result.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ("--agent", "oracle", "--concurrency", "4"),
            "--concurrency is for vision-language agents",
        ),
        (("--agent", "openai:m", "--agent-config", "genius"), "there is no agent 'genius'"),
        (("--agent", "openai:m", "--set", "sees=nothing"), "wrong field 'sees'"),
        (("--agent", "openai:m"), "there is no key: set OPENAI_API_KEY"),
        (
            ("--agent", "openai:m", "--base-url", "http://127.0.0.1:1/v1", "--max-usd", "1"),
            "--max-usd needs prices",
        ),
        *(
            (("--agent", "openai:m", f"--max-{what}", given), f"--max-{what}")
            for what in ("usd", "tokens", "minutes")
            for given in ("0", "-1", "nan", "inf")
        ),
        (("--agent", "oracle", "--max-usd", "1"), "--max-usd is for vision-language agents"),
        (("--agent", "openai:m", "--set", "prices.prompt=.nan"), "'prices.prompt'"),
        (("--agent", "openai:m", "--set", "prices.prompt=.inf"), "'prices.prompt'"),
        (("--agent", "openai:m", "--set", "prices.completion=-1"), "'prices.completion'"),
        (("--agent", "openai:m", "--set", "prices.prompt=true"), "'prices.prompt'"),
        (("--agent", "recorded:nowhere"), "holds no conversations"),
        (("--agent", "openai:m", "--set", "prompts.profile=x"), "there are no prompts 'x'"),
    ],
)
def test_wrong_options_are_reported(
    arguments: tuple[str, ...], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    asked = ["bench", "--suite", "mini", "--out", str(tmp_path), "--limit", "1"]
    result = CliRunner().invoke(cli, [*asked, *arguments])
    assert result.exit_code == 2
    assert message in result.output


# -- SIGKILL ---------------------------------------------------------------------------------------


class Process:
    """``er-gym bench`` or the server as a process of its own."""

    def __init__(self, *argv: str) -> None:
        self.process = subprocess.Popen(
            [sys.executable, *argv], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )

    def kill(self) -> None:
        self.process.kill()
        self.process.wait()

    def end(self) -> tuple[int, str]:
        said, _ = self.process.communicate(timeout=120)
        return self.process.returncode, said


@pytest.fixture
def server() -> Iterator[Any]:
    began: list[Process] = []

    def start(port: int = 0) -> tuple[Process, str]:
        script = str(_HELPERS / "naughty_server.py")
        say = "<DecisionMaking>end</DecisionMaking>"
        began.append(Process(script, "--port", str(port), "--latency", "0.2", "--say", say))
        assert began[-1].process.stdout is not None
        return began[-1], began[-1].process.stdout.readline().strip()

    yield start
    for each in began:
        each.kill()


def run(url: str, out: Path, *more: str) -> Process:
    return Process("-m", "benchmarks.cli", *command(url, out, "--concurrency", "2", *more))


def until(out: Path, episodes: int) -> None:
    """Wait until so many episodes are in a run directory."""
    deadline = time.monotonic() + 60
    while len(list((out / "episodes").glob("*.json"))) < episodes:
        assert time.monotonic() < deadline
        time.sleep(0.02)


def children(pid: int) -> list[int]:
    tasks = Path(f"/proc/{pid}/task").glob("*/children")
    return [int(child) for file in tasks for child in file.read_text().split()]


def test_the_runner_is_killed_and_goes_on(server: Any, tmp_path: Path) -> None:
    _, url = server()
    killed = run(url, tmp_path, "--limit", "12")
    until(tmp_path, 3)
    killed.kill()
    before = len(list((tmp_path / "episodes").glob("*.json")))
    assert before < 12
    code, said = run(url, tmp_path, "--limit", "12").end()
    assert code == 0, said
    assert_whole(tmp_path, 12, paid_again=2)


def test_a_worker_is_killed_and_nothing_is_lost(server: Any, tmp_path: Path) -> None:
    _, url = server()
    running = run(url, tmp_path, "--limit", "12")
    until(tmp_path, 3)
    workers = [
        child
        for child in children(running.process.pid)
        if b"spawn_main" in Path(f"/proc/{child}/cmdline").read_bytes()
    ]
    assert workers
    os.kill(workers[0], signal.SIGKILL)
    code, said = running.end()
    assert code == 0, said
    assert_whole(tmp_path, 12)


def test_the_server_is_killed_and_comes_back(server: Any, tmp_path: Path) -> None:
    process, url = server()
    quick = ("--limit", "8", "--set", "server.tries=2")
    running = run(url, tmp_path, *quick)
    until(tmp_path, 2)
    process.kill()
    code, said = running.end()
    assert code == 3, said
    assert "(try 1 of 2); trying again in 0." in said
    assert "requests in a row, the last with: naughty-1 at http://127.0.0.1:" in said
    assert "run the same command again to continue: " in said
    crashed = [each for each in RunDirectory.open(tmp_path).episodes() if each.error]
    assert len(crashed) <= 2  # not one by one to the last
    port = int(url.rpartition(":")[2].partition("/")[0])
    server(port)
    code, said = run(url, tmp_path, *quick).end()
    assert code == 0, said
    assert_whole(tmp_path, 8)
