"""The images of all cameras, as an AI2-THOR event has them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.agent import Agent
from er_gym.sim.crew import MOST_AGENTS
from er_gym.sim.look import Look
from er_gym.sim.metadata import instance_color
from er_gym.sim.render.camera import Camera
from er_gym.sim.settings import Settings, ThirdPartyCamera
from er_gym.sim.space.bodies import body_of, in_sight
from er_gym.sim.space.map_camera import map_camera
from er_gym.sim.world import World
from er_gym.sim.world_cache import CacheKey

if TYPE_CHECKING:
    from er_gym.sim.render.panda import Frames

_FLAGS = {
    "renderInstanceSegmentation": "render_instances",
    "renderSemanticSegmentation": "render_classes",
}
"""Arguments of any action that switch on a setting for this one step."""


@dataclass(frozen=True, eq=False)
class View:
    """The images of a camera, top row first. They are read-only, because they may be returned
    again.

    Attributes:
        rgb: (H, W, 3) uint8.
        depth: (H, W) float32 metres along the view axis, None unless asked for.
        instances: (H, W, 3) uint8 colours as in the metadata's ``colors``, None unless asked for.
        classes: the same with one colour for each object type.
        third_party: the views of the third-party cameras, in the order of their numbers.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32] | None = None
    instances: NDArray[np.uint8] | None = None
    classes: NDArray[np.uint8] | None = None
    third_party: tuple[View, ...] = ()


@dataclass(frozen=True, eq=False)
class _Kept:
    """A view and the parts of the world that it shows, besides the state of the objects."""

    agent: Agent
    others: tuple[Agent, ...]
    settings: Settings
    cameras: tuple[ThirdPartyCamera, ...]
    map_view: bool
    look: Look
    view: View

    def shows(self, world: World, others: tuple[Agent, ...]) -> bool:
        # A moving agent is replaced as a whole, and the held object moves only with it.
        same = self.agent is world.agent and self.settings == world.settings
        same = same and self.cameras == world.cameras and self.map_view == world.map_view
        same = same and len(self.others) == len(others)
        same = same and all(a is b for a, b in zip(self.others, others, strict=True))
        return same and self.look == world.look


_VIEWS: tuple[CacheKey[_Kept], ...] = tuple(
    CacheKey(f"view of agent {number}") for number in range(MOST_AGENTS)
)


def with_flags(settings: Settings, request: Mapping[str, Any]) -> Settings:
    """The settings, with the images that one action asks for in addition to those of
    ``Initialize``."""
    asked: dict[str, Any] = {
        name: True for flag, name in _FLAGS.items() if request.get(flag) is True
    }
    return replace(settings, **asked) if asked else settings


def draw(world: World, third_party: tuple[View, ...] | None = None) -> View:
    """Draw the world as the acting agent and the third-party cameras see it now.

    The last view is returned again as long as nothing has changed.

    Args:
        third_party: the views of the third-party cameras, if they are drawn already.
    """
    key, others = _VIEWS[world.acting], _others_shown(world)
    kept = world.cache.state.get(key)
    if kept is not None and kept.shows(world, others):
        return kept.view
    own, *cameras = _cameras(world)
    if third_party is None:
        third_party = tuple(_draw(world, *camera) for camera in cameras)
    view = replace(_draw(world, *own), third_party=third_party)
    world.cache.state.put(
        key,
        _Kept(world.agent, others, world.settings, world.cameras, world.map_view, world.look, view),
    )
    return view


def _others_shown(world: World) -> tuple[Agent, ...]:
    """The poses of the other agents that may be in a picture, with what they hold."""
    others = [other for _, other in sorted(world.others.items())]
    if world.map_view or world.cameras:
        return tuple(other.agent for other in others)
    eye, settings = world.agent.eye, world.settings
    lens = (
        *(world.agent.rotation, world.agent.horizon, settings.field_of_view),
        settings.width / settings.height,
    )
    return tuple(
        other.agent
        for other in others
        if other.held >= 0 or in_sight(body_of(other.agent), eye, lens)
    )


def seen_at(world: World, x: float, y: float) -> tuple[int | None, float, Camera]:
    """What is at a point of the agent's picture: the row of the object, None for the room; its
    depth in metres along the view; and the camera.

    Args:
        x, y: 0 to 1, from the left and from the top.
    """
    settings, (camera, unseen) = world.settings, next(_cameras(world))
    frames = _frames(world, camera, unseen, depth=True)
    column = min(int(x * settings.width), settings.width - 1)
    row = min(int(y * settings.height), settings.height - 1)
    seen = int(frames.ids[row, column])
    assert frames.depth is not None  # depth was requested
    return seen - 1 if seen else None, float(frames.depth[row, column]), camera


def _cameras(world: World) -> Iterator[tuple[Camera, int | None]]:
    """The cameras, each with the agent whose body it does not show: its own."""
    settings, agent = world.settings, world.agent
    size = settings.width, settings.height
    if world.map_view:
        yield _camera(map_camera(world.scene.name), size), None
    else:
        fov = settings.field_of_view
        yield Camera(agent.camera, agent.rotation, agent.horizon, fov, *size), world.acting
    for camera in world.cameras:
        yield _camera(camera, size), None


def _camera(camera: ThirdPartyCamera, size: tuple[int, int]) -> Camera:
    pitch, yaw, roll = camera.rotation
    return Camera(
        camera.position,
        yaw,
        pitch,
        camera.field_of_view,
        *size,
        roll=roll,
        orthographic_size=camera.orthographic_size,
    )


def _draw(world: World, camera: Camera, unseen: int | None) -> View:
    settings = world.settings
    frames = _frames(world, camera, unseen, settings.render_depth, ids=settings.draws_colors)
    view = View(
        frames.rgb,
        frames.depth,
        # As in AI2-THOR, the client cuts the masks of classes from the instance image.
        _colored(frames, world.object_ids) if settings.draws_colors else None,
        _colored(frames, world.types) if settings.render_classes else None,
    )
    for picture in (view.rgb, view.depth, view.instances, view.classes):
        if picture is not None:
            picture.setflags(write=False)
    return view


def _frames(
    world: World, camera: Camera, unseen: int | None, depth: bool = False, *, ids: bool = True
) -> Frames:
    # Most worlds are never drawn.
    from er_gym.sim.render.scene_graph import scene_graph_of

    graph = scene_graph_of(world.scene.name, world.settings.light)
    return graph.draw(world, camera, depth, ids=ids, unseen=unseen)


def _colored(frames: Frames, names: Sequence[str]) -> NDArray[np.uint8]:
    """(H, W, 3) the colour of each pixel's object or type, black for the room."""
    palette = np.array([(0, 0, 0), *map(instance_color, names)], dtype=np.uint8)
    return palette[frames.ids]
