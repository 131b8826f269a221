"""Runs ``er-gym`` with hundreds of bad command lines.

    python -m benchmarks.checks.command_lines [WORD …]

Each line of :mod:`benchmarks.checks.bad_commands` that holds the given words is run in an empty
folder of its own. For each line, the exit code must be right. A few lines on stderr must say why,
without a traceback or terminal control codes. The command must end in time, with less than 500 MB
of memory, and it must leave no files or processes and change no file. Most lines are run by the
command's own entry point in a fork of this process, which has imported the command already; every
tenth is run as a process from its start. Prints the failures. The exit code is 1 if there is one.
"""

from __future__ import annotations

import contextlib
import math
import os
import re
import resource
import shutil
import socket
import stat
import sys
import tempfile
import time
import traceback
from collections.abc import Generator, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import benchmarks.vlm_run  # noqa: F401  # imported once, not in each fork
from benchmarks.checks.bad_commands import Line, lines
from benchmarks.checks.bad_files import make
from benchmarks.cli.main import main as er_gym
from benchmarks.harness.output import ROOT
from benchmarks.harness.processes import ER_GYM, kill, members
from benchmarks.harness.tally import Tally, Try, has_words, run_check, tally

_AT_ONCE = 2
_REAL_EVERY = 10
_SECONDS, _CPU_SECONDS = 120.0, 20.0
"""The time limits of a line in seconds, on a busy machine and of processor time; most take 0.1 s.
"""
_GRACE = 5.0
"""Seconds that a command's helper processes, such as multiprocessing's, have to end after it."""
_MEGABYTES = 500
_LINES, _CHARACTERS = 3, 2_500
"""That stderr may have."""
_RAW = re.compile(b"[\x00-\x08\x0b-\x1f\x7f]|\xc2[\x80-\x9f]|\xe2\x80[\xa8-\xae]")
"""Terminal control characters in UTF-8, except tab and newline."""
_SAYS_WHY = re.compile(r"(loading [^\n]+\n)*er-gym: ")
"""How stderr begins if it says why: outside a terminal, imports that take long are told first."""


def check(words: Sequence[str], *, at_least: int | None = None) -> Tally:
    """Try all lines that hold the words, or a number of lines of every kind, and print the
    failures.
    """
    chosen = [line for line in lines() if has_words(str(line), words)]
    return tally("command lines", _tries(chosen if at_least is None else _choice(chosen, at_least)))


def _tries(chosen: Sequence[Line]) -> Iterator[Try]:
    with tempfile.TemporaryDirectory() as directory, _taken_port() as port:
        top = Path(directory)
        make(top / "files")
        before = _state(top / "files")
        with contextlib.closing(_ends(chosen, top, port)) as ends:
            for ended in ends:
                now = _state(top / "files")
                changed = [f"changed files: {sorted(now ^ before)[:3]}"] if now != before else []
                before = now
                yield f"er-gym {str(ended.line)!r}", (*_problems(ended), *changed)
                shutil.rmtree(ended.folder, ignore_errors=True)


def _choice(every: Sequence[Line], at_least: int) -> list[Line]:
    """About this many lines: the same share of each kind, and at least one."""
    kinds: dict[tuple[str, ...], list[Line]] = {}
    for line in every:
        options = (word.partition("=")[0] for word in line.words if word.startswith("--"))
        kinds.setdefault((*line.words[:2], *options), []).append(line)
    step = max(1.0, len(every) / at_least)
    return [
        of_kind[int(place * step)]
        for of_kind in kinds.values()
        for place in range(math.ceil(len(of_kind) / step))
    ]


@dataclass(frozen=True)
class _Ended:
    """A line that has been run.

    Attributes:
        line: which.
        folder: with ``work``, where it was run, its home, ``out`` and ``err``.
        code: of its end; below 0 the signal that ended it.
        seconds, cpu_seconds, megabytes: that it took.
        left: whether some of its processes had to be killed.
    """

    line: Line
    folder: Path
    code: int
    seconds: float
    cpu_seconds: float
    megabytes: int
    left: bool


@contextlib.contextmanager
def _taken_port() -> Iterator[int]:
    with socket.socket() as listening:
        listening.bind(("127.0.0.1", 0))
        listening.listen()
        yield listening.getsockname()[1]


def _ends(chosen: Sequence[Line], top: Path, port: int) -> Generator[_Ended, None, None]:
    """Run all, a few at once."""
    running: dict[int, tuple[Line, Path, float]] = {}
    try:
        yield from _ends_of(list(enumerate(chosen))[::-1], running, top, port)
    finally:  # Ctrl-C too
        for pid in running:
            kill(pid)
            os.waitpid(pid, 0)
            for member, _ in members(pid):
                kill(member)


