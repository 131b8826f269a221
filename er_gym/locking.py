"""A folder is used by one process at a time."""

from __future__ import annotations

import contextlib
import errno
import fcntl
import os
import re
import socket
from collections.abc import Iterator
from pathlib import Path

from er_gym.writing import ForeignFile, make_folder

LOCK = "run.lock"
_FLAGS = os.O_RDWR | os.O_CREAT | os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK
_LONGEST = 300
_OURS = re.compile(rb"((?P<pid>[0-9]+) (?P<host>[!-~]*)\n)?")
"""What the file says: a process and its machine; nothing, if it was killed before it could."""
_NO_LOCKS = {errno.ENOSYS, errno.EOPNOTSUPP, errno.ENOLCK}


class Locked(ValueError):
    """Another process uses the folder; the message names it."""


@contextlib.contextmanager
def exclusive_use(folder: Path) -> Iterator[None]:
    """Have a folder to oneself.

    The folder is made where it is not there. The operating system holds the lock on the file
    ``run.lock`` in it and lets go of it when the process ends, however that ends. The file names
    the process, and is removed at the end; where a killed process left it, it does not matter. A
    folder made here that is empty at the end is removed. On a file system without locks nobody is
    kept out.

    Raises:
        Locked: another process, or another part of this one, uses it.
        ForeignFile: a ``run.lock`` is there that er-gym did not write.
        OSError: the folder cannot be made or written to.
    """
    # The library `filelock` neither tells who holds a lock nor removes its file; it would be ten
    # thousand lines for the one call of flock.
    made = _make(folder)
    try:
        handle = _lock(folder)
        try:
            yield
        finally:
            # Before the lock is let go of: whoever waits for it sees that the file has gone.
            with contextlib.suppress(OSError):
                os.unlink(folder / LOCK)
            os.close(handle)
    finally:
        for path in made:
            with contextlib.suppress(OSError):
                path.rmdir()


def _make(folder: Path) -> list[Path]:
    """Make a folder and those above it; which have been made, the innermost first."""
    absent = [path for path in (folder, *folder.parents) if not path.exists()]
    make_folder(folder)
    return absent


def _lock(folder: Path) -> int:
    path = folder / LOCK
    while True:
        try:
            handle = os.open(path, _FLAGS, 0o644)
        except FileNotFoundError:  # whoever made the folder has just removed it
            make_folder(folder)
            continue
        try:
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise Locked(
                    f"{folder} is in use by {_holder(handle)}; wait for its end, or choose another "
                    "--out"
                ) from None
            except OSError as error:
                if error.errno not in _NO_LOCKS:
                    raise
            if _is_at(handle, path):
                if not _OURS.fullmatch(os.pread(handle, _LONGEST, 0)):
                    raise ForeignFile(
                        f"{path} is there, and er-gym did not write it; choose another --out"
                    )
                os.ftruncate(handle, 0)
                os.pwrite(handle, f"{os.getpid()} {socket.gethostname()}\n".encode(), 0)
                return handle
        except BaseException:
            os.close(handle)
            raise
        os.close(handle)  # of one who has just removed the file: there may be another by now


def _is_at(handle: int, path: Path) -> bool:
    """Whether an open file is still the one of that name."""
    try:
        return os.path.samestat(os.fstat(handle), os.stat(path))
    except FileNotFoundError:
        return False


def _holder(handle: int) -> str:
    """Who holds the lock, in words."""
    told = _OURS.fullmatch(os.pread(handle, _LONGEST, 0))
    if told is None or not told["pid"]:
        return "another process"
    pid, host = told["pid"].decode(), told["host"].decode()
    return f"process {pid}" if host == socket.gethostname() else f"process {pid} on {host}"
