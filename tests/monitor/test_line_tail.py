"""A file of lines is followed however it grows."""

from __future__ import annotations

import random
from pathlib import Path

import pytest

from benchmarks.monitor.line_tail import LineTail

LONGEST = 5
"""So short that lines stand across the chunks that are read."""


class Reader:
    """Keeps what a tail has told of its file."""

    def __init__(self, file: Path) -> None:
        self.file, self.tail = file, LineTail(file, LONGEST)
        self.lines: list[tuple[int, bytes]] = []
        self.too_long = 0

    def read(self) -> bool:
        """Read what is new; whether all before was void."""
        began = False
        for some in self.tail.read():
            if some.restarted:
                began, self.lines, self.too_long = True, [], 0
            self.too_long += some.passed_over
            offset = some.offset
            for line in some.lines:
                self.lines.append((offset, line))
                offset += len(line) + 1
        return began

    def check(self) -> None:
        """Compare with the file as a whole."""
        wanted, too_long, offset = [], 0, 0
        for line in self.file.read_bytes().split(b"\n")[:-1]:
            if len(line) <= LONGEST:
                wanted.append((offset, line))
            else:
                too_long += 1
            offset += len(line) + 1
        assert (self.lines, self.too_long) == (wanted, too_long)


@pytest.mark.parametrize(
    "pieces",
    [
        (b"", b"ab", b"c\n", b"", b"\n\nde\n"),
        (b"12345\n123456\n1\n",),
        (b"123", b"456", b"7" * 99, b"8\n9\n"),
        (b"1" * 99 + b"\n" + b"2" * 99, b"\n3\n"),
        *(
            [bytes(dice.choices(b"ab\n", (4, 4, dice.random() * 4), k=dice.randrange(30)))
             for _ in range(8)]
            for dice in map(random.Random, range(40))
        ),
    ],
)  # fmt: skip
def test_every_whole_line_is_read_once(pieces: list[bytes], tmp_path: Path) -> None:
    reader = Reader(tmp_path / "lines")
    assert not reader.read()  # it is not there yet
    for number, piece in enumerate(pieces):
        with reader.file.open("ab") as grown:
            grown.write(piece)
        assert reader.read() is (number == 0)
        reader.check()


@pytest.mark.parametrize("before", [b"", b"a\nb", b"1" * 99, b"1" * 99 + b"\n2\n"])
def test_another_file_is_read_from_its_beginning(before: bytes, tmp_path: Path) -> None:
    reader = Reader(tmp_path / "lines")
    reader.file.write_bytes(b"0\n" + before)
    reader.read()
    reader.file.write_bytes(b"c\n" + b"1" * 99 if len(before) > 99 else b"c")  # shorter
    assert reader.read()
    reader.check()
    for content in (b"d\n" + before, b""):
        other = tmp_path / "other"
        other.write_bytes(content)
        other.replace(reader.file)
        assert reader.read()
        reader.check()
    reader.file.unlink()
    assert not reader.read()
