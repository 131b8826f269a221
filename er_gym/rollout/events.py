"""The event stream of a run: one JSON line for each event, in the order of writing.

``events.jsonl`` in a run directory only grows. Every process that plays appends whole lines to it,
so the lines of processes do not mix. A killed process leaves at most one broken line, which readers
skip. Progress bars, trainers and viewers read the stream. Results come from the episodes' records,
never from the stream. Times are seconds since the epoch (UTC).

The events of an episode name its task. If a worker process dies, its episode begins again: a second
``episode_begun`` of a task makes the events of its first try void.

A change that an older reader would misread takes a new ``format`` in ``run_begun``.
"""

from __future__ import annotations

import contextlib
import json
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from er_gym.rollout.json_lines import JsonLines
from er_gym.rollout.records import Words, added

EVENTS = "events.jsonl"
"""The file's name in a run directory."""
_FORMAT = b"er-gym/events/1"


class _Event(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore")

    time: float = Field(default_factory=time.time)


class RunBegun(_Event):
    """A run starts or continues.

    Attributes:
        format: the version of the stream's layout.
        suite: the suite's name.
        agent: the agent's spec.
        tasks: the number of episodes that the run is to have.
        done: the number of these that earlier starts finished.
    """

    kind: Literal["run_begun"] = "run_begun"
    format: Literal["er-gym/events/1"] = "er-gym/events/1"
    suite: str
    agent: str
    tasks: int
    done: int


class EpisodeBegun(_Event):
    """The agent has been placed in a scene and has got its task.

    Attributes:
        max_steps: the step limit; placing the agent counts as the first step.
    """

    kind: Literal["episode_begun"] = "episode_begun"
    task_id: str
    task_type: str
    scene: str
    instruction: str
    max_steps: int


class Reply(_Event):
    """A model has answered.

    Attributes:
        step: the number of the step that the reply decided, from 1.
        seconds: how long the reply took.
        prompt_tokens, completion_tokens: as the server counted them, or upper bounds.
        cost: US dollars; 0 if no price is known.
        cached: whether the reply came from the cache, so that an earlier request paid for it.
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
    """The agent has taken a step.

    Attributes:
        step: the number of the step, from 1. Placing the agent is step 0 and has no event.
        verb: the canonical verb; ``error`` for a reply that named no known action.
        object_type: the object type that the agent named.
        success: whether the action was legal and the simulator did it.
        reward: what the step earned.
        thought: the agent's reasoning.
        feedback: what the environment said of it; "" in streams of older versions.
    """

    kind: Literal["step"] = "step"
    task_id: str
    step: int
    verb: str
    object_type: Words = ""
    success: bool
    reward: float
    thought: Words = ""
    feedback: Words = ""


class EpisodeEnded(_Event):
    """An episode is over and its record is in the run directory.

    Attributes:
        success: the environment's verdict; scores are computed from the record.
        end_reason: why the episode ended, in the environment's words; ``""`` if it crashed.
        total_reward: the sum over the steps.
        steps: the number of steps that the agent took.
        seconds: wall-clock time.
        error: the error it crashed with, in one line; ``""`` if it did not crash.
        replies, causes, unusable, ended: its causes, as
            :class:`er_gym.rollout.causes.EpisodeCauses` has it.
        side_effects: how many its record tells; None if it tells none.
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
    replies: int = added(0)
    causes: dict[str, int] = added({})
    unusable: dict[str, int] = added({})
    ended: str = added("")
    side_effects: int | None = added(None)


class Cost(_Event):
    """What the run has cost so far, continued runs included.

    Attributes:
        requests: the number of replies.
        tokens: the sum of prompt and completion tokens.
        cost: US dollars.
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
    """A run has played all its tasks, or has stopped. A killed run has no such event.

    Attributes:
        played, crashed: the number of episodes since this ``run_begun``.
        stopped: why the run stopped early; ``""`` if it did not.
    """

    kind: Literal["run_ended"] = "run_ended"
    played: int
    crashed: int
    stopped: Words = ""


Event: TypeAlias = RunBegun | EpisodeBegun | Reply | StepDone | EpisodeEnded | Cost | RunEnded
EventListener: TypeAlias = Callable[[Event], None]
"""Is called with each event."""
_ANY: TypeAdapter[Event] = TypeAdapter(Annotated[Event, Field(discriminator="kind")])


def ignore_event(event: Event) -> None:
    """The listener that does nothing."""


class EventLog:
    """Appends events to the stream of a run directory, and calls listeners.

    Args:
        directory: the run directory.
        listeners: called with each event that this log is given, in the thread that gives it.

    Raises:
        ValueError: the file is a link, or not a regular file.
        OSError: the file cannot be opened.
    """

    def __init__(self, directory: Path, listeners: Iterable[EventListener] = ()) -> None:
        self._lines = JsonLines(directory / EVENTS)
        self._listeners = tuple(listeners)

    def __call__(self, event: Event) -> None:
        """Append an event, and call the listeners.

        A failure to write the event is ignored, since only a lost result may end a run.
        """
        with contextlib.suppress(OSError):
            self._lines.add(event.model_dump_json())
        for listener in self._listeners:
            listener(event)

    def append(self, events: Iterable[Event]) -> None:
        """Append events of another process, without calling the listeners."""
        for event in events:
            with contextlib.suppress(OSError):
                self._lines.add(event.model_dump_json())

    def close(self) -> None:
        """Close the file."""
        self._lines.close()


def read_events(directory: Path, kinds: Sequence[str] = ()) -> Iterator[Event]:
    """All events of a run so far, oldest first; see :func:`parse_events`.

    Args:
        directory: the run directory.
        kinds: yield only events of these kinds, such as ``"episode_ended"``, which is faster: most
            events are steps. Empty for all kinds.
    """
    try:
        data = (directory / EVENTS).read_bytes()
    except FileNotFoundError:
        return
    lines = data.split(b"\n")
    if kinds:
        marks = [f'"kind":"{kind}"'.encode() for kind in kinds]
        lines = [line for line in lines if any(mark in line for mark in marks)]
    yield from parse_events(lines)


def parse_events(lines: Iterable[bytes]) -> Iterator[Event]:
    """The events in the lines of a stream.

    Lines that are not events are skipped: a killed process leaves half a line, and a later version
    may write unknown kinds of events.

    Raises:
        ValueError: a run has begun in another format, so its events might be misread.
    """
    for line in lines:
        try:
            event = _ANY.validate_json(line)
        except ValidationError:
            if _FORMAT not in line and (other := _other_format(line)):
                raise ValueError(
                    f"the event stream has the format {other!r}, not {_FORMAT.decode()!r}; read it "
                    "with the version of er-gym that wrote it"
                ) from None
            continue
        yield event


def _other_format(line: bytes) -> str:
    """The format that a ``run_begun`` of another version states, ``""`` for any other line."""
    try:
        event = json.loads(line)
    except ValueError:
        return ""
    if not isinstance(event, dict) or event.get("kind") != "run_begun":
        return ""
    return str(event.get("format", ""))
