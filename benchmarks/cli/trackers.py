"""Sends the figures of a run to TensorBoard or trackio while it is played."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, redirect_stdout
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from benchmarks.cli.errors import BadInput
from er_gym.rollout.events import (
    Cost,
    EpisodeEnded,
    Event,
    EventListener,
    read_events,
)

Log = Callable[[Mapping[str, float], int], None]
"""Takes figures by name, and after how many episodes they hold."""
PACKAGES: Mapping[str, tuple[str, ...]] = {
    "tensorboard": ("tensorboard", "torch"),
    "trackio": ("trackio",),
}
"""What each tracker needs."""


class RunFigures:
    """Figures of a run after each episode; an :data:`~er_gym.rollout.events.EventListener`.

    Args:
        log: takes them.
        before: the last events of the episodes that earlier starts of the run finished.
    """

    def __init__(self, log: Log, before: Sequence[EpisodeEnded] = ()) -> None:
        self._log = log
        self._episodes = self._successes = self._crashed = 0
        for event in before:
            self._count(event)

    def __call__(self, event: Event) -> None:
        """Log what follows from an event."""
        if isinstance(event, EpisodeEnded):
            self._count(event)
            played = self._episodes - self._crashed
            figures = {"crashed": float(self._crashed)}
            if played:
                figures["success"] = self._successes / played
            if not event.error:
                figures |= {
                    "episode/reward": event.total_reward,
                    "episode/steps": float(event.steps),
                    "episode/seconds": event.seconds,
                }
            self._log(figures, self._episodes)
        elif isinstance(event, Cost):
            self._log({"tokens": float(event.tokens), "dollars": event.cost}, self._episodes)

    def _count(self, event: EpisodeEnded) -> None:
        self._episodes += 1
        self._crashed += bool(event.error)
        self._successes += event.success and not event.error


@contextmanager
def tracking(
    names: Sequence[str], run: Path, settings: Mapping[str, Any]
) -> Iterator[list[EventListener]]:
    """Listeners that log a run's figures, until the context ends.

    Args:
        names: of :data:`PACKAGES`.
        run: the run directory; its name is the run's, its folder's the project's.
        settings: what is played, for trackers that keep it.

    Raises:
        BadInput: a package is not installed.
    """
    for name in dict.fromkeys(names):
        missing = [each for each in PACKAGES[name] if find_spec(each) is None]
        if missing:
            raise BadInput(
                f"--track {name} needs {' and '.join(missing)}: pip install {' '.join(missing)}"
            )
    with ExitStack() as stack:
        logs = [stack.enter_context(_OPEN[name](run, settings)) for name in dict.fromkeys(names)]
        before = {
            event.task_id: event
            for event in (read_events(run) if logs else ())
            if isinstance(event, EpisodeEnded)
        }
        done = [event for event in before.values() if not event.error]
        yield [RunFigures(log, done) for log in logs]


@contextmanager
def _tensorboard(run: Path, settings: Mapping[str, Any]) -> Iterator[Log]:
    """Logs into ``RUN/tensorboard``."""
    from torch.utils.tensorboard import SummaryWriter

    writer = SummaryWriter(str(run / "tensorboard"))

    def log(figures: Mapping[str, float], episodes: int) -> None:
        for name, value in figures.items():
            writer.add_scalar(name, value, episodes)
        writer.flush()

    try:
        yield log
    finally:
        writer.close()


@contextmanager
def _trackio(run: Path, settings: Mapping[str, Any]) -> Iterator[Log]:
    """Logs into trackio's own folder, on this machine."""
    import trackio

    project = run.resolve().parent.name or "er-gym"
    with redirect_stdout(sys.stderr):  # the results alone go to stdout
        opened = trackio.init(project=project, name=run.name, config=dict(settings), resume="allow")
    try:
        yield lambda figures, episodes: opened.log(dict(figures), step=episodes)
    finally:
        with redirect_stdout(sys.stderr):
            trackio.finish()


_OPEN = {"tensorboard": _tensorboard, "trackio": _trackio}
