"""Starts a server in its own process, waits until it is ready, and always ends it."""

from __future__ import annotations

import contextlib
import http.client
import os
import subprocess
import sys
import threading
import time
import urllib.request
from collections import deque
from collections.abc import Callable, Mapping, Sequence

from benchmarks.cli import process_guard as guard

LINES = 20
"""How many of its last lines are kept."""

_BETWEEN = 0.25  # seconds between two looks whether it is ready
_ONE_LOOK = 5.0  # seconds that an answer may take
_REST = 2.0  # seconds in which what was written by an ended server is read

# A proxy for the internet cannot reach this machine's own addresses.
_DIRECT = urllib.request.build_opener(urllib.request.ProxyHandler({}))


class ServerError(Exception):
    """The server ended, or was not ready in time."""


class ServerProcess:
    """A context manager that runs a server; it has ended when the context has.

    It runs under :mod:`benchmarks.cli.process_guard`: if this process is killed, the server ends
    too, with all its child processes.

    Args:
        argv: the command.
        environment: variables besides those of this process.
        on_line: called with each line that it writes, in a thread of its own.
    """

    def __init__(
        self,
        argv: Sequence[str],
        environment: Mapping[str, str] | None = None,
        on_line: Callable[[str], None] = lambda line: None,
    ) -> None:
        self._lines: deque[str] = deque(maxlen=LINES)
        self._on_line = on_line
        self._process = subprocess.Popen(
            [sys.executable, "-I", guard.__file__, *argv],
            env={**os.environ, "PYTHONUNBUFFERED": "1", **(environment or {})},
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            encoding="utf-8",
            errors="replace",
            start_new_session=True,  # Ctrl-C is for this process, which then ends the server
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def __enter__(self) -> ServerProcess:
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()

    @property
    def last_lines(self) -> list[str]:
        """The last lines that it wrote, without empty ones."""
        return list(self._lines)

    def wait_until_ready(
        self,
        url: str,
        seconds: float,
        tell: Callable[[float, str], None] = lambda since, line: None,
    ) -> float:
        """Wait until an address answers with 200; the seconds that it took.

        Args:
            url: the address.
            seconds: how long to wait at most.
            tell: called again and again with the seconds so far and the last line.

        Raises:
            ServerError: it ended, or the time has passed.
        """
        start = time.monotonic()
        while True:
            since = time.monotonic() - start
            self._still_runs(f"before it was ready, after {since:.0f} s")
            if _answers(url):
                return since
            if since >= seconds:
                raise ServerError(f"the server was not ready after {seconds:g} s")
            tell(since, self._lines[-1] if self._lines else "")
            time.sleep(_BETWEEN)

    def wait(self) -> None:
        """Wait until it ends by itself.

        Raises:
            ServerError: it has; always.
        """
        self._process.wait()
        self._still_runs("by itself")

    def stop(self) -> None:
        """End it, and return when it has ended."""
        assert self._process.stdin is not None
        with contextlib.suppress(OSError):
            self._process.stdin.close()
        self._process.wait()
        self._reader.join(_REST)

    def _still_runs(self, when: str) -> None:
        code = self._process.poll()
        if code is not None:
            self._reader.join(_REST)
            raise ServerError(f"the server ended {when}, with exit code {code}")

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            if line.strip():
                self._lines.append(line.rstrip())
                with contextlib.suppress(OSError):  # nobody listens; the server must not wait
                    self._on_line(line.rstrip())


def _answers(url: str) -> bool:
    try:
        with _DIRECT.open(url, timeout=_ONE_LOOK) as answer:
            return bool(answer.status == 200)
    except (OSError, http.client.HTTPException):
        return False
