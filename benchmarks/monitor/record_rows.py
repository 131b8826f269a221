"""The episodes of a run as its records have them; the event stream alone can say too much or too
little.

A process that was killed between a record and its event leaves a result without an event, and a
record that somebody took away leaves an event without a result. Reports count records, so pages do.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from benchmarks.monitor.event_tail import EpisodeRow
from benchmarks.monitor.fingerprint import in_use
from er_gym.rollout.causes import causes_in
from er_gym.rollout.outcomes import succeeded
from er_gym.rollout.records import EpisodeRecord
from er_gym.rollout.run_directory import EPISODES, RunDirectory, RunDirectoryError
from er_gym.writing import file_stem


@dataclass
class RecordRows:
    """Follows the folder of a run's records.

    Attributes:
        path: the run directory.
    """

    path: Path
    _names: frozenset[str] = frozenset()
    _changed: tuple[int, int] = (0, 0)
    _files: dict[str, str] = field(default_factory=dict)
    """The file of each episode's record, by its key."""
    _read: dict[str, tuple[int, EpisodeRow | None]] = field(default_factory=dict)
    """By file: when it was changed last, and the row that it gives; None if it is no episode."""

    def agreeing(self, rows: Mapping[str, EpisodeRow]) -> dict[str, EpisodeRow]:
        """The rows of the event stream, without results that have no record, and with those that
        have no event. The latter are looked for in a run that nobody plays: else they are late."""
        if not self._look():
            return dict(rows)
        found: dict[str, EpisodeRow] = {}
        told = set()
        for key, row in rows.items():
            file = self._file(key)
            if row.ended is None or file in self._names:
                found[key] = row
            if row.result is not None:
                told.add(file)
        if self._names - told and not in_use(self.path):
            for name in sorted(self._names - told):
                one = self._row(name)
                if one is not None:
                    found[one.key] = _joined(found.get(one.key), one)
        return found

    def _look(self) -> bool:
        """Read the names in the folder if it has changed; False if there is no folder."""
        folder = self.path / EPISODES
        try:
            status = folder.stat()
            changed = status.st_mtime_ns, status.st_ino
            if changed != self._changed:
                self._names = frozenset(each for each in os.listdir(folder) if each[-5:] == ".json")
                self._changed = changed
        except OSError:
            return False
        return True

    def _file(self, key: str) -> str:
        if key not in self._files:
            self._files[key] = f"{file_stem(key)}.json"
        return self._files[key]

    def _row(self, name: str) -> EpisodeRow | None:
        file = self.path / EPISODES / name
        try:
            changed = file.stat().st_mtime_ns
            if self._read.get(name, (0, None))[0] != changed:
                record = RunDirectory.open(self.path).episode_in(name)
                self._read[name] = changed, _row_of(record, changed / 1e9)
        except (RunDirectoryError, OSError):
            return None
        except ValueError:  # not one of this run's
            self._read[name] = changed, None
        return self._read[name][1]


def _row_of(record: EpisodeRecord, ended: float) -> EpisodeRow:
    return EpisodeRow(
        record.key,
        task_type=record.task_type,
        scene=record.scene,
        instruction=record.instruction,
        max_steps=record.max_steps,
        begun=ended - record.seconds,
        ended=ended,
        success=succeeded(record.success, record.error),
        end_reason=record.end_reason,
        error=record.error,
        steps=sum(not step.appended for step in record.steps[1:]),
        reward=record.total_reward,
        seconds=record.seconds,
        causes=causes_in(record),
        side_effects=None if record.side_effects is None else len(record.side_effects),
    )


def _joined(playing: EpisodeRow | None, told: EpisodeRow) -> EpisodeRow:
    """The result of a record, with what only the stream tells of its episode."""
    if playing is None:
        return told
    return replace(told, begun=playing.begun, tokens=playing.tokens, cost=playing.cost)
