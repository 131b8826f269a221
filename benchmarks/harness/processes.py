"""Runs a command in a pseudo-terminal, or without one, and says when it printed what.

Also: the command ``er-gym`` of this checkout, and the processes of a session.
"""

from __future__ import annotations

import contextlib
import fcntl
import math
import os
import pty
import re
import selectors
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

ER_GYM = (sys.executable, "-m", "benchmarks.cli")
"""The command of this checkout."""
ROWS, COLUMNS = 40, 100
_ESCAPES = re.compile(r"\x1b(?:\[[0-?]*[ -/]*[@-~]|\][^\x07\x1b]*(?:\x07|\x1b\\)|[@-Z\\-_=>78])")
_GRACE = 20.0
"""Seconds that a command has to end after a signal."""


@dataclass(frozen=True)
class PrintedText:
    """What a command printed at once.

    Attributes:
        at: seconds after its start.
        stream: ``out`` or ``err``; a terminal shows both as ``out``.
        text: with the terminal's control codes.
    """

    at: float
    stream: str
    text: str

    @property
    def shown(self) -> str:
        """The text without control codes and space: what a reader sees."""
        return "".join(_ESCAPES.sub("", self.text).split())


@dataclass
class TerminalRun:
    """A command that has been run.

    Attributes:
        code: of its end; below 0 the signal that ended it.
        seconds: from its start to its end, or until it said what was waited for.
        said: all that it printed, in order.
        late: whether it had to be ended, since it took longer than allowed.
        ending: seconds from Ctrl-C to its end; 0 if none was sent.
    """

    code: int = 0
    seconds: float = 0.0
    ending: float = 0.0
    said: list[PrintedText] = field(default_factory=list)
    late: bool = False

    def text(self, stream: str = "") -> str:
        """All text of a stream, or of both in order, without control codes."""
        told = (each.text for each in self.said if stream in ("", each.stream))
        return _ESCAPES.sub("", "".join(told)).replace("\r\n", "\n")

    @property
    def news(self) -> list[PrintedText]:
        """What differs from what was printed before."""
        shown = [each for each in self.said if each.shown]
        return [
            each
            for before, each in zip(["", *(one.shown for one in shown)], shown, strict=False)
            if each.shown != before
        ]

    @property
    def first(self) -> float:
        """Seconds until the first word; those of the whole run, if there was none."""
        return self.news[0].at if self.news else self.seconds

    @property
    def silence(self) -> tuple[float, str]:
        """The longest time without news after the first word, seconds, and what it followed."""
        told = [(each.at, each.shown) for each in self.news if each.at < self.seconds]
        ends = [at for at, _ in told[1:]] + [self.seconds]
        gaps = ((end - at, text) for (at, text), end in zip(told, ends, strict=True))
        return max(gaps, default=(0.0, ""))


