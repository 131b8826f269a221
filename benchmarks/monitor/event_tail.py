"""Follows a run's event stream while it grows."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any, NamedTuple

from pydantic_core import from_json

from benchmarks.monitor.line_tail import LineFollower, Lines
from benchmarks.monitor.notes import Note
from benchmarks.scoring.metrics import METRICS, tidy_success
from er_gym.rollout.causes import EpisodeCauses
from er_gym.rollout.outcomes import succeeded
from er_gym.rollout.records import sample_of_key, task_of_key

_LINE = re.compile(
    rb'(?:\{"time":([0-9.e+-]+),"kind":"step","task_id":"([^"]*)","step":([0-9]+),"verb":"([^"]*)",'
    rb'"object_type":"([^"]*)","success":(?:true|false),"reward":([0-9.e+-]+)[,}][^\n]*|([^\n]+))\n'
)
"""How er-gym writes a step: its time, task, number, verb, type and reward; or any other line. Most
lines are steps; to parse their thoughts, which are not shown here, would take most of the time."""


class Figures(NamedTuple):
    """What the record of an episode tells that the stream does not.

    Attributes:
        failure: why it failed (:mod:`benchmarks.monitor.failures`); "" for a success.
        metrics: those of :data:`benchmarks.scoring.metrics.METRICS` by the corrected scorer; none
            if its record cannot be read.
        by_paper: success by the paper's scorer.
        side_effects: the kind of each (:mod:`er_gym.tasks.side_effects`); None if the record does
            not tell them.
    """

    failure: str
    metrics: tuple[float, ...] = ()
    by_paper: bool = False
    side_effects: tuple[str, ...] | None = None

    @property
    def tidy_success(self) -> bool | None:
        """As :attr:`EpisodeRow.tidy_success`, by the corrected scorer."""
        effects = None if self.side_effects is None else len(self.side_effects)
        return tidy_success(bool(self.metrics[0]), effects)


@dataclass(slots=True)
class EpisodeRow:
    """What the event stream contains about one episode.

    Attributes:
        key: the name of the episode in its run.
        task_type, scene, instruction, max_steps: of the task.
        begun: when it began, seconds since the epoch.
        ended: when it ended; None if it has not.
        success: whether it counts as a success (:mod:`er_gym.rollout.outcomes`).
        end_reason, error: as :class:`~er_gym.rollout.events.EpisodeEnded` has them.
        steps, reward, seconds: so far.
        tokens, cost: of the model's replies that were not cached, cost in US dollars.
        last: the last action.
        causes: of its unusable replies; None while it plays.
        side_effects: how many it had; None while it plays, and if neither the stream nor its record
            tells them.
        before: while it is played again, the result that it had: it had crashed.
        figures: what its record tells; None until it has been read.
        note: what people noted of it; None for nothing.
    """

    key: str
    task_type: str = ""
    scene: str = ""
    instruction: str = ""
    max_steps: int = 0
    begun: float = 0.0
    ended: float | None = None
    success: bool = False
    end_reason: str = ""
    error: str = ""
    steps: int = 0
    reward: float = 0.0
    seconds: float = 0.0
    tokens: int = 0
    cost: float = 0.0
    last: str = ""
    causes: EpisodeCauses | None = None
    side_effects: int | None = None
    before: EpisodeRow | None = None
    figures: Figures | None = None
    note: Note | None = None

    @property
    def task_id(self) -> str:
        """The task that was played."""
        return task_of_key(self.key)

    @property
    def sample(self) -> int:
        """Which of the task's episodes it is, from 1."""
        return sample_of_key(self.key)

    @property
    def result(self) -> EpisodeRow | None:
        """The row of its latest result; None if it has none yet."""
        return self.before if self.ended is None else self

    @property
    def failure(self) -> str:
        """Why it failed; "" for a success, and until its record has been read."""
        return self.figures.failure if self.figures else ""

    def metric(self, name: str) -> float | None:
        """One of :data:`benchmarks.scoring.metrics.METRICS`; None until its record has been
        read."""
        told = self.figures.metrics if self.figures else ()
        return told[METRICS.index(name)] if told else None

    @property
    def tidy_success(self) -> bool | None:
        """Whether it is a success without side effects
        (:func:`benchmarks.scoring.metrics.tidy_success`)."""
        return tidy_success(self.success, self.side_effects)

    @property
    def outcome(self) -> str:
        """``playing``, ``crashed``, ``success`` or ``failure``."""
        if self.ended is None:
            return "playing"
        if self.error:
            return "crashed"
        return "success" if self.success else "failure"


