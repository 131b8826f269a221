"""The event stream of a run: what happens, as it happens, one JSON line each.

``events.jsonl`` in a run directory only grows. Every process that plays appends to it, a line per
write, so lines never mix and a killed process leaves at most one broken line, which readers skip.
Progress bars, trainers and viewers read it; results are read from the episodes' records, never from
here. Times are seconds since the epoch (UTC).

A change that an older reader would misread takes a new ``format`` in ``run_begun``.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from er_gym.rollout.json_lines import JsonLines
from er_gym.rollout.records import Words

EVENTS = "events.jsonl"
"""The file's name in a run directory."""


class _Event(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")

    time: float = Field(default_factory=time.time)


class RunBegun(_Event):
    """A run starts or continues.

    Attributes:
        tasks: how many episodes it is to have in all.
        done: how many of them were there before.
    """

    kind: Literal["run_begun"] = "run_begun"
    format: Literal["er-gym/events/1"] = "er-gym/events/1"
    suite: str
    agent: str
    tasks: int
    done: int


class EpisodeBegun(_Event):
    """An agent has been placed in a scene and told its task."""

    kind: Literal["episode_begun"] = "episode_begun"
    task_id: str
    task_type: str
    scene: str
    instruction: str
    max_steps: int


class Reply(_Event):
    """A model has answered.

    Attributes:
        step: number of the step that the reply decided, counting from 1.
        seconds: how long the answer took.
        cost: in US dollars; 0 where no price is known.
        cached: whether an earlier request paid for it.
    """

    kind: Literal["reply"] = "reply"
    task_id: str
    step: int
    model: Words = ""
    seconds: float = 0.0
    prompt_tokens: int = 0
    completion_tokens: int = 0
    cost: float = 0.0
    cached: bool = False


class StepDone(_Event):
    """A step has been taken.

    Attributes:
        step: its number, counting from 1; placing the agent is 0 and no event.
        verb: canonical; ``error`` for a reply that named no known action.
    """

    kind: Literal["step"] = "step"
    task_id: str
    step: int
    verb: str
    object_type: Words = ""
    success: bool
    reward: float
    thought: Words = ""


class EpisodeEnded(_Event):
    """An episode is over and its record is in the run directory.

    Attributes:
        success: what the environment said; scores are computed from the record.
        steps: how many were taken.
        error: what it crashed with, in one line; ``""`` if it did not.
    """

    kind: Literal["episode_ended"] = "episode_ended"
    task_id: str
    task_type: str
    success: bool
    end_reason: str
    total_reward: float
    steps: int
    seconds: float
    error: Words = ""


class Cost(_Event):
    """What the run has cost so far, continued runs included.

    Attributes:
        cost: in US dollars.
        estimated: whether some of it is an upper bound.
    """

    kind: Literal["cost"] = "cost"
    requests: int
    tokens: int
    cost: float
    estimated: bool = False

    def __str__(self) -> str:
        most = "at most " if self.estimated else ""
        words = f"{most}{self.tokens:,} tokens in {self.requests:,} replies"
        return f"{words}, {most}${self.cost:.2f}" if self.cost else words


class RunEnded(_Event):
    """A run has played all it was asked to, or stopped; a killed run has no such event.

    Attributes:
        played, crashed: episodes of this start of the run.
        stopped: why it stopped early; ``""`` if it did not.
    """

    kind: Literal["run_ended"] = "run_ended"
    played: int
    crashed: int
    stopped: Words = ""


Event: TypeAlias = RunBegun | EpisodeBegun | Reply | StepDone | EpisodeEnded | Cost | RunEnded
Emit: TypeAlias = Callable[[Event], None]
"""Whoever wants to hear of events."""
_ANY: TypeAdapter[Event] = TypeAdapter(Annotated[Event, Field(discriminator="kind")])


def nobody(event: Event) -> None:
    """Listen to nothing."""


class EventLog:
    """Appends events to the stream of a run directory, and tells listeners in this process.

    Args:
        directory: of the run.
        listeners: called with each event that this object is given, in its thread.

    Raises:
        ValueError: the file is a link or no regular file.
        OSError: it cannot be written.
    """

    def __init__(self, directory: Path, listeners: Iterable[Emit] = ()) -> None:
        self._lines = JsonLines(directory / EVENTS)
        self._listeners = tuple(listeners)

    def __call__(self, event: Event) -> None:
        """Append an event, and tell the listeners.

        A full disk ends a run where a result is lost by it, not here.
        """
        with contextlib.suppress(OSError):
            self._lines.add(event.model_dump_json())
        for listener in self._listeners:
            listener(event)

    def close(self) -> None:
        """Close the file."""
        self._lines.close()


def read_events(directory: Path) -> Iterator[Event]:
    """All events of a run so far, oldest first; lines that are no event are skipped."""
    try:
        data = (directory / EVENTS).read_bytes()
    except FileNotFoundError:
        return
    yield from parse_events(data.split(b"\n"))


def parse_events(lines: Iterable[bytes]) -> Iterator[Event]:
    """Events from the lines of a stream; those that are no event are skipped.

    A killed process leaves half a line, and a later version may write kinds unknown here.
    """
    for line in lines:
        try:
            yield _ANY.validate_json(line)
        except ValidationError:
            continue
