"""How the player and AI2-THOR's client exchange messages: one class for each transport.

The player's environment names the transport and its address. Each class opens its connection from
there, sends events and receives actions.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import IO, Any, Protocol

from er_gym.sim.protocol import FORM_NAMES, Field, MetadataJson, MetadataPacker, read_request, send

_PIPE_BYTES = 1 << 20
"""The size of the pipe, bytes. An image goes through it in one write, and Linux allows any user
this size."""
_ONLY_WHOLE = frozenset({"objects", "thirdPartyCameras"})
"""When one of these or an image has changed, FIFO sends the whole metadata. Otherwise it sends the
changes only, as Unity's ``fastActionEmit`` does, which saves the client most of its work."""


@dataclass(frozen=True)
class Message:
    """The answer to an action.

    Attributes:
        sequence_id: the number of the request; the client compares it.
        agents: all metadata of every agent's event, by their ids.
        active: the id of the agent that acted.
        changes: the part of its metadata that differs from the last message.
        images: the images, as :func:`er_gym.sim.protocol.images` gives them.
        same_images: whether the images equal those of the last message.
        may_patch: whether the client accepts a message with the changes only.
    """

    sequence_id: int
    agents: Sequence[dict[str, Any]]
    active: int
    changes: dict[str, Any]
    images: Sequence[tuple[Field, bytes]]
    same_images: bool
    may_patch: bool


class Transport(Protocol):
    """A connection to the client that started the player.

    Both methods raise OSError (ConnectionError for the most part) when the client is gone.
    """

    def send(self, message: Message) -> None:
        """Send the answer to an action."""

    def receive(self) -> dict[str, Any] | None:
        """The client's next action, None when there are no more."""


class Fifo:
    """Two named pipes; see :mod:`er_gym.sim.protocol`."""

    VARIABLES = ("AI2THOR_FIFO_SERVER_PIPE_PATH", "AI2THOR_FIFO_CLIENT_PIPE_PATH")

    def __init__(self, environment: Mapping[str, str]) -> None:
        to_client, self._from_client = (environment[name] for name in self.VARIABLES)
        self._to_client = os.open(to_client, os.O_WRONLY)
        # Only Linux can enlarge a pipe. The user's pipes may have reached their limit.
        with contextlib.suppress(ImportError, AttributeError, OSError):
            import fcntl

            fcntl.fcntl(self._to_client, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)
        self._requests: IO[bytes] | None = None
        self._pack = MetadataPacker()

    def send(self, message: Message) -> None:
        if "sceneName" in message.changes:
            for each in self._pack.objects:
                each.forget()
        if message.may_patch and message.same_images and not message.changes.keys() & _ONLY_WHOLE:
            fields = [(Field.PATCH, self._pack.patch(message.active, message.changes))]
        else:
            metadata = self._pack(message.agents, message.active, message.sequence_id)
            fields = [(Field.METADATA, metadata), *message.images]
        send(self._to_client, fields)

    def receive(self) -> dict[str, Any] | None:
        if self._requests is None:
            # The client opens its end for writing only after the first message.
            self._requests = open(self._from_client, "rb")  # noqa: SIM115  # for as long as we play
        return read_request(self._requests)


class Wsgi:
    """The client is an HTTP server: it gets events as forms and responds with actions."""

    VARIABLES = ("AI2THOR_HOST", "AI2THOR_PORT")

    def __init__(self, environment: Mapping[str, str]) -> None:
        from http.client import HTTPConnection  # takes 40 ms, which a player on FIFO can save

        host, port = (environment[name] for name in self.VARIABLES)
        self._token = environment.get("AI2THOR_CLIENT_TOKEN", "")
        self._boundary = os.urandom(16).hex()  # in an image with a probability of 1 in 10³⁰
        self._connection = HTTPConnection(host, int(port))
        self._encode = MetadataJson()

    def send(self, message: Message) -> None:
        if "sceneName" in message.changes:
            for each in self._encode.objects:
                each.forget()
        metadata = self._encode(message.agents, message.active, message.sequence_id)  # no patches
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
        except HTTPException as error:  # the connection broke in the middle
            raise ConnectionError(f"{type(error).__name__}: {error}") from error
        if response.status != OK:
            raise ConnectionError(f"AI2-THOR's client answered {response.status} {response.reason}")
        request: dict[str, Any] = json.loads(body)
        return request if "action" in request else None  # the client's way to say that it stops

    def _head(self, disposition: str, kind: str) -> bytes:
        # The client's parser wants these two names in exactly this spelling.
        return (
            f"\r\n--{self._boundary}\r\n"
            f"Content-Type: {kind}\r\n"
            f"Content-disposition: form-data; name={disposition}\r\n\r\n"
        ).encode()


TRANSPORTS: dict[str, type[Fifo] | type[Wsgi]] = {"FIFO": Fifo, "WSGI": Wsgi}
"""The class of each transport, by the value of ``AI2THOR_SERVER_TYPE``."""
