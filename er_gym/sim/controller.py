"""The embedded engine behind the official AI2-THOR client, in one process."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cached_property, partial
from typing import Any, ClassVar

from numpy.typing import NDArray

from er_gym.sim.bystander import Bystander
from er_gym.sim.client_import import import_client
from er_gym.sim.copy_on_read import CopyOnReadDict
from er_gym.sim.direct import Direct
from er_gym.sim.engine import Engine
from er_gym.sim.errors import CLIENT_ERRORS
from er_gym.sim.lazy_metadata import LazyMetadata
from er_gym.sim.object_metadata import writable_objects
from er_gym.sim.protocol import rgba
from er_gym.sim.render.view import View
from er_gym.sim.settings import SOFT
from er_gym.sim.world import World
from er_gym.sim.world_state import restore_state, state_of

import_client()

import ai2thor.controller  # noqa: E402
import ai2thor.server  # noqa: E402

_TAKEN = frozenset(
    {"server_class", "start_unity", "local_executable_path", "local_build", "platform", "host"}
)
"""Arguments of the official controller that choose a Unity build; refused here."""


_ROBOTHOR = "FloorPlan_"
"""What the names of RoboTHOR's scenes begin with."""
_WITHOUT_PICTURES = frozenset(
    {"metadata", "screen_width", "screen_height", "color_to_object_id", "object_id_to_color"}
)
"""The attributes of an official event that are no pictures and nothing made of pictures."""
_READ_BY_EVENT = ("screenWidth", "screenHeight", "colors")
_RENAMED = {
    "renderClassImage": "renderSemanticSegmentation",
    "renderObjectImage": "renderInstanceSegmentation",
}
"""Old names of arguments. The client still accepts them for any action."""


class EventMetadata(LazyMetadata, ai2thor.server.MetadataWrapper):  # type: ignore[misc]  # untyped
    """Metadata that are computed when read, that the caller may change, and that know old keys.

    ``dict`` and ``json`` read them as a whole and find plain dictionaries.
    """

    instead: ClassVar = {"objects": writable_objects}

    def read_whole(self) -> None:
        super().read_whole()
        objects = dict.__getitem__(self, "objects")
        if objects and type(objects[0]) is CopyOnReadDict:
            objects[:] = map(dict, objects)


class EmbeddedEvent(ai2thor.server.Event):  # type: ignore[misc]  # untyped
    """An agent's event that keeps lazy metadata lazy and is freed as soon as nobody refers to it.

    If there are several agents, the controller returns the official ``MultiAgentEvent`` of them.
    """

    def __init__(self, metadata: LazyMetadata) -> None:
        # Event copies the metadata that it gets, and a copy computes every value.
        super().__init__({name: metadata[name] for name in _READ_BY_EVENT})
        self.metadata = metadata

    @property
    def events(self) -> list[EmbeddedEvent]:
        """The events of all agents, if this is the only one."""
        return [self]

    @events.setter
    def events(self, events: object) -> None:
        # The official class keeps [self], a cycle that only the garbage collector would break.
        pass


Attach = Callable[[EmbeddedEvent, View], None]
"""Adds images to an event."""


class BystanderEvent(EmbeddedEvent):
    """The event of an agent that did not act, whose pictures are drawn when they are first read."""

    def __init__(self, bystander: Bystander, attach: Attach) -> None:
        super().__init__(bystander.metadata)
        own = self.__dict__
        without = {name: own.pop(name) for name in own.keys() - _WITHOUT_PICTURES}
        self._later: tuple[Bystander, Any, dict[str, Any]] | None = (bystander, attach, without)

    def __getattr__(self, name: str) -> Any:
        # Python asks this only for what is not there yet.
        later = self.__dict__.get("_later")
        if later is None or name not in later[2]:
            raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")
        self._show()
        return self.__dict__[name]

    def __getstate__(self) -> dict[str, Any]:
        self._show()
        return self.__dict__

    def _show(self) -> None:
        """Draw the pictures; what a program has put in their place stays."""
        if self._later is None:
            return
        (bystander, attach, without), self._later = self._later, None
        put = dict(self.__dict__)
        self.__dict__.update(without)
        view = bystander.view
        assert view is not None  # otherwise the event is a plain one
        attach(self, view)
        self.__dict__.update(put)


