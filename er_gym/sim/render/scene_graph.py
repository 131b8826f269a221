"""The scene graph of a room: what is drawn, and where.

An object that looks the same as before is not made again. Triangles are cached by appearance, and
nodes by appearance, heading and number. Only objects that have changed are updated.

Even so, a picture depends on the world alone and not on what was drawn before. Of surfaces at the
same depth the one drawn first is seen. So the order of drawing is fixed: first the room, then the
objects in an order of their own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.appearance import Appearance, appearance_of
from er_gym.sim.render.bake import (
    Place,
    bake_of,
    heading_of,
    look_of,
    pieces_of_look,
    place_of,
)
from er_gym.sim.render.camera import Camera
from er_gym.sim.render.panda import (
    DRAWING,
    MOST_INSTANCES,
    Frames,
    core,
    geometry,
    rasteriser,
)
from er_gym.sim.render.shapes import UNSEEN
from er_gym.sim.space.solids import Solid, solid_of
from er_gym.sim.world import World
from er_gym.sim.world_cache import CacheKey

_SCENES = 64
"""Rooms whose scene graphs are kept."""
_SHOWN: CacheKey[object] = CacheKey("state that a scene graph shows")
_NODES = 2048
_BEFORE = 8
"""The parts of the room come first in the order of drawing: they start this far below 0."""


@dataclass(frozen=True, eq=False)
class _Placed:
    """An object in the graph.

    Attributes:
        look: a name of what it looks like.
        order: of drawing.
        path: its node.
        seen, solid: the state that it was drawn in; None if it is as recorded.
    """

    look: str
    order: int
    path: Any
    seen: Appearance | None = None
    solid: Solid | None = None

    def shows(self, seen: Appearance, heading: float) -> bool:
        return self.solid is not None and self.seen == seen and heading_of(self.solid) == heading


class SceneGraph:
    """The scene graph of one scene; use :func:`scene_graph_of`."""

    def __init__(self, scene_name: str) -> None:
        self._name = scene_name
        self._build()
        self._state: object | None = object()  # the state that it shows; None while it changes

    def draw(
        self, world: World, camera: Camera, depth: bool = False, *, ids: bool = True
    ) -> Frames:
        """The images of a camera in a world of this scene; object i is instance i + 1.

        Several threads may call this at once; they take turns.
        """
        with DRAWING:
            self._follow(world)
            return rasteriser().draw(self._root, camera, depth, ids=ids)

    def _build(self) -> None:
        """Build the room without its objects."""
        self._root = core().NodePath(self._name)
        self._placed: dict[int, _Placed] = {}
        # Of the world that is shown: the rows that have changed since it was recorded, and which
        # objects are hidden.
        self._touched: set[int] = set()
        self._hidden: NDArray[np.bool_] | None = None
        for k, (name, pieces) in enumerate(bake_of(self._name).around.items()):
            self._root.attachNewNode(geometry(pieces, 0, name), k - _BEFORE)
        self._floor_number = -1

    def _follow(self, world: World) -> None:
        """Update everything that has changed in the world."""
        before, self._state = self._state, None
        if before is None:  # an exception left it half updated
            self._build()
        elif world.cache.state.get(_SHOWN) is before:
            for i in world.in_hand:  # nothing but the hand has moved
                if i in self._placed:
                    self._place(world, i, self._placed[i].order)
            self._state = before
            return
        hidden, order = world.hidden, _order(world)
        # An object that has never changed is the same in all worlds of the scene.
        rows = world.touched | self._touched
        if self._hidden is None:
            rows |= set(range(len(world)))
        else:
            both = min(len(hidden), len(self._hidden))
            rows.update(np.flatnonzero(hidden[:both] != self._hidden[:both]).tolist())
        recorded = bake_of(self._name).recorded
        for i in sorted(rows):
            if i >= len(world) or hidden[i]:
                self._remove(i)
            elif world.types[i] in UNSEEN:
                self._lay_floor(i)
            elif i in recorded and i not in world.touched:
                self._place_as_recorded(i, world.types[i])
            else:
                self._place(world, i, order[i])
        self._touched, self._hidden = set(world.touched), hidden.copy()
        self._state = world.cache.state.put(_SHOWN, object())

    def _lay_floor(self, i: int) -> None:
        if self._floor_number != i + 1:
            node = geometry(bake_of(self._name).floor, i + 1, "floor")
            self._root.attachNewNode(node, -1)
            self._floor_number = i + 1

    def _remove(self, i: int) -> None:
        placed = self._placed.pop(i, None)
        if placed is not None:
            placed.path.removeNode()

    def _place_as_recorded(self, i: int, kind: str) -> None:
        before, bake = self._placed.get(i), bake_of(self._name)
        if before is not None and before.seen is None:
            return
        look, place = bake.recorded[i]
        if before is not None and before.look == look and before.order == i:
            path = before.path
        else:
            path = self._attach(i, geometry(bake.looks[look], _number(i), kind), i)
        self._placed[i] = _Placed(look, i, path)
        _put(path, place)

    def _place(self, world: World, i: int, order: int) -> None:
        seen, solid, before = appearance_of(world, i), solid_of(world, i), self._placed.get(i)
        heading = heading_of(solid)
        if before is not None and before.order == order and before.shows(seen, heading):
            if before.solid is solid:
                return
            look, path = before.look, before.path
        else:
            look = look_of(seen, heading)
            if before is not None and before.order == order and before.look == look:
                path = before.path
            else:
                # A copy shares the triangles, and its place is a property of the node.
                path = self._attach(i, _node(seen, heading, _number(i)).makeCopy(), order)
        self._placed[i] = _Placed(look, order, path, seen, solid)
        _put(path, place_of(solid))

    def _attach(self, i: int, node: Any, order: int) -> Any:
        self._remove(i)
        return self._root.attachNewNode(node, order)


def _put(path: Any, place: Place) -> None:
    path.setPosHpr(place.x, place.z, place.y, -place.yaw, 0.0, 0.0)


def _number(i: int) -> int:
    """The instance of object i; 0 for no instance, as there may be more copies than numbers."""
    return i + 1 if i < MOST_INSTANCES else 0


def _order(world: World) -> Sequence[int]:
    """The order of drawing: recorded objects by row, then the others by name.

    The rows of slices and copies depend on which were made first.
    """
    recorded = len(world.scene)
    if len(world) == recorded:
        return range(recorded)
    others = sorted(range(recorded, len(world)), key=lambda i: world.names[i])
    rank = {i: recorded + k for k, i in enumerate(others)}
    return [*range(recorded), *(rank[i] for i in range(recorded, len(world)))]


@lru_cache(maxsize=_NODES)
def _node(seen: Appearance, heading: float, number: int) -> Any:
    pieces = bake_of(seen.scene).looks.get(look_of(seen, heading))
    return geometry(pieces or pieces_of_look(seen, heading), number, seen.kind)


@lru_cache(maxsize=_SCENES)
def _scene_graph(scene_name: str) -> SceneGraph:
    return SceneGraph(scene_name)


def scene_graph_of(scene_name: str) -> SceneGraph:
    """The scene graph of a scene; those of recently drawn scenes are kept."""
    with DRAWING:  # otherwise two threads could make two
        return _scene_graph(scene_name)
