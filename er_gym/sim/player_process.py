"""The player: an executable that AI2-THOR's official client launches in place of the Unity build.

    Controller(local_executable_path=er_gym.thor_executable(), x_display=":0", ...)

The player answers over the transport that the client names in the environment. In everything else
it equals the in-process controller. It ends when the connection ends, on SIGTERM, and soon after
its parent process. It writes no file. It takes Unity's arguments, and ``-parent``, the id of the
process that it must not outlive.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections.abc import Sequence
from itertools import pairwise
from typing import Any

from er_gym.sim.engine import Engine
from er_gym.sim.lazy_metadata import LazyMetadata
from er_gym.sim.protocol import Field, images
from er_gym.sim.render.view import View
from er_gym.sim.size import check_size
from er_gym.sim.transports import TRANSPORTS, Message, Transport

NOT_BY_THE_CLIENT = 2
"""The exit code if anything but AI2-THOR's client has started the player."""
_SECONDS_TO_CONNECT = 300
"""The player waits for the client as long as the client waits for a player."""
_QUESTIONS = frozenset(
    {
        *("GetReachablePositions", "GetInteractablePoses", "GetObjectInFrame"),
        *("GetCoordinateFromRaycast", "GetSpawnCoordinatesAboveReceptacle", "GetShortestPath"),
        *("GetShortestPathToPoint", "ObjectNavExpertAction"),
    }
)
"""With ``fastActionEmit``, Unity answers these actions with the changes only, which saves the
client most of its work. For all other actions the whole metadata are sent. The client makes several
events of one message, so a program that writes into one event's objects would write into the next
event's too."""
_HEARTBEAT = 0.25
"""Seconds between two checks that the parent process is alive."""


class PlayerProcess:
    """An engine that answers requests over a transport.

    Args:
        width, height: size of frames, pixels.
        transport: the connection to the client.
    """

    def __init__(self, width: int, height: int, transport: Transport) -> None:
        self._engine = Engine(width, height)
        self._transport = transport
        self._said: list[dict[str, Any]] = []
        self._shown: tuple[View, ...] = ()
        self._images: list[tuple[Field, bytes]] = []
        self._may_patch = True

    def answer(self, request: dict[str, Any]) -> None:
        """Do one action and send its event."""
        action = request.get("action")
        if action == "Initialize":
            self._may_patch = request.get("fastActionEmit") is not False
        elif action == "Reset":
            request = {**request, "renderImage": False}  # the client drops this event
        metadata, view = self._engine.step(request)
        said, shown = self._said, self._shown
        events: list[tuple[LazyMetadata, View | None]] = [
            (each.metadata, each.view) for each in self._engine.bystanders
        ]
        active = metadata["agentId"]
        events.insert(active, (metadata, view))
        self._said = [dict(each) for each, _ in events]
        self._shown = tuple(each for _, each in events if each is not None)
        same_images = len(shown) == len(self._shown)
        same_images &= all(a is b for a, b in zip(shown, self._shown, strict=False))
        if self._shown and not same_images:
            self._images = list(images(self._shown))
        before = said[active] if active < len(said) else {}
        changes = {
            name: value
            for name, value in metadata.items()
            if name == "actionReturn" or before.get(name) != value
        }
        self._transport.send(
            Message(
                sequence_id=request["sequenceId"],
                agents=self._said,
                active=active,
                changes=changes,
                images=self._images if self._shown else [],
                same_images=same_images,
                may_patch=(
                    self._may_patch
                    and action in _QUESTIONS
                    and metadata["lastActionSuccess"]
                    and len(said) == len(self._said)
                ),
            )
        )


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve the client that started this process; returns the exit code."""
    kind = os.environ.get("AI2THOR_SERVER_TYPE", "FIFO")
    transport = TRANSPORTS.get(kind)
    if transport is None or any(name not in os.environ for name in transport.VARIABLES):
        print(_not_by_the_client(kind), file=sys.stderr)
        return NOT_BY_THE_CLIENT
    words = sys.argv[1:] if arguments is None else arguments
    given = dict(pairwise(words))  # arguments come as `-name value`, Unity's and ours
    _end_with(int(given.get("-parent", os.getppid())))
    width, height = (int(given.get(f"-screen-{side}", 300)) for side in ("width", "height"))
    try:
        check_size(width, height)
    except ValueError as error:
        print(f"er-gym's player: {error}", file=sys.stderr)
        return NOT_BY_THE_CLIENT
    try:
        client = transport(os.environ)
        player = PlayerProcess(width, height, client)
        player.answer({"action": "Pass", "renderImage": False, "sequenceId": 0})
        while (request := client.receive()) is not None:
            signal.alarm(0)  # the client is there
            player.answer(request)
    except ConnectionError as gone:
        print(f"er-gym's player ends: AI2-THOR's client is gone ({gone})", file=sys.stderr)
    return 0


def _not_by_the_client(kind: str) -> str:
    known = "; or ".join(
        f"AI2THOR_SERVER_TYPE={name} with {' and '.join(transport.VARIABLES)}"
        for name, transport in TRANSPORTS.items()
    )
    return (
        f"AI2-THOR's client starts er-gym's player and sets {known} (the type here: {kind!r}). "
        "Write Controller(local_executable_path=er_gym.thor_executable(), x_display=':0')"
    )


def _end_with(parent: int) -> None:
    """Make this process end soon after the one that started it.

    The end of file on a pipe reports the same, but only once both pipes are open, and not while a
    fork of the client keeps its end open. The kernel's PR_SET_PDEATHSIG does not help: it fires
    when the *thread* that started the player ends, and clients are made in thread pools.
    """
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the client handles Ctrl-C
    signal.alarm(_SECONDS_TO_CONNECT)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_HEARTBEAT)
    os._exit(0)


if __name__ == "__main__":
    sys.exit(main())
