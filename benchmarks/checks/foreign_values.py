"""What strangers' files may hold: names that lead out of a folder, values of every type, pictures
that are none."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

NAMES = (
    "../../x", "/tmp/er-gym-outside/x", "..\\..\\x", "C:\\x", ".", "..", "", "a\0b", "x" * 4000,
    "a/../../../../x", "~/x", "\u202e", "con", " ", "-rf",
)  # fmt: skip
"""What a field that becomes a path may hold."""
VALUES: tuple[Any, ...] = (
    None, True, 0, -1, 1e300, "", "x", "😀", "../../x", "a\0b", "<image>" * 3, [], {}, [[]], [{}],
    [None], {"a": {}}, "x" * 5000,
)  # fmt: skip
"""What any field may hold."""
EPS = b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 64 64\n%%EndComments\n{} loop\n"
"""A program that never ends, which Pillow would have Ghostscript run."""
DDS = b"DDS " + struct.pack("<7I", 124, 0x1007, 8, 8, 0, 0, 0) + bytes(44)
DDS += struct.pack("<2I4s5I", 32, 0x4, b"ZZZZ", 0, 0, 0, 0, 0) + bytes(20)
"""An unknown pixel format, for which Pillow raises NotImplementedError."""


def png(width: int, height: int) -> bytes:
    """A PNG that claims a size in pixels, with hardly any content."""
    head = struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(bytes(100))), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
        for name, data in chunks
    )


PICTURES = {
    "eps": EPS, "dds": DDS, "empty": b"", "text": b"secret", "pdf": b"%PDF-1.4\n",
    "svg": b"<svg xmlns='http://www.w3.org/2000/svg'/>", "large": png(13_000, 13_000),
    "bomb": png(60_000, 60_000), "nothing": png(0, 0), "cut": png(64, 64)[:30],
}  # fmt: skip
"""Files that are named as pictures, and of which none is read."""


def mutations(value: Any) -> Iterator[Any]:
    """A value of JSON with each of its parts in turn left out, and as each of :data:`VALUES`."""
    yield from VALUES
    if isinstance(value, dict):
        for key, part in value.items():
            yield {other: each for other, each in value.items() if other != key}
            for changed in mutations(part):
                yield {**value, key: changed}
    elif isinstance(value, list):
        for at in range(min(len(value), 2)):
            yield value[:at] + value[at + 1 :]
            for changed in mutations(value[at]):
                yield [*value[:at], changed, *value[at + 1 :]]


def contents(folder: Path) -> dict[str, tuple[bytes, int]]:
    """Of each file in a folder, its content and the time of its last change; of folders nothing."""
    return {
        str(each.relative_to(folder)): (each.read_bytes(), each.stat().st_mtime_ns)
        if each.is_file()
        else (b"", 0)
        for each in folder.rglob("*")
    }
