"""Follows a file of lines while it grows."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

_CHUNK = 4 * 2**20


@dataclass(frozen=True, slots=True)
class Lines:
    """Some whole lines that stand one behind the other.

    Attributes:
        offset: of the first one's first byte in the file.
        lines: without their newlines; they may be empty.
        passed_over: how many lines that stood before them were too long: 0 or 1.
        anew: whether the file is another one than was read before, or the first; all that was
            known of it is void.
    """

    offset: int
    lines: Sequence[bytes]
    passed_over: int = 0
    anew: bool = False


@dataclass
class LineTail:
    """Reads what has been added to a file since it was read last.

    Attributes:
        file: it need not be there yet.
        longest: a line with more bytes is passed over: anybody may have written it.
    """

    file: Path
    longest: int
    _inode: int = field(default=0, init=False)
    _offset: int = field(default=0, init=False)
    _rest: bytes = field(default=b"", init=False)
    """The beginning of a line that is not whole yet."""
    _too_long: bool = field(default=False, init=False)
    """Whether the line that is not whole is too long; then no beginning is kept."""

    def read(self) -> Iterator[Lines]:
        """The lines that have become whole, in the order of the file, many at a time.

        A file that was replaced or that has become shorter is read from its beginning.
        """
        try:
            with self.file.open("rb") as file:
                status = os.fstat(file.fileno())
                if status.st_ino != self._inode or status.st_size < self._offset:
                    self._inode, self._offset = status.st_ino, 0
                    self._rest, self._too_long = b"", False
                    yield Lines(0, (), anew=True)
                file.seek(self._offset)
                while chunk := file.read(min(_CHUNK, self.longest)):
                    yield self._whole(chunk)
        except OSError:  # there is none (yet)
            return

    def _whole(self, chunk: bytes) -> Lines:
        """The lines that end in a chunk, which is no longer than the longest line: only the first
        one can be too long."""
        begin = self._offset - len(self._rest)
        self._offset += len(chunk)
        *lines, rest = (self._rest + chunk).split(b"\n")
        passed_over = int(bool(lines) and (self._too_long or len(lines[0]) > self.longest))
        if passed_over:
            begin += len(lines[0]) + 1
            del lines[0]
            self._too_long = False
        self._too_long = self._too_long or len(rest) > self.longest
        self._rest = b"" if self._too_long else rest
        return Lines(begin, lines, passed_over)
