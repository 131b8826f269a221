"""Shows how far a command is: a live bar on a terminal, a few lines elsewhere."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress import Progress as RichProgress

from benchmarks.cli.activity import doing
from benchmarks.cli.live_line import LINE
from er_gym.rollout.events import Cost, EpisodeEnded, Event, RunEnded
from er_gym.rollout.outcomes import Outcomes

_LINES = 10
"""The number of lines that a whole command prints without a terminal."""


class Bar(RichProgress):
    """Bars in place of the line that says what the command is doing."""

    def start(self) -> None:
        LINE.hold()
        super().start()

    def stop(self) -> None:
        super().stop()
        LINE.release()
        doing("finishing")


def bar(console: Console) -> Bar:
    """A progress bar: the number of finished items and, in the field ``status``, the results."""
    return Bar(
        TextColumn("{task.description}", markup=False),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[status]}", markup=False),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=console,
        disable=not console.is_terminal,
    )


@contextmanager
def counting(console: Console, title: str) -> Iterator[Callable[[int, int], None]]:
    """Shows a bar meanwhile; gives a function that takes how many are done, and of how many."""
    with bar(console) as shown:
        task = shown.add_task(title, total=None, status="")
        yield lambda done, total: shown.update(task, completed=done, total=total)


class LiveProgress:
    """A context manager that shows how far a command is.

    Args:
        console: where to, a :func:`~benchmarks.terminal.terminal`.
        title: what is counted.
        total: how many there are.
        completed: how many are done already.
    """

    def __init__(self, console: Console, title: str, total: int, completed: int = 0) -> None:
        self._console, self._total = console, total
        self._cost = ""
        self._lines = self._lines_until(completed)
        self._bar = bar(console)
        self._task = self._bar.add_task(title, total=total, completed=completed, status="starting")

    def __enter__(self) -> LiveProgress:
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

    def say(self, what: object) -> None:
        """Print a line, above the bar where there is one; from any thread."""
        self._console.print(str(what), style="dim", soft_wrap=True)

    def update(self, **fields: Any) -> None:
        """Change what the bar shows."""
        self._bar.update(self._task, **fields)

    def is_line_due(self, done: int) -> bool:
        """Whether another tenth is done than when it was asked last."""
        before, self._lines = self._lines, max(self._lines, self._lines_until(done))
        return self._lines > before

    def _lines_until(self, done: int) -> int:
        return _LINES * done // max(self._total, 1)

    def print_line(self, line: str) -> None:
        """Print a line where there is no bar."""
        if not self._console.is_terminal:
            self._console.print(line, soft_wrap=True)


class CollectProgress(LiveProgress):
    """Shows how many trajectories are taken."""

    def __init__(self, console: Console, total: int) -> None:
        super().__init__(console, "trajectories", total)
        self._taken = self._played = 0

    def __call__(self, event: Event) -> None:
        """Hear of an event of a run."""
        if isinstance(event, Cost):
            self._cost = str(event)
        if isinstance(event, EpisodeEnded):
            self._played += 1
            self.update(completed=self._taken, status=self._status())

    def taken(self, part: str, number: int) -> None:
        """Hear how many trajectories are taken so far, of all parts."""
        self._taken = number
        self.update(description=part, completed=number, status=self._status())
        if self.is_line_due(number):
            self.print_line(f"{part}: {number}/{self._total} trajectories, {self._status()}")

    def _status(self) -> str:
        return ", ".join(filter(None, (f"{self._played} episodes played", self._cost)))


class Progress(LiveProgress):
    """Follows a run by its events, or by calls of :meth:`episode`.

    Args:
        console: where to, a :func:`~benchmarks.terminal.terminal`.
        title: what is played.
        total: how many episodes there are.
        before: what earlier starts of the run have come to; those that crashed are played again.
    """

    def __init__(
        self,
        console: Console,
        title: str,
        total: int,
        before: Outcomes | None = None,
    ) -> None:
        self._due = False
        """Whether a line is to be printed, as soon as it is known what it says."""
        self._title = title
        self._outcomes = before or Outcomes()
        self._before = self._done = self._outcomes.n - self._outcomes.crashed
        self._start = time.monotonic()
        super().__init__(console, title, total, self._done)
        self._show()

    def __enter__(self) -> Progress:
        self._start = time.monotonic()
        super().__enter__()
        return self

    def __call__(self, event: Event) -> None:
        """Take an event of the run. The cost of an episode is told after its end."""
        if isinstance(event, Cost):
            self._cost = str(event)
            self._show()
            self._print()
        elif isinstance(event, EpisodeEnded):
            self._print()
            self._count(event.success, event.task_id, event.error)
            if not self._cost and self._done < self._total:
                self._print()
        elif isinstance(event, RunEnded):
            self._print()

    def episode(self, success: bool, key: str = "", error: str = "") -> None:
        """Count an episode, by its key where it may have been counted before."""
        self._count(success, key, error)
        self._print()

    def _count(self, success: bool, key: str, error: str) -> None:
        self._done += 1
        self._outcomes.add(key or f"{self._done}", success, error)
        self._show()
        self._due |= self.is_line_due(self._done)

    def _show(self) -> None:
        self.update(completed=self._done, status=self._status())

    def _print(self) -> None:
        """Print the line that is due."""
        if self._due:
            played = 0 if self._none_played else self._done
            self.print_line(f"{self._title}: {played}/{self._total} episodes, {self._status()}")
        self._due = False

    @property
    def _none_played(self) -> bool:
        """Whether all so far have crashed and there are more to come. A run that stops then, such
        as one whose model refused all of them, has played no episode and has no rate."""
        return self._outcomes.crashed == self._outcomes.n and self._done < self._total

    def _status(self) -> str:
        if not self._done:
            return "starting"
        played = self._done - self._before
        speed = played / max(time.monotonic() - self._start, 1e-9)
        results = f"{100 * self._outcomes.rate:.1f} % success"
        if self._none_played:
            results = f"{self._done:,} crashed"
        return ", ".join(filter(None, (results, f"{speed:.1f} episodes/s", self._cost)))
