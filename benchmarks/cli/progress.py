"""Shows a run's progress: a live bar on a terminal, a few lines elsewhere."""

from __future__ import annotations

import time

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
"""The number of lines that a whole run prints without a terminal."""


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


class Progress:
    """A context manager that follows a run by its events, or by calls of :meth:`episode`.

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
        self._cost = ""
        self._due = False
        """Whether a line is to be printed, as soon as it is known what it says."""
        self._console = console
        self._title = title
        self._total = total
        self._outcomes = before or Outcomes()
        self._before = self._done = self._outcomes.n - self._outcomes.crashed
        self._start = time.monotonic()
        self._bar = bar(console)
        self._task = self._bar.add_task(
            title, total=total, completed=self._done, status=self._status()
        )

    def __enter__(self) -> Progress:
        self._start = time.monotonic()
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

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
        lines = self._done * _LINES // self._total
        self._due |= lines > (self._done - 1) * _LINES // self._total

    def _show(self) -> None:
        self._bar.update(self._task, completed=self._done, status=self._status())

    def _print(self) -> None:
        """Print the line that is due."""
        if self._due and not self._console.is_terminal:
            played = 0 if self._none_played else self._done
            self._console.print(
                f"{self._title}: {played}/{self._total} episodes, {self._status()}",
                soft_wrap=True,
            )
        self._due = False

    @property
    def _none_played(self) -> bool:
        """Whether all so far have crashed and there are more to come. A run that stops then, such
        as one whose model refused all of them, has played no episode and has no rate."""
        return self._outcomes.crashed == self._outcomes.n and self._done < self._total

    def say(self, what: object) -> None:
        """Print a line, above the bar where there is one; from any thread."""
        self._console.print(str(what), style="dim", soft_wrap=True)

    def _status(self) -> str:
        if not self._done:
            return "starting"
        played = self._done - self._before
        speed = played / max(time.monotonic() - self._start, 1e-9)
        told = f"{100 * self._outcomes.rate:.1f} % success"
        if self._none_played:
            told = f"{self._done:,} crashed"
        return ", ".join(filter(None, (told, f"{speed:.1f} episodes/s", self._cost)))