class CrewEvent(ai2thor.server.MultiAgentEvent):  # type: ignore[misc]  # ai2thor is untyped
    """The official event of several agents, which makes those of the others when they are read.

    Args:
        acting: the event of the agent that acted.
        beside: makes the events of the others.
    """

    def __init__(self, acting: EmbeddedEvent, beside: Callable[[], list[EmbeddedEvent]]) -> None:
        # What the official class does, which wants all events now.
        self._active_event, self.metadata = acting, acting.metadata
        self.screen_width, self.screen_height = acting.screen_width, acting.screen_height
        self.third_party_camera_frames: list[Any] = []
        self._beside = beside

    @cached_property
    def events(self) -> list[EmbeddedEvent]:
        """The events of all agents, by their ids."""
        events = self._beside()
        events.insert(self.metadata["agentId"], self._active_event)
        del self._beside
        return events

    def __getstate__(self) -> dict[str, Any]:
        _ = self.events
        return self.__dict__


class EmbeddedServer(ai2thor.server.Server):  # type: ignore[misc]  # ai2thor is untyped
    """Replaces the client's pipe to Unity: ``send`` acts, ``receive`` returns the event."""

    server_type = "EMBEDDED"

    def __init__(self, width: int, height: int, *, light: str = SOFT, **kwargs: Any) -> None:
        super().__init__(width, height, **kwargs)
        self.engine = Engine(width, height, EventMetadata, light)
        self._event: ai2thor.server.Event | None = None
        # The client adjusts the resolution only if it believes that a player process is there.
        self.unity_proc = self

    def start(self) -> None:
        """Start. The client waits for a first event, which shows the scene before any action."""
        self.started = True
        self.send({"action": "Pass", "renderImage": False})

    def stop(self) -> None:
        """Stop. There is no process to end."""
        self.started = False

    def send(self, action: dict[str, Any]) -> None:
        """Do an action and keep its event for :meth:`receive`."""
        if action.get("action") == "Reset":
            # The client drops this event in favour of that of the Initialize which it sends next.
            action = {**action, "renderImage": False}
        metadata, frames = self.engine.step(action)
        event = self._event_of(metadata, frames)
        others = self.engine.bystanders
        if others:
            event = CrewEvent(event, partial(self._beside, others, self._reader()))
        self._event = event

    def _event_of(self, metadata: LazyMetadata, frames: View | None) -> EmbeddedEvent:
        event = EmbeddedEvent(metadata)
        if frames is not None:
            self._reader()(event, frames)
        return event

    @staticmethod
    def _beside(bystanders: tuple[Bystander, ...], attach: Attach) -> list[EmbeddedEvent]:
        """The events of agents that did not act, and whose pictures may be drawn already."""
        return [
            EmbeddedEvent(each.metadata) if each.pictureless else BystanderEvent(each, attach)
            for each in bystanders
        ]

    def _reader(self) -> Attach:
        """Adds the images to an event, with the depth of the present settings."""
        depth = {
            "depth_format": self.depth_format,
            "camera_near_plane": self.camera_near_plane,
            "camera_far_plane": self.camera_far_plane,
        }
        noise = {"add_noise": self.add_depth_noise, "noise_indices": self.noise_indices}
        return partial(_attach, depth=depth, noise=noise)

    def receive(self, timeout: float | None = None) -> ai2thor.server.Event:
        """The event of the action last sent."""
        event, self._event = self._event, None
        return event


