"""The player: an executable that AI2-THOR's official client launches in place of the Unity build.

    Controller(local_executable_path=er_gym.thor_executable(), x_display=":0", ...)

It answers over the transport that the client names in the environment, and differs from the
in-process controller in nothing else. It ends when the connection does, on SIGTERM, and soon after
its parent; it writes no file. Its arguments are Unity's, and ``-parent``, the process that it must
not outlive.
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
from er_gym.sim.protocol import Field, images
from er_gym.sim.render.view import View
from er_gym.sim.size import check_size
from er_gym.sim.transports import TRANSPORTS, Message, Transport

NOT_BY_THE_CLIENT = 2
"""The exit code when somebody else than AI2-THOR's client starts the player."""
_SECONDS_TO_CONNECT = 300
"""As long as the client waits for a player, a player waits for the client."""
_QUESTIONS = frozenset(
    {
        *("GetReachablePositions", "GetInteractablePoses", "GetObjectInFrame"),
        *("GetCoordinateFromRaycast", "GetSpawnCoordinatesAboveReceptacle", "GetShortestPath"),
        *("GetShortestPathToPoint", "ObjectNavExpertAction"),
    }
)
"""Actions that Unity answers, with ``fastActionEmit``, by what has changed, which saves the client
most of its work. After all others it sends everything: of one message the client makes several
events, so that a program that writes into one event's objects writes into the next event's too."""
_HEARTBEAT = 0.25
"""Seconds between looks at whether the parent lives."""


class PlayerProcess:
    """An engine that answers requests over a transport.

    Args:
        width, height: size of frames, pixels.
        transport: whom it answers.
    """

    def __init__(self, width: int, height: int, transport: Transport) -> None:
        self._engine = Engine(width, height)
        self._transport = transport
        self._said: dict[str, Any] = {}
        self._shown: View | None = None
        self._images: list[tuple[Field, bytes]] = []
        self._may_patch = True

    def answer(self, request: dict[str, Any]) -> None:
        """Do one action and send what comes of it."""
        action = request.get("action")
        if action == "Initialize":
            self._may_patch = request.get("fastActionEmit") is not False
        elif action == "Reset":
            request = {**request, "renderImage": False}  # the client drops this event
        metadata, view = self._engine.step(request)
        said, shown = self._said, self._shown
        self._said, self._shown = dict(metadata), view
        if view is not shown and view is not None:
            self._images = list(images(view))
        changes = {
            name: value
            for name, value in metadata.items()
            if name == "actionReturn" or said.get(name) != value
        }
        self._transport.send(
            Message(
                sequence_id=request["sequenceId"],
                metadata=self._said,
                changes=changes,
                images=[] if view is None else self._images,
                same_images=view is shown,
                may_patch=(
                    self._may_patch and action in _QUESTIONS and metadata["lastActionSuccess"]
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
    given = dict(pairwise(words))  # Unity's come as `-name value`, and so does ours
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
    """See to it that this process ends soon after the one that started it.

    End of file on a pipe says so too, but not before both pipes are open, nor while a fork of the
    client keeps its end. The kernel's PR_SET_PDEATHSIG will not do: it strikes when the *thread*
    ends that started the player, and clients are made in pools of threads.
    """
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C is the client's to answer
    signal.alarm(_SECONDS_TO_CONNECT)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _watch(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_HEARTBEAT)
    os._exit(0)


if __name__ == "__main__":
    sys.exit(main())
