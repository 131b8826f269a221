"""Writes a file completely or not at all."""

from __future__ import annotations

import contextlib
import os
import secrets
import stat
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

CAREFULLY = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
"""Flags for opening a file whose name another program may have given to something else: no link is
followed, no pipe is waited for, and bytes stay as they are. No system has all of them."""

_NEW = os.O_WRONLY | os.O_CREAT | os.O_EXCL | CAREFULLY
_LONGEST_NAME = 200
"""The number of bytes of the file's name in a draft's name; file systems allow 255 in all."""


class CannotWrite(OSError):
    """A file cannot be written; the message names it in one line. The old file is unchanged."""


def write_atomic(path: Path, data: str | bytes, *, mode: int | None = None) -> None:
    """Write a file completely or not at all, even in a power cut.

    Args:
        path: the file; its folder must exist. An existing file or link is replaced.
        data: text is encoded as UTF-8; line ends are kept.
        mode: permissions; by default those of the replaced file, or else the user's usual ones.

    Raises:
        CannotWrite: the disk is full, the folder does not exist or is not writable, or ``path`` is
            a folder.
    """
    content = data.encode() if isinstance(data, str) else data
    if mode is None:
        with contextlib.suppress(OSError):
            mode = stat.S_IMODE(os.stat(path).st_mode)
    with _draft(path, "wb", mode=mode) as file:
        file.write(content)


def write_new(path: Path, data: bytes) -> None:
    """Write one of many files: as :func:`write_atomic`, but that a power cut may lose it.

    Raises:
        CannotWrite: as :func:`write_atomic`.
    """
    with _draft(path, "wb", durable=False) as file:
        file.write(data)


def replaced(path: Path, *, errors: str = "strict") -> contextlib.AbstractContextManager[IO[str]]:
    """Write a text file line by line, completely or not at all: ``with replaced(path) as file``.

    Args:
        path: the file; its folder must exist. An existing file or link is replaced.
        errors: what becomes of what UTF-8 cannot hold, as ``open`` takes it.

    Raises:
        CannotWrite: as :func:`write_atomic`.
    """
    return _draft(path, "w", encoding="utf-8", errors=errors, newline="\n")


def make_folder(path: Path) -> None:
    """Make a folder and its parents, if they do not exist.

    Raises:
        CannotWrite: the folder cannot be made.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = "a file is there" if isinstance(error, FileExistsError) else error.strerror
        raise CannotWrite(f"{path}: the folder cannot be made: {reason}") from error


def draft_name(path: Path, ending: str) -> str:
    """A name that nothing has, for what is written before it has its place.

    If a kill leaves the draft behind, its name shows what it belongs to.
    """
    return f"{os.fsdecode(os.fsencode(path.name)[:_LONGEST_NAME])}.{secrets.token_hex(8)}.{ending}"


def write_problem(error: OSError, path: Path) -> str:
    """The reason for an error, in words; it names the file's folder, not the draft."""
    if isinstance(error, (FileNotFoundError, NotADirectoryError)):
        return f"there is no folder {path.parent}; make it first"
    if isinstance(error, IsADirectoryError):
        return "a folder is there; name a file"
    if isinstance(error, PermissionError):
        return f"the folder {path.parent} may not be written to"
    return error.strerror or type(error).__name__


@contextlib.contextmanager
def _draft(
    path: Path, how: str, *, durable: bool = True, mode: int | None = None, **options: Any
) -> Iterator[IO[Any]]:
    """A new file beside a file's place. It is moved there at the end, or removed after an error.

    Args:
        path: the place.
        how: ``"w"`` or ``"wb"``, and ``options``, as ``open`` takes them.
        durable: whether it also outlives a power cut, once it has its place.
        mode: permissions; None for the user's usual ones.

    Raises:
        CannotWrite: as :func:`write_atomic`.
    """
    draft = str(path.with_name(draft_name(path, "tmp")))
    try:
        handle = os.open(draft, _NEW, 0o666)
        try:
            with open(handle, how, **options) as file:
                yield file
                if durable:
                    file.flush()
                    os.fsync(handle)
            if mode is not None:
                os.chmod(draft, mode)
            os.replace(draft, path)
        except BaseException:  # Ctrl-C too
            with contextlib.suppress(OSError):
                os.unlink(draft)
            raise
    except OSError as error:
        # An error that names another file is one of the block's own.
        if isinstance(error, CannotWrite) or error.filename not in (None, draft):
            raise
        raise CannotWrite(f"{path}: cannot be written: {write_problem(error, path)}") from error
