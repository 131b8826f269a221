"""Folders that a command fills, and that the same command goes on with where it stopped.

Runs, collections, frames, fine-tuning runs, policies' training and plans are such folders. Each has
a manifest: a file that says what is made in it. A command goes on in a folder whose manifest is its
own, begins in one in which nothing has been made, and leaves any other as it is. One process at a
time works in a folder.
"""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Generic, TypeVar

from pydantic import BaseModel, ValidationError

from er_gym.locking import LOCK, exclusive_use
from er_gym.tasks.errors import TaskFileError, first_problem
from er_gym.tasks.reading import read_text
from er_gym.writing import is_ours, make_folder, write_atomic

KINDS: Mapping[str, str] = {
    "run.json": "a run",
    "collection.json": "a collection",
    "frames.json": "a folder of frames",
    "export.json": "an export",
    "finetune.json": "a fine-tuning run",
    "reinforce.json": "a reinforcement run",
    "model.npz": "a run of er-gym train-rl",
    "ladder.json": "a ladder",
    "ablation.json": "an ablation",
}
"""What a folder of er-gym's is, by a file that it holds."""
_MOST_NAMED = 5

M = TypeVar("M", bound=BaseModel)
F = TypeVar("F", bound="ResumableFolder[Any]")


class FolderConflict(ValueError):
    """A folder holds something else; the message says what and what to do. Nothing is changed."""


class _NotGiven:
    def __repr__(self) -> str:
        return "not given"


NOT_GIVEN = _NotGiven()
"""The value of a setting that one of two manifests does not state."""


def _all(there: BaseModel, here: BaseModel) -> tuple[Any, Any]:
    return there.model_dump(mode="json"), here.model_dump(mode="json")


def _as_json(manifest: BaseModel) -> str:
    return manifest.model_dump_json(indent=2) + "\n"


@dataclass(frozen=True)
class FolderKind(Generic[M]):
    """A kind of folders that can be gone on with.

    Attributes:
        noun: what a person calls one, such as ``run``.
        command: what makes one, such as ``er-gym bench``.
        manifest: the name of the file that says what is made.
        model: of the manifest.
        parts: the names of the files and folders that belong to it beside its manifest.
        holds_something: whether something in a folder would be lost with it. If not, as after a
            mistyped command or a kill at the start, another command may begin there.
        shared: whether one may begin beside files that er-gym knows nothing of, such as a log.
        compared: what has to be equal of the manifest that is there and of this one; by default
            all.
        error: is raised for a folder that cannot be used.
        load: reads a manifest that is not JSON; ``text``: what is written.
    """

    noun: str
    command: str
    manifest: str
    model: type[M]
    parts: tuple[str, ...]
    holds_something: Callable[[Path], bool]
    shared: bool = False
    compared: Callable[[M, M], tuple[Mapping[str, Any], Mapping[str, Any]]] = _all
    error: type[ValueError] = FolderConflict
    load: Callable[[Path], M] | None = None
    text: Callable[[M], str] = _as_json

    def read(self, folder: Path) -> M:
        """The manifest of a folder.

        Raises:
            ValueError: ``error``: there is none, or it is damaged.
        """
        file = folder / self.manifest
        try:
            return self.load(file) if self.load else self.model.model_validate_json(read_text(file))
        except (TaskFileError, ValidationError) as error:
            place = f"{file}: " if isinstance(error, ValidationError) else ""
            raise self.error(
                f"{folder} is no {self.noun}: {place}{first_problem(error)}; give the --out "
                f"directory of {self.command}"
            ) from error

    def check(self, folder: Path, manifest: M) -> bool:
        """Whether a manifest would begin in a folder; False if it would go on.

        Raises:
            ValueError: ``error``: something else is there.
        """
        file = folder / self.manifest
        if not file.exists():
            self._check_free(folder)
            return True
        if not self.holds_something(folder):
            if not is_ours(file):
                raise self.error(
                    f"{file} exists, and er-gym did not write it; choose another --out"
                )
            return True
        found = [*_differences(*self.compared(self.read(folder), manifest))]
        if found:
            raise self.error(
                f"{folder} holds another {self.noun}: {_in_words(found)}; choose another --out, or "
                "repeat that command"
            )
        return False

    def begin(self, folder: Path, manifest: M) -> bool:
        """Write a manifest into a folder, unless it goes on there.

        Returns:
            Whether it begins. What a command that was killed early has left is then removed.

        Raises:
            ValueError: ``error``: something else is there; nothing is changed.
            OSError: the folder cannot be made or written to.
        """
        begins = self.check(folder, manifest)
        if begins:
            if (folder / self.manifest).exists():
                self.withdraw(folder)
            make_folder(folder)
            write_atomic(folder / self.manifest, self.text(manifest))
        return begins

    def withdraw(self, folder: Path) -> None:
        """Remove what belongs to the kind, the manifest last: after a kill meanwhile it can be
        removed again."""
        for path in (folder / name for name in (*self.parts, self.manifest)):
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            else:
                path.unlink(missing_ok=True)

    @contextlib.contextmanager
    def locked(self, folder: Path, manifest: M) -> Iterator[bool]:
        """Begin or go on in a folder, for this process alone; gives whether it begins.

        If the block raises before the folder holds something, what began is removed. A mistyped
        command thus does not block the corrected one.

        Raises:
            Locked: another process works in it.
            ForeignFile, ValueError, OSError: as :func:`.locking.exclusive_use` and :meth:`begin`.
        """
        with exclusive_use(folder):
            begins = self.begin(folder, manifest)
            try:
                yield begins
            except BaseException:  # Ctrl-C too
                if begins and not self.holds_something(folder):
                    self.withdraw(folder)
                raise

    def _check_free(self, folder: Path) -> None:
        """Raise an error if a folder without the manifest is no place to begin in."""
        held = {each.name for each in folder.iterdir()} - {LOCK} if folder.is_dir() else set()
        own = [name for name in self.parts if has_content(folder / name)]
        other = [name for name in KINDS if name in held and name not in self.parts]
        if other:
            why = f"is {KINDS[other[0]]} (it holds {other[0]})"
        elif own:
            why = f"holds {own[0]} but no {self.manifest} that says which {self.noun} it is"
        elif held and not self.shared:
            why = f"is not empty and holds no {self.manifest}"
        else:
            return
        raise self.error(f"{folder} {why}; choose another --out")


