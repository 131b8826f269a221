"""A stand-in for libX11 on machines without it.

Panda3D's wheel for Linux declares that its software rasteriser needs libX11.so.6, but does not
contain it. Nothing calls the library when there is no window, but the loader requires it. If it is
not installed, as in slim containers, this module writes a library of that name whose functions all
return 0, loads it and deletes it again. The loader then considers the name as loaded.
"""

from __future__ import annotations

import struct
import sys
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

from er_gym.shared_library import load, load_bytes

_SONAME = "libX11.so.6"
_RASTERISER = "libp3tinydisplay.so"
_X86_64, _AARCH64 = 62, 183
_RETURN_0 = {
    _X86_64: bytes.fromhex("31c0c3"),  # xor eax, eax; ret
    _AARCH64: bytes.fromhex("000080d2c0035fd6"),  # mov x0, 0; ret
}
"""Machine code for each machine number of ELF."""
_PAGE = 0x10000
"""The largest page size of both machines, bytes."""
_READ, _WRITE, _EXECUTE = 4, 2, 1
_LOAD, _DYNAMIC, _STACK = 1, 2, 0x6474E551
_ADVICE = (
    f"Panda3D's software rasteriser needs {_SONAME}, which is not installed, and a stand-in for it "
    "could not be loaded: install libx11-6 (Debian or Ubuntu: apt-get install libx11-6)"
)


def provide_libx11() -> None:
    """Make sure that the rasteriser can be loaded. On systems other than Linux it always can.

    Raises:
        ImportError: there is no libX11, and the system does not load a stand-in.
    """
    if sys.platform != "linux" or load(_SONAME) is not None:
        return
    rasteriser = _rasteriser()
    if rasteriser is None:
        return  # not the wheel, but a build with its own libraries
    machine, names = wanted_symbols(rasteriser)
    if machine not in _RETURN_0:
        raise ImportError(_ADVICE)
    stub = stand_in(_SONAME, names, machine)
    if load_bytes(stub, _SONAME) is None:
        raise ImportError(_ADVICE)


def _rasteriser() -> Path | None:
    """The rasteriser's library in Panda3D's wheel."""
    package = find_spec("panda3d")
    places = (package.submodule_search_locations if package else None) or ()
    return next((p for p in (Path(place, _RASTERISER) for place in places) if p.exists()), None)


# -- reading -------------------------------------------------------------------------------------


class _Section(NamedTuple):
    """The needed part of a row of ELF's section table."""

    kind: int
    offset: int
    size: int
    link: int


_DYNAMIC_SYMBOLS = 11


def wanted_symbols(library: Path) -> tuple[int, list[str]]:
    """The machine of a library, and the functions of X that it needs.

    Raises:
        ImportError: it is not a 64-bit little-endian ELF file with dynamic symbols.
    """
    content = library.read_bytes()
    if content[:6] != b"\x7fELF\x02\x01":
        raise ImportError(f"{library} is not a 64-bit little-endian ELF file")
    machine = int(struct.unpack_from("<H", content, 18)[0])
    sections = list(_sections(content))
    table = next((section for section in sections if section.kind == _DYNAMIC_SYMBOLS), None)
    if table is None:
        raise ImportError(f"{library} has no table of dynamic symbols")
    names = _undefined(content, table, sections[table.link])
    return machine, sorted(name for name in names if name.startswith(("X", "_X")))


def _sections(content: bytes) -> Iterator[_Section]:
    (start,) = struct.unpack_from("<Q", content, 0x28)
    size, count = struct.unpack_from("<HH", content, 0x3A)
    for k in range(count):
        row = struct.unpack_from("<IIQQQQIIQQ", content, start + k * size)
        yield _Section(kind=row[1], offset=row[4], size=row[5], link=row[6])


def _undefined(content: bytes, table: _Section, strings: _Section) -> Iterator[str]:
    """The names of undefined symbols."""
    rows = content[table.offset : table.offset + table.size]
    for name, _, _, section, _, _ in struct.iter_unpack("<IBBHQQ", rows):
        if section == 0:
            start = strings.offset + name
            yield content[start : content.index(b"\0", start)].decode()


# -- writing -------------------------------------------------------------------------------------


def stand_in(soname: str, names: Sequence[str], machine: int) -> bytes:
    """A shared library with functions of some names that all return 0.

    Two segments are loaded: one to be read and executed, and one that the loader writes to. The
    stack is not executable.
    """
    strings, offsets = _strings([soname, *names])
    headers = 64 + 4 * 56
    code = _RETURN_0[machine].ljust(16, b"\0")
    at_symbols = headers + len(code)
    symbols = _symbols(offsets[1:], headers, len(_RETURN_0[machine]))
    at_hashes = at_symbols + len(symbols)
    hashes = _hashes(len(names) + 1)
    at_strings = at_hashes + len(hashes)
    fixed = code + symbols + hashes + strings
    fixed = fixed.ljust(-(-len(fixed) // 16) * 16, b"\0")
    at_dynamic = headers + len(fixed)
    dynamic = b"".join(
        struct.pack("<qQ", tag, value)
        for tag, value in (
            (14, offsets[0]),  # the library's name
            (4, at_hashes),
            (5, at_strings),
            (6, at_symbols),
            (10, len(strings)),
            (11, 24),  # the size of a symbol
            (0, 0),
        )
    )
    written = at_dynamic + _PAGE  # a page later in memory, so that both have pages of their own
    segments = (
        _segment(_LOAD, _READ | _EXECUTE, 0, 0, at_dynamic, _PAGE),
        _segment(_LOAD, _READ | _WRITE, at_dynamic, written, len(dynamic), _PAGE),
        _segment(_DYNAMIC, _READ | _WRITE, at_dynamic, written, len(dynamic), 8),
        _segment(_STACK, _READ | _WRITE, 0, 0, 0, 16),
    )
    return _header(machine, len(segments)) + b"".join(segments) + fixed + dynamic


def _header(machine: int, segments: int) -> bytes:
    ident = b"\x7fELF\x02\x01\x01".ljust(16, b"\0")
    fields = (3, machine, 1, 0, 64, 0, 0, 64, 56, segments, 64, 0, 0)  # 3: a shared library
    return ident + struct.pack("<HHIQQQIHHHHHH", *fields)


def _segment(kind: int, flags: int, offset: int, address: int, size: int, align: int) -> bytes:
    return struct.pack("<IIQQQQQQ", kind, flags, offset, address, address, size, size, align)


def _strings(texts: Sequence[str]) -> tuple[bytes, list[int]]:
    """A string table, and the offset of each string in it."""
    table, offsets = b"\0", []
    for text in texts:
        offsets.append(len(table))
        table += text.encode() + b"\0"
    return table, offsets


def _symbols(names: Sequence[int], address: int, size: int) -> bytes:
    """Global functions at one address; the first symbol of a table is always empty."""
    function = 0x12
    rows = (struct.pack("<IBBHQQ", name, function, 0, 1, address, size) for name in names)
    return bytes(24) + b"".join(rows)


def _hashes(symbols: int) -> bytes:
    """A hash table with a single bucket that links each symbol to the next."""
    chain = [0, *range(2, symbols), 0][:symbols]
    found = struct.pack(f"<{3 + symbols}I", 1, symbols, min(1, symbols - 1), *chain)
    return found.ljust(-(-len(found) // 8) * 8, b"\0")
