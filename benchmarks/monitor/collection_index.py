"""What the pages need of a collection's trajectories, read in one pass and without holding them.

Most of a trajectory is what was in view, which no list shows. A line as er-gym writes it is
therefore searched, not parsed: the names of its fields stand in quotes, and quotes within texts are
written ``\\"``, so a name cannot be taken for a text. Other lines are parsed.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from sys import intern
from typing import Any

from pydantic import TypeAdapter

from benchmarks.monitor.directories import Directory
from benchmarks.monitor.followed import Followed
from benchmarks.monitor.line_tail import LineFollower, Lines
from er_gym.data.collection import TRAJECTORIES
from er_gym.data.paper_figures import ACTION, BEGIN
from er_gym.data.statistics import Statistics
from er_gym.data.trajectory import THOUGHT_KINDS

_JSON: TypeAdapter[Any] = TypeAdapter(Any)
_TURN, _VERB, _TURNS, _END = b'"purpose":"', b',"verb":"', b',"turns":[', b'],"success":'
_THOUGHT = re.compile(
    rb'\{"kind":"(\w+)","text":"[^"\\]*(?:\\.[^"\\]*)*","writer":"[^"\\]*","refused":\[([^\]]*)\]'
)
_FORMAT = b'{"format":"er-gym/trajectory/'
_NOT_LEARNT = b'"train":false'
_MOST_TEXT = 300
_MOST_KEPT = 16


@dataclass(frozen=True, slots=True)
class TrajectoryHead:
    """The fields of a trajectory that lists show.

    Attributes:
        offset: of its line's first byte.
        id, part, kind, task_type, scene, language, actor, instruction: the trajectory's.
        success: the environment's verdict.
        turns: how many it has, and ``learnt``: how many of them are to be learnt from.
        thoughts: how many thoughts it has.
        refused: why the critic refused some, a code each.
    """

    offset: int
    id: str
    part: str
    kind: str
    task_type: str
    scene: str
    language: str
    actor: str
    instruction: str
    success: bool
    turns: int
    learnt: int
    thoughts: int
    refused: tuple[str, ...]


@dataclass
class CollectionIndex(LineFollower):
    """The trajectories of a collection.

    Attributes:
        heads: in the file's order.
        found: counts as ``er-gym data stats`` has them, those that need no words read.
        lengths: number of turns to number of trajectories.
        damaged: how many lines are no trajectory.
    """

    longest = 64 * 2**20  # one with more bytes is damaged

    heads: list[TrajectoryHead] = field(default_factory=list)
    found: Statistics = field(default_factory=Statistics)
    lengths: Counter[int] = field(default_factory=Counter)
    damaged: int = 0
    _places: dict[str, int] = field(default_factory=dict)

    def at(self, id: str) -> TrajectoryHead | None:
        """The trajectory with an id; None if there is none."""
        place = self._places.get(id)
        return None if place is None else self.heads[place]

    def _take(self, lines: Lines) -> None:
        self.damaged += lines.passed_over
        offset = lines.offset
        for line in lines.lines:
            self._take_line(line, offset)
            offset += len(line) + 1

    def _take_line(self, line: bytes, offset: int) -> None:
        try:
            told, turns, learnt = _searched(line) or _parsed(line)
            head = self._head(offset, told, turns, learnt)
        except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
            self.damaged += 1
            return
        self._places.setdefault(head.id, len(self.heads))
        self.heads.append(head)
        found = self.found
        found.task_types[head.task_type] += 1
        found.languages[head.language] += 1
        found.turns += head.turns
        found.trained_turns += head.learnt
        found.refused.update(head.refused)
        self.lengths[head.turns] += 1
        for kinds, _ in turns:
            found.thoughts.update(kinds)
        before = BEGIN
        for kinds, _ in turns:
            for state in (*kinds, ACTION):
                found.transitions[before][state] += 1
                before = state

    def _head(
        self, offset: int, told: Mapping[str, Any], turns: _Turns, learnt: int
    ) -> TrajectoryHead:
        return TrajectoryHead(
            offset=offset,
            id=_text(told["id"]),
            part=_shared(told.get("part", "")),
            kind=_shared(told["kind"]),
            task_type=_shared(told["task_type"]),
            scene=_shared(told["scene"]),
            language=_shared(told.get("language", "en")),
            actor=_shared(told.get("actor", "")),
            instruction=_text(told["instruction"])[:_MOST_TEXT],
            success=told["success"] is True,
            turns=len(turns),
            learnt=learnt,
            thoughts=sum(len(kinds) for kinds, _ in turns),
            refused=tuple(_shared(code) for _, codes in turns for code in codes),
        )


_Turns = Sequence[tuple[Sequence[str], Sequence[str]]]
"""The kinds of each turn's thoughts, and why thoughts of it were refused."""


def _searched(line: bytes) -> tuple[dict[str, Any], _Turns, int] | None:
    """A line's fields beside the turns, its turns, and how many of them are to be learnt from;
    None if it is not written as er-gym writes lines."""
    begin, end = line.find(_TURNS), line.rfind(_END)
    if not line.startswith(_FORMAT) or not 0 < begin < end:
        return None
    told = _JSON.validate_json(line[:begin] + b"}")
    told |= _JSON.validate_json(b"{" + line[end + 2 :])
    _, *parts = line[begin:end].split(_TURN)
    turns = []
    for part in parts:
        thoughts = _THOUGHT.findall(part, 0, max(0, part.find(_VERB)))
        codes = [code for _, all_codes in thoughts if all_codes for code in _codes(all_codes)]
        turns.append(([_kind(kind) for kind, _ in thoughts], codes))
    return told, turns, len(turns) - line.count(_NOT_LEARNT, begin, end)


def _parsed(line: bytes) -> tuple[dict[str, Any], _Turns, int]:
    """The same of any line."""
    told = _JSON.validate_json(line)
    turns = []
    for turn in told["turns"]:
        thoughts = turn.get("thoughts", [])
        codes = [code for each in thoughts for code in each.get("refused", [])]
        turns.append(([_kind(each["kind"].encode()) for each in thoughts], codes))
    return told, turns, sum(turn.get("train", True) is True for turn in told["turns"])


def _codes(text: bytes) -> list[str]:
    found = json.loads(b"[" + text + b"]")
    return [str(each) for each in found]


_KINDS = {kind.encode(): kind for kind in THOUGHT_KINDS}


def _kind(name: bytes) -> str:
    return _KINDS[name]  # a KeyError: it is no trajectory


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError
    return value


def _shared(value: object) -> str:
    """A text that many trajectories have, kept once."""
    return intern(_text(value)[:_MOST_TEXT])


class Collections(Followed[CollectionIndex]):
    """The collections that were looked at last; safe for threads."""

    def __init__(self) -> None:
        super().__init__(
            lambda directory: CollectionIndex(directory.path / TRAJECTORIES), _MOST_KEPT
        )
        self._counts: dict[Path, tuple[tuple[int, int, int], int]] = {}

    def count(self, directory: Directory) -> int | None:
        """How many lines a collection has; None if there is no file (yet)."""
        file = directory.path / TRAJECTORIES
        try:
            status = file.stat()
            state = status.st_ino, status.st_size, status.st_mtime_ns
            if file not in self._counts or self._counts[file][0] != state:
                with file.open("rb") as lines:
                    number = sum(
                        chunk.count(b"\n") for chunk in iter(lambda: lines.read(2**20), b"")
                    )
                self._counts[file] = state, number
            return self._counts[file][1]
        except OSError:
            return None