class ResumableFolder(Generic[M]):
    """A folder of a kind, opened with :meth:`create` to go on with or :meth:`open` to read.

    Attributes:
        KIND: the kind.
        path: the folder.
        manifest: what is made in it.
    """

    KIND: ClassVar[FolderKind[Any]]

    def __init__(self, path: Path, manifest: M) -> None:
        self.path, self.manifest = path, manifest

    @classmethod
    def open(cls: type[F], path: Path) -> F:
        """Open a folder to read it; raises as :meth:`FolderKind.read`."""
        return cls(path, cls.KIND.read(path))

    @classmethod
    def create(cls: type[F], path: Path, manifest: M) -> F:
        """Begin or go on in a folder; raises as :meth:`FolderKind.begin`."""
        cls.KIND.begin(path, manifest)
        return cls(path, manifest)

    @classmethod
    @contextlib.contextmanager
    def locked(cls: type[F], path: Path, manifest: M) -> Iterator[F]:
        """Begin or go on in a folder, alone; removes and raises as :meth:`FolderKind.locked`."""
        with cls.KIND.locked(path, manifest):
            yield cls(path, manifest)


def has_content(path: Path) -> bool:
    """Whether a folder has entries, or a file bytes."""
    if path.is_dir():
        return any(path.iterdir())
    return path.exists() and path.stat().st_size > 0


def _differences(there: Any, here: Any, name: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Where two manifests differ: the path of the setting, ``env.faults``, and both values."""
    if isinstance(there, Mapping) and isinstance(here, Mapping):
        for key in (*there, *(key for key in here if key not in there)):
            values = there.get(key, NOT_GIVEN), here.get(key, NOT_GIVEN)
            yield from _differences(*values, f"{name}.{key}" if name else key)
    elif there != here:
        yield name, there, here


def _in_words(found: list[tuple[str, Any, Any]]) -> str:
    """The first difference with both values, and the names of the others."""
    (name, there, here), *more = found
    others = ", ".join(name for name, _, _ in more[:_MOST_NAMED])
    number = len(more) - _MOST_NAMED
    others += f" and {number} more" if number > 0 else ""
    words = f"its {name} is {there!r:.300}, this one's {here!r:.300}"
    return f"{words} (further differences: {others})" if others else words
