"""Shows the progress of ``er-gym collect``."""

from __future__ import annotations

from rich.console import Console

from benchmarks.cli.progress import bar
from er_gym.rollout.events import Cost, EpisodeEnded, Event


class CollectProgress:
    """Shows how many trajectories are taken: a live bar on a terminal, a few lines elsewhere."""

    def __init__(self, console: Console, total: int) -> None:
        self._console, self._total = console, total
        self._taken = self._played = 0
        self._told = 0
        self._cost = ""
        self._bar = bar(console)
        self._task = self._bar.add_task("trajectories", total=total, status="starting")

    def __enter__(self) -> CollectProgress:
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

    def __call__(self, event: Event) -> None:
        """Hear of an event of a run."""
        if isinstance(event, Cost):
            self._cost = str(event)
        if isinstance(event, EpisodeEnded):
            self._played += 1
            self._show()

    def taken(self, part: str, number: int) -> None:
        """Hear how many trajectories are taken so far, of all parts."""
        self._taken = number
        self._bar.update(self._task, description=part)
        self._show()
        tenth = 10 * number // max(self._total, 1)
        if not self._console.is_terminal and tenth > self._told:
            self._told = tenth
            self._console.print(
                f"{part}: {number}/{self._total} trajectories, {self._status()}",
                soft_wrap=True,
            )

    def say(self, what: object) -> None:
        """Print a line, above the bar where there is one; from any thread."""
        self._console.print(str(what), style="dim", soft_wrap=True)

    def _show(self) -> None:
        self._bar.update(self._task, completed=self._taken, status=self._status())

    def _status(self) -> str:
        return ", ".join(filter(None, (f"{self._played} episodes played", self._cost)))
