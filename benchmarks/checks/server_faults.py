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
import signal
import subprocess
import sys
import tempfile
import threading
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
from benchmarks.checks.faulty_server import CASES, KEY, Case, FaultyServer
from benchmarks.checks.tally import Tally
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


def main(words: Sequence[str]) -> int:
    """Try all faults; print the failures and their number."""
    tally = check(words)
    print(tally)
    return int(tally.short > 0)


def check(words: Sequence[str], *, with_runs: bool = True) -> Tally:
    """Try the faults and runs whose names hold the words, and print the failures."""
    os.environ[_KEY_FROM] = KEY
    # What a shell starts in the background ignores Ctrl-C, and so would the commands tried here.
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    chosen = [case for case in CASES if all(word in case.name for word in words)]
    began = time.monotonic()
    short = 0
    with _logged() as log, ThreadPoolExecutor(_AT_ONCE) as pool:
        for case, problems in zip(chosen, pool.map(_try, chosen), strict=True):
            short += bool(problems)
            for problem in problems:
                print(f"{case.name}: {problem}", flush=True)
    if KEY in log.getvalue():
        short += 1
        print("the key is in the logs")
    runs = [run for run in RUNS if with_runs and all(word in run.name for word in words)]
    with ThreadPoolExecutor(_RUNS_AT_ONCE) as pool:
        for run, problems in zip(runs, pool.map(_play, runs), strict=True):
            short += bool(problems)
            for problem in problems:
                print(f"er-gym bench, {run.name}: {problem}", flush=True)
    return Tally("server faults", len(chosen) + len(runs), short, time.monotonic() - began)


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
    with FaultyServer(case.fault) as server, tempfile.TemporaryDirectory() as directory:
        return list(_problems(case, server, Path(directory)))


def _problems(case: Case, server: FaultyServer, directory: Path) -> Iterator[str]:
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


def _wrong_ledger(directory: Path, server: FaultyServer, replies: int) -> Iterator[str]:
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
        says: the texts that it should print, on either stream.
        seconds: its time limit.
        crashed: how many episodes may be recorded as crashed.
        good_first: how many requests are answered well first.
        interrupt: the output after which it gets Ctrl-C; then it has six seconds to end.
    """

    name: str
    fault: str
    options: tuple[str, ...] = ()
    says: str = "the same command"
    seconds: float = 60.0
    crashed: int = 0
    good_first: int = 0
    interrupt: str = ""

    @property
    def code(self) -> int:
        """The exit code that it should have."""
        return 130 if self.interrupt else 3


_QUICK = ("--set", "server.tries=2", "--set", "server.timeout=2")
_ALONE = ("--concurrency", "1")
RUNS = [
    Run("a dead server", "hangs up", _QUICK, says="requests in a row", crashed=2, good_first=6),
    Run(
        "a dead server, one by one",
        "answers 500",
        (*_QUICK, *_ALONE),
        says="requests in a row",
        crashed=2,
    ),
    Run("a server that hangs", "hangs before the head", _QUICK, says="nothing has answered yet"),
    Run(
        "minutes end a request",
        "hangs before the head",
        ("--max-minutes", "0.05"),
        says="0.05 minutes are over",
    ),
    Run(
        "minutes end a drip",
        "drips the body",
        ("--max-minutes", "0.05"),
        says="0.05 minutes are over",
    ),
    Run(
        "a wait beyond the minutes",
        "answers 503, Retry-After '300'",
        ("--max-minutes", "4"),
        says="asks to wait 5 min, and",
    ),
    Run(
        "a long wait without minutes",
        "answers 503, Retry-After '300'",
        (),
        says="give --max-minutes",
    ),
    Run(
        "a long wait that the minutes allow",
        "answers 503, Retry-After '300'",
        ("--max-minutes", "90"),
        says="trying again in 5 min",
        interrupt="trying again in 5 min",
    ),
    Run(
        "Ctrl-C while it hangs",
        "hangs before the head",
        ("--set", "server.timeout=120"),
        says="interrupted",
        interrupt="no answer for",
    ),
    Run(
        "tokens that are not counted",
        "sends no token counts",
        ("--max-tokens", "20000"),
        says="the budget is spent",
    ),
    Run(
        "tokens given back",
        "counts -1000000 of both",
        ("--max-usd", "0.02"),
        says="the budget is spent",
    ),
    Run(
        "answers that are rejected",
        "sends choices []",
        ("--max-usd", "0.02", "--set", "server.tries=9"),
        says="the budget is spent",
    ),
]


def _play(run: Run) -> list[str]:
    return list(_run_problems(run))


def _run_problems(run: Run) -> Iterator[str]:
    fault = next(case.fault for case in CASES if case.name == run.fault)
    with FaultyServer(fault, run.good_first) as server, tempfile.TemporaryDirectory() as directory:
        command = [
            sys.executable, "-m", "benchmarks.cli", "bench", "--suite", "mini", "--limit", "40",
            "--agent", "openai:m", "--agent-config", "text", "--base-url", server.url,
            "--set", f"server.key_from={_KEY_FROM}", "--set", "prices.prompt=2",
            "--set", "prices.completion=10", "--out", directory, *run.options,
        ]  # fmt: skip
        began = time.monotonic()
        process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        assert process.stdout is not None
        end = threading.Timer(run.seconds + 30, process.kill)
        end.start()
        said, interrupted = "", 0.0
        for line in process.stdout:
            said += line
            if run.interrupt and run.interrupt in line and not interrupted:
                interrupted = time.monotonic()
                process.send_signal(signal.SIGINT)
        process.wait()
        end.cancel()
        ended = time.monotonic()
        if interrupted and ended - interrupted > 6:
            yield f"took {ended - interrupted:.1f} s to end after Ctrl-C"
        if ended - began > run.seconds:
            yield f"took {ended - began:.1f} s"
        if process.returncode != run.code:
            yield f"ended with {process.returncode}, not {run.code}: {said[-1500:]}"
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
    sys.exit(main(sys.argv[1:]))
