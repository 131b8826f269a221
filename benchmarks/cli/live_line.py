"""The line at the bottom of a terminal that says what a command is doing.

It is drawn from a thread of its own, so that it goes on during imports and calls that take long.
Whatever anybody prints meanwhile, a library too, takes its place: on stderr until the next look, on
stdout for good, since results have begun then. Commands use :mod:`benchmarks.cli.activity`.
"""

from __future__ import annotations

import contextlib
import os
import sys
import threading
import time
from collections.abc import Callable, Iterator
from typing import Any, TextIO

_DELAY = 0.15
"""Seconds after which the line appears; what ends sooner shows none."""
_PERIOD = 0.25
"""Seconds between two looks at whether the line has changed."""
_COLUMNS = 80
"""The width of a terminal that does not tell its own."""
_ERASE = "\r\x1b[2K"


class Line:
    """A line of the terminal behind ``sys.stderr``."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._what = ""
        self._count: Callable[[], str] | None = None
        self._since = 0.0
        self._drawn = ""
        self._stream: TextIO = sys.stderr
        self._ended: threading.Event | None = None
        self._holders = 0
        # Kept for good: print() of Python 3.10-3.12 holds no reference to the stream that it writes
        # to, and it is in the midst of it when the line ends.
        self._printing: list[_Printing] = []

    def show(self, what: str, count: Callable[[], str] | None) -> None:
        """Show this from now on, until :meth:`end`.

        Args:
            what: in words, without control codes.
            count: called at each look, from another thread: how far it is; "" for nothing.
        """
        with self._lock:
            if self._holders:
                return
            self._what, self._count, self._since = what, count, time.monotonic()
            if self._ended is None:
                self._stream = sys.stderr
                sys.stdout = self._before(sys.stdout, self.end)
                sys.stderr = self._before(sys.stderr, self._erase)
                self._ended = threading.Event()
                threading.Thread(target=self._follow, args=(self._ended,), daemon=True).start()

    def end(self) -> None:
        """Erase the line, for good."""
        with self._lock:
            if self._ended is None:
                return
            self._erase()
            self._ended.set()
            self._ended = None
            for name in ("stdout", "stderr"):
                if isinstance(stream := getattr(sys, name), _Printing):
                    setattr(sys, name, stream.behind)

    def hold(self) -> None:
        """Erase the line, and show none until :meth:`release`: another display has the place."""
        with self._lock:
            self.end()
            self._holders += 1

    def release(self) -> None:
        """The other display has ended."""
        with self._lock:
            self._holders = max(0, self._holders - 1)

    def _before(self, stream: Any, make_way: Callable[[], None]) -> Any:
        """The stream with which others print meanwhile."""
        if isinstance(stream, _Printing):
            return stream
        for each in self._printing:
            if each.behind is stream and each.make_way == make_way:
                return each
        self._printing.append(_Printing(stream, make_way))
        return self._printing[-1]

    def _follow(self, ended: threading.Event) -> None:
        wait = _DELAY
        while not ended.wait(wait):
            wait = _PERIOD
            with self._lock, contextlib.suppress(OSError, ValueError):  # the terminal is gone
                if self._ended is ended:
                    self._draw()

    def _draw(self) -> None:
        seconds = int(time.monotonic() - self._since)
        more = self._count() if self._count else "", f"{seconds} s" if seconds else ""
        told = ", ".join(filter(None, more))
        text = f"{self._what} ({told})" if told else f"{self._what} ..."
        columns = _columns(self._stream)
        text = text if len(text) < columns else f"{text[: columns - 4]}..."
        if text != self._drawn:
            self._stream.write(f"{_ERASE}{text}")
            self._stream.flush()
            self._drawn = text

    def _erase(self) -> None:
        with self._lock, contextlib.suppress(OSError, ValueError):
            if self._drawn:
                self._drawn = ""
                self._stream.write(_ERASE)
                self._stream.flush()


class _Printing:
    """A stream before whose output the line is erased."""

    def __init__(self, behind: Any, make_way: Callable[[], None]) -> None:
        self.behind, self.make_way = behind, make_way

    def write(self, text: str) -> int:
        self.make_way()
        return int(self.behind.write(text))

    def writelines(self, lines: Any) -> None:
        self.make_way()
        self.behind.writelines(lines)

    def __iter__(self) -> Iterator[str]:
        return iter(self.behind)

    def __getattr__(self, name: str) -> Any:
        return getattr(self.behind, name)


def _columns(stream: TextIO) -> int:
    with contextlib.suppress(OSError, ValueError):
        return os.get_terminal_size(stream.fileno()).columns or _COLUMNS
    return _COLUMNS


LINE = Line()
