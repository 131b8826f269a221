"""The scene graph of a room: what of it is drawn, and where.

Nothing is drawn anew that looks as it did: a thing's triangles are kept by its look, its node by
its look, heading and number, and of a world's objects only those are looked at that have changed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from er_gym.sim.render.camera import Camera
from er_gym.sim.render.carcasses import carcasses
from er_gym.sim.render.fixtures import fixtures
from er_gym.sim.render.look import Look
from er_gym.sim.render.mesh import Patch
from er_gym.sim.render.panda import MOST_INSTANCES, Frames, core, geometry, rasteriser
from er_gym.sim.render.portrait import look
from er_gym.sim.render.room import room_shell
from er_gym.sim.render.shade import shaded
from er_gym.sim.render.shapes import UNSEEN, build
from er_gym.sim.space.shapes import Shape
from er_gym.sim.world import World

_SCENES = 64
"""Rooms whose graphs are kept."""
_NODES = 2048
_HEADING = 1.0
"""Things are lit as if they stood at a multiple of so many degrees."""


@dataclass(frozen=True, eq=False)
class _Placed:
    """An object in the graph, and what it was placed by."""

    look: Look
    shape: Shape
    path: Any


class Stage:
    """The graph of one scene; use :func:`stage`."""

    def __init__(self, scene_name: str) -> None:
        self._root = core().NodePath(scene_name)
        self._placed: dict[int, _Placed] = {}
        shell = room_shell(scene_name)
        self._root.attachNewNode(_drawn(shell.rest, 0, "room"))
        self._root.attachNewNode(_drawn(fixtures(scene_name), 0, "fixtures"))
        self._root.attachNewNode(_drawn(carcasses(scene_name), 0, "carcasses"))
        self._floor, self._floor_number = shell.floor, -1
        self._state = object()

    def draw(self, world: World, camera: Camera, depth: bool = False) -> Frames:
        """What a camera sees of a world of this scene; object i is instance i + 1."""
        self._follow(world)
        return rasteriser().draw(self._root, camera, depth)

    def _follow(self, world: World) -> None:
        """Change what has changed in the world."""
        if world.derived.get("staged") is self._state:  # nothing has, but where the hand is
            for i in world.in_hand:
                self._place(world, i)
            return
        self._state = world.derived["staged"] = object()
        shown = (~world.hidden).tolist()
        for i in range(max(len(world), max(self._placed, default=-1) + 1)):
            if i >= len(world) or not shown[i]:
                self._remove(i)
            elif world.types[i] in UNSEEN:
                self._lay_floor(i)
            else:
                self._place(world, i)

    def _lay_floor(self, i: int) -> None:
        if self._floor_number != i + 1:
            self._floor_number = i + 1
            self._root.attachNewNode(_drawn(self._floor, i + 1, "floor"))

    def _remove(self, i: int) -> None:
        placed = self._placed.pop(i, None)
        if placed is not None:
            placed.path.removeNode()

    def _place(self, world: World, i: int) -> None:
        seen, shape, before = look(world, i), world.shape(i), self._placed.get(i)
        if before is not None and before.shape is shape and before.look == seen:
            return
        heading = _heading(shape)
        if before is not None and before.look == seen and _heading(before.shape) == heading:
            path = before.path
        else:
            self._remove(i)
            number = i + 1 if i < MOST_INSTANCES else 0  # copies without end have no instance
            path = self._root.attachNewNode(_node(seen, heading, number))
        x, y, z = shape.middle.tolist()
        path.setPos(x, z, y + float(shape.upright[:, 0, 1].min()))
        path.setH(-shape.yaw)
        self._placed[i] = _Placed(seen, shape, path)


def _heading(shape: Shape) -> float:
    return round(shape.yaw / _HEADING) * _HEADING % 360.0


def _drawn(patches: dict[str, Patch], number: int, name: str) -> Any:
    """A node of triangles that are lit already."""
    parts = [(m, p.vertices, p.colours, p.uv, p.triangles) for m, p in patches.items()]
    return geometry(parts, number, name)


@lru_cache(maxsize=_NODES)
def _node(seen: Look, heading: float, number: int) -> Any:
    parts = [
        (m, p.vertices, shaded(m, p, heading, seen.size[1], seen.height), p.uv, p.triangles)
        for m, p in build(seen).items()
    ]
    return geometry(parts, number, seen.kind)


@lru_cache(maxsize=_SCENES)
def stage(scene_name: str) -> Stage:
    """The graph of a scene; those of the scenes last drawn are kept."""
    return Stage(scene_name)