def _attach(
    event: ai2thor.server.Event, view: View, depth: dict[str, Any], noise: dict[str, Any]
) -> None:
    """Add the images to an event, in the form in which the client reads them off the wire."""
    event.frame = view.rgb.copy()  # later events share the view
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

    It takes the official controller's arguments (``scene``, ``width``, ``height``, ``gridSize``,
    ``visibilityDistance``, ``fieldOfView``, ``renderDepthImage`` …), except for those that choose a
    Unity build, and ``light``, which is ``"soft"`` (windows, lamps and soft shadows) or ``"flat"``
    (the same light everywhere). It behaves as the official one does: ``step`` and ``reset`` return
    an ``ai2thor.server.Event``, and invalid calls raise ValueError.

    Raises:
        TypeError: an argument chooses a Unity build.
        ValueError: there is no such light.
    """

    def __init__(self, *, light: str = SOFT, **arguments: Any) -> None:
        taken = sorted(_TAKEN & arguments.keys())
        if taken:
            raise TypeError(
                f"the embedded engine takes no {', '.join(taken)}; "
                "make_controller(backend='unity', …) does"
            )
        arguments.setdefault("scene", "FloorPlan1")
        self._light = light
        super().__init__(server_class=EmbeddedServer, start_unity=False, **arguments)

    server: EmbeddedServer | None
    _last_event: ai2thor.server.Event | None = None
    _stale = False

    def reset(self, scene: Any = None, **arguments: Any) -> ai2thor.server.Event:
        """Enter a scene, as the official ``reset`` does.

        Raises:
            ValueError: there is no such scene here.
        """
        if isinstance(scene, str) and scene.startswith(_ROBOTHOR):
            raise ValueError(
                "The embedded engine has the 120 iTHOR rooms and no RoboTHOR scene such as "
                f"{scene}; backend='unity' has."
            )
        return super().reset(scene, **arguments)

    def step(
        self, action: str | dict[str, Any] | None = None, **arguments: Any
    ) -> ai2thor.server.Event:
        """Do an action, as the official ``step`` does, but without its deep copies for the wire.

        Raises:
            ValueError: the call is invalid: no such action, or wrong arguments.
            RuntimeError: the action failed and ``raise_for_failure`` is set.
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
        # If nobody else refers to the last event, its objects are never computed.
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

    @property
    def last_event(self) -> ai2thor.server.Event | None:
        """The event of the last action; after :attr:`direct` calls, of the world as it is now."""
        if self._stale:
            assert self.server is not None
            self.server.send({"action": "Pass", "renderImage": False})
            self.last_event = self.server.receive()
        return self._last_event

    @last_event.setter
    def last_event(self, event: ai2thor.server.Event | None) -> None:
        self._last_event, self._stale = event, False

    @property
    def world(self) -> World | None:
        """The engine's world as it is now, which must not be changed."""
        return None if self.server is None else self.server.engine.world

    @property
    def direct(self) -> Direct | None:
        """The engine without the client, for actions that need no event; None while pictures are
        drawn, since these come with events."""
        if not self.headless or self.server is None:
            return None
        return Direct(self.server.engine, self._let_go)

    def world_state(self) -> dict[str, Any]:
        """The state of the objects and the agent, see :mod:`er_gym.sim.world_state`."""
        assert self.server is not None
        return state_of(self.server.engine.world)

    def restore_world(self, state: Mapping[str, Any]) -> None:
        """Go back to a state of the same scene in the same arrangement.

        Raises:
            ValueError: it is of another one.
        """
        assert self.server is not None
        self._let_go()
        engine = self.server.engine
        answer = engine.do(lambda world: restore_state(world, state))
        assert not answer.error, answer.error

    def _let_go(self) -> None:
        self._last_event, self._stale = None, True

    def _build_server(self, host: str, port: int, width: int, height: int) -> None:
        if self.server is None:
            self.server = EmbeddedServer(
                width,
                height,
                timeout=self.server_timeout,
                depth_format=self.depth_format,
                add_depth_noise=self.add_depth_noise,
                light=self._light,
            )
