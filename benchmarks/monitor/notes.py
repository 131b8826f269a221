"""What people note of a run: tags, and a flag and a text for an episode; in a file beside records.

::

    runs/x/notes.json

The file is read whenever it has changed and written whole. It is no part of what was played:
reports pass it over, and the run goes on with it or without.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from er_gym.rollout.records import Words
from er_gym.rollout.run_directory import NOTES
from er_gym.tasks.errors import first_problem
from er_gym.writing import CAREFULLY, write_atomic

MOST_TEXT, MOST_TAGS, MOST_TAG = 4_000, 20, 40
"""Characters of a note, tags of a run, and characters of a tag."""
_MOST_BYTES = 64 * 2**20
_WRITING = threading.Lock()


class _Record(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class Note(_Record):
    """What is noted of an episode: a flag, and a text."""

    flag: bool = False
    text: Annotated[Words, Field(max_length=MOST_TEXT)] = ""


class Notes(_Record):
    """What is noted of a run.

    Attributes:
        tags: of the run.
        episodes: the notes of episodes by their keys.
    """

    format: Literal["er-gym/notes/1"] = "er-gym/notes/1"
    tags: tuple[Annotated[Words, Field(max_length=MOST_TAG)], ...] = Field(
        default=(), max_length=MOST_TAGS
    )
    episodes: Mapping[str, Note] = {}


class CannotNote(ValueError):
    """The notes cannot be read or written; the message says why in one line."""


@dataclass
class NotesTail:
    """Follows the notes of a run.

    Attributes:
        path: the run directory.
        notes: as they are now; none where the file cannot be read.
        problem: why it cannot be; "" if it can.
        changed: changes whenever the file does.
    """

    path: Path
    notes: Notes = field(default_factory=Notes)
    problem: str = ""
    changed: tuple[int, int, int] = (0, 0, 0)

    def read(self) -> None:
        """Read the file if it has changed."""
        try:
            status = os.stat(self.path / NOTES, follow_symlinks=False)
            changed = status.st_mtime_ns, status.st_size, status.st_ino
        except OSError:
            changed = (0, 0, 0)
        if changed == self.changed:
            return
        self.changed, self.problem = changed, ""
        try:
            self.notes = read_notes(self.path)
        except CannotNote as error:
            self.notes, self.problem = Notes(), str(error)


def read_notes(path: Path) -> Notes:
    """The notes of a run directory; empty ones if there are none.

    Raises:
        CannotNote: the file is no file of notes.
    """
    try:
        with os.fdopen(os.open(path / NOTES, os.O_RDONLY | CAREFULLY), "rb") as file:
            content = file.read(_MOST_BYTES + 1)
    except FileNotFoundError:
        return Notes()
    except OSError as error:
        raise CannotNote(f"{NOTES} cannot be read: {error.strerror or error}") from None
    if len(content) > _MOST_BYTES:
        raise CannotNote(f"{NOTES} has more than {_MOST_BYTES >> 20} MiB")
    try:
        return Notes.model_validate_json(content)
    except ValidationError as error:
        raise CannotNote(f"{NOTES} cannot be read: {first_problem(error)}") from None


def note_episode(path: Path, key: str, note: Note) -> None:
    """Note something of an episode; an empty note takes away what was noted.

    Raises:
        CannotNote: the notes cannot be read or written; they are as before.
    """
    with _WRITING:
        before = read_notes(path)
        episodes = {name: each for name, each in before.episodes.items() if name != key}
        if note != Note():
            episodes[key] = note
        _write(path, before.model_copy(update={"episodes": episodes}))


def tag_run(path: Path, text: str) -> None:
    """Give a run the tags that stand in a text, with commas between.

    Raises:
        CannotNote: they are too many or too long, or the notes cannot be read or written; they are
            as before.
    """
    tags = tuple(dict.fromkeys(filter(None, (" ".join(each.split()) for each in text.split(",")))))
    if len(tags) > MOST_TAGS or any(len(each) > MOST_TAG for each in tags):
        raise CannotNote(f"give at most {MOST_TAGS} tags of {MOST_TAG} characters")
    with _WRITING:
        _write(path, read_notes(path).model_copy(update={"tags": tags}))


def _write(path: Path, notes: Notes) -> None:
    try:
        if notes == Notes():
            (path / NOTES).unlink(missing_ok=True)
        else:
            write_atomic(path / NOTES, notes.model_dump_json(indent=1) + "\n")
    except OSError as error:
        raise CannotNote(f"{NOTES} cannot be written: {error.strerror or error}") from None
