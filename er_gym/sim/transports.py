"""How the player and AI2-THOR's client exchange messages: one class a transport.

The client names the transport and where it listens in the player's environment. Each class opens
its connection from there, sends what comes of an action and receives the next one.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import IO, Any, Protocol

from er_gym.sim.protocol import FORM_NAMES, Field, MetadataJson, MetadataPacker, read_request, send

_PIPE_BYTES = 1 << 20
"""A picture goes through a pipe of this size in one write; Linux allows it to anybody."""
_ONLY_WHOLE = frozenset({"objects", "thirdPartyCameras"})
"""Where these have changed, or a picture has, FIFO sends a whole message; else, as Unity's
``fastActionEmit`` does, only what has changed. It saves the client most of its work."""


@dataclass(frozen=True)
class Message:
    """What came of an action.

    Attributes:
        sequence_id: the request's number, which the client compares.
        metadata: all that the agent is told.
        changes: the part of it that differs from the last message.
        images: the pictures, as :func:`er_gym.sim.protocol.images` gives them.
        same_images: whether they are the last message's.
        may_patch: whether the client agrees to be told the changes alone.
    """

    sequence_id: int
    metadata: dict[str, Any]
    changes: dict[str, Any]
    images: Sequence[tuple[Field, bytes]]
    same_images: bool
    may_patch: bool


class Transport(Protocol):
    """A connection to the client that started the player.

    Both methods raise OSError (ConnectionError for the most part) when the client is gone.
    """

    def send(self, message: Message) -> None:
        """Tell the client what came of an action."""

    def receive(self) -> dict[str, Any] | None:
        """The client's next action; None when there are no more."""


class Fifo:
    """Two named pipes; see :mod:`er_gym.sim.protocol`."""

    VARIABLES = ("AI2THOR_FIFO_SERVER_PIPE_PATH", "AI2THOR_FIFO_CLIENT_PIPE_PATH")

    def __init__(self, environment: Mapping[str, str]) -> None:
        to_client, self._from_client = (environment[name] for name in self.VARIABLES)
        self._to_client = os.open(to_client, os.O_WRONLY)
        if hasattr(fcntl, "F_SETPIPE_SZ"):  # Linux, Python 3.10
            with contextlib.suppress(OSError):  # the user's pipes are at their limit
                fcntl.fcntl(self._to_client, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
        self._requests: IO[bytes] | None = None
        self._pack = MetadataPacker()

    def send(self, message: Message) -> None:
        if "sceneName" in message.changes:
            self._pack.objects.forget()
        if message.may_patch and message.same_images and not message.changes.keys() & _ONLY_WHOLE:
            fields = [(Field.PATCH, self._pack.patch(message.changes))]
        else:
            metadata = self._pack(message.metadata, message.sequence_id)
            fields = [(Field.METADATA, metadata), *message.images]
        send(self._to_client, fields)

    def receive(self) -> dict[str, Any] | None:
        if self._requests is None:
            # Not before the first message has gone: the client opens its end for writing after it.
            self._requests = open(self._from_client, "rb")  # noqa: SIM115  # for as long as we play
        return read_request(self._requests)


class Wsgi:
    """The client serves HTTP: an event is a form that is posted, the response the next action."""

    VARIABLES = ("AI2THOR_HOST", "AI2THOR_PORT")

    def __init__(self, environment: Mapping[str, str]) -> None:
        from http.client import HTTPConnection  # takes 40 ms, which a player on FIFO does not need

        host, port = (environment[name] for name in self.VARIABLES)
        self._token = environment.get("AI2THOR_CLIENT_TOKEN", "")
        self._boundary = os.urandom(16).hex()  # a picture holds it with a chance of 1 in 10³⁰
        self._connection = HTTPConnection(host, int(port))
        self._encode = MetadataJson()

    def send(self, message: Message) -> None:
        if "sceneName" in message.changes:
            self._encode.objects.forget()
        metadata = self._encode(message.metadata, message.sequence_id)  # WSGI has no patches
        parts: list[bytes] = []
        for name, text in (("metadata", metadata), ("token", self._token.encode())):
            parts += [self._head(name, "text/plain; charset=utf-8"), text]
        for field, pixels in message.images:
            head = self._head(f"{FORM_NAMES[field]}; filename={field.name}", "image/raw")
            parts += [head, pixels]
        parts.append(f"\r\n--{self._boundary}--\r\n".encode())
        content = f"multipart/form-data; boundary={self._boundary}"
        self._connection.request("POST", "/train", b"".join(parts), {"Content-Type": content})

    def receive(self) -> dict[str, Any] | None:
        from http.client import OK, HTTPException

        try:
            response = self._connection.getresponse()
            body = response.read()
        except HTTPException as error:  # it broke off in the middle
            raise ConnectionError(f"{type(error).__name__}: {error}") from error
        if response.status != OK:
            raise ConnectionError(f"AI2-THOR's client answered {response.status} {response.reason}")
        request: dict[str, Any] = json.loads(body)
        return request if "action" in request else None  # so the client says that it stops

    def _head(self, disposition: str, kind: str) -> bytes:
        # The client's parser wants these two names in these very letters.
        return (
            f"\r\n--{self._boundary}\r\n"
            f"Content-Type: {kind}\r\n"
            f"Content-disposition: form-data; name={disposition}\r\n\r\n"
        ).encode()


TRANSPORTS: dict[str, type[Fifo] | type[Wsgi]] = {"FIFO": Fifo, "WSGI": Wsgi}
"""What the client says in ``AI2THOR_SERVER_TYPE`` to the class that speaks it."""
