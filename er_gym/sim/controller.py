"""The embedded engine behind the official AI2-THOR client, in one process."""

from __future__ import annotations

from typing import Any

import ai2thor.controller
import ai2thor.server
import numpy as np

from er_gym.sim.engine import Engine
from er_gym.sim.render.view import View

_TAKEN = frozenset(
    {"server_class", "start_unity", "local_executable_path", "local_build", "platform", "host"}
)
"""Arguments of the official controller that choose a Unity build; they mean nothing here."""


class EmbeddedServer(ai2thor.server.Server):  # type: ignore[misc]  # ai2thor is untyped
    """Stands where the client's pipe to Unity would be: ``send`` acts, ``receive`` hands over."""

    server_type = "EMBEDDED"

    def __init__(self, width: int, height: int, **kwargs: Any) -> None:
        super().__init__(width, height, **kwargs)
        self._engine = Engine(width, height)
        self._event: ai2thor.server.Event | None = None
        # The client adjusts the resolution only if it believes that a player process is there.
        self.unity_proc = self

    def start(self) -> None:
        """Begin; the first event, which the client waits for, is the scene at rest."""
        self.started = True
        self.send({"action": "Pass", "renderImage": False})

    def stop(self) -> None:
        """End; there is no process to end."""
        self.started = False

    def send(self, action: dict[str, Any]) -> None:
        """Do an action at once."""
        if action["action"] == "Reset":
            # The client drops this event for that of the Initialize which it sends next.
            action = {**action, "renderImage": False}
        metadata, frames = self._engine.step(action)
        event = ai2thor.server.Event(metadata)
        if frames is not None:
            _attach(event, frames)
        self._event = event

    def receive(self, timeout: float | None = None) -> ai2thor.server.Event:
        """The event of the action last sent."""
        self.last_event = self._event
        return self._event


def _attach(event: ai2thor.server.Event, frames: View) -> None:
    """Give an event its pictures, as it would have read them off the wire."""
    event.frame = frames.rgb
    if frames.depth is not None:
        event.depth_frame = frames.depth
    if frames.instances is not None:
        alpha = np.full((*frames.instances.shape[:2], 1), 255, np.uint8)
        rgba = np.concatenate([frames.instances, alpha], axis=2)
        event.add_image_ids(np.ascontiguousarray(rgba[::-1]).tobytes())


class EmbeddedController(ai2thor.controller.Controller):  # type: ignore[misc]  # untyped
    """The official ``ai2thor.controller.Controller`` on the embedded engine.

    Takes the official controller's arguments (``scene``, ``width``, ``height``, ``gridSize``,
    ``visibilityDistance``, ``fieldOfView``, ``renderDepthImage`` …), less those that choose a Unity
    build, and behaves as it does: ``step`` and ``reset`` return an ``ai2thor.server.Event``, calls
    that are wrong in themselves raise ValueError.

    Raises:
        TypeError: an argument chooses a Unity build.
    """

    def __init__(self, **arguments: Any) -> None:
        taken = sorted(_TAKEN & arguments.keys())
        if taken:
            raise TypeError(
                f"the embedded engine takes no {', '.join(taken)}; "
                "make_controller(backend='unity', …) does"
            )
        arguments.setdefault("scene", "FloorPlan1")
        super().__init__(server_class=EmbeddedServer, start_unity=False, **arguments)

    server: EmbeddedServer | None

    def _build_server(self, host: str, port: int, width: int, height: int) -> None:
        if self.server is None:
            self.server = EmbeddedServer(
                width,
                height,
                timeout=self.server_timeout,
                depth_format=self.depth_format,
                add_depth_noise=self.add_depth_noise,
            )