def _ends_of(
    waiting: list[tuple[int, Line]],
    running: dict[int, tuple[Line, Path, float]],
    top: Path,
    port: int,
) -> Iterator[_Ended]:
    while waiting or running:
        while waiting and len(running) < _AT_ONCE:
            number, line = waiting.pop()
            folder = top / str(number)
            for name in ("work", "home", "tmp"):
                (folder / name).mkdir(parents=True)
            for name in line.holds:
                shutil.copy(top / "files" / name, folder / "work" / name)
            # work/../files is where lines look for files
            (folder / "files").symlink_to(top / "files")
            pid = os.fork()
            if pid == 0:
                _run(line, folder, port, real=number % _REAL_EVERY == 0)
            running[pid] = line, folder, time.monotonic()
        time.sleep(0.005)
        for pid, (line, folder, start) in list(running.items()):
            seconds = time.monotonic() - start
            if seconds > _SECONDS:
                kill(pid)
            done, status, used = os.wait4(pid, 0 if seconds > _SECONDS else os.WNOHANG)
            if done:
                del running[pid]
                code = os.waitstatus_to_exitcode(status)
                left = _left_behind(pid)
                cpu = used.ru_utime + used.ru_stime
                yield _Ended(line, folder, code, seconds, cpu, used.ru_maxrss >> 10, left)


def _left_behind(pid: int) -> bool:
    """Kill the remaining processes of a command's session; returns whether there were any."""
    end = time.monotonic() + _GRACE
    while left := [*members(pid)]:
        if time.monotonic() > end:
            for member, _ in left:
                kill(member)
            return True
        time.sleep(0.02)
    return False


def _run(line: Line, folder: Path, port: int, real: bool) -> NoReturn:
    """Run a line in this process, a fork, and end it."""
    code = 70
    try:
        os.setsid()
        (folder / "in").write_text(line.says)
        for number, (name, flags) in enumerate(
            (
                ("in", os.O_RDONLY),
                ("out", os.O_CREAT | os.O_WRONLY),
                ("err", os.O_CREAT | os.O_WRONLY),
            )
        ):
            os.dup2(os.open(folder / name, flags, 0o644), number)
        os.chdir(folder / "work")
        os.environ |= {
            "HOME": str(folder / "home"),
            "TMPDIR": str(folder / "tmp"),
            "PYTHONPATH": f"{ROOT}:{folder / 'files'}",
            "COLUMNS": "200",
        }
        for name in ("OPENAI_API_KEY", "ER_GYM_HOME", "XDG_DATA_HOME"):
            os.environ.pop(name, None)
        tempfile.tempdir = None
        resource.setrlimit(resource.RLIMIT_FSIZE, (1 << 28, 1 << 28))
        words = [word.replace("{port}", str(port)) for word in line.words]
        if real:
            os.execv(sys.executable, [*ER_GYM, *words])
        sys.path.insert(0, str(folder / "files"))
        try:
            er_gym(words)
        except SystemExit as ended:
            code = ended.code if isinstance(ended.code, int) else 1
    except BaseException:  # as a process of its own would end
        traceback.print_exc()
        code = 1
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)


def _problems(ended: _Ended) -> Iterator[str]:
    out, err = ((ended.folder / name).read_bytes() for name in ("out", "err"))
    said = err.decode(errors="replace")
    if ended.seconds > _SECONDS:
        yield f"did not end in {_SECONDS:.0f} s"
    elif ended.code not in ended.line.codes:
        yield f"ended with {ended.code}, not {sorted(ended.line.codes)}: {said[-300:]!r}"
    if ended.code and not _SAYS_WHY.match(said) and ended.seconds <= _SECONDS:
        yield f"does not say why: {said[:200]!r}"
    if b"Traceback" in out + err:
        yield f"a traceback: {said[-300:]!r}"
    if len(said.splitlines()) > _LINES or len(said) > _CHARACTERS:
        yield f"{len(said.splitlines())} lines, {len(said)} characters: {said[:300]!r}"
    for name, data in (("stdout", out), ("stderr", err)):
        if raw := _RAW.search(data):
            yield f"{name} has {raw[0]!r}, a terminal control character"
    if ended.cpu_seconds > _CPU_SECONDS:
        yield f"took {ended.cpu_seconds:.0f} s of a processor"
    if ended.megabytes > _MEGABYTES:
        yield f"took {ended.megabytes} MB"
    if ended.left:
        yield "left processes behind"
    if ended.code:
        yield from _leavings(ended)


def _leavings(ended: _Ended) -> Iterator[str]:
    """The files that a refused command left or changed."""
    work = ended.folder / "work"
    files = ended.folder / "files"
    found = {str(path.relative_to(work)) for path in work.rglob("*")}
    if more := found - {*ended.line.holds}:
        yield f"left {sorted(more)[:3]}"
    for name in ended.line.holds:
        if (work / name).read_bytes() != (files / name).read_bytes():
            yield f"overwrote {name}"
    for name in ("home", "tmp"):
        rest = [path.name for path in (ended.folder / name).rglob("*") if path.is_file()]
        # matplotlib keeps a list of fonts.
        if files_left := [each for each in rest if not each.startswith("fontlist-")]:
            yield f"left {sorted(files_left)[:3]} in its {name} folder"


def _state(folder: Path) -> set[tuple[str, int, int]]:
    """Name, size and time of the files in a folder, and the names of folders in it."""
    found = set()
    for place, names, files in os.walk(folder):
        for name in (*names, *files):
            state = os.lstat(os.path.join(place, name))
            # A folder in which a lock was held for a moment has another time.
            told = (0, 0) if stat.S_ISDIR(state.st_mode) else (state.st_size, state.st_mtime_ns)
            found.add((os.path.join(place, name), *told))
    return {each for each in found if "__pycache__" not in each[0]}


if __name__ == "__main__":
    run_check(check, __doc__)