def run(
    argv: Sequence[str],
    *,
    cwd: Path,
    terminal: bool = True,
    environment: Mapping[str, str] | None = None,
    until: str = "",
    keys: str = "",
    seconds: float = 300.0,
    idle: float = math.inf,
) -> TerminalRun:
    """Run a command to its end, and end what it started and left behind.

    Args:
        argv: the command.
        cwd: where.
        terminal: whether its input and output are a pseudo-terminal; without one, the input is
            empty and the outputs are pipes.
        environment: all its variables; :func:`plain_environment` by default.
        until: a regular expression; once the output has it, Ctrl-C is sent. For servers.
        keys: what is typed at once.
        seconds: after these it is killed.
        idle: after so many seconds in which none of its processes had anything to do, too.
    """
    variables = plain_environment() if environment is None else environment
    start = time.monotonic()
    process, streams = _start(argv, cwd, variables, keys, terminal)
    done = TerminalRun()
    wanted = re.compile(until) if until else None
    try:
        with selectors.DefaultSelector() as selector:
            for descriptor, name in streams.items():
                selector.register(descriptor, selectors.EVENT_READ, name)
            interrupted = busy = 0.0
            while selector.get_map():
                since = time.monotonic() - start
                if idle == math.inf or any(state in "RD" for _, state in members(process.pid)):
                    busy = since
                limit = interrupted + _GRACE if interrupted else seconds
                if since > limit or since > busy + idle:
                    done.late = True
                    break
                for key, _ in selector.select(timeout=0.5):
                    data = _read(key.fd)
                    if not data:
                        selector.unregister(key.fd)
                        continue
                    text = data.decode(errors="replace")
                    done.said.append(PrintedText(time.monotonic() - start, key.data, text))
                if wanted and not interrupted and wanted.search(done.text()):
                    done.seconds = interrupted = time.monotonic() - start
                    end_group(process.pid, signal.SIGINT)
    finally:
        if process.poll() is None and not done.late:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(_GRACE)
        if process.poll() is None:
            done.late = True
        end_group(process.pid)
        done.code = process.wait()
        for descriptor in streams:
            os.close(descriptor)
    whole = time.monotonic() - start
    done.ending = whole - done.seconds if done.seconds else 0.0
    done.seconds = done.seconds or whole
    return done


def plain_environment(**more: str) -> dict[str, str]:
    """This process's variables without those that decide how a command prints, and some more."""
    left_out = ("COLUMNS", "LINES", "NO_COLOR", "FORCE_COLOR")
    kept = {name: value for name, value in os.environ.items() if name not in left_out}
    return {**kept, "TERM": "xterm-256color", **more}


def end_group(leader: int, number: int = signal.SIGKILL) -> None:
    """Send a signal to a command and all that it started, if there is any of it."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(leader, number)


def kill(pid: int) -> None:
    """Kill a process by SIGKILL; nothing happens if it has ended."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGKILL)


def members(session: int) -> Iterator[tuple[int, str]]:
    """The processes of a session and their states, as ``/proc`` names them; without zombies."""
    for file in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            pid, _, rest = file.read_text().partition(" (")
            state, _, _, its_session, *_ = rest.rpartition(") ")[2].split()
            if int(its_session) == session and state not in "ZX":
                yield int(pid), state


def _start(
    argv: Sequence[str], cwd: Path, variables: Mapping[str, str], keys: str, terminal: bool
) -> tuple[subprocess.Popen[bytes], dict[int, str]]:
    """The process, and what to read its outputs from."""
    if terminal:
        ours, theirs = pty.openpty()
        fcntl.ioctl(ours, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, COLUMNS, 0, 0))
        read, ends = {ours: "out"}, [theirs, theirs, theirs]
    else:
        (out, theirs_out), (err, theirs_err) = os.pipe(), os.pipe()
        nothing = os.open(os.devnull, os.O_RDONLY)
        read, ends = {out: "out", err: "err"}, [nothing, theirs_out, theirs_err]
    made: Callable[..., subprocess.Popen[bytes]] = subprocess.Popen
    process = made(
        argv,
        cwd=cwd,
        env=variables,
        stdin=ends[0],
        stdout=ends[1],
        stderr=ends[2],
        start_new_session=True,
        preexec_fn=_take_terminal if terminal else _obey_ctrl_c,
    )
    for descriptor in {*ends}:
        os.close(descriptor)
    if terminal and keys:  # not shown, so that what the command says comes first
        settings = termios.tcgetattr(ours)
        settings[3] &= ~termios.ECHO
        termios.tcsetattr(ours, termios.TCSANOW, settings)
        os.write(ours, keys.encode())
    return process, read


def _obey_ctrl_c() -> None:
    """A shell's background jobs ignore Ctrl-C, and so would what they start."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def _take_terminal() -> None:
    _obey_ctrl_c()
    fcntl.ioctl(0, termios.TIOCSCTTY, 0)


def _read(descriptor: int) -> bytes:
    try:
        return os.read(descriptor, 1 << 16)
    except OSError:  # the terminal's other side is closed
        return b""
