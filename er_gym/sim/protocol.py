"""The messages to and from AI2-THOR's client, as ``ai2thor==5.0.0`` reads them.

Over FIFO a message is a sequence of fields. Each field has a header (one byte of type, four bytes
of big-endian length) and a body. An empty field of type 255 ends the message. The client sends one
JSON field. The player answers with metadata in msgpack and then images. Over WSGI the metadata is
JSON and the images are parts of a form. Images go bottom row first. All this was measured with a
stub in place of Unity.
"""

from __future__ import annotations

import json
import os
import struct
from collections.abc import Callable, Iterator, Sequence
from enum import IntEnum
from typing import IO, Any

import msgpack  # type: ignore[import-untyped]  # what the client reads metadata with
import numpy as np
from numpy.typing import NDArray

from er_gym.sim.crew import MOST_AGENTS
from er_gym.sim.render.view import View

_HEADER = struct.Struct("!BI")


class Field(IntEnum):
    """Types of fields, without those of images that the embedded engine does not draw."""

    METADATA = 1
    ACTION = 2
    RGB = 4
    DEPTH = 5
    CLASSES = 8
    INSTANCES = 9
    THIRD_PARTY_RGB = 10
    PATCH = 11
    THIRD_PARTY_DEPTH = 12
    THIRD_PARTY_INSTANCES = 14
    THIRD_PARTY_CLASSES = 15
    END = 255


FORM_NAMES = {
    Field.RGB: "image",
    Field.DEPTH: "image_depth",
    Field.CLASSES: "image_classes",
    Field.INSTANCES: "image_ids",
    Field.THIRD_PARTY_RGB: "image-thirdParty-camera",
    Field.THIRD_PARTY_DEPTH: "image_thirdParty_depth",
    Field.THIRD_PARTY_INSTANCES: "image_thirdParty_image_ids",
    Field.THIRD_PARTY_CLASSES: "image_thirdParty_classes",
}
"""The names of the images in the form that the client's WSGI server reads."""
_END = _HEADER.pack(Field.END, 0)
_FIELDS = {
    "rgb": (Field.RGB, Field.THIRD_PARTY_RGB),
    "depth": (Field.DEPTH, Field.THIRD_PARTY_DEPTH),
    "classes": (Field.CLASSES, Field.THIRD_PARTY_CLASSES),
    "instances": (Field.INSTANCES, Field.THIRD_PARTY_INSTANCES),
}
"""For each attribute of a view its fields: the agent's and the third-party cameras'."""


def read_request(pipe: IO[bytes]) -> dict[str, Any] | None:
    """The client's next action, None when the client has closed its end."""
    request: dict[str, Any] | None = None
    while True:
        header = pipe.read(_HEADER.size)
        if len(header) < _HEADER.size:
            return None
        kind, length = _HEADER.unpack(header)
        if kind == Field.END:
            return request
        body = pipe.read(length)
        if len(body) < length:
            return None
        if kind == Field.ACTION:
            request = json.loads(body)


def send(pipe: int, fields: Sequence[tuple[Field, bytes]]) -> None:
    """Write one message to a file descriptor."""
    parts: list[bytes] = []
    for kind, body in fields:
        parts += [_HEADER.pack(kind, len(body)), body]
    parts.append(_END)
    written = os.writev(pipe, parts)
    if written < sum(map(len, parts)):
        rest = memoryview(b"".join(parts))[written:]
        while rest:
            rest = rest[os.write(pipe, rest) :]


def images(views: Sequence[View]) -> Iterator[tuple[Field, bytes]]:
    """The images of the agents' views as fields: of each kind the agents' first, in the order of
    their ids, and then those of each third-party camera."""
    for name, (own, third_party) in _FIELDS.items():
        for kind, shown in (
            *((own, view) for view in views),
            *((third_party, other) for other in views[0].third_party),
        ):
            picture = getattr(shown, name)
            if picture is not None:
                colours_of_ids = name in ("classes", "instances")
                pixels = rgba(picture) if colours_of_ids else picture
                yield kind, pixels[::-1].tobytes()


