"""Follows a file of lines while it grows."""

from __future__ import annotations

import os
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import ClassVar

_CHUNK = 2**20


@dataclass(frozen=True, slots=True)
class Lines:
    """Some whole lines that stand one behind the other.

    Attributes:
        offset: of the first one's first byte in the file.
        text: the lines, each with its newline.
        passed_over: how many lines that stood before them were too long: 0 or 1.
        restarted: whether the file is another one than was read before, or the first; all that was
            known of it is void.
    """

    offset: int
    text: bytes = b""
    passed_over: int = 0
    restarted: bool = False

    @property
    def lines(self) -> list[bytes]:
        """The lines without their newlines; they may be empty."""
        return self.text.split(b"\n")[:-1]


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
                    yield Lines(0, restarted=True)
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
        text = self._rest + chunk
        first, end = text.find(b"\n") + 1, text.rfind(b"\n") + 1
        passed_over = first > 0 and (self._too_long or first - 1 > self.longest)
        self._too_long = (self._too_long and not passed_over) or len(text) - end > self.longest
        self._rest = b"" if self._too_long else text[end:]
        skipped = first if passed_over else 0
        return Lines(begin + skipped, text[skipped:end], int(passed_over))


@dataclass
class LineFollower(ABC):
    """Keeps what the lines of a growing file tell.

    Attributes:
        file: it need not be there yet.
        longest: a line with more bytes is passed over.
    """

    longest: ClassVar[int]

    file: Path
    _tail: LineTail = field(init=False, repr=False)

    def __post_init__(self) -> None:
        self._tail = LineTail(self.file, self.longest)

    def read(self) -> None:
        """Read what has been added. A file that was replaced is read from its beginning."""
        for lines in self._tail.read():
            if lines.restarted:
                self._forget()
            self._take(lines)

    def _forget(self) -> None:
        """Become as new: the file is another one, or the first."""
        vars(self).update(vars(type(self)(self.file)) | {"_tail": self._tail})

    @abstractmethod
    def _take(self, lines: Lines) -> None:
        """Take some lines that have become whole."""
