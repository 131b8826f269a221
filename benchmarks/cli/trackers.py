"""Sends the figures of a run to TensorBoard or trackio while it is played.

A figure's step is the number of results so far, those of episodes that crashed and were played
again included. The run's event stream is what counts: a start first brings a log to where the
stream is, whatever a kill has left of it. So no step is there twice, and none is lost.
"""

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
from er_gym.rollout.outcomes import Outcomes

Log = Callable[[Mapping[str, float], int, float], None]
"""Takes figures by name, after how many results they hold, and when, in seconds since the epoch."""
PACKAGES: Mapping[str, tuple[str, ...]] = {
    "tensorboard": ("tensorboard", "torch"),
    "trackio": ("trackio",),
}
"""What each tracker needs."""


class RunFigures:
    """Figures of a run after each result; an :data:`~er_gym.rollout.events.EventListener`.

    Args:
        log: takes them.
    """

    def __init__(self, log: Log) -> None:
        self._log, self._outcomes, self._results = log, Outcomes(), 0

    def __call__(self, event: Event) -> None:
        """Log what follows from an event."""
        if isinstance(event, EpisodeEnded):
            self._results += 1
            self._outcomes.add(event.task_id, event.success, event.error)
            figures = {
                "crashed": float(self._outcomes.crashed),
                "success": self._outcomes.rate,
            }
            if not event.error:
                figures |= {
                    "episode/reward": event.total_reward,
                    "episode/steps": float(event.steps),
                    "episode/seconds": event.seconds,
                }
            self._log(figures, self._results, event.time)
        elif isinstance(event, Cost):
            figures = {"tokens": float(event.tokens), "dollars": event.cost}
            self._log(figures, self._results, event.time)


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
        found = [RunFigures(log) for log in logs]
        for event in read_events(run, ["episode_ended", "cost"]) if logs else ():
            for each in found:
                each(event)
        yield [*found]


@contextmanager
def _tensorboard(run: Path, settings: Mapping[str, Any]) -> Iterator[Log]:
    """Logs into ``RUN/tensorboard``, anew at each start: its files can only be appended to."""
    from torch.utils.tensorboard import SummaryWriter

    folder = run / "tensorboard"
    for old in folder.glob("events.out.tfevents.[0-9]*"):
        old.unlink()
    writer = SummaryWriter(str(folder), purge_step=0)  # a TensorBoard that is open forgets, too

    def log(figures: Mapping[str, float], step: int, when: float) -> None:
        for name, value in figures.items():
            writer.add_scalar(name, value, step, walltime=when)
        writer.flush()

    try:
        yield log
    finally:
        writer.close()


@contextmanager
def _trackio(run: Path, settings: Mapping[str, Any]) -> Iterator[Log]:
    """Logs into trackio's own folder, on this machine, the steps that are not there yet."""
    import trackio

    project = run.resolve().parent.name or "er-gym"
    with redirect_stdout(sys.stderr):  # the results alone go to stdout
        opened = trackio.init(project=project, name=run.name, config=dict(settings), resume="allow")
    missing = getattr(opened, "_next_step", 0)  # it has no public name

    def log(figures: Mapping[str, float], step: int, when: float) -> None:
        if step >= missing:
            opened.log(dict(figures), step=step)

    try:
        yield log
    finally:
        with redirect_stdout(sys.stderr):
            trackio.finish()


_OPEN = {"tensorboard": _tensorboard, "trackio": _trackio}