def rgba(colours: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """(H, W, 4) colours: (H, W, 3) ones with the opaque alpha that the client expects in
    segmentations."""
    return np.pad(colours, ((0, 0), (0, 0), (0, 1)), constant_values=255)


class ObjectCache:
    """Encoded objects. An object whose metadata are unchanged is not encoded again.

    Args:
        encode: turns an object's metadata into bytes.
    """

    def __init__(self, encode: Callable[[dict[str, Any]], bytes]) -> None:
        self._encode = encode
        self._kept: dict[str, tuple[dict[str, Any], bytes]] = {}

    def __call__(self, entry: dict[str, Any]) -> bytes:
        """One object, encoded."""
        kept = self._kept.get(entry["objectId"])
        if kept is None or kept[0] != entry:
            kept = self._kept[entry["objectId"]] = entry, self._encode(entry)
        return kept[1]

    def forget(self) -> None:
        """Forget all objects, because another scene follows."""
        self._kept.clear()


class MetadataPacker:
    """Encodes metadata as msgpack, which FIFO sends."""

    def __init__(self) -> None:
        # A string with a lone surrogate cannot be encoded and must not end the player.
        self._packer = msgpack.Packer(unicode_errors="replace")
        self.objects = tuple(ObjectCache(self._packer.pack) for _ in range(MOST_AGENTS))

    def __call__(self, agents: Sequence[dict[str, Any]], active: int, sequence_id: int) -> bytes:
        """The metadata of a message: those of all agents, and what the client keeps beside them.

        Args:
            agents: by their ids.
            active: the id of the agent that acted.
        """
        pack = self._packer.pack
        return b"".join(
            (
                self._packer.pack_map_header(4),
                pack("sequenceId"),
                pack(sequence_id),
                pack("activeAgentId"),
                pack(active),
                pack("thirdPartyCameras"),
                pack(agents[0]["thirdPartyCameras"]),
                pack("agents"),
                self._packer.pack_array_header(len(agents)),
                *(
                    part
                    for pair in zip(agents, self.objects, strict=False)
                    for part in self._agent(*pair)
                ),
            )
        )

    def patch(self, active: int, changes: dict[str, Any]) -> bytes:
        """The changes since the last message, whose images the client keeps as well.

        Args:
            active: the id of the agent that acted; nothing has changed for the others.
        """
        packed: bytes = self._packer.pack({"agentId": active, **changes})
        return packed

    def _agent(self, metadata: dict[str, Any], objects: ObjectCache) -> Iterator[bytes]:
        pack = self._packer.pack
        yield self._packer.pack_map_header(len(metadata))
        for name, value in metadata.items():
            yield pack(name)
            if name == "objects":
                yield self._packer.pack_array_header(len(value))
                yield from map(objects, value)
            else:
                yield pack(value)


class MetadataJson:
    """Encodes metadata as JSON, which WSGI sends."""

    def __init__(self) -> None:
        self.objects = tuple(ObjectCache(_json) for _ in range(MOST_AGENTS))

    def __call__(self, agents: Sequence[dict[str, Any]], active: int, sequence_id: int) -> bytes:
        """The same metadata as :class:`MetadataPacker` encodes."""
        return b'{"sequenceId":%d,"activeAgentId":%d,"thirdPartyCameras":%b,"agents":[%b]}' % (
            sequence_id,
            active,
            _json(agents[0]["thirdPartyCameras"]),
            b",".join(map(self._agent, agents, self.objects)),
        )

    def _agent(self, metadata: dict[str, Any], objects: ObjectCache) -> bytes:
        return b"{%b}" % b",".join(
            b"%b:%b"
            % (
                _json(name),
                b"[%b]" % b",".join(map(objects, value)) if name == "objects" else _json(value),
            )
            for name, value in metadata.items()
        )


def _json(value: Any) -> bytes:
    return json.dumps(value).encode()
