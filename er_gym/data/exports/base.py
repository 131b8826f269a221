"""What all export formats share: options, splits, pictures, counts, and how files are written."""

from __future__ import annotations

import json
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path, PurePosixPath
from typing import Any, Literal, TypeAlias

from er_gym.data.chat import Chat, ChatTurn
from er_gym.data.collection import Collection
from er_gym.data.dialects import Dialect
from er_gym.data.picture_folder import PictureFolder, PicturesElsewhere, picture_name
from er_gym.data.pictures import picture_size
from er_gym.data.trajectory import Language, PictureRecord, Trajectory
from er_gym.writing import OutsideFolder, file_stem, inside

Split: TypeAlias = Literal["train", "validation"]
SPLITS: tuple[Split, ...] = ("train", "validation")
"""``validation`` holds the trajectories of held-out rooms. These are the names by which the
``datasets`` library tells splits."""
PICTURES = "pictures"


class ExportError(ValueError):
    """A collection cannot be exported; the message says why and what to do."""


@dataclass(frozen=True)
class ExportOptions:
    """What a user chooses.

    Attributes:
        dialect: the name of a dialect, or a folder (:mod:`er_gym.data.dialects`).
        language: of the dialect's texts; by default that of each trajectory's thoughts.
        held_out: rooms, such as ``FloorPlan1``, or the share of the rooms that is held out.
        per_turn: one sample for each turn that is learnt, also of trajectories in which all are
            (formats ``sharegpt`` only; the ``trl-turns`` format always does so).
        copy: copy pictures instead of linking them.
        tasks_file: the task file that was played, for formats that play the trajectories again;
            by default the collection's suite is loaded by its name.
    """

    dialect: str = "tags"
    language: Language | None = None
    held_out: tuple[str, ...] | float = ()
    per_turn: bool = False
    copy: bool = False
    tasks_file: Path | None = None


@dataclass(frozen=True)
class ExportSummary:
    """What an export holds.

    Attributes:
        format: its name.
        trajectories: how many were exported; ``left_out``: why others were not, with counts.
        samples: by split.
        turns: the turns of these trajectories; ``trained_turns``: those that are learnt.
        pictures: the picture files; ``shown``: the places in samples where a picture is shown,
            which are more if samples repeat the beginning of a trajectory.
        linked: how many of the files are hard links.
        outside: of the pictures that lie outside the collection, links resolved.
    """

    format: str
    trajectories: int
    left_out: Mapping[str, int]
    samples: Mapping[str, int]
    turns: int
    trained_turns: int
    pictures: int
    shown: int
    linked: int
    outside: PicturesElsewhere


Progress: TypeAlias = Callable[[int, int], None]
"""Is told how many trajectories are done, and of how many."""


