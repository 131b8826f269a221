"""The run directory: a manifest of what is played, and one file per episode.

::

    runs/x/run.json                      the manifest
    runs/x/events.jsonl                  the events in order, see er_gym.rollout.events
    runs/x/episodes/<task id>.json       the record of each episode
    runs/x/conversations/<task id>.json  the messages of a vision-language agent
    runs/x/pictures/<task id>/           the pictures that the agent was shown

Where a task is played several times, the files of a later episode are named
``<task id>.sample2`` and so on (:func:`.records.episode_key`).

An agent may leave other files beside the records (:class:`.agent.LeavesAttachments`). A file is
written under a temporary name and then moved, so each file is whole. Readers ignore the temporary
files of a killed run. The same run continues where it stopped: :meth:`RunDirectory.read` returns
the episodes it has. One process at a time plays in a directory (:meth:`RunDirectory.locked`).
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import shutil
import sqlite3
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, ValidationError

from er_gym.envs.protocol import DEFAULT
from er_gym.resumable import FolderConflict, FolderKind, ResumableFolder, has_content
from er_gym.rollout.agent import CannotGoOn
from er_gym.rollout.events import EVENTS
from er_gym.rollout.play import episode_seed
from er_gym.rollout.records import EpisodeRecord
from er_gym.tasks.errors import SetAsideTask, Substitution, TaskFileError, first_problem
from er_gym.tasks.reading import read_bytes
from er_gym.writing import file_stem, make_folder, write_atomic

MANIFEST = "run.json"
EPISODES = "episodes"
CONVERSATIONS = "conversations"
PICTURES = "pictures"
SPENDING = "spending.jsonl"
REPLIES = "replies"
_DATABASE = "cache.db"
"""The file of diskcache in the folder of replies."""
SERVER_EVENTS = "server-events.jsonl"
NOTES = "notes.json"
"""What people note of the run, see :mod:`benchmarks.monitor.notes`."""


class RunDirectoryError(FolderConflict):
    """The directory cannot be used for this run; the message says why and what to do."""


class Manifest(BaseModel):
    """What a run plays. Two runs with equal manifests may share a directory.

    Attributes:
        format: the version of this layout.
        suite: the suite's name.
        suite_digest: the digest of the suite's tasks.
        suite_size: the number of the suite's tasks that can be played; a run may have played fewer.
        agent: the agent's spec.
        agent_settings: the settings of a model agent that determine its replies.
        env: the keyword arguments of the environment.
        seed: the run's seed; the seed of every episode is derived from it.
        er_gym: the version of the package.
        set_aside: the suite's tasks that cannot be played, and why; ``suite_size`` leaves them out.
        taken: the substitutes for objects that the tasks name and their scenes lack.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal["er-gym/run/1"] = "er-gym/run/1"
    suite: str
    suite_digest: str
    suite_size: int
    agent: str
    agent_settings: dict[str, Any] = {}
    env: dict[str, Any]
    seed: int
    er_gym: str
    set_aside: tuple[SetAsideTask, ...] = ()
    taken: tuple[Substitution, ...] = ()

    @property
    def protocol(self) -> str:
        """The rules by which episodes are played, see :mod:`er_gym.envs.protocol`."""
        return str(self.env.get("protocol", DEFAULT.name))

    @property
    def digest(self) -> str:
        """The id of the run in its episodes: 16 hex digits of a sha256. Fields at their default do
        not change it, so later versions can add fields."""
        told = self.model_dump(mode="json", exclude_defaults=True)
        return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()[:16]


@dataclass(frozen=True)
class UnusableFile:
    """A file in the folder of episodes that is not an episode of this run.

    Attributes:
        path: the file.
        reason: why it is not usable.
    """

    path: Path
    reason: str

    def __str__(self) -> str:
        line = f"{EPISODES}/{self.path.name}: {self.reason}"
        return "".join(char if char.isprintable() else "?" for char in line)


@dataclass(frozen=True)
class RunContents:
    """The contents of a run directory.

    Attributes:
        episodes: the episodes, sorted by file name.
        unusable: the other files in their folder.
    """

    episodes: tuple[EpisodeRecord, ...]
    unusable: tuple[UnusableFile, ...]


def _compared(there: Manifest, here: Manifest) -> tuple[dict[str, Any], dict[str, Any]]:
    """All of both, the protocol first: where it differs, that tells the most."""
    protocols = {"protocol": there.protocol}, {"protocol": here.protocol}
    return protocols[0] | there.model_dump(mode="json"), protocols[1] | here.model_dump(mode="json")


RUN = FolderKind(
    noun="run",
    command="er-gym bench",
    manifest=MANIFEST,
    model=Manifest,
    parts=(EPISODES, CONVERSATIONS, PICTURES, SPENDING, SERVER_EVENTS, REPLIES, EVENTS, NOTES),
    holds_something=lambda path: has_content(path / EPISODES) or _has_replies(path),
    shared=True,
    compared=_compared,
    error=RunDirectoryError,
)


