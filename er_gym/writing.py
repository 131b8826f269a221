"""Files that are written whole or not at all, and only over what er-gym wrote.

Every file goes through :func:`write_atomic`. It is written beside its place and moved there, so
neither a full disk nor a kill leaves half a file or harms the old one. A file that the user named,
or that is derived from such a name, goes through :func:`write_output`, which replaces nothing that
er-gym did not write unless it is told to.

How er-gym knows its own files (:func:`is_ours`): each says so at its beginning.

========================  ======================================================================
JSON, JSON lines (.gz)    the first key is ``"format"``, its value begins with ``er-gym/``
Markdown                  begins with ``<!-- Written by er-gym``
YAML                      begins with ``# Written by er-gym``
PNG                       the text chunk ``Software`` is ``er-gym``
JPEG                      the comment begins with ``Written by er-gym``
========================  ======================================================================

The paper's task files and other kinds of pictures have no place for such a mark. An empty file
counts as er-gym's, since it holds nothing that could be lost.
"""

from __future__ import annotations

import contextlib
import hashlib
import io
import os
import re
import secrets
import shutil
import stat
import zlib
from collections.abc import Collection, Iterator, Mapping
from pathlib import Path, PurePath, PureWindowsPath
from typing import IO, TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from PIL.Image import Image

MARKDOWN_MARK = "<!-- Written by er-gym -->\n"
"""The first line of er-gym's Markdown files; readers do not see it."""
YAML_MARK = "# Written by er-gym\n"
"""The first line of er-gym's YAML files."""
PICTURE_MARK: Mapping[str, str] = {"Software": "er-gym"}
"""The text chunk of er-gym's PNG files."""

CAREFULLY = sum(getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))
"""Flags for opening a file whose name another program may have given to something else: no link is
followed, no pipe is waited for, and bytes stay as they are. No system has all of them."""

_LONGEST_NAME = 200
"""The number of bytes of the file's name in a draft's name; file systems allow 255 in all."""
_LONGEST_STEM = 120
_LONGEST_PART = 255
"""The number of bytes of a name between two separators, on most file systems."""
_HEAD = 4096
"""The number of bytes at the beginning of a file in which its mark is looked for."""
_COMMENT = b"Written by er-gym"
_OURS = re.compile(rb'\s*\{\s*"format"\s*:\s*"er-gym/|(<!--|#) Written by er-gym\b')
_PNG, _JPEG, _GZIP = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff", b"\x1f\x8b"


class CannotWrite(OSError):
    """A file cannot be written; the message names it in one line. The old file is unchanged."""


class ForeignFile(ValueError):
    """er-gym did not write the file at the path, so it does not replace it; nothing is changed."""


