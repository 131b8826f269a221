"""Checks a submission: what it claims against its records, and its records against the engine."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from benchmarks.leaderboard.packing import versions
from benchmarks.leaderboard.problems import Problem
from benchmarks.leaderboard.record_checks import by_records, by_suite
from benchmarks.leaderboard.replaying import (
    compared,
    foreign_pictures,
    picture_settings,
    pictures_of,
    played_again,
)
from benchmarks.leaderboard.submission import Submission, read_submission
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.suites import Suite
from er_gym.tasks.task import Task


@dataclass(frozen=True)
class Checked:
    """A submission that was checked.

    Attributes:
        path: the file.
        submission: what it holds; None if it cannot be read.
        problems: what is wrong; empty for an honest one.
        episodes: its records; those that tell no side effects have them as the engine told them.
        replayed: how many episodes were played again.
        notes: what could not be checked here, in words.
    """

    path: Path
    submission: Submission | None
    problems: tuple[Problem, ...]
    episodes: tuple[EpisodeRecord, ...] = ()
    replayed: int = 0
    notes: tuple[str, ...] = ()


FindSuite = Callable[[str], Suite]
"""Gives the suite of a name, or raises ValueError: only er-gym's own, and fresh tasks of these."""


def check(
    path: Path,
    find_suite: FindSuite,
    *,
    replay: bool = True,
    say: Callable[[int, int], None] = lambda done, of: None,
) -> Checked:
    """Check a submission.

    Args:
        path: the file, of whoever.
        find_suite: where tasks come from.
        replay: whether to do the actions again on the engine.
        say: told how many episodes of how many have been played again.
    """
    try:
        submission = read_submission(path)
    except TaskFileError as error:
        return Checked(path, None, (Problem("file", "", str(error)),))
    found = [*by_records(submission)]
    try:
        suite = find_suite(submission.header.manifest.suite)
    except ValueError as error:
        return Checked(
            path, submission, (*found, Problem("suite", "", str(error))), submission.episodes
        )
    found += by_suite(submission, suite)
    notes: list[str] = []
    told = {each.key: each for each in submission.episodes}
    replayed = 0
    if replay and not any(each.kind in ("rules", "suite") for each in found):
        tasks = {task.id: task for task in suite.tasks}
        playable = [each for each in submission.episodes if each.task_id in tasks]
        with _Environments(submission.header.manifest.env) as environments:
            for replayed, record in enumerate(playable, 1):
                try:
                    again = played_again(environments["text"], tasks[record.task_id], record)
                    words = [*compared(record, again)]
                except (TypeError, ValueError) as error:
                    words = [f"it cannot be played: {error}"]
                else:
                    told[record.key] = _whole(record, again)
                found += [Problem("replay", record.key, each) for each in words]
                say(replayed, len(playable))
            found += _by_pictures(environments, submission, tasks, notes)
    episodes = tuple(told[each.key] for each in submission.episodes)
    return Checked(path, submission, tuple(found), episodes, replayed, tuple(notes))


def _whole(record: EpisodeRecord, again: EpisodeRecord) -> EpisodeRecord:
    """A record with the side effects that the engine told, where it tells none: an older one."""
    if record.side_effects is not None or again.side_effects is None:
        return record
    return record.model_copy(update={"side_effects": again.side_effects})


# -- by the engine ---------------------------------------------------------------------------------


class _Environments:
    """The environments of a submission, made when they are needed; use it in a ``with``.

    Args:
        arguments: those of its run.
    """

    def __init__(self, arguments: Mapping[str, Any]) -> None:
        self._arguments = arguments
        self._made: dict[str, EmbodiedEnv] = {}

    def __enter__(self) -> _Environments:
        return self

    def __exit__(self, *error: object) -> None:
        for env in self._made.values():
            env.close()

    def __getitem__(self, obs_mode: str) -> EmbodiedEnv:
        if obs_mode not in self._made:
            self._made[obs_mode] = EmbodiedEnv((), **{**self._arguments, "obs_mode": obs_mode})
        return self._made[obs_mode]


def _by_pictures(
    environments: _Environments,
    submission: Submission,
    tasks: Mapping[str, Task],
    notes: list[str],
) -> Iterator[Problem]:
    shown = [
        (record, talk)
        for record in submission.episodes
        if (talk := submission.conversations.get(record.key)) is not None and pictures_of(talk)
    ]
    if not shown:
        return
    here, there = versions(), submission.header.versions
    apart = [name for name in ("pillow", "panda3d", "numpy") if here.get(name) != there.get(name)]
    if apart:
        notes.append(
            f"the pictures are not compared: {apart[0]} is {here.get(apart[0])} here and "
            f"{there.get(apart[0], 'none')!r:.40} there"
        )
        return
    for record, talk in shown:
        task = tasks.get(record.task_id)
        if task is None:  # which is told as a problem of its own
            continue
        try:
            settings = picture_settings(talk)
            if settings.noise:
                notes.append(f"{record.key}: it was shown noise, which is not compared")
                continue
            env = environments["rgb+text"]
            found = [*foreign_pictures(env, task, record, talk, settings)]
        except (TypeError, ValueError) as error:
            found = [f"it cannot be drawn: {error}"]
        yield from (Problem("picture", record.key, words) for words in found)
