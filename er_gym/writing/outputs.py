"""Output files that the user names: foreign files are replaced only with ``force``."""

from __future__ import annotations

import os
import re
import stat
import zlib
from pathlib import Path

from er_gym.writing.atomic import CannotWrite, write_atomic, write_problem

MARKDOWN_MARK = "<!-- Written by er-gym -->\n"
"""The first line of er-gym's Markdown files; readers do not see it."""
YAML_MARK = "# Written by er-gym\n"
"""The first line of er-gym's YAML files."""
COMMENT = b"Written by er-gym"
"""The beginning of the comment of er-gym's JPEG files."""

_HEAD = 4096
"""The number of bytes at the beginning of a file in which its mark is looked for."""
_OURS = re.compile(rb'\s*\{\s*"format"\s*:\s*"er-gym/|(<!--|#) Written by er-gym\b')
_PNG, _JPEG, _GZIP = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"\x1f\x8b"


class ForeignFile(ValueError):
    """er-gym did not write the file at the path, so it does not replace it; nothing is changed."""


def write_output(path: str | Path, data: str | bytes, *, force: bool = False) -> None:
    """Write a file that the user asked for.

    If the file already has this content, nothing is done. A link is followed.

    Args:
        path: the file; its folder must be there.
        data: text is encoded as UTF-8.
        force: whether to replace a file that er-gym did not write.

    Raises:
        ForeignFile: er-gym did not write the existing file.
        CannotWrite: as :func:`write_atomic`; or ``path`` is a device, a pipe or a read-only file.
    """
    path = Path(path)
    content = data.encode() if isinstance(data, str) else data
    if not _holds(path, content):
        check_output(path, force=force)
        write_atomic(Path(os.path.realpath(path)), content)


def check_output(path: str | Path, data: bytes | None = None, *, force: bool = False) -> None:
    """Raise the exception that :func:`write_output` would raise, as far as it can be foreseen.

    Args:
        path: the file.
        data: the content, if it is known already.
        force: as in :func:`write_output`.
    """
    path = Path(path)
    if data is not None and _holds(path, data):
        return
    folder = Path(os.path.realpath(path)).parent
    try:
        kind = os.stat(path).st_mode
    except FileNotFoundError:
        if not folder.is_dir():
            why = f"there is no folder {folder}; make it first"
            raise CannotWrite(f"{path}: cannot be written: {why}") from None
    except OSError as error:
        raise CannotWrite(f"{path}: cannot be written: {write_problem(error, path)}") from error
    else:
        if not stat.S_ISREG(kind):
            what = "a folder" if stat.S_ISDIR(kind) else "a device or a pipe"
            raise CannotWrite(f"{path}: cannot be written: {what} is there; name a file")
        if not os.access(path, os.W_OK):
            raise CannotWrite(f"{path}: cannot be written: the file is read-only")
        if not (force or is_ours(path)):
            raise ForeignFile(
                f"{path} is there already, and er-gym did not write it; choose another name or "
                "move it away (commands that have --force then replace it)"
            )
    if not os.access(folder, os.W_OK | os.X_OK):
        raise CannotWrite(f"{path}: cannot be written: the folder {folder} is read-only")


def is_ours(path: Path) -> bool:
    """Whether er-gym wrote a file, by the mark in the file; an empty file counts as er-gym's."""
    try:
        with open(path, "rb") as file:
            head = file.read(_HEAD)
    except OSError:
        return False
    if not head:
        return True
    if head.startswith(_GZIP):
        try:
            head = zlib.decompressobj(wbits=31).decompress(head, _HEAD)
        except zlib.error:
            return False
    if head.startswith(_PNG):
        return b"tEXtSoftware\x00er-gym" in head
    if head.startswith(_JPEG):
        return COMMENT in head
    return _OURS.match(head) is not None


def _holds(path: Path, content: bytes) -> bool:
    """Whether a file has this content."""
    try:
        state = os.stat(path)
        same_size = stat.S_ISREG(state.st_mode) and state.st_size == len(content)
        return same_size and path.read_bytes() == content
    except OSError:
        return False
