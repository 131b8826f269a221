"""Read users' files within limits, so that no file can hang er-gym or fill the memory.

All files that users may have written are read here: task files, configurations, prompts, run
directories. Only regular files are read, never devices or pipes. The size is limited before and
after decompression. Parsed data are limited in size and depth; a YAML alias counts as much as the
value that it stands for.
"""

from __future__ import annotations

import gzip
import io
import json
import math
import os
import re
import stat
import zlib
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

import yaml

from er_gym.tasks.errors import TaskFileError

LARGEST = 64 << 20
"""The most bytes of a file, decompressed. The suite ``train``, 9,876 tasks, has 14 MB."""
LARGEST_TEXT = 32 << 20
"""The most bytes of a file read as one text; in memory a text takes up to four times as much."""
LONGEST_LINE = 4 << 20
"""The most bytes of a line of JSON Lines; the longest line of ``train`` has 4,600."""
LARGEST_YAML = 1 << 16
"""The most characters of a YAML document; PyYAML takes up to two seconds for these."""
LARGEST_STREAM = 1 << 30
"""The most bytes, decompressed, of a file of JSON Lines of which one line at a time is kept."""
MOST_VALUES = 2_000_000
"""The most commas and opening brackets in a JSON file; ``train`` has 0.6 million."""
MOST_IN_YAML = 100_000
"""The most nodes of a YAML document; an alias counts as the nodes that it stands for."""
DEEPEST = 64
"""The most levels of nested lists and objects."""
LONGEST_INTEGER = 20
"""The most characters of an integer; 64 bits need at most this many."""

