"""Where each item of a large JSON file is, so that items can be read one at a time.

The file is a list of objects, or objects one after another (JSON Lines, on one line each or not).
Other values among them are items, too, so that it can be said which are wrong. The file is mapped
into memory, not read: what is kept are two numbers for each item. (ijson reads faster from
beginning to end, but does not say where an item is, and stops at the first that is not JSON.)
"""

from __future__ import annotations

import mmap
import re
from array import array
from dataclasses import dataclass
from pathlib import Path

from er_gym.tasks.errors import TaskFileError
from er_gym.tasks.reading import LONGEST_LINE, open_file, parse_json

_MARK = b"\xef\xbb\xbf"
_TOKEN = re.compile(rb'"[^"\\]*(?:\\.[^"\\]*)*"|[][{}"]', re.DOTALL)
"""A string, or a bracket; a lone quotation mark begins a string that does not end."""
_BETWEEN = re.compile(rb"[\s,]*")
_WORD = re.compile(rb"(?:null|true|false|-?\d[\d.eE+-]*)(?=[\s,\]]|\Z)")
"""A value that is no object, list or string."""
_OTHERS = {
    b"\x1f\x8b": "gzip; unpack it first, with gunzip",
    b"PK\x03\x04": "a zip file; unpack it first, with unzip",
    b"PAR1": "Parquet; write it as JSON Lines first, with pandas.read_parquet(…).to_json(…, "
    "orient='records', lines=True), its pictures as files of their own",
}
"""How files of other kinds begin, and what to do with them."""


@dataclass(frozen=True)
class JsonItems:
    """The items of a file.

    Attributes:
        path: the file.
        starts, ends: (n,) the offsets of each item's first byte, and after its last.
    """

    path: Path
    starts: array[int]
    ends: array[int]

    def __len__(self) -> int:
        return len(self.starts)

    def __getitem__(self, index: int) -> object:
        """The value of an item, read from the file.

        Raises:
            TaskFileError: it is not JSON, or larger than er-gym reads; the message says where.
        """
        value, wrong = self.look(index)
        if wrong:
            raise TaskFileError(f"{self.place(index)}: {wrong}")
        return value

    def look(self, index: int) -> tuple[object, str]:
        """The value of an item, or None and why it cannot be read.

        Raises:
            TaskFileError: the file is not there any more.
        """
        start, end = self.starts[index], self.ends[index]
        if end - start > LONGEST_LINE:
            return None, (
                f"an item of {(end - start) >> 20} MB; er-gym reads at most {LONGEST_LINE >> 20} "
                "MB; pictures stand in a file as paths"
            )
        with open_file(self.path) as file:
            file.seek(start)
            raw = file.read(end - start)
        try:
            return parse_json(raw.decode("utf-8"), self.path), ""
        except UnicodeDecodeError as error:
            return None, f"not UTF-8: {error.reason}"
        except TaskFileError as error:
            return None, f"{str(error).removeprefix(f'{self.path}: ')}, counted from there"

    def place(self, index: int) -> str:
        """Where an item is, for people: its number from 0, and its line."""
        return f"{self.path}: item {index} (line {self.line(index)})"

    def line(self, index: int) -> int:
        """The line on which an item begins, from 1."""
        count, left = 1, self.starts[index]
        with open_file(self.path) as file:
            while left > 0 and (block := file.read(min(left, 1 << 20))):
                count += block.count(b"\n")
                left -= len(block)
        return count


def json_items(path: Path) -> JsonItems:
    """Find the items of a file. Only brackets and strings are looked at.

    Raises:
        TaskFileError: the file cannot be read, is neither a list of objects nor objects one after
            another, or ends in the middle of one.
    """
    starts, ends = array("Q"), array("Q")
    with open_file(path) as file:
        if not path.stat().st_size:
            raise TaskFileError(f"{path}: the file is empty")
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as text:
            for beginning, told in _OTHERS.items():
                if text[: len(beginning)] == beginning:
                    raise TaskFileError(f"{path}: {told}")
            _scan(path, text, starts, ends)
    if not starts:
        raise TaskFileError(f"{path}: no items; the file is a list of objects, or JSON Lines")
    return JsonItems(path, starts, ends)


def _scan(path: Path, text: mmap.mmap, starts: array[int], ends: array[int]) -> None:
    """Fill in where the items are."""
    place = len(_MARK) if text[: len(_MARK)] == _MARK else 0
    opening = _gap(text, place)
    in_list = text[opening : opening + 1] == b"["
    depth = 0
    last = opening + 1 if in_list else opening
    for token in _TOKEN.finditer(text, last):
        if not depth:
            last = _words(text, last, starts, ends)
        sign = text[token.start() : token.start() + 1]
        if sign == b'"':
            if token.end() - token.start() == 1:
                raise TaskFileError(f"{_at(path, text, token.start())}: a string without an end")
            if not depth:
                if _gap(text, last) != token.start():
                    break
                starts.append(token.start())
                last = token.end()
                ends.append(last)
        elif sign in b"{[":
            if not depth:
                if _gap(text, last) != token.start():
                    break
                starts.append(token.start())
            depth += 1
        else:
            depth -= 1
            if depth < 0:
                depth = 0
                break
            if not depth:
                last = token.end()
                ends.append(last)
    if depth > 0:
        raise TaskFileError(
            f"{path}: the file ends in the middle of item {len(starts) - 1}; was it cut off?"
        )
    last = _words(text, last, starts, ends)
    rest = _gap(text, last)
    closed = in_list and text[rest : rest + 1] == b"]"
    if closed:
        rest = _gap(text, rest + 1)
    if in_list and not closed and rest == len(text):
        raise TaskFileError(f"{path}: the list has no end after item {len(starts) - 1}; cut off?")
    if rest != len(text):
        raise TaskFileError(
            f"{_at(path, text, rest)}: expected an object or the end, found "
            f"{text[rest : rest + 20].decode('utf-8', 'replace')!r}; the file is a list of "
            "objects, or JSON Lines"
        )


def _words(text: mmap.mmap, place: int, starts: array[int], ends: array[int]) -> int:
    """Fill in the values without brackets that come next, and return the place after them."""
    while found := _WORD.match(text, _gap(text, place)):
        starts.append(found.start())
        place = found.end()
        ends.append(place)
    return place


def _gap(text: mmap.mmap, place: int) -> int:
    """The first place from ``place`` on that is no space and no comma."""
    found = _BETWEEN.match(text, place)
    return found.end() if found else place


def _at(path: Path, text: mmap.mmap, place: int) -> str:
    line, start = 1, 0
    while (start := text.find(b"\n", start, place) + 1) > 0:
        line += 1
    return f"{path}: line {line}"