@dataclass
class EventTail(LineFollower):
    """The state of a run, read from its event stream.

    Attributes:
        rows: by episode, in the order in which they began first.
        wanted: how many episodes the run is to have; None if it does not say.
        begun: when it was started last, seconds since the epoch; 0 if unknown.
        done_before: how many episodes earlier starts had finished.
        stopped: whether it has ended, and ``why`` it did so early.
        time: of the last event.
        version: changes with every event that was read.
    """

    longest = 8 * 2**20  # a model may say anything

    rows: dict[str, EpisodeRow] = field(default_factory=dict)
    wanted: int | None = None
    begun: float = 0.0
    done_before: int = 0
    stopped: bool = False
    why: str = ""
    time: float = 0.0
    version: int = 0

    def _forget(self) -> None:
        version = self.version + 1
        super()._forget()
        self.version = version

    def _take(self, lines: Lines) -> None:
        # A run may have hundreds of thousands of steps, and its first page waits for this loop.
        steps, latest, row, row_of = 0, self.time, EpisodeRow(""), None
        for time, key, number, verb, object_type, reward, other in _LINE.findall(lines.text):
            try:
                if other:
                    row_of = None  # the episode may begin again
                    self._other(other)
                    continue
                action, moment = _action(verb, object_type), float(time)
                steps_so_far, gained = int(number), float(reward)
                if key != row_of:
                    row, row_of = self._row(_text(key)), key
            except (ValueError, KeyError, TypeError, RecursionError):
                continue  # half a line of a killed process, or an event of a later version
            row.last = action
            row.reward += gained
            if steps_so_far > row.steps:
                row.steps = steps_so_far
            if moment > latest:
                latest = moment
            steps += 1
        self.time = max(self.time, latest)
        self.version += steps

    def _other(self, line: bytes) -> None:
        try:
            event = from_json(line)
        except ValueError:
            event = json.loads(line)  # knows more: half a surrogate pair
        _HANDLERS[event["kind"]](self, event)
        self.time = max(self.time, float(event["time"]))
        self.version += 1

    def _row(self, key: str) -> EpisodeRow:
        if key not in self.rows:
            self.rows[key] = EpisodeRow(key)
        return self.rows[key]

    def _run_begun(self, event: dict[str, Any]) -> None:
        self.wanted, self.done_before = int(event["tasks"]), int(event["done"])
        self.begun, self.stopped, self.why = float(event["time"]), False, ""
        for key, row in [*self.rows.items()]:
            if row.result is None:  # the start before was killed
                del self.rows[key]
            else:  # one that crashed counts until it has been played again
                self.rows[key] = row.result

    def _episode_begun(self, event: dict[str, Any]) -> None:
        key = str(event["task_id"])
        earlier = self.rows.pop(key, None)
        self.rows[key] = EpisodeRow(
            key,
            task_type=str(event["task_type"]),
            scene=str(event["scene"]),
            instruction=str(event["instruction"]),
            max_steps=int(event["max_steps"]),
            begun=float(event["time"]),
            before=earlier.result if earlier else None,
        )

    def _reply(self, event: dict[str, Any]) -> None:
        row = self._row(str(event["task_id"]))
        if not event.get("cached"):
            row.tokens += int(event["prompt_tokens"]) + int(event["completion_tokens"])
            row.cost += float(event["cost"])

    def _step(self, event: dict[str, Any]) -> None:
        row = self._row(str(event["task_id"]))
        number, reward = int(event["step"]), float(event["reward"])
        row.last = f"{event['verb']} {event.get('object_type', '')}".strip()
        row.steps = max(row.steps, number)
        row.reward += reward

    def _ended(self, event: dict[str, Any]) -> None:
        row = self._row(str(event["task_id"]))
        row.task_type = str(event["task_type"])
        row.ended, row.error = float(event["time"]), str(event.get("error", ""))
        row.success = succeeded(bool(event["success"]), row.error)
        row.end_reason, row.before = str(event["end_reason"]), None
        row.steps, row.seconds = int(event["steps"]), float(event["seconds"])
        row.reward = float(event["total_reward"])
        effects = event.get("side_effects")
        row.side_effects = None if effects is None else int(effects)
        row.causes = EpisodeCauses(
            int(event.get("replies", 0)),
            {str(name): int(number) for name, number in event.get("causes", {}).items()},
            {str(name): int(number) for name, number in event.get("unusable", {}).items()},
            str(event.get("ended", "")),
        )

    def _run_ended(self, event: dict[str, Any]) -> None:
        self.stopped, self.why = True, str(event.get("stopped", ""))


_HANDLERS = {
    "run_begun": EventTail._run_begun,
    "episode_begun": EventTail._episode_begun,
    "reply": EventTail._reply,
    "step": EventTail._step,
    "episode_ended": EventTail._ended,
    "cost": lambda tail, event: None,
    "run_ended": EventTail._run_ended,
}


def _text(quoted: bytes) -> str:
    """What stands between the quotes of a JSON string."""
    return str(json.loads(b'"%b"' % quoted)) if b"\\" in quoted else quoted.decode()


@lru_cache(4096)
def _action(verb: bytes, object_type: bytes) -> str:
    return f"{_text(verb)} {_text(object_type)}".strip()
