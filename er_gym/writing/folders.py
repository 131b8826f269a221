"""Writes a folder completely or not at all."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Collection, Iterator
from pathlib import Path

from er_gym.writing.atomic import CannotWrite, draft_name, make_folder
from er_gym.writing.outputs import ForeignFile


def check_folder(path: Path, stamp: str = "", names: Collection[str] | None = None) -> None:
    """Raise the exception that :func:`whole_folder` would raise, as far as it can be foreseen.

    Args:
        path: the folder; it need not exist.
        stamp: as in :func:`whole_folder`.
        names: what a folder with a stamp may hold beside it; None if this is not known yet.

    Raises:
        ForeignFile: something is there that would be lost.
        CannotWrite: the folder cannot be made or written to.
    """
    if os.path.lexists(path) and (not path.is_dir() or (stamp and path.is_symlink())):
        raise ForeignFile(
            f"{path} is there already and is no folder of its own; choose another output, or move "
            "it away"
        )
    held = {each.name for each in path.iterdir()} if path.exists() else set()
    if stamp in held:
        held = held - {stamp, *names} if names is not None else set()
    if held:
        raise ForeignFile(
            f"{path} is not empty; choose another output, or move away what would be lost: "
            f"{min(held)}"
        )
    there = next(each for each in (path, *path.absolute().parents) if os.path.lexists(each))
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        why = "read-only" if there.is_dir() else "no folder"
        raise CannotWrite(f"{path}: the folder cannot be made: {there} is {why}")


@contextlib.contextmanager
def whole_folder(path: Path, stamp: str = "") -> Iterator[Path]:
    """Write a folder completely or not at all: ``with whole_folder(path) as draft``.

    A new folder is written beside its place and moved there. An empty one that is there stays, as
    it may be the working directory, or a link leads to it: what is written moves into it.

    Args:
        path: the folder.
        stamp: the name of the file that er-gym puts into each folder of the kind. A folder that
            has it, and nothing beside that is not written anew, is replaced. By default none is.

    Raises:
        ForeignFile, CannotWrite: as :func:`check_folder`; nothing is changed.
        OSError: something cannot be written or moved; nothing is left.
    """
    check_folder(path, stamp)
    is_empty = path.is_dir() and not any(path.iterdir())
    draft = (path if is_empty else path.parent) / f".{draft_name(path, 'draft')}"
    old = draft.with_suffix(".old")
    make_folder(draft)
    moved: list[tuple[Path, Path]] = []

    def move(one: Path, to: Path) -> None:
        one.rename(to)
        moved.append((one, to))

    try:
        yield draft
        if is_empty:
            if [*path.iterdir()] != [draft]:
                raise ForeignFile(f"{path} was empty and is no more; choose another output")
            for each in sorted(draft.iterdir()):
                move(each, path / each.name)
        else:
            check_folder(path, stamp, [each.name for each in draft.iterdir()])
            if path.exists():
                move(path, old)
            move(draft, path)
    except BaseException:  # Ctrl-C too
        for one, to in reversed(moved):
            to.rename(one)
        raise
    finally:
        shutil.rmtree(draft, ignore_errors=True)
    shutil.rmtree(old, ignore_errors=True)
