"""The player: an executable that AI2-THOR's official client launches in place of the Unity build.

    Controller(local_executable_path=er_gym.thor_executable(), x_display=":0", ...)

It answers on the pipes that the client names in the environment, and differs from the in-process
controller in the transport alone. It ends when either pipe does, on SIGTERM, and when its parent is
no more; it writes no file. Its arguments are Unity's, and
``-parent``, the process that it is to outlive by a moment only.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Sequence
from itertools import pairwise
from typing import Any

from er_gym.sim.engine import Engine
from er_gym.sim.protocol import Field, MetadataPacker, images, read_request, send
from er_gym.sim.render.view import View

SERVER_PIPE = "AI2THOR_FIFO_SERVER_PIPE_PATH"
CLIENT_PIPE = "AI2THOR_FIFO_CLIENT_PIPE_PATH"
NOT_BY_THE_CLIENT = 2
"""The exit code when somebody else than AI2-THOR's client starts the player."""
_PIPE_BYTES = 1 << 20
"""A picture goes through a pipe of this size in one write; Linux allows it to anybody."""
_SECONDS_TO_CONNECT = 300
"""As long as the client waits for a player, a player waits for the client."""
_ONLY_WHOLE = frozenset({"objects", "thirdPartyCameras"})
"""Where these have changed, or a picture has, a whole message is sent; else, as Unity's
``fastActionEmit`` does, what has changed: it saves the client most of its work."""
_HEARTBEAT = 0.25
"""Seconds between looks at whether the parent lives."""


class Player:
    """An engine that answers requests with messages.

    Args:
        width, height: size of frames, pixels.
        send: writes one message.
    """

    def __init__(
        self, width: int, height: int, send: Callable[[Sequence[tuple[Field, bytes]]], None]
    ) -> None:
        self._engine = Engine(width, height)
        self._send = send
        self._pack = MetadataPacker()
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
            self._pack.forget()
            request = {**request, "renderImage": False}  # the client drops this event
        metadata, view = self._engine.step(request)
        said, shown = self._said, self._shown
        self._said, self._shown = dict(metadata), view
        changes = {name: value for name, value in metadata.items() if said.get(name) != value}
        if self._may_patch and view is shown and not changes.keys() & _ONLY_WHOLE:
            self._send([(Field.PATCH, self._pack.patch(changes))])
            return
        if view is not shown and view is not None:
            self._images = list(images(view))
        fields = [(Field.METADATA, self._pack(self._said, request["sequenceId"]))]
        self._send(fields if view is None else fields + self._images)

    def play(self, next_request: Callable[[], dict[str, Any] | None]) -> None:
        """Answer requests until there are no more."""
        while (request := next_request()) is not None:
            self.answer(request)


def main(arguments: Sequence[str] | None = None) -> int:
    """Serve the client that started this process; returns the exit code."""
    missing = [name for name in (SERVER_PIPE, CLIENT_PIPE) if name not in os.environ]
    if missing:
        print(
            f"er-gym's player is started by AI2-THOR's client, which sets {' and '.join(missing)}: "
            "Controller(local_executable_path=er_gym.thor_executable(), x_display=':0')",
            file=sys.stderr,
        )
        return NOT_BY_THE_CLIENT
    words = sys.argv[1:] if arguments is None else arguments
    given = dict(pairwise(words))  # Unity's come as `-name value`, and so does ours
    _end_with(int(given.get("-parent", os.getppid())))
    width, height = (int(given.get(f"-screen-{side}", 300)) for side in ("width", "height"))
    with contextlib.suppress(BrokenPipeError):
        # In this order: the client opens its end for writing only after the first message.
        server = os.open(os.environ[SERVER_PIPE], os.O_WRONLY)
        _widen(server)
        player = Player(width, height, lambda fields: send(server, fields))
        player.answer({"action": "Pass", "renderImage": False, "sequenceId": 0})
        with open(os.environ[CLIENT_PIPE], "rb") as client:
            signal.alarm(0)
            player.play(lambda: read_request(client))
    return 0


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


def _widen(pipe: int) -> None:
    if hasattr(fcntl, "F_SETPIPE_SZ"):  # Linux, Python 3.10
        with contextlib.suppress(OSError):  # the user's pipes are at their limit
            fcntl.fcntl(pipe, fcntl.F_SETPIPE_SZ, _PIPE_BYTES)


if __name__ == "__main__":
    sys.exit(main())
