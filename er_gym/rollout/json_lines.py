"""Append-only files of JSON lines, which several threads and processes write at once."""

from __future__ import annotations

import errno
import os
import stat
import threading
from pathlib import Path

from er_gym.writing import CAREFULLY

_CLOSED = -1


class JsonLines:
    """An append-only file of lines. The file and its directory are made if they are missing.

    Args:
        path: the file.

    Raises:
        ValueError: the path is a link, or not a regular file. er-gym does not write to a file that
            may be another program's.
        OSError: the file cannot be written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._lock = threading.Lock()
        self._read_to = 0
        self._half_written = False
        path.parent.mkdir(parents=True, exist_ok=True)
        flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | CAREFULLY
        try:
            self._file = os.open(path, flags, 0o644)
        except OSError as error:
            if error.errno in (errno.ELOOP, errno.ENXIO):
                raise _not_ours(path) from None
            raise
        state = os.fstat(self._file)
        if not stat.S_ISREG(state.st_mode) or state.st_nlink != 1:
            os.close(self._file)
            raise _not_ours(path)
        if state.st_size and _read(self._file, 1, state.st_size - 1) != b"\n":
            os.write(self._file, b"\n")  # end the line that a killed process left half-written

    def add(self, line: str) -> None:
        """Append a line.

        Raises:
            OSError: the line cannot be written, or the file is closed.
        """
        # One write appends a whole line, so lines of different processes do not mix.
        with self._lock:
            data = b"\n" * self._half_written + line.encode() + b"\n"
            written = os.write(self._file, data)
            self._half_written = written != len(data)
            if self._half_written:  # the disk is full; the next call begins a new line
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(self.path))

    def new(self) -> list[bytes]:
        """The whole lines that any process has added since the last call, or at all."""
        with self._lock:
            if self._file == _CLOSED:
                return []
            size = max(0, os.fstat(self._file).st_size - self._read_to)
            *lines, _ = _read(self._file, size, self._read_to).split(b"\n")
            self._read_to += sum(len(line) + 1 for line in lines)
            return lines

    def close(self) -> None:
        """Close the file."""
        with self._lock:
            if self._file != _CLOSED:
                os.close(self._file)
                self._file = _CLOSED


def _read(file: int, size: int, start: int) -> bytes:
    """Bytes of a file that is appended to; where it was read has no effect on that."""
    os.lseek(file, start, os.SEEK_SET)
    return os.read(file, size)


def _not_ours(path: Path) -> ValueError:
    return ValueError(
        f"{path} is a link, or not a regular file, so er-gym does not write to it; remove it, "
        "or choose another --out"
    )
