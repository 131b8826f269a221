"""Runs a vision-language agent against a server that fails in a hundred ways.

    python -m benchmarks.checks.server_faults [WORD …]

Each fault of :mod:`benchmarks.checks.faulty_server` whose name holds a given word meets three
requests of two tries each. Each request must end in time, in a way that the fault allows, with
messages of one line. Each failed try must be reported. Each accepted answer must be in the ledger,
with a cost of 0 or more. The key must not be in any file, message, exception or log. Then some
faults are tried on whole runs of ``er-gym bench``. Prints the failures. The exit code is 1 if there
is one.
"""

from __future__ import annotations

import contextlib
import io
import json
import logging
import math
import os
import re
import tempfile
import time
import traceback
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from agents.factory import AgentFactory
from agents.vlm.chat import Message, ModelError, Picture, Reply
from agents.vlm.clients.budget import Budget
from agents.vlm.clients.supervisor import ServerEvent
from agents.vlm.settings import AgentSettings
from benchmarks.checks.faulty_server import CASES, KEY, Case
from benchmarks.harness import processes
from benchmarks.harness.chat_server import ChatServer
from benchmarks.harness.output import ROOT
from benchmarks.harness.processes import ER_GYM
from benchmarks.harness.tally import Tally, Try, has_words, run_check, tally
from er_gym.rollout.agent import CannotGoOn
from er_gym.rollout.run_directory import SPENDING

_KEY_FROM = "ER_GYM_CHECK_KEY"
_FAILED_TRIES = ("retry", "failed", "refused", "probe", "stopped")
_TIMEOUT = 0.7
_IN_TIME = 14.0  # seconds for three requests of two tries each, on a busy machine
_AT_ONCE, _RUNS_AT_ONCE = 6, 2
_ASKED = (
    Message("system", ("You are a robot.",)),
    Message("user", ("Find the mug.", Picture(b"jpeg", "image/jpeg", 300, 300))),
)


def check(words: Sequence[str], *, with_runs: bool = True) -> Tally:
    """Try the faults and runs whose names hold the words, and print the failures."""
    os.environ[_KEY_FROM] = KEY
    return tally("server faults", _tries(words, with_runs))


def _tries(words: Sequence[str], with_runs: bool) -> Iterator[Try]:
    chosen = [case for case in CASES if has_words(case.name, words)]
    with _logged() as log, ThreadPoolExecutor(_AT_ONCE) as pool:
        for case, problems in zip(chosen, pool.map(_try, chosen), strict=True):
            yield case.name, problems
    yield "the logs", ["the key is in them"] if KEY in log.getvalue() else []
    runs = [run for run in RUNS if with_runs and has_words(run.name, words)]
    with ThreadPoolExecutor(_RUNS_AT_ONCE) as pool:
        for run, problems in zip(runs, pool.map(_play, runs), strict=True):
            yield f"er-gym bench, {run.name}", problems


@contextlib.contextmanager
def _logged() -> Iterator[io.StringIO]:
    """Collects all log records, in full."""
    log = io.StringIO()
    handler = logging.StreamHandler(log)
    root = logging.getLogger()
    before, others = root.level, root.handlers[:]
    root.handlers[:] = [handler]  # the others would print it all
    root.setLevel(logging.DEBUG)
    try:
        yield log
    finally:
        root.setLevel(before)
        root.handlers[:] = others


# -- requests --------------------------------------------------------------------------------------


def _try(case: Case) -> list[str]:
    with ChatServer(case.fault) as server, tempfile.TemporaryDirectory() as directory:
        return list(_problems(case, server, Path(directory)))


def _problems(case: Case, server: ChatServer, directory: Path) -> Iterator[str]:
    settings = AgentSettings.model_validate(
        {
            "server": {
                "base_url": f"{server.url}?tenant=a",
                "key_from": _KEY_FROM,
                "timeout": _TIMEOUT,
                "tries": 2,
            },
            "prices": {"prompt": 2, "cached_prompt": 1, "completion": 10},
            "sampling": {"max_tokens": 100},
        }
    )
    server_events: list[ServerEvent] = []
    began = time.monotonic()
    speaker = AgentFactory("openai:m", settings, directory, Budget(max_usd=1000))
    speaker.supervisor.show = server_events.append
    client = speaker.client
    ends, told = [], []
    for seed in range(3):
        try:
            reply = client.reply(_ASKED, seed)
            ends.append("reply")
            told.append(repr(reply))
            yield from _wrong_reply(reply)
        except (ModelError, CannotGoOn) as error:
            ends.append("stopped" if isinstance(error, CannotGoOn) else "failed")
            told += [str(error), *_chain(error)]
            if len(str(error).splitlines()) != 1 or not str(error).isprintable():
                yield f"a message that is not one line: {error!r}"
            if len(str(error)) > 1200:
                yield f"a message of {len(str(error))} characters"
        except Exception:  # this check looks for any other exception
            yield f"an unexpected error: {traceback.format_exc()}"
    speaker.close()
    seconds = time.monotonic() - began
    if seconds > _IN_TIME:
        yield f"took {seconds:.1f} s"
    if not set(ends) <= case.ends:
        yield f"ended with {ends}, not with {sorted(case.ends)}: {told[-1]}"
    yield from _wrong_ledger(directory, server, ends.count("reply"))
    kept = _lines(directory / "server-events.jsonl")
    events = [ServerEvent.model_validate_json(line) for line in kept]
    failed = server.count - ends.count("reply")
    said = sum(each.event in _FAILED_TRIES for each in events)
    if said != failed:
        yield f"{failed} tries failed, and {said} were reported: {[str(each) for each in events]}"
    told += [str(each) for each in server_events]
    if any(KEY in each for each in told):
        yield f"the key is told: {next(each for each in told if KEY in each)}"
    for file in directory.rglob("*"):
        if file.is_file() and KEY.encode() in file.read_bytes():
            yield f"the key is in {file.name}"