class RunDirectory(ResumableFolder[Manifest]):
    """A run directory."""

    KIND = RUN

    def __init__(self, path: Path, manifest: Manifest) -> None:
        super().__init__(path, manifest)
        self._digest = manifest.digest

    @classmethod
    @contextlib.contextmanager
    def locked(cls, path: Path, manifest: Manifest) -> Iterator[RunDirectory]:
        """A run directory to play in, locked against other processes.

        If the block raises before there is anything to lose, a run that began here is removed
        (:meth:`er_gym.resumable.FolderKind.locked`). Episodes that crashed because the model
        refused are nothing to lose: they tell no more than the error.

        Raises:
            Locked: another process plays in it.
            RunDirectoryError: another run's results are there; nothing is changed.
            OSError: the directory cannot be made or written to.
        """
        with RUN.locked(path, manifest) as begins:
            directory = cls(path, manifest)
            try:
                yield directory
            except CannotGoOn:
                if (
                    begins
                    and not _has_replies(path)
                    and all(one.error for one in directory.episodes())
                ):
                    shutil.rmtree(path / EPISODES, ignore_errors=True)
                raise

    def write(self, episode: EpisodeRecord) -> Path:
        """Write an episode; it replaces an earlier one of the same task and sample."""
        path = self._file(episode.key)
        make_folder(path.parent)
        told = episode.model_copy(update={"run": self._digest})
        write_atomic(path, told.model_dump_json(indent=1) + "\n")
        return path

    def has(self, key: str) -> bool:
        """Whether there is a record of an episode, crashed or not; it is written last."""
        return self._file(key).is_file()

    def forget(self, key: str) -> None:
        """Remove the record of an episode, so that it is played again."""
        self._file(key).unlink(missing_ok=True)

    def attach(self, key: str, attachments: Mapping[str, bytes], folders: Sequence[str]) -> None:
        """Write the files that an agent leaves; they replace earlier ones of the same episode.

        Args:
            key: of the episode.
            attachments: path in the run directory to bytes, written in this order.
            folders: the folders for such files. The episode's earlier files in them are removed.
        """
        if not attachments and not folders:
            return
        stem = file_stem(key)
        played_before = self._file(key).exists()
        for folder in folders:
            shutil.rmtree(self.path / folder / stem, ignore_errors=True)
            if played_before:
                for old in (self.path / folder).glob("*.*"):
                    if old.stem == stem and f"{folder}/{old.name}" not in attachments:
                        old.unlink()
        for name, data in attachments.items():
            place = self.path / name
            make_folder(place.parent)
            write_atomic(place, data)

    def read(self) -> RunContents:
        """All episodes, and the unusable files among them: broken, copied or foreign."""
        found = [*self._files()]
        return RunContents(
            tuple(each for each in found if isinstance(each, EpisodeRecord)),
            tuple(each for each in found if isinstance(each, UnusableFile)),
        )

    def episodes(self) -> Iterator[EpisodeRecord]:
        """All episodes of this run, sorted by file name; each is read when it is asked for."""
        return (each for each in self._files() if isinstance(each, EpisodeRecord))

    def episode(self, key: str) -> EpisodeRecord:
        """One episode of this run.

        Raises:
            ValueError: there is none, or its file is not usable; the message says why.
        """
        return self._episode(self._file(key))

    def episode_in(self, name: str) -> EpisodeRecord:
        """The episode in a file of the folder of episodes.

        Raises:
            ValueError: the file is not usable; the message says why.
        """
        return self._episode(self.path / EPISODES / name)

    def move_aside(self, keys: Iterable[str]) -> list[str]:
        """Rename unusable files that have the file name of one of these episodes.

        Returns:
            One line for each unusable file: the reason, and whether the file was renamed.
        """
        ways = {self._file(key) for key in keys}
        told = []
        for one in self.read().unusable:
            then = "it is not counted"
            if one.path in ways:
                aside = _free_name(one.path)
                one.path.rename(aside)
                then = f"it is now {aside.name}, and the task is played anew"
            told.append(f"{self.path / str(one)}; {then}")
        return told

    def _files(self) -> Iterator[EpisodeRecord | UnusableFile]:
        for path in sorted((self.path / EPISODES).glob("*.json")):
            try:
                yield self._episode(path)
            except ValueError as error:
                yield UnusableFile(path, str(error))

    def _file(self, key: str) -> Path:
        return self.path / EPISODES / f"{file_stem(key)}.json"

    def _episode(self, path: Path) -> EpisodeRecord:
        """The episode in a file; a ValueError says in one line why it is not one of this run's."""
        if not path.is_file():  # reading a pipe would block
            raise ValueError("not a regular file")
        try:
            episode = EpisodeRecord.model_validate_json(read_bytes(path))
        except ValidationError as error:
            raise ValueError(f"broken: {first_problem(error)}") from None
        except TaskFileError as error:
            raise ValueError(f"it cannot be read: {error}") from None
        name = self._file(episode.key).name
        if name != path.name:
            raise ValueError(f"a copy: it holds the episode of {episode.key!r:.80}, as {name}")
        manifest = self.manifest
        if episode.run:
            told: list[tuple[str, str | int, str | int]] = [("run", episode.run, self._digest)]
        else:  # written before episodes named their run
            seed = episode_seed(manifest.seed, episode.task_id)
            told = [("agent", episode.agent, manifest.agent), ("seed", episode.seed, seed)]
        for what, its, ours in told:
            if its != ours:
                raise ValueError(f"of another run: its {what} is {its!r:.80}, not {ours!r:.80}")
        return episode.model_copy(update={"run": ""})


def _has_replies(path: Path) -> bool:
    """Whether a run directory holds replies that were paid for or are kept."""
    if has_content(path / SPENDING):
        return True
    file = (path / REPLIES / _DATABASE).absolute()  # it is made before the first reply
    try:
        with contextlib.closing(sqlite3.connect(f"{file.as_uri()}?mode=ro", uri=True)) as database:
            return database.execute("SELECT 1 FROM Cache LIMIT 1").fetchone() is not None
    except sqlite3.Error:
        return has_content(path / REPLIES)


def _free_name(path: Path) -> Path:
    """A free name beside a file. It does not end in ``.json``, so readers do not take it for an
    episode."""
    number = 1
    while (aside := path.with_name(f"{path.name}.aside-{number}")).exists():
        number += 1
    return aside
