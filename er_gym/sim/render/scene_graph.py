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
from er_gym.sim.render.camera import Camera
from er_gym.sim.render.carcasses import carcasses
from er_gym.sim.render.fixtures import fixtures
from er_gym.sim.render.lighting import lit_colours
from er_gym.sim.render.panda import (
    DRAWING,
    MOST_INSTANCES,
    Frames,
    core,
    geometry,
    rasteriser,
)
from er_gym.sim.render.patch import Patch
from er_gym.sim.render.room_shell import room_shell
from er_gym.sim.render.shapes import UNSEEN, build
from er_gym.sim.space.solids import Solid, solid_of
from er_gym.sim.world import World
from er_gym.sim.world_cache import CacheKey

_SCENES = 64
"""Rooms whose scene graphs are kept."""
_SHOWN: CacheKey[object] = CacheKey("state that a scene graph shows")
_NODES = 2048
_BEFORE = 8
"""The parts of the room come first in the order of drawing: they start this far below 0."""
_HEADING = 1.0
"""Headings are rounded to a multiple of this for lighting, degrees."""


@dataclass(frozen=True, eq=False)
class _Placed:
    """An object in the graph, and the state that it was drawn in."""

    appearance: Appearance
    solid: Solid
    order: int
    path: Any


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
        shell = room_shell(self._name)
        around = {"room": shell.rest, "fixtures": fixtures(self._name)}
        for k, (name, patches) in enumerate({**around, "carcasses": carcasses(self._name)}.items()):
            self._root.attachNewNode(_drawn(patches, 0, name), k - _BEFORE)
        self._floor, self._floor_number = shell.floor, -1

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
        for i in sorted(rows):
            if i >= len(world) or hidden[i]:
                self._remove(i)
            elif world.types[i] in UNSEEN:
                self._lay_floor(i)
            else:
                self._place(world, i, order[i])
        self._touched, self._hidden = set(world.touched), hidden.copy()
        self._state = world.cache.state.put(_SHOWN, object())

    def _lay_floor(self, i: int) -> None:
        if self._floor_number != i + 1:
            self._root.attachNewNode(_drawn(self._floor, i + 1, "floor"), -1)
            self._floor_number = i + 1

    def _remove(self, i: int) -> None:
        placed = self._placed.pop(i, None)
        if placed is not None:
            placed.path.removeNode()

    def _place(self, world: World, i: int, order: int) -> None:
        seen, solid, before = appearance_of(world, i), solid_of(world, i), self._placed.get(i)
        same = before is not None and before.appearance == seen and before.order == order
        if before is not None and same and before.solid is solid:
            return
        heading = _heading(solid)
        if before is not None and same and _heading(before.solid) == heading:
            path = before.path
        else:
            self._remove(i)
            number = i + 1 if i < MOST_INSTANCES else 0  # there may be more copies than instances
            # A copy shares the triangles, and its place is a property of the node.
            path = self._root.attachNewNode(_node(seen, heading, number).makeCopy(), order)
        x, y, z = solid.middle.tolist()
        path.setPosHpr(x, z, y + float(solid.upright[:, 0, 1].min()), -solid.yaw, 0.0, 0.0)
        self._placed[i] = _Placed(seen, solid, order, path)


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


def _heading(solid: Solid) -> float:
    return round(solid.yaw / _HEADING) * _HEADING % 360.0


def _drawn(patches: dict[str, Patch], number: int, name: str) -> Any:
    """A node of lit triangles."""
    parts = [(m, p.vertices, p.colours, p.uv, p.triangles) for m, p in patches.items()]
    return geometry(parts, number, name)


@lru_cache(maxsize=_NODES)
def _node(seen: Appearance, heading: float, number: int) -> Any:
    parts = [
        (m, p.vertices, lit_colours(m, p, heading, seen.size[1], seen.height), p.uv, p.triangles)
        for m, p in build(seen).items()
    ]
    return geometry(parts, number, seen.kind)


@lru_cache(maxsize=_SCENES)
def _scene_graph(scene_name: str) -> SceneGraph:
    return SceneGraph(scene_name)


def scene_graph_of(scene_name: str) -> SceneGraph:
    """The scene graph of a scene; those of recently drawn scenes are kept."""
    with DRAWING:  # otherwise two threads could make two
        return _scene_graph(scene_name)