_KINDS = (
    (stat.S_ISDIR, "a directory"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISSOCK, "a socket"),
)
_FLAGS = os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""No system has all of them."""
_MOST_BRACKETS = 500
_LONGEST_PATH = 300
"""The most characters of a path that a message names; a file may state one of any length."""
_BRACKET = re.compile(r"[\[\]{}]")
_INTEGER = "tag:yaml.org,2002:int"
_SURROGATE = re.compile(r"\\u[dD][89a-fA-F]")
"""JSON escapes that form a character only in pairs."""


def open_file(path: Path) -> BinaryIO:
    """Open a regular file for reading bytes.

    Raises:
        TaskFileError: the file does not exist, is not a regular file, or may not be read.
    """
    try:
        _must_be_regular(os.stat(path).st_mode, path)  # opening a device can have side effects
        # O_NONBLOCK: do not wait if a pipe has replaced the file in the meantime.
        handle = os.open(path, _FLAGS)
        file = open(handle, "rb")  # noqa: SIM115  # the caller closes it
    except TaskFileError:
        raise
    except FileNotFoundError:
        raise TaskFileError(f"{path}: no such file") from None
    except OSError as error:
        raise TaskFileError(f"{path!s:.{_LONGEST_PATH}}: {error.strerror}") from None
    except ValueError as error:  # a path with a zero byte
        raise TaskFileError(f"{str(path)!r}: not a path: {error}") from None
    try:
        _must_be_regular(os.fstat(handle).st_mode, path)
    except TaskFileError:
        file.close()
        raise
    return file


def read_bytes(path: Path, most: int = LARGEST) -> bytes:
    """The bytes of a file, decompressed if its name ends in ``.gz``.

    Args:
        path: a regular file.
        most: the most bytes that it may have, compressed and decompressed.

    Raises:
        TaskFileError: the file cannot be read, is larger, or is not gzip.
    """
    with open_file(path) as file:
        try:
            data = file.read(most + 1)
            if data is None:  # reading such a file of the kernel would block
                raise TaskFileError(f"{path}: nothing to read now; give a regular file")
            if path.suffix.lower() == ".gz" and len(data) <= most:
                with gzip.GzipFile(fileobj=io.BytesIO(data)) as packed:
                    data = packed.read(most + 1)
        except (gzip.BadGzipFile, EOFError, zlib.error) as error:
            raise TaskFileError(f"{path}: not a whole gzip file: {error}") from None
        except OSError as error:
            raise TaskFileError(f"{path}: {error.strerror}") from None
    if len(data) > most:
        raise TaskFileError(
            f"{path}: larger than er-gym reads; such a file has at most {_size(most)}, unpacked"
        )
    return data


def read_text(path: Path, most: int = LARGEST_TEXT) -> str:
    """The text of a file without a byte order mark, decompressed if its name ends in ``.gz``.

    Raises:
        TaskFileError: the file cannot be read, is larger than ``most`` bytes, or is not UTF-8 or
            gzip.
    """
    return _decoded(read_bytes(path, most), path)


def parse_json(text: str, path: Path, first_line: int = 1) -> object:
    """Parse JSON that starts at line ``first_line`` of a file.

    Raises:
        TaskFileError: the text is not JSON, has too many values or levels, or holds NaN, a number
            beyond 64 bits or a lone surrogate. The message says where.
    """
    opened = text.count("[") + text.count("{")
    if opened + text.count(",") > MOST_VALUES:
        _too_many(path)
    try:
        data = _DECODER.decode(text)
    except json.JSONDecodeError as error:
        line = error.lineno + first_line - 1
        raise TaskFileError(
            f"{path}: not JSON: {error.msg} (line {line}, column {error.colno})"
        ) from None
    except RecursionError:
        _too_deep(f"{path}: line {first_line}")
    except ValueError as error:  # raised by _integer, _decimal and _constant
        raise TaskFileError(f"{path}: {_place(text, first_line)}: {error}") from None
    if opened > DEEPEST and _is_deeper(data):
        _too_deep(f"{path}: {_place(text, first_line)}")
    if _SURROGATE.search(text):
        try:
            json.dumps(data, ensure_ascii=False).encode()
        except UnicodeEncodeError:
            raise TaskFileError(
                f"{path}: {_place(text, first_line)}: half a character (a lone surrogate); "
                "write the whole one"
            ) from None
    return data


def read_json_lines(path: Path) -> Iterator[tuple[int, object]]:
    """Yield the number of each line, from 1, and its JSON value; empty lines are skipped.

    Only a newline ends a line. U+2028 and similar characters are part of a text.

    Raises:
        TaskFileError: as :func:`read_bytes` and :func:`parse_json`.
    """
    data = read_bytes(path)
    values = data.count(b"\n")
    for number, line in enumerate(io.BytesIO(data), 1):
        if len(line) > LONGEST_LINE:
            raise TaskFileError(f"{path}: line {number} is longer than {_size(LONGEST_LINE)}")
        values += line.count(b",") + line.count(b"[") + line.count(b"{")
        if values > MOST_VALUES:
            _too_many(path)
        text = _decoded(line, path, number)
        if text.strip():
            yield number, parse_json(text, path, number)


def stream_json_lines(path: Path, most: int = LARGEST_STREAM) -> Iterator[tuple[int, object]]:
    """As :func:`read_json_lines`, for long files: one line at a time is in memory.

    Args:
        path: a regular file, decompressed if its name ends in ``.gz``.
        most: the most bytes of all lines, decompressed.

    Raises:
        TaskFileError: as there, and each line may have as many values as a file there.
    """
    with open_file(path) as file:
        packed = path.suffix.lower() == ".gz"
        lines: Any = gzip.GzipFile(fileobj=file) if packed else file
        number = total = 0
        while True:
            try:
                line = lines.readline(LONGEST_LINE + 1)
            except (gzip.BadGzipFile, EOFError, zlib.error) as error:
                raise TaskFileError(f"{path}: not a whole gzip file: {error}") from None
            except OSError as error:
                raise TaskFileError(f"{path}: {error.strerror}") from None
            if not line:
                return
            number, total = number + 1, total + len(line)
            if len(line) > LONGEST_LINE:
                raise TaskFileError(f"{path}: line {number} is longer than {_size(LONGEST_LINE)}")
            if total > most:
                raise TaskFileError(
                    f"{path}: larger than er-gym reads; such a file has at most {_size(most)}, "
                    "unpacked"
                )
            text = _decoded(line, path, number)
            if text.strip():
                yield number, parse_json(text, path, number)


def read_yaml(path: Path) -> Any:
    """Parse a YAML file.

    Raises:
        TaskFileError: as :func:`read_text` and :func:`parse_yaml`.
    """
    return parse_yaml(read_text(path, LARGEST_YAML), str(path))


def parse_yaml(text: str, where: str) -> Any:
    """Parse a YAML document.

    Args:
        text: one document.
        where: its place, for messages.

    Raises:
        TaskFileError: the text is not YAML, is too long, or has too many levels or nodes.
    """
    if len(text) > LARGEST_YAML:
        raise TaskFileError(f"{where}: too long; YAML may have {LARGEST_YAML:,} characters")
    if _brackets(text) > _MOST_BRACKETS:  # PyYAML takes quadratic time for these
        _too_deep(where)
    loader = None
    try:
        loader = yaml.SafeLoader(text)
        node = loader.get_single_node()
        if node is None:
            return None
        size, height = _measured(node, {})
        if height > DEEPEST:
            _too_deep(where)
        if size > MOST_IN_YAML:
            raise TaskFileError(
                f"{where}: too many values; YAML may have {MOST_IN_YAML:,}; an alias counts as the "
                "values that it stands for"
            )
        return loader.construct_document(node)
    except TaskFileError:
        raise
    except UnicodeEncodeError:
        raise TaskFileError(f"{where}: not YAML: half a character (a lone surrogate)") from None
    except yaml.YAMLError as error:
        raise TaskFileError(f"{where}: not YAML: {' '.join(str(error).split())}") from None
    except RecursionError:
        _too_deep(where)
    except Exception as error:  # PyYAML fails so on "!!int x" and on 2001-99-99
        raise TaskFileError(
            f"{where}: not YAML: a value does not fit its tag ({type(error).__name__}: "
            f"{' '.join(str(error).split())})"
        ) from None
    finally:
        if loader is not None:
            loader.dispose()


# -- parts ----------------------------------------------------------------------------------------


def _integer(text: str) -> int:
    if len(text) > LONGEST_INTEGER:
        raise ValueError(f"a whole number of {len(text)} digits; er-gym reads those of 64 bits")
    return int(text)


def _decimal(text: str) -> float:
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"the number {text[:LONGEST_INTEGER]} is too large; give a finite one")
    return number


def _constant(text: str) -> NoReturn:
    raise ValueError(f"{text} is not a JSON number; give a finite number or null")


_DECODER = json.JSONDecoder(parse_int=_integer, parse_float=_decimal, parse_constant=_constant)


def _must_be_regular(mode: int, path: Path) -> None:
    if not stat.S_ISREG(mode):
        kind = next((name for is_one, name in _KINDS if is_one(mode)), "something else")
        raise TaskFileError(f"{path}: {kind}, not a file; give the path of a file")


def _decoded(data: bytes, path: Path, line: int | None = None) -> str:
    try:
        return data.decode("utf-8-sig" if line in (None, 1) else "utf-8")
    except UnicodeDecodeError as error:
        at = f"byte {error.start}" if line is None else f"line {line}, byte {error.start}"
        raise TaskFileError(f"{path}: not UTF-8 text ({at})") from None


def _place(text: str, first_line: int) -> str:
    """The line or the lines of a JSON text."""
    last = first_line + text.rstrip().count("\n")
    return f"line {first_line}" if last == first_line else f"lines {first_line} to {last}"


def _is_deeper(data: object) -> bool:
    """Whether parsed JSON has more levels than :data:`DEEPEST`."""
    level: list[Any] = [data]
    for _ in range(DEEPEST):
        inner = (each.values() if isinstance(each, dict) else each for each in level)
        level = [part for each in inner for part in each if isinstance(part, (dict, list))]
        if not level:
            return False
    return True


def _brackets(text: str) -> int:
    """The deepest nesting of brackets in YAML, brackets in strings included."""
    depth = deepest = 0
    for bracket in _BRACKET.findall(text):
        depth = depth + 1 if bracket in "[{" else max(depth - 1, 0)
        deepest = max(deepest, depth)
    return deepest


def _measured(node: yaml.Node, known: dict[int, tuple[int, int] | None]) -> tuple[int, int]:
    """The number of nodes below a YAML node, itself and aliases included, and its height.

    Args:
        node: the node.
        known: results by the node's Python id; None while a node is being measured.
    """
    if isinstance(node, yaml.ScalarNode):
        node.value.encode()
        if node.tag == _INTEGER and len(node.value) > LONGEST_INTEGER:
            raise yaml.YAMLError(f"a whole number of {len(node.value)} digits; 64 bits are allowed")
        return 1, 0
    if id(node) in known:
        found = known[id(node)]
        if found is None:
            raise yaml.YAMLError("a value contains itself")
        return found
    known[id(node)] = None
    is_map = isinstance(node, yaml.MappingNode)
    parts = chain.from_iterable(node.value) if is_map else node.value
    sizes = [_measured(part, known) for part in parts]
    total = 1 + sum(size for size, _ in sizes), 1 + max((height for _, height in sizes), default=0)
    known[id(node)] = total
    return total


def _too_deep(where: str) -> NoReturn:
    raise TaskFileError(f"{where}: nested too deeply; er-gym reads {DEEPEST} levels") from None


def _too_many(path: Path) -> NoReturn:
    raise TaskFileError(f"{path}: too many values; er-gym reads files of {MOST_VALUES:,}")


def _size(count: int) -> str:
    return f"{count >> 20} MiB" if count >= 1 << 20 else f"{count >> 10} KiB"