def _chain(error: BaseException | None) -> Iterator[str]:
    """An exception and all its causes and contexts, even suppressed ones."""
    while error is not None:
        yield repr(error) + repr(vars(error))
        error = error.__cause__ or error.__context__


def _wrong_reply(reply: Reply) -> Iterator[str]:
    used = reply.usage
    counts = (used.prompt, used.completion, used.cached, used.reasoning)
    if not (used.prompt > 0 <= min(counts) and used.cached <= used.prompt < 100_000):
        yield f"impossible tokens: {used}"
    if not 0 < reply.cost < 1:
        yield f"an impossible cost: {reply.cost}"


def _wrong_ledger(directory: Path, server: ChatServer, replies: int) -> Iterator[str]:
    entries = [json.loads(line) for line in _lines(directory / SPENDING)]
    if sum(not each["rejected"] for each in entries) != replies + server.probed:
        yield f"{replies} replies, and in the ledger: {entries}"
    if len(entries) < server.accepted:
        yield f"{server.accepted} answers were accepted and {len(entries)} are in the ledger"
    for each in entries:
        counts = [each[name] for name in ("prompt", "completion", "cached", "reasoning")]
        if min(counts) < 0 or each["prompt"] < 1 or not 0 < each["cost"] < math.inf:
            yield f"an impossible entry: {each}"


def _lines(file: Path) -> list[str]:
    return [line for line in file.read_text().split("\n") if line] if file.exists() else []


# -- runs ------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Run:
    """A run of the command against a faulty server.

    Attributes:
        name: of the run.
        fault: the name of the fault.
        options: of the command.
        says: the text that it should print, on either stream.
        seconds: its time limit.
        crashed: how many episodes may be recorded as crashed.
        good_first: how many requests are answered well first.
        interrupt: the output after which it gets Ctrl-C; then it has six seconds to end.
    """

    name: str
    fault: str
    options: str
    says: str
    seconds: float = 60.0
    crashed: int = 0
    good_first: int = 0
    interrupt: str = ""

    @property
    def code(self) -> int:
        """The exit code that it should have."""
        return 130 if self.interrupt else 3


_QUICK = "--set server.tries=2 --set server.timeout=2"
_HANGS, _LONG_WAIT = "hangs before the head", "answers 503, Retry-After '300'"
_DEAD, _SPENT, _OVER = "requests in a row", "the budget is spent", "0.05 minutes are over"
_AGAIN = "trying again in 5 min"
RUNS = [
    Run("a dead server", "hangs up", _QUICK, _DEAD, crashed=2, good_first=6),
    Run("a dead server, one by one", "answers 500", f"{_QUICK} --concurrency 1", _DEAD, crashed=2),
    Run("a server that hangs", _HANGS, _QUICK, "nothing has answered yet"),
    Run("minutes end a request", _HANGS, "--max-minutes 0.05", _OVER),
    Run("minutes end a drip", "drips the body", "--max-minutes 0.05", _OVER),
    Run("a wait beyond the minutes", _LONG_WAIT, "--max-minutes 4", "asks to wait 5 min, and"),
    Run("a long wait without minutes", _LONG_WAIT, "", "give --max-minutes"),
    Run(
        "a long wait that the minutes allow",
        _LONG_WAIT,
        "--max-minutes 90",
        _AGAIN,
        interrupt=_AGAIN,
    ),
    Run(
        "Ctrl-C while it hangs",
        _HANGS,
        "--set server.timeout=120",
        "interrupted",
        interrupt="no answer for",
    ),
    Run("tokens that are not counted", "sends no token counts", "--max-tokens 20000", _SPENT),
    Run("tokens given back", "counts -1000000 of both", "--max-usd 0.02", _SPENT),
    Run(
        "answers that are rejected",
        "sends choices []",
        "--max-usd 0.02 --set server.tries=9",
        _SPENT,
    ),
]


def _play(run: Run) -> list[str]:
    return list(_run_problems(run))


def _run_problems(run: Run) -> Iterator[str]:
    fault = next(case.fault for case in CASES if case.name == run.fault)
    with ChatServer(fault, run.good_first) as server, tempfile.TemporaryDirectory() as directory:
        command = [
            *ER_GYM, "bench", "--suite", "mini", "--limit", "40",
            "--agent", "openai:m", "--agent-config", "text", "--base-url", server.url,
            "--set", f"server.key_from={_KEY_FROM}", "--set", "prices.prompt=2",
            "--set", "prices.completion=10", "--out", directory, *run.options.split(),
        ]  # fmt: skip
        until = re.escape(run.interrupt)
        done = processes.run(
            command, cwd=ROOT, terminal=False, until=until, seconds=run.seconds + 30
        )
        said = done.text()
        if done.ending > 6:
            yield f"took {done.ending:.1f} s to end after Ctrl-C"
        if done.seconds + done.ending > run.seconds:
            yield f"took {done.seconds + done.ending:.1f} s"
        if done.code != run.code:
            yield f"ended with {done.code}, not {run.code}: {said[-1500:]}"
        if run.says not in said:
            yield f"does not say {run.says!r}: {said[-1500:]}"
        if "Traceback" in said or KEY in said:
            yield f"prints what it should not: {said[-1500:]}"
        episodes = [
            json.loads(each.read_text()) for each in Path(directory).glob("episodes/*.json")
        ]
        crashed = sum(bool(each["error"]) for each in episodes)
        if crashed > run.crashed:
            yield f"{crashed} of {len(episodes)} episodes crashed"


if __name__ == "__main__":
    run_check(check, __doc__)
