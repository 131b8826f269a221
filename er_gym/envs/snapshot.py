"""Snapshots: an episode as bytes, with a version and a checksum.

The bytes are plain data in msgpack: to open a snapshot runs nothing that is in it. It is checked
before the environment changes.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping
from functools import cache
from hashlib import blake2b
from typing import Any

import msgpack  # type: ignore[import-untyped]
import numpy as np

from er_gym.envs.actions import ACTIONS
from er_gym.thor.objects import TYPES

FORMAT = b"er-gym/episode/1\n"
"""The first bytes of a snapshot, with the version of what follows."""
_NAME = FORMAT[: FORMAT.rindex(b"/") + 1]
_DIGEST = 16
_FASTEST = 1
_ERRORS = "surrogatepass"
"""Models write lone surrogates, which UTF-8 does not have."""
_LARGEST = 1 << 24
"""Bytes of an unpacked snapshot; episodes take some thousand."""


class SnapshotError(ValueError):
    """A snapshot cannot be restored; the message says why. The environment is as it was."""


def pack(state: Mapping[str, Any]) -> bytes:
    """The bytes of plain data: dictionaries with texts as keys, lists, texts, bytes, numbers."""
    packed = zlib.compress(msgpack.packb(state, unicode_errors=_ERRORS), _FASTEST)
    return FORMAT + _digest(packed) + packed


def unpack(snapshot: bytes) -> dict[str, Any]:
    """The data in a snapshot.

    Raises:
        SnapshotError: it is none, is damaged, or is of another version.
    """
    if not isinstance(snapshot, bytes | bytearray | memoryview):
        raise SnapshotError(
            f"a snapshot is the bytes that snapshot() returns, not {type(snapshot).__name__}"
        )
    content = bytes(snapshot)
    if not content.startswith(FORMAT):
        if content.startswith(_NAME):
            version = content[len(_NAME) :].split(b"\n", 1)[0][:20].decode("ascii", "replace")
            own = FORMAT[len(_NAME) :].decode().strip()
            raise SnapshotError(
                f"the snapshot has version {version}, and this er-gym reads {own}: play the "
                "episode again, or use the er-gym that wrote it"
            )
        raise SnapshotError("these bytes are no snapshot of an episode; snapshot() makes one")
    body = content[len(FORMAT) :]
    digest, packed = body[:_DIGEST], body[_DIGEST:]
    if digest != _digest(packed):
        raise SnapshotError("the snapshot is damaged: its checksum does not fit its content")
    unpacker = zlib.decompressobj()
    data = unpacker.decompress(packed, _LARGEST)
    if unpacker.unconsumed_tail:
        raise SnapshotError(f"the snapshot is larger than {_LARGEST} bytes")
    state: dict[str, Any] = msgpack.unpackb(data, unicode_errors=_ERRORS)
    return state


def _digest(packed: bytes) -> bytes:
    return blake2b(packed, digest_size=_DIGEST).digest()


@cache
def vocabulary() -> str:
    """A name of the object types and actions that a snapshot refers to by number."""
    text = "\n".join((*TYPES, *map(str, ACTIONS)))
    return blake2b(text.encode(), digest_size=8).hexdigest()


def generator_state(random: np.random.Generator) -> list[Any]:
    """The state of a PCG64 generator, NumPy's usual one, in texts and numbers.

    Raises:
        ValueError: it is another generator.
    """
    state = random.bit_generator.state
    if state["bit_generator"] != "PCG64":
        raise ValueError(
            f"random numbers of {state['bit_generator']} cannot be saved; use np.random.default_rng"
        )
    inner = state["state"]
    return [str(inner["state"]), str(inner["inc"]), state["has_uint32"], state["uinteger"]]


def generator_of(state: list[Any]) -> np.random.Generator:
    """A generator in a state of :func:`generator_state`."""
    number, increment, has_half, half = state
    bits = np.random.PCG64(0)
    bits.state = {
        "bit_generator": "PCG64",
        "state": {"state": int(number), "inc": int(increment)},
        "has_uint32": has_half,
        "uinteger": half,
    }
    return np.random.Generator(bits)
