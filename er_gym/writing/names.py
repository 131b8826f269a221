"""Names from files that anyone may have written, as paths that stay in a folder."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
from pathlib import Path, PurePath, PureWindowsPath

from er_gym.writing.atomic import CannotWrite

_LONGEST_STEM = 120
_LONGEST_PART = 255
"""The number of bytes of a name between two separators, on most file systems."""


class OutsideFolder(ValueError):
    """A name leads out of the folder that it must stay in; nothing was read or written."""


def inside(folder: Path, name: str | PurePath, *, links: bool = True) -> Path:
    """The path in a folder that a name stands for.

    Every name from a file that anyone may have written becomes a path here, or by
    :func:`file_stem`: neither an absolute name nor one with ``..`` gets through, whichever of
    ``/`` and ``\\`` is between its parts.

    Args:
        folder: which.
        name: relative to it.
        links: whether links in the folder may lead out of it. If not, the answer has none.

    Raises:
        OutsideFolder: the name leads out of the folder, or no file can have it.
    """
    told = f"{str(name)!r:.200}"
    # Windows' rules take both separators, and drives.
    parts = PureWindowsPath(name)
    longest = max((len(os.fsencode(part)) for part in parts.parts), default=0)
    leads_out = parts.anchor or ".." in parts.parts or not parts.parts
    if leads_out or "\0" in str(name) or longest > _LONGEST_PART:
        raise OutsideFolder(
            f"{told} is no name of a file in {folder}: give a relative path without '..', of at "
            f"most {_LONGEST_PART} bytes a part"
        )
    if links:
        return folder / name
    top, found = os.path.realpath(folder), os.path.realpath(folder / name)
    if os.path.commonpath((top, found)) != top:
        raise OutsideFolder(
            f"{told} is a link that leads out of {folder}; put the file itself there"
        )
    return Path(found)


def place_file(source: Path, to: Path, *, copy: bool) -> bool:
    """Put a file of the user's into an output: a hard link to it where there can be one, or a copy.

    Links are resolved first: a relative one would lead elsewhere from its new place. Nothing may be
    at the new place. It is never written into: it may be a hard link to another file of the user's.

    Args:
        source: a regular file, or a link to one.
        to: its new place; the folder must exist.
        copy: whether it is copied in any case.

    Returns:
        Whether it is a hard link.

    Raises:
        CannotWrite: something is there already, or the disk is full, for example.
    """
    try:
        real = os.path.realpath(source, strict=True)
        if not copy:
            try:
                os.link(real, to)
            except FileExistsError:
                raise
            except OSError:  # another file system, one without links, or another user's file
                pass
            else:
                return True
        with open(real, "rb") as given, open(to, "xb") as made:
            shutil.copyfileobj(given, made)
        return False
    except FileExistsError as error:
        raise CannotWrite(f"{to}: cannot be written: a file is there already") from error
    except OSError as error:
        raise CannotWrite(f"{to}: cannot be written: {error.strerror}: {source}") from error


def writable(text: str) -> str:
    r"""A text that UTF-8 can hold: half a character (a lone surrogate) becomes ``\ud800``."""
    return text if text.isascii() else text.encode(errors="backslashreplace").decode()


def file_stem(name: str) -> str:
    """A file name without suffix for any name.

    It is the name itself if a file can have that name; otherwise a readable, unique name of at most
    129 characters.
    """
    stem = re.sub(r"[^A-Za-z0-9._-]", "_", name)[:_LONGEST_STEM]
    if stem == name and not stem.startswith("."):
        return stem
    return f"{stem.lstrip('.')}-{hashlib.sha256(writable(name).encode()).hexdigest()[:8]}"