class OutsideFolder(ValueError):
    """A name leads out of the folder that it belongs into; nothing was read or written."""


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
    # The name of a draft that a kill leaves behind shows which file it belongs to.
    name = os.fsdecode(os.fsencode(path.name)[:_LONGEST_NAME])
    draft = path.with_name(f"{name}.{secrets.token_hex(8)}.tmp")
    try:
        if mode is None:
            with contextlib.suppress(OSError):
                mode = stat.S_IMODE(os.stat(path).st_mode)
        handle = os.open(draft, os.O_WRONLY | os.O_CREAT | os.O_EXCL | CAREFULLY, 0o666)
        try:
            with open(handle, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            if mode is not None:
                os.chmod(draft, mode)
            os.replace(draft, path)
        except BaseException:  # Ctrl-C too
            with contextlib.suppress(OSError):
                os.unlink(draft)
            raise
    except OSError as error:
        raise CannotWrite(f"{path}: cannot be written: {_reason(error, path)}") from error


def write_new(path: Path, data: bytes) -> None:
    """Write one of many files: as :func:`write_atomic`, but that a power cut may lose it.

    Raises:
        CannotWrite: as :func:`write_atomic`.
    """
    draft = path.with_name(f"{path.name}.{secrets.token_hex(8)}.tmp")
    try:
        with open(draft, "xb") as file:
            file.write(data)
        os.replace(draft, path)
    except OSError as error:
        raise CannotWrite(f"{path}: cannot be written: {_reason(error, path)}") from error
    finally:
        draft.unlink(missing_ok=True)


@contextlib.contextmanager
def replaced(path: Path, *, errors: str = "strict") -> Iterator[IO[str]]:
    """Write a text file line by line, completely or not at all: ``with replaced(path) as file``.

    It is written beside its place, under a name that nothing has, and moved there at the end.

    Args:
        path: the file; its folder must exist. An existing file or link is replaced.
        errors: what becomes of what UTF-8 cannot hold, as ``open`` takes it.

    Raises:
        CannotWrite: as :func:`write_atomic`.
    """
    name = os.fsdecode(os.fsencode(path.name)[:_LONGEST_NAME])
    draft = path.with_name(f".{name}.{secrets.token_hex(8)}.tmp")
    try:
        with open(draft, "x", encoding="utf-8", errors=errors, newline="\n") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        os.replace(draft, path)
    except OSError as error:
        # An error that names another file is one of the block's own.
        if isinstance(error, CannotWrite) or error.filename not in (None, str(draft)):
            raise
        raise CannotWrite(f"{path}: cannot be written: {_reason(error, path)}") from error
    finally:
        draft.unlink(missing_ok=True)


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
        raise CannotWrite(f"{path}: cannot be written: {_reason(error, path)}") from error
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


def check_replaceable(folder: Path, stamp: str, names: Collection[str] | None = None) -> None:
    """Raise an error unless a folder may be replaced as a whole: it is empty, or er-gym filled it.

    Args:
        folder: it need not exist.
        stamp: the name of the file that er-gym puts into each folder of the kind.
        names: what it may hold beside that; None if this is not known yet.

    Raises:
        ForeignFile: it is a link or a file, or holds something else.
    """
    if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
        raise ForeignFile(
            f"{folder} is there already and is no folder of its own; choose another name or move "
            "it away"
        )
    held = {each.name for each in folder.iterdir()} if folder.exists() else set()
    other = sorted(held if stamp not in held else () if names is None else held - {stamp, *names})
    if other:
        raise ForeignFile(
            f"{folder} holds {other[0]}, which would be lost; choose another name or move it away"
        )


def replace_folder(draft: Path, folder: Path, stamp: str) -> None:
    """Move a finished draft to its place, whatever er-gym wrote there before.

    Args:
        draft: a folder on the same disk.
        folder: its place.
        stamp: see :func:`check_replaceable`. What the draft has may be there.

    Raises:
        ForeignFile: as :func:`check_replaceable`; nothing is changed.
    """
    check_replaceable(folder, stamp, [each.name for each in draft.iterdir()])
    old = draft.with_name(f".{draft.name}.{secrets.token_hex(4)}.old")
    if folder.exists():
        folder.rename(old)
    draft.rename(folder)
    shutil.rmtree(old, ignore_errors=True)


def check_new_folder(path: Path) -> None:
    """Raise the exception that :func:`whole_folder` would raise, as far as it can be foreseen.

    Raises:
        ForeignFile: something else than an empty folder, or a link to one, is there.
        CannotWrite: the folder cannot be made or written to.
    """
    if path.is_dir():
        if any(path.iterdir()):
            raise ForeignFile(f"{path} is not empty; choose another output, or remove it first")
    elif os.path.lexists(path):
        raise ForeignFile(f"{path} is there already and is no folder; choose another output")
    there = next(each for each in (path, *path.absolute().parents) if os.path.lexists(each))
    if not there.is_dir() or not os.access(there, os.W_OK | os.X_OK):
        why = "read-only" if there.is_dir() else "no folder"
        raise CannotWrite(f"{path}: the folder cannot be made: {there} is {why}")


@contextlib.contextmanager
def whole_folder(path: Path) -> Iterator[Path]:
    """Write a folder completely or not at all: ``with whole_folder(path) as draft``.

    A new folder is written beside its place and moved there. An empty one that is there stays, as
    it may be the working directory, or a link leads to it: what is written moves into it.

    Raises:
        ForeignFile, CannotWrite: as :func:`check_new_folder`; nothing is changed.
        OSError: something cannot be written or moved; nothing is left.
    """
    check_new_folder(path)
    is_new = not path.is_dir()
    name = os.fsdecode(os.fsencode(path.name)[:_LONGEST_NAME])
    draft = (path.parent if is_new else path) / f".{name}.{secrets.token_hex(4)}.draft"
    make_folder(draft)
    moved: list[Path] = []
    try:
        yield draft
        if is_new:
            draft.rename(path)
            return
        if [*path.iterdir()] != [draft]:
            raise ForeignFile(f"{path} was empty and is no more; choose another output")
        for each in sorted(draft.iterdir()):
            each.rename(path / each.name)
            moved.append(each)
    except BaseException:  # Ctrl-C too
        for each in moved:
            (path / each.name).rename(each)
        raise
    finally:
        shutil.rmtree(draft, ignore_errors=True)


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
        return _COMMENT in head
    return _OURS.match(head) is not None


def picture_format(path: Path) -> str:
    """Pillow's name of the picture format of a file name's ending.

    Raises:
        ValueError: no picture format has that ending.
    """
    from PIL.Image import SAVE, registered_extensions

    kind = registered_extensions().get(path.suffix.lower(), "")
    if kind not in SAVE:
        raise ValueError(f"{path}: {path.suffix!r} is not a picture format; give .png or .jpg")
    return kind


def write_picture(path: Path, picture: Image, *, force: bool = False, **options: Any) -> None:
    """Write a picture that the user asked for, in the format of its name's ending.

    Args:
        path: the file.
        picture: what to write.
        force: as in :func:`write_output`.
        options: options of Pillow's writer.

    Raises:
        ForeignFile, CannotWrite: as :func:`write_output`.
        ValueError: there is no such picture format, or it cannot hold this picture.
    """
    from PIL.PngImagePlugin import PngInfo

    kind = picture_format(path)
    if kind == "PNG":
        options["pnginfo"] = PngInfo()
        for name, text in PICTURE_MARK.items():
            options["pnginfo"].add_text(name, text)
    elif kind == "JPEG":
        options["comment"] = _COMMENT
    buffer = io.BytesIO()
    try:
        picture.save(buffer, format=kind, **options)
    except (OSError, ValueError, KeyError) as error:
        raise ValueError(f"{path}: a {kind} file cannot hold this picture: {error}") from error
    write_output(path, buffer.getvalue(), force=force)


def write_figure(path: Path, figure: Figure, *, force: bool = False, **options: Any) -> None:
    """Write a matplotlib figure as PNG.

    Args:
        path: the file.
        figure: what to write.
        force: as in :func:`write_output`.
        options: options of ``savefig``.

    Raises:
        ForeignFile, CannotWrite: as :func:`write_output`.
    """
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata=dict(PICTURE_MARK), **options)
    write_output(path, buffer.getvalue(), force=force)


def _holds(path: Path, content: bytes) -> bool:
    """Whether a file has this content."""
    try:
        state = os.stat(path)
        same_size = stat.S_ISREG(state.st_mode) and state.st_size == len(content)
        return same_size and path.read_bytes() == content
    except OSError:
        return False


def _reason(error: OSError, path: Path) -> str:
    """The reason for an error, in words; it names the file's folder, not the draft."""
    if isinstance(error, (FileNotFoundError, NotADirectoryError)):
        return f"there is no folder {path.parent}; make it first"
    if isinstance(error, IsADirectoryError):
        return "a folder is there; name a file"
    if isinstance(error, PermissionError):
        return f"the folder {path.parent} may not be written to"
    return error.strerror or type(error).__name__
