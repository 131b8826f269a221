"""What a run shows of itself while it plays: a live bar on a terminal, a few lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
from rich.progress import Progress as Bar

_LINES = 10
"""How many lines a whole run prints where there is no terminal."""


def bar(console: Console) -> Bar:
    """A bar that says how many are done and, in the field ``status``, how it goes."""
    return Bar(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[status]}", markup=False),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
    )


class Progress:
    """A context manager; call :meth:`episode` for each that is over.

    Args:
        console: where to, a :func:`~benchmarks.cli.terminal.terminal`.
        title: what is played.
        total: how many episodes there are.
        done: how many of them were there before.
        succeeded: how many of those were a success.
        more: what else is to be said each time, such as what has been spent.
    """

    def __init__(
        self,
        console: Console,
        title: str,
        total: int,
        done: int = 0,
        succeeded: int = 0,
        more: Callable[[], str] = lambda: "",
    ) -> None:
        self._more = more
        self._console = console
        self._title = title
        self._total = total
        self._before = self._done = done
        self._succeeded = succeeded
        self._start = time.monotonic()
        self._bar = bar(console)
        self._task = self._bar.add_task(title, total=total, completed=done, status=self._status())

    def __enter__(self) -> Progress:
        self._start = time.monotonic()
        self._bar.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        where: TracebackType | None,
    ) -> None:
        self._bar.stop()

    def episode(self, success: bool) -> None:
        """Count an episode."""
        self._done += 1
        self._succeeded += success
        self._bar.update(self._task, completed=self._done, status=self._status())
        lines = self._done * _LINES // self._total
        if not self._console.is_terminal and lines > (self._done - 1) * _LINES // self._total:
            self._console.print(
                f"{self._title}: {self._done}/{self._total} episodes, {self._status()}",
                soft_wrap=True,
            )

    def say(self, what: object) -> None:
        """Print a line, above the bar where there is one; from any thread."""
        self._console.print(str(what), style="dim", soft_wrap=True)

    def _status(self) -> str:
        if not self._done:
            return "starting"
        played = self._done - self._before
        speed = played / max(time.monotonic() - self._start, 1e-9)
        said = f"{100 * self._succeeded / self._done:.1f} % success, {speed:.1f} episodes/s"
        return ", ".join(filter(None, (said, self._more())))