@dataclass
class ExportJob:
    """An export under way: what a format reads, and where it writes.

    Attributes:
        collection: what is exported.
        folder: where to; it becomes the output when the format has written everything.
        options: the user's.
        dialect: the dialect that the options name.
        held_out: the rooms of the split ``validation``.
        total: how many trajectories the collection has.
        progress: see :data:`Progress`.
    """

    collection: Collection
    folder: Path
    options: ExportOptions
    dialect: Dialect
    held_out: frozenset[str]
    total: int
    progress: Progress
    left_out: Counter[str] = field(default_factory=Counter)
    samples: Counter[str] = field(default_factory=Counter)
    counts: Counter[str] = field(default_factory=Counter)
    picture_folder: PictureFolder = field(init=False)
    _folders: set[PurePosixPath] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.picture_folder = PictureFolder(self.folder, copy=self.options.copy)

    def trajectories(self) -> Iterator[tuple[Split, Trajectory]]:
        """The trajectories with their splits, one at a time."""
        for number, trajectory in enumerate(self.collection.trajectories(), 1):
            if trajectory.turns:
                yield self.split(trajectory), trajectory
            else:
                self.leave_out("no turns")
            self.progress(number, self.total)

    def chats(self, under: Mapping[Split, str] | None = None) -> Iterator[tuple[Split, Chat]]:
        """The conversations with a turn to learn; their pictures are files of the output.

        Args:
            under: for each split, the folder of the output to which the paths of its pictures are
                relative; by default the output itself.
        """
        for split, trajectory in self.trajectories():
            if any(turn.train for turn in trajectory.turns):
                chat = self.dialect.chat(trajectory, self.options.language)
                self.take(trajectory)
                yield split, self.with_pictures(chat, (under or {}).get(split, ""))
            else:
                self.leave_out("no turn is to be learnt")

    def split(self, trajectory: Trajectory) -> Split:
        """The split of a trajectory, by its room."""
        return "validation" if room(trajectory.scene) in self.held_out else "train"

    def with_pictures(self, chat: Chat, under: str = "") -> Chat:
        """Put the pictures of a conversation into ``under/pictures/ID/``; their paths in the
        conversation that is returned are relative to ``under``."""
        folder = self.new_folder(PurePosixPath(PICTURES), chat.id)
        number = 0
        turns: list[ChatTurn] = []
        for turn in chat.turns:
            parts = []
            for part in turn.parts:
                if not isinstance(part, str):
                    path = folder / picture_name(f"{number:03}", part)
                    self.place(part, self.folder / under / path)
                    part = part.model_copy(update={"path": str(path)})
                    number += 1
                parts.append(part)
            turns.append(replace(turn, parts=tuple(parts)))
        return replace(chat, turns=tuple(turns))

    def new_folder(self, parent: PurePosixPath, name: str) -> PurePosixPath:
        """A folder of the output for a name from the collection, which no other name has."""
        stem = file_stem(name)
        folder, number = parent / stem, 1
        while folder in self._folders:
            number += 1
            folder = parent / f"{stem}-{number}"
        self._folders.add(folder)
        return folder

    def place(self, picture: PictureRecord, to: Path) -> None:
        """Link a picture of the collection to a file of the output, or copy it.

        Raises:
            ExportError: the collection lacks the picture.
            OutsideFolder: the file would not be in the output.
            UnusablePicture: it is no picture.
            OSError: it cannot be written, or is there already.
        """
        try:
            path = to.relative_to(self.folder)
        except ValueError:
            raise OutsideFolder(f"{to} is not in the output {self.folder}") from None
        self.picture_folder.place(self.source(picture), PurePosixPath(path), self.collection.path)

    def embedded(self, chat: Chat) -> list[dict[str, Any]]:
        """The pictures of a conversation as ``datasets`` keeps them in a file, bytes and name.

        Raises:
            ExportError: the collection lacks one.
            UnusablePicture: one is no picture.
        """
        files = [self.source(picture) for picture in chat.pictures]
        for file in files:
            picture_size(file)
            self.picture_folder.look(file, self.collection.path)
        self.picture_folder.pictures += len(files)
        return [{"bytes": file.read_bytes(), "path": file.name} for file in files]

    def source(self, picture: PictureRecord) -> Path:
        """The file of a picture in the collection.

        Raises:
            ExportError: it is not there, or its path leads out of the collection.
        """
        try:
            file = inside(self.collection.path, picture.path)
        except OutsideFolder as error:
            raise ExportError(
                f"a trajectory names a picture outside the collection: {error}"
            ) from None
        if not file.is_file():
            raise ExportError(
                f"the collection {self.collection.path} lacks the picture {picture.path!r} that a "
                "trajectory names; copy a collection with its folder parts, or collect again"
            )
        return file

    def take(self, trajectory: Trajectory) -> None:
        """Count a trajectory."""
        self.counts["trajectories"] += 1
        self.counts["turns"] += len(trajectory.turns)
        self.counts["trained_turns"] += sum(turn.train for turn in trajectory.turns)

    def leave_out(self, why: str) -> None:
        """Count a trajectory that is not exported."""
        self.left_out[why] += 1

    def add(self, split: str, shown: int) -> None:
        """Count a sample, and the places in it where a picture is shown."""
        self.samples[split] += 1
        self.counts["shown"] += shown


@dataclass(frozen=True)
class ExportFormat:
    """A row of the table of formats.

    Attributes:
        name: what ``--to`` takes.
        about: one line for people.
        write: writes the files of an export into its folder.
        usage: how the library reads them, in Markdown; what is between ``[[`` and ``]]`` is said
            only where there is a split ``validation``.
        card: what README.md begins with, the metadata of a dataset card.
    """

    name: str
    about: str
    write: Callable[[ExportJob], None]
    usage: str
    card: str = ""


def room(scene: str) -> str:
    """A scene's room: the scene's name without what AI2-THOR may append."""
    return scene.removesuffix("_physics")


class RowFile:
    """JSON Lines, written a row at a time."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self._file = path.open("x", encoding="utf-8", newline="\n")

    def add(self, row: Mapping[str, Any]) -> None:
        """Write a row."""
        self._file.write(json.dumps(row, ensure_ascii=False, separators=(",", ":")) + "\n")

    def close(self) -> None:
        """Have everything on the disk."""
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()


@contextmanager
def row_files(make: Callable[[str], Path]) -> Iterator[Callable[[str, Mapping[str, Any]], None]]:
    """Add rows to files by name; a file is made with its first row, so that none is empty.

    Args:
        make: the path of a name's file.
    """
    files: dict[str, RowFile] = {}

    def add(name: str, row: Mapping[str, Any]) -> None:
        if name not in files:
            files[name] = RowFile(make(name))
        files[name].add(row)

    try:
        yield add
    finally:
        for file in files.values():
            file.close()


def plain_messages(chat: Chat) -> list[dict[str, Any]]:
    """The messages as texts, with ``<image>`` for each picture."""
    return [{"role": turn.role, "content": turn.text} for turn in chat.turns]


def paths(chat: Chat) -> list[str]:
    """The paths of the pictures, in order."""
    return [picture.path for picture in chat.pictures]


def needs(package: str, extra: str, error: ImportError) -> ExportError:
    """The error for a missing library."""
    return ExportError(
        f"this format needs {error.name or package}, which is not installed: "
        f"pip install 'er-gym[{extra}]'"
    )
