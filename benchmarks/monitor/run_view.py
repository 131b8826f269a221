"""What the pages say of a run: progress, counts, and rows that can be filtered and sorted."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from benchmarks.monitor.directories import Directory
from benchmarks.monitor.episode_filter import Filter, room_number
from benchmarks.monitor.event_tail import EpisodeRow, EventTail
from benchmarks.monitor.fingerprint import in_use
from benchmarks.monitor.followed import Followed
from benchmarks.monitor.notes import NotesTail
from benchmarks.monitor.record_figures import (
    BESIDE_SUCCESS,
    FailureCounts,
    Means,
    RecordFigures,
)
from benchmarks.monitor.record_rows import RecordRows
from benchmarks.monitor.server_tail import ServerTail
from benchmarks.monitor.spending_tail import SpendingTail
from benchmarks.monitor.success_count import SuccessCount
from benchmarks.scoring.samples import TaskSamples, group_by, most_samples, task_samples
from er_gym.locking import LOCK
from er_gym.rollout.causes import count_causes
from er_gym.rollout.events import EVENTS, Cost
from er_gym.rollout.run_directory import (
    SERVER_EVENTS,
    SPENDING,
    Manifest,
    RunDirectory,
    RunDirectoryError,
)
from er_gym.tasks.types import task_type

_SILENT_SECONDS = 120.0
"""A run without a lock and without an event for so long is not counted as playing."""
_RECENT_SECONDS = 60.0


@dataclass(frozen=True)
class RunSummary:
    """A run at a moment.

    Attributes:
        directory: where it is.
        manifest: what is played; None if that cannot be read, and ``problem`` says why.
        state: ``playing``, ``finished``, ``stopped`` or ``waiting``.
        wanted: how many episodes it is to have.
        finished: how many of them have ended, without those that crashed and are played again.
        counts: episodes by outcome.
        success: over all.
        spent: so far, by the run's ledger; by its replies if it has none.
        decisions_per_second: in the last minute of play.
        seconds_left: by the speed of this start; None if unknown.
        begun: when its first episode began, seconds since the epoch; 0 if unknown.
        samples: how often a task was played, at most.
        causes: the causes of unusable replies, a line for each.
        tags: that people gave it.
        version: changes when anything does.
    """

    directory: Directory
    manifest: Manifest | None
    problem: str
    state: str
    wanted: int
    finished: int
    counts: Mapping[str, int]
    success: SuccessCount
    spent: Cost
    decisions_per_second: float
    seconds_left: float | None
    begun: float
    samples: int
    causes: Sequence[str]
    tags: Sequence[str]
    version: object


@dataclass
class RunView:
    """A run, followed while it grows. One thread at a time may use it.

    Attributes:
        directory: where it is.
        figures: what its records tell.
        noted: what people noted of it.
        spending, server: what its replies cost, and what its model server did.
    """

    directory: Directory
    figures: RecordFigures = field(default_factory=RecordFigures)
    _tail: EventTail = field(init=False)
    _records: RecordRows = field(init=False)
    spending: SpendingTail = field(init=False)
    server: ServerTail = field(init=False)
    noted: NotesTail = field(init=False)
    _rows: Mapping[str, EpisodeRow] = field(default_factory=dict)
    _manifest: Manifest | None = None
    _problem: str = ""
    _means: tuple[object, tuple[Means | None, Mapping[str, Means]]] | None = None

    def __post_init__(self) -> None:
        self._tail = EventTail(self.directory.path / EVENTS)
        self._records = RecordRows(self.directory.path)
        self.spending = SpendingTail(self.directory.path / SPENDING)
        self.server = ServerTail(self.directory.path / SERVER_EVENTS)
        self.noted = NotesTail(self.directory.path)

    def read(self) -> None:
        """Read what is new."""
        if self._manifest is None:
            try:
                self._manifest = RunDirectory.open(self.directory.path).manifest
                self._problem = ""
            except (RunDirectoryError, OSError) as error:
                self._problem = str(error)
        self._tail.read()
        self.spending.read()
        self.server.read()
        self._rows = self._records.agreeing(self._tail.rows)
        self._tell_notes()

    def _tell_notes(self) -> None:
        """Tell rows what is noted of them. Few have a note, and a row may be another object now."""
        before = self.noted.notes.episodes
        self.noted.read()
        for key in before:
            if key in self._rows:
                self._rows[key].note = None
        for key, note in self.noted.notes.episodes.items():
            if key in self._rows:
                self._rows[key].note = note

    def read_records(self, seconds: float) -> None:
        """Read records of episodes, for a while."""
        try:
            run = RunDirectory.open(self.directory.path)
        except (RunDirectoryError, OSError):
            return
        self.figures.read(run, self._rows, seconds)

    @property
    def failures(self) -> FailureCounts:
        """Why episodes failed, as far as their records have been read."""
        return FailureCounts.of(self._rows.values())

    def means(self) -> tuple[Means | None, Mapping[str, Means]]:
        """The metrics over all episodes whose records have been read, and those that stand beside
        success by group."""
        # While records are read, they are taken again for each twentieth of them.
        ended = sum(row.ended is not None for row in self._rows.values())
        at = 20 * self.figures.done // max(1, ended), ended, self._tail.version
        if self._means is None or self._means[0] != at:
            rows = self._rows.values()
            told = {
                name: Means.of(some, BESIDE_SUCCESS)
                for name, some in group_by(rows, lambda row: _group(row.task_type)).items()
            }
            by_group = {name: means for name, means in told.items() if means is not None}
            self._means = at, (Means.of(rows), by_group)
        return self._means[1]

    @property
    def rows(self) -> Mapping[str, EpisodeRow]:
        """The episodes by key."""
        return self._rows

    def summary(self, now: float | None = None) -> RunSummary:
        """The run at this moment."""
        now = time.time() if now is None else now
        tail, rows = self._tail, list(self._rows.values())
        counts = Counter(row.outcome for row in rows)
        again = sum(row.outcome == "crashed" and (row.ended or 0) < tail.begun for row in rows)
        finished = sum(counts.values()) - counts["playing"] - again
        wanted = max(tail.wanted or 0, finished)
        if tail.stopped:
            state = "finished" if finished >= wanted else "stopped"
        elif not tail.version:
            state = "waiting"
        else:
            state = "playing" if self._is_played(now - tail.time) else "stopped"
        since = [row for row in rows if row.ended is not None and row.ended >= tail.begun]
        spent = tail.time - tail.begun
        # A start that found nothing to play says nothing of the speed.
        last = max((row.ended for row in rows if row.ended), default=tail.time)
        left = None
        if state == "playing" and since and spent > 0:
            left = (wanted - finished) * spent / len(since)
        return RunSummary(
            directory=self.directory,
            manifest=self._manifest,
            problem=self._problem,
            state=state,
            wanted=wanted,
            finished=finished,
            counts=counts,
            success=SuccessCount.of("", rows),
            spent=self.spending.spent or _of_replies(rows),
            decisions_per_second=_speed(rows, tail.time if state == "playing" else last),
            seconds_left=left,
            begun=min((row.begun for row in rows if row.begun), default=tail.begun),
            samples=max((row.sample for row in rows), default=0),
            causes=self._causes(rows),
            tags=self.noted.notes.tags,
            version=(
                tail.version,
                self.spending.spent.requests if self.spending.spent else 0,
                self.server.counts.total(),
                self.noted.changed,
            ),
        )

    def _is_played(self, silent: float) -> bool:
        """Whether a process plays it: by its lock, or where there is none by its last event."""
        path = self.directory.path
        return in_use(path) if (path / LOCK).exists() else silent < _SILENT_SECONDS

    def _causes(self, rows: Iterable[EpisodeRow]) -> list[str]:
        settings = self._manifest.agent_settings if self._manifest else {}
        found = count_causes(row.causes for row in rows if row.causes is not None)
        return [each.sentence(settings) for each in found]

    def chosen(self, filter: Filter) -> list[EpisodeRow]:
        """The rows that a filter takes, sorted."""
        if filter.failure:
            self.read_records(0.0)
        return filter.chosen(self._rows.values())

    def success_counts(self) -> tuple[list[SuccessCount], list[SuccessCount]]:
        """Success by group and by task type, in the order of the paper's table."""
        by_type: dict[str, list[EpisodeRow]] = {}
        for row in self._rows.values():
            by_type.setdefault(row.task_type, []).append(row)
        by_group: dict[str, list[EpisodeRow]] = {}
        for name, rows in by_type.items():
            by_group.setdefault(_group(name), []).extend(rows)
        return (
            [SuccessCount.of(name, rows) for name, rows in by_group.items()],
            [SuccessCount.of(name, rows) for name, rows in sorted(by_type.items())],
        )

    def sample_counts(self) -> list[tuple[str, TaskSamples]]:
        """Success by task, over all ("") and by group; empty if each was played once."""
        ended = [row.result for row in self._rows.values() if row.result is not None]
        samples = most_samples(ended)
        if samples < 2:
            return []
        by_group = group_by(ended, lambda row: _group(row.task_type))
        found = [
            (name, task_samples(rows, samples)) for name, rows in {"": ended, **by_group}.items()
        ]
        return [(name, counted) for name, counted in found if counted is not None]

    def choices(self) -> dict[str, list[str]]:
        """The values by which rows can be filtered."""
        rows = self._rows.values()
        return {
            "type": sorted({row.task_type for row in rows}),
            "scene": sorted({row.scene for row in rows}, key=room_number),
            "outcome": sorted({row.outcome for row in rows}),
            "failure": sorted({row.failure for row in rows} - {""}),
            "reason": sorted({row.end_reason for row in rows} - {""}),
        }


def _of_replies(rows: Sequence[EpisodeRow]) -> Cost:
    """What replies cost by the event stream, which does not tell how many of them were paid for."""
    tokens, cost = sum(row.tokens for row in rows), sum(row.cost for row in rows)
    return Cost(requests=0, tokens=tokens, cost=cost)


def _group(name: str) -> str:
    try:
        return task_type(name).group
    except (KeyError, ValueError):
        return "-"


def _speed(rows: Sequence[EpisodeRow], until: float) -> float:
    """Decisions per second over the last minute before a time, from the episodes in it."""
    recent = [row for row in rows if (row.ended or until) > until - _RECENT_SECONDS]
    begun = min((row.begun for row in recent if row.begun), default=until)
    spent = until - max(begun, until - _RECENT_SECONDS)
    steps = sum(row.steps * _share(row, until) for row in recent)
    return steps / spent if spent > 0 else 0.0


def _share(row: EpisodeRow, until: float) -> float:
    """Which part of an episode lies in the last minute."""
    end, begin = row.ended or until, row.begun
    if end <= begin:
        return 1.0
    return (end - max(begin, until - _RECENT_SECONDS)) / (end - begin)


def run_views() -> Followed[RunView]:
    """All runs that have been looked at."""
    return Followed(RunView)
