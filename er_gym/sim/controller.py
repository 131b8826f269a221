"""The embedded engine behind the official AI2-THOR client, in one process."""

from __future__ import annotations

from typing import Any, ClassVar

import ai2thor.controller
import ai2thor.server
from numpy.typing import NDArray

from er_gym.sim.copy_on_read import CopyOnReadDict
from er_gym.sim.engine import Engine
from er_gym.sim.errors import CLIENT_ERRORS
from er_gym.sim.lazy_metadata import LazyMetadata
from er_gym.sim.object_metadata import writable_objects
from er_gym.sim.protocol import rgba
from er_gym.sim.render.view import View

_TAKEN = frozenset(
    {"server_class", "start_unity", "local_executable_path", "local_build", "platform", "host"}
)
"""Arguments of the official controller that choose a Unity build; they mean nothing here."""


_READ_BY_EVENT = ("screenWidth", "screenHeight", "colors")
_RENAMED = {
    "renderClassImage": "renderSemanticSegmentation",
    "renderObjectImage": "renderInstanceSegmentation",
}
"""Old names of arguments, which the client goes on accepting for any action."""


class EventMetadata(LazyMetadata, ai2thor.server.MetadataWrapper):  # type: ignore[misc]  # untyped
    """Lazy, the receiver's own to change, and with the client's aliases for old keys.

    What reads them as a whole, such as ``dict`` or ``json``, finds plain dictionaries.
    """

    instead: ClassVar = {"objects": writable_objects}

    def read_whole(self) -> None:
        super().read_whole()
        objects = dict.__getitem__(self, "objects")
        if objects and type(objects[0]) is CopyOnReadDict:
            objects[:] = map(dict, objects)


class EmbeddedEvent(ai2thor.server.Event):  # type: ignore[misc]  # untyped
    """An event that keeps lazy metadata lazy, and is gone as soon as nobody keeps it."""

    def __init__(self, metadata: LazyMetadata) -> None:
        # Event copies the metadata it is given, and a copy has to have everything worked out.
        super().__init__({name: metadata[name] for name in _READ_BY_EVENT})
        self.metadata = metadata

    @property
    def events(self) -> list[EmbeddedEvent]:
        """Itself, as if there were several agents."""
        return [self]

    @events.setter
    def events(self, events: object) -> None:
        # The official class keeps [self], a cycle that only the garbage collector would break.
        pass


class EmbeddedServer(ai2thor.server.Server):  # type: ignore[misc]  # ai2thor is untyped
    """Stands where the client's pipe to Unity would be: ``send`` acts, ``receive`` hands over."""

    server_type = "EMBEDDED"

    def __init__(self, width: int, height: int, **kwargs: Any) -> None:
        super().__init__(width, height, **kwargs)
        self._engine = Engine(width, height, EventMetadata)
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
        if action.get("action") == "Reset":
            # The client drops this event for that of the Initialize which it sends next.
            action = {**action, "renderImage": False}
        metadata, frames = self._engine.step(action)
        event = EmbeddedEvent(metadata)
        if frames is not None:
            self._attach(event, frames)
        self._event = event

    def receive(self, timeout: float | None = None) -> ai2thor.server.Event:
        """The event of the action last sent."""
        event, self._event = self._event, None
        return event

    def _attach(self, event: ai2thor.server.Event, view: View) -> None:
        """Give an event its pictures, as it would have read them off the wire."""
        depth = {
            "depth_format": self.depth_format,
            "camera_near_plane": self.camera_near_plane,
            "camera_far_plane": self.camera_far_plane,
        }
        noise = {"add_noise": self.add_depth_noise, "noise_indices": self.noise_indices}
        event.frame = view.rgb.copy()  # the view is handed out again while nothing changes
        if view.depth is not None:
            event.add_image_depth(_upside_down(view.depth), **depth, **noise)
        if view.instances is not None:
            event.add_image_ids(_upside_down(rgba(view.instances)))
        event.semantic_segmentation_frame = view.classes
        for other in view.third_party:
            event.third_party_camera_frames.append(other.rgb)
            if other.depth is not None:
                event.add_third_party_image_depth(_upside_down(other.depth), **depth)
            if other.instances is not None:
                event.add_third_party_image_ids(_upside_down(rgba(other.instances)))
            if other.classes is not None:
                event.third_party_semantic_segmentation_frames.append(other.classes)


def _upside_down(picture: NDArray[Any]) -> bytes:
    return picture[::-1].tobytes()


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

    def step(
        self, action: str | dict[str, Any] | None = None, **arguments: Any
    ) -> ai2thor.server.Event:
        """Do an action, as the official ``step`` does, less its deep copies for the wire.

        Raises:
            ValueError: the call is wrong in itself: no such action, or wrong arguments.
            RuntimeError: it failed and ``raise_for_failure`` is set.
        """
        request: dict[str, Any] = dict(action) if isinstance(action, dict) else {"action": action}
        raise_for_failure = arguments.pop("raise_for_failure", False)
        request.update(arguments)
        if self.headless:
            request["renderImage"] = False
        rotation = request.get("rotation")
        if rotation is not None and not isinstance(rotation, dict):
            request["rotation"] = {"y": rotation}
        for old in _RENAMED.keys() & request.keys():
            request[_RENAMED[old]] = request[old]
        self.last_action = request
        # An event that nobody else keeps need not have its objects worked out.
        self.last_event = None
        assert self.server is not None
        self.server.send(request)
        event = self.last_event = self.server.receive()
        if not event.metadata["lastActionSuccess"]:
            message = event.metadata["errorMessage"]
            if event.metadata["errorCode"] in CLIENT_ERRORS:
                raise ValueError(message)
            if raise_for_failure:
                raise RuntimeError(message)
        return event

    def _build_server(self, host: str, port: int, width: int, height: int) -> None:
        if self.server is None:
            self.server = EmbeddedServer(
                width,
                height,
                timeout=self.server_timeout,
                depth_format=self.depth_format,
                add_depth_noise=self.add_depth_noise,
            )
