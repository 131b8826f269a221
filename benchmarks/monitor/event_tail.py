"""Follows a run's event stream while it grows."""

from __future__ import annotations

import json
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from benchmarks.monitor.line_tail import LineTail
from er_gym.rollout.events import EVENTS

_STEP = re.compile(
    rb'\{"time":(?P<time>[0-9.e+-]+),"kind":"step","task_id":"(?P<key>[^"\\]*)",'
    rb'"step":(?P<step>[0-9]+),"verb":"(?P<verb>[^"\\]*)","object_type":"(?P<type>[^"\\]*)",'
    rb'"success":(?:true|false),"reward":(?P<reward>[0-9.e+-]+)[,}]'
)
"""How er-gym writes a step. Most lines are steps; to parse their thoughts, which are not shown
here, would take most of the time."""
_LONGEST = 8 * 2**20
"""A line with more bytes is passed over: a model may say anything."""


@dataclass(slots=True)
class EpisodeRow:
    """What the stream tells of one episode.

    Attributes:
        key: the name of the episode in its run.
        task_type, scene, instruction, max_steps: of the task.
        begun: when it began, seconds since the epoch.
        ended: when it ended; None if it has not.
        success: the environment's verdict.
        end_reason, error: as :class:`~er_gym.rollout.events.EpisodeEnded` has them.
        steps, reward, seconds: so far.
        tokens, cost: of the model's replies that were not cached, cost in US dollars.
        last: the last action.
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

    @property
    def outcome(self) -> str:
        """``playing``, ``crashed``, ``success`` or ``failure``."""
        if self.ended is None:
            return "playing"
        if self.error:
            return "crashed"
        return "success" if self.success else "failure"


@dataclass
class EventTail:
    """The state of a run as its event stream tells it.

    Attributes:
        folder: the run directory.
        rows: by episode, in the order in which they began first.
        wanted: how many episodes the run is to have; None if it does not say.
        begun: when it was started last, seconds since the epoch; 0 if unknown.
        done_before: how many episodes earlier starts had finished.
        stopped: whether it has ended, and ``why`` it did so early.
        time: of the last event.
        version: changes with every event that was read.
    """

    folder: Path
    rows: dict[str, EpisodeRow] = field(default_factory=dict)
    wanted: int | None = None
    begun: float = 0.0
    done_before: int = 0
    stopped: bool = False
    why: str = ""
    time: float = 0.0
    version: int = 0
    _tail: LineTail = field(init=False)

    def __post_init__(self) -> None:
        self._tail = LineTail(self.folder / EVENTS, _LONGEST)

    def read(self) -> None:
        """Read what has been added. A stream that was replaced is read from its beginning."""
        for some in self._tail.read():
            if some.anew:
                self._forget()
            for line in some.lines:
                if line:
                    self._line(line)

    def _forget(self) -> None:
        fresh = EventTail(self.folder, version=self.version + 1)
        self.__dict__.update(fresh.__dict__ | {"_tail": self._tail})

    def _line(self, line: bytes) -> None:
        try:
            if match := _STEP.match(line):
                self._step(
                    match["key"].decode(),
                    int(match["step"]),
                    float(match["reward"]),
                    b" ".join((match["verb"], match["type"])).strip().decode(),
                )
                self.time = max(self.time, float(match["time"]))
                self.version += 1
                return
            event = json.loads(line)
            told = _HANDLERS[event["kind"]]
            told(self, event)
            self.time = max(self.time, float(event["time"]))
        except (ValueError, KeyError, TypeError, RecursionError):
            return  # half a line of a killed process, or an event of a later version
        self.version += 1

    def _row(self, key: str) -> EpisodeRow:
        if key not in self.rows:
            self.rows[key] = EpisodeRow(key)
        return self.rows[key]

    def _run_begun(self, event: dict[str, Any]) -> None:
        self.wanted, self.done_before = int(event["tasks"]), int(event["done"])
        self.begun, self.stopped, self.why = float(event["time"]), False, ""
        for key in [key for key, row in self.rows.items() if row.ended is None or row.error]:
            del self.rows[key]  # the start before was killed, or it is played again

    def _episode_begun(self, event: dict[str, Any]) -> None:
        key = str(event["task_id"])
        self.rows.pop(key, None)
        self.rows[key] = EpisodeRow(
            key,
            task_type=str(event["task_type"]),
            scene=str(event["scene"]),
            instruction=str(event["instruction"]),
            max_steps=int(event["max_steps"]),
            begun=float(event["time"]),
        )

    def _reply(self, event: dict[str, Any]) -> None:
        row = self._row(str(event["task_id"]))
        if not event.get("cached"):
            row.tokens += int(event["prompt_tokens"]) + int(event["completion_tokens"])
            row.cost += float(event["cost"])

    def _step(self, key: str, number: int, reward: float, action: str) -> None:
        row = self._row(key)
        row.steps = max(row.steps, number)
        row.reward += reward
        row.last = action

    def _other_step(self, event: dict[str, Any]) -> None:
        action = f"{event['verb']} {event.get('object_type', '')}".strip()
        self._step(str(event["task_id"]), int(event["step"]), float(event["reward"]), action)

    def _ended(self, event: dict[str, Any]) -> None:
        row = self._row(str(event["task_id"]))
        row.task_type = str(event["task_type"])
        row.ended, row.success = float(event["time"]), bool(event["success"])
        row.end_reason, row.error = str(event["end_reason"]), str(event.get("error", ""))
        row.steps, row.seconds = int(event["steps"]), float(event["seconds"])
        row.reward = float(event["total_reward"])

    def _run_ended(self, event: dict[str, Any]) -> None:
        self.stopped, self.why = True, str(event.get("stopped", ""))


_HANDLERS = {
    "run_begun": EventTail._run_begun,
    "episode_begun": EventTail._episode_begun,
    "reply": EventTail._reply,
    "step": EventTail._other_step,
    "episode_ended": EventTail._ended,
    "cost": lambda tail, event: None,
    "run_ended": EventTail._run_ended,
}
