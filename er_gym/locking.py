"""Locks a folder, so that one process at a time uses it."""

from __future__ import annotations

import contextlib
import errno
import os
import re
import socket
from collections.abc import Iterator
from pathlib import Path

from er_gym.writing import CAREFULLY, ForeignFile, make_folder

LOCK = "run.lock"
_FLAGS = os.O_RDWR | os.O_CREAT | CAREFULLY
_LONGEST = 300
_OURS = re.compile(rb"((?P<pid>[0-9]+) (?P<host>[!-~]*)\n)?")
"""The content of the file: a process and its machine; empty if a kill came before the write."""
_NO_LOCKS = {errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOLCK}


class Locked(ValueError):
    """Another process uses the folder; the message names it."""


@contextlib.contextmanager
def exclusive_use(folder: Path) -> Iterator[None]:
    """Lock a folder for this process.

    The folder is made if it is missing. The operating system locks the file ``run.lock`` in it, and
    releases the lock when the process ends, in any way. The file names the process and is removed
    at the end; a file that a killed process left does no harm. A folder made here that is empty at
    the end is removed. On a file system without locks nothing keeps other processes out.

    Raises:
        Locked: another process, or another part of this one, uses it.
        ForeignFile: er-gym did not write the ``run.lock`` in the folder.
        OSError: the folder cannot be made or written to.
    """
    made = _make(folder)
    try:
        handle = _lock(folder)
        try:
            yield
        finally:
            # Removed while the lock is held: a process that waits for the lock sees that the file
            # is gone.
            with contextlib.suppress(OSError):
                os.unlink(folder / LOCK)
            os.close(handle)
    finally:
        for path in made:
            with contextlib.suppress(OSError):
                path.rmdir()


def _make(folder: Path) -> list[Path]:
    """Make a folder and its parents; return the folders made, innermost first."""
    absent = [path for path in (folder, *folder.parents) if not path.exists()]
    make_folder(folder)
    return absent


def _lock(folder: Path) -> int:
    from filelock import lock_descriptor

    path = folder / LOCK
    while True:
        try:
            handle = os.open(path, _FLAGS, 0o644)
        except FileNotFoundError:  # the process that made the folder has just removed it
            make_folder(folder)
            continue
        try:
            try:
                if not lock_descriptor(handle, blocking=False):
                    raise Locked(
                        f"{folder} is in use by {_holder(handle)}; wait until it ends, or choose "
                        "another --out"
                    )
            except OSError as error:
                if error.errno not in _NO_LOCKS:
                    raise
            if _is_at(handle, path):
                if not _OURS.fullmatch(_content(handle)):
                    raise ForeignFile(
                        f"{path} exists, and er-gym did not write it; choose another --out"
                    )
                os.ftruncate(handle, 0)
                os.lseek(handle, 0, os.SEEK_SET)
                os.write(handle, f"{os.getpid()} {socket.gethostname()}\n".encode())
                return handle
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)  # the holder has just removed the file; there may be another one by now


def _content(handle: int) -> bytes:
    """The beginning of an open file."""
    os.lseek(handle, 0, os.SEEK_SET)
    return os.read(handle, _LONGEST)


def _is_at(handle: int, path: Path) -> bool:
    """Whether an open file is still the file at a path."""
    try:
        return os.path.samestat(os.fstat(handle), os.stat(path))
    except FileNotFoundError:
        return False


def _holder(handle: int) -> str:
    """The process that holds the lock, in words."""
    told = _OURS.fullmatch(_content(handle))
    if told is None or not told["pid"]:
        return "another process"
    pid, host = told["pid"].decode(), told["host"].decode()
    return f"process {pid}" if host == socket.gethostname() else f"process {pid} on {host}"
