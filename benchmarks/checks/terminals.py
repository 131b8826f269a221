"""Runs light command lines with and without a terminal, in the checkout and elsewhere.

    python -m benchmarks.checks.terminals [WORD …]

Each line that holds the given words is run in a pseudo-terminal and without one, in the checkout
and in an empty folder, with relative paths in both. It must end with the same exit code everywhere,
without a traceback; what it writes must be where it was asked for; and without a terminal, its
output must be free of control codes, and JSON where that was asked for. Prints the failures; the
exit code is 1 if there is one.
"""

from __future__ import annotations

import json
import re
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from benchmarks.harness.output import ROOT
from benchmarks.harness.processes import ER_GYM, TerminalRun, run
from benchmarks.harness.tally import Tally, Try, has_words, run_check, tally

_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f]")
_SECONDS = 300.0


@dataclass(frozen=True)
class Line:
    """A command line to try everywhere.

    Attributes:
        words: of it; ``OUT`` stands for a folder, relative to where it is run.
        makes: what it must have written below that folder.
        code: how it must end.
        first: an earlier line whose results it needs, in the same folder.
        keys: what is typed; without a terminal, the input is empty.
        until: of a server: ended by Ctrl-C after these words.
        json: whether its output is JSON.
        quick: whether it is cheap enough for a test.
    """

    words: str
    makes: str = ""
    code: tuple[int, ...] = (0,)
    first: str = ""
    keys: str = ""
    until: str = ""
    json: bool = False
    quick: bool = False


_BENCH = "bench --suite mini --agent oracle --limit 2 --out OUT/run"
_COLLECT = "collect --suite mini --types single_search --limit 1 --no-pictures --out OUT/made"
LINES = (
    Line("--help", quick=True),
    Line("suites"),
    Line("envs", quick=True),
    Line("zoo"),
    Line("zoo show all"),
    Line("player path"),
    Line("doctor", code=(0, 1)),
    Line("tasks show mini --limit 1"),
    Line("tasks stats mini --out OUT/charts", makes="charts"),
    Line("tasks convert mini OUT/mini.jsonl", makes="mini.jsonl"),
    Line("tasks verify OUT/nothing.jsonl", code=(2,), quick=True),
    Line(_BENCH, makes="run"),
    Line("report OUT/run", first=_BENCH),
    Line("report OUT/run --format json", first=_BENCH, json=True),
    Line("report OUT/none", code=(2,), quick=True),
    Line(_COLLECT, makes="made"),
    Line("data stats OUT/made --format json", first=_COLLECT, json=True),
    Line("data verify OUT/made", first=_COLLECT),
    Line("data export OUT/made --to sharegpt --out OUT/sharegpt", "sharegpt", first=_COLLECT),
    Line("render --scene FloorPlan1 --out OUT/room.png", makes="room.png"),
    Line("play --no-window --frames OUT/seen", makes="seen", keys="observe\nquit\n"),
    Line("ladder --config tiny-text --print"),
    Line("ui OUT --port 0 --no-browser", code=(0, 130), until="http://.*\n"),
    Line("match-server --port 0", code=(0, 130), until="http://.*\n"),
    Line("train-rl --config none", code=(2,)),
)


def check(
    words: Sequence[str] = (),
    *,
    quick: bool = False,
    command: Sequence[str] = ER_GYM,
    checkout: bool = True,
) -> Tally:
    """Try all lines, or the quick ones, and print the failures.

    Args:
        words: that a line must hold.
        quick: whether only the cheapest lines are tried.
        command: of er-gym.
        checkout: whether to try them in the checkout, too.
    """
    chosen = (each for each in LINES if (each.quick or not quick) and has_words(each.words, words))
    return tally("terminal lines", _tries(chosen, command, checkout))


def _tries(lines: Iterable[Line], command: Sequence[str], checkout: bool) -> Iterator[Try]:
    for line in lines:
        for where, folder in _places(checkout):
            for terminal in (True, False):
                how = f"{'with' if terminal else 'without'} a terminal, {where}"
                yield f"er-gym {line.words} ({how})", _problems(line, command, folder, terminal)


def _places(checkout: bool) -> Iterator[tuple[str, Path]]:
    """Where commands are run."""
    if checkout:
        yield "in the checkout", ROOT
    with tempfile.TemporaryDirectory() as empty:
        yield "in an empty folder", Path(empty)


def _problems(line: Line, command: Sequence[str], folder: Path, terminal: bool) -> Iterator[str]:
    """What is wrong with one run of a line."""
    out = Path(tempfile.mkdtemp(prefix=".terminals-", dir=folder))
    name = out.name  # relative to the folder
    try:
        if line.first:
            _run(line.first.replace("OUT", name), command, folder, terminal=False)
        done = _run(line.words.replace("OUT", name), command, folder, terminal, line)
        if done.late:
            yield f"it has not ended after {_SECONDS:.0f} s"
        elif done.code not in line.code:
            yield f"exit code {done.code}: {done.text().strip()[-300:]}"
        if "Traceback (most recent call last)" in done.text():
            yield f"a traceback: {done.text()[-300:]}"
        if line.makes and not (out / line.makes).exists():
            yield f"{line.makes} is not there"
        if not terminal:
            raw = "".join(each.text for each in done.said)
            if found := _CONTROL.search(raw):
                yield f"the control code {found[0]!r} without a terminal"
            if line.json and not _is_json(done.text("out")):
                yield f"its output is not JSON: {done.text('out')[:100]!r}"
    finally:
        shutil.rmtree(out)


def _run(
    words: str,
    command: Sequence[str],
    folder: Path,
    terminal: bool,
    line: Line = Line(""),
) -> TerminalRun:
    return run(
        [*command, *words.split()],
        cwd=folder,
        terminal=terminal,
        until=line.until,
        keys=line.keys,
        seconds=_SECONDS,
    )


def _is_json(text: str) -> bool:
    try:
        json.loads(text)
    except ValueError:
        return False
    return True


if __name__ == "__main__":
    run_check(check, __doc__)
