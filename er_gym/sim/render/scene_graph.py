"""The scene graph of a room: what is drawn, and where.

An object that looks the same as before is not made again. Rooms as recorded come out of a bake
(:mod:`er_gym.sim.render.bake`); what has changed since is made, and kept by appearance, heading and
number. Only objects that have changed are updated.

Even so, a picture depends on the world alone and not on what was drawn before. Of surfaces at the
same depth the one drawn first is seen. So the order of drawing is fixed: first the room, then the
objects in an order of their own.

In soft light, colours depend on where an object is and on the lamps that are on, and shadows lie
under what stands on something. What is in the hand is drawn in flat light, wherever it is carried.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.look import OWN, Line, Look
from er_gym.sim.render.agent_body import body_node, put_body
from er_gym.sim.render.appearance import Appearance, appearance_of
from er_gym.sim.render.bake import bake_of, heading_of, look_of
from er_gym.sim.render.camera import Camera
from er_gym.sim.render.lines import line_piece
from er_gym.sim.render.nodes import FLOOR, made_node, recorded_node, room_node, veil_node
from er_gym.sim.render.panda import DRAWING, MOST_INSTANCES, Frames, core, geometry, rasteriser
from er_gym.sim.render.place import Place, place_of
from er_gym.sim.render.shades import shade_of
from er_gym.sim.render.shapes import UNSEEN
from er_gym.sim.render.soft_light import Lamp, lamps_on
from er_gym.sim.settings import FLAT, SOFT
from er_gym.sim.space.solids import Solid, solid_of
from er_gym.sim.world import World
from er_gym.sim.world_cache import CacheKey

_SCENES = 64
"""Rooms whose scene graphs are kept."""
_SHOWN: dict[str, CacheKey[object]] = {
    light: CacheKey(f"state that a scene graph in {light} light shows") for light in (SOFT, FLAT)
}
_AFTER = 1 << 20
"""Agents come last in the order of drawing."""
_BEFORE = 8
"""The parts of the room come first in the order of drawing: they start this far below 0."""


@dataclass(frozen=True, eq=False)
class _Placed:
    """An object in the graph.

    Attributes:
        look: a name of what it looks like.
        order: of drawing.
        path: its node.
        lit_at: the place whose light it is drawn in, None for flat light.
        seen, solid: the state that it was drawn in; None if it is as recorded.
    """

    look: str
    order: int
    path: Any
    lit_at: Place | None
    seen: Appearance | None = None
    solid: Solid | None = None

    def shows(self, seen: Appearance, heading: float) -> bool:
        return self.solid is not None and self.seen == seen and heading_of(self.solid) == heading


@dataclass(frozen=True, eq=False)
class _Shaded:
    """The shadow of an object: its node, None if it has none, and the state that it depends on."""

    path: Any
    depends: tuple[object, ...]


class SceneGraph:
    """The scene graph of one scene in a light; use :func:`scene_graph_of`."""

    def __init__(self, scene_name: str, light: str = SOFT) -> None:
        self._name, self._soft, self._key = scene_name, light == SOFT, _SHOWN[light]
        self._build((), OWN)
        self._state: object | None = object()  # the state that it shows; None while it changes

    def draw(
        self,
        world: World,
        camera: Camera,
        depth: bool = False,
        *,
        ids: bool = True,
        unseen: int | None = None,
    ) -> Frames:
        """The images of a camera in a world of this scene; object i is instance i + 1.

        Several threads may call this at once; they take turns.

        Args:
            unseen: the agent whose body is left out; one agent alone has no body.
        """
        with DRAWING:
            self._follow(world)
            if world.others or self._bodies:
                self._stand(world, unseen)
            veils = self._veils if self._soft else None
            return rasteriser().draw(self._root, camera, depth, ids=ids, veils=veils)

    def _build(self, lamps: tuple[Lamp, ...], look: Look) -> None:
        """Build the room without its objects, in the light of some lamps and in a look."""
        bake = bake_of(self._name)
        self._root = core().NodePath(self._name)
        self._lamps, self._look = lamps, look
        self._placed: dict[int, _Placed] = {}
        self._shaded: dict[int, _Shaded] = {}
        # Of the world that is shown: the rows that have changed since it was recorded, and which
        # objects are hidden.
        self._touched: set[int] = set()
        self._lines: dict[Line, Any] = {}
        self._bodies: dict[int, Any] = {}
        self._hidden: NDArray[np.bool_] | None = None
        for k, part in enumerate(bake.around):
            self._root.attachNewNode(self._part(part, 0), k - _BEFORE)
        self._floor_number = -1
        self._veils = core().NodePath("veils")
        if self._soft and -1 in bake.shades:
            self._veils.attachNewNode(veil_node(bake.shades[-1]).makeCopy(), -1)

    def _follow(self, world: World) -> None:
        """Update everything that has changed in the world."""
        before, self._state = self._state, None
        if before is None:  # an exception left it half updated
            self._build(self._lamps, self._look)
        elif world.cache.state.get(self._key) is before:
            for i in world.carried:  # nothing but the hands has moved
                if i in self._placed:
                    self._place(world, i, self._placed[i].order)
            self._state = before
            return
        lamps = lamps_on(world) if self._soft else ()
        if lamps != self._lamps or world.look != self._look:
            self._build(lamps, world.look)
        hidden, order = _left_out(world), _order(world)
        rows = self._rows(world, hidden)
        recorded = bake_of(self._name).recorded
        for i in sorted(rows):
            if i >= len(world) or hidden[i]:
                self._remove(i)
                continue
            if world.types[i] in UNSEEN:
                if world.types[i] == "Floor":
                    self._lay_floor(i)
                continue
            if i in recorded and i not in world.touched:
                self._place_as_recorded(i, world.types[i])
            else:
                self._place(world, i, order[i])
            if self._soft:
                self._shade(world, i, order[i])
        if self._lines or world.lines:
            self._draw_lines(world.lines)
        self._touched, self._hidden = set(world.touched), hidden.copy()
        self._state = world.cache.state.put(self._key, object())

    def _stand(self, world: World, unseen: int | None) -> None:
        """Put the bodies of the agents, all but one, where they are."""
        agents = {number: other.agent for number, other in world.others.items()}
        if agents:
            agents[world.acting] = world.agent
        if not world.settings.agents_visible:
            agents = {}
        for number in self._bodies.keys() - agents.keys() | {unseen}:
            if number in self._bodies:
                self._bodies.pop(number).removeNode()
        for number, agent in sorted(agents.items()):
            if number == unseen:
                continue
            if number not in self._bodies:
                self._bodies[number] = self._root.attachNewNode(body_node(number), _AFTER + number)
            put_body(self._bodies[number], agent)

    def _draw_lines(self, lines: tuple[Line, ...]) -> None:
        for gone in self._lines.keys() - set(lines):
            self._lines.pop(gone).removeNode()
        for line in lines:
            piece = None if line in self._lines else line_piece(line)
            if piece is not None:
                self._lines[line] = self._root.attachNewNode(geometry([piece], 0, "line"), -1)

    def _rows(self, world: World, hidden: NDArray[np.bool_]) -> set[int]:
        """The rows that this world may show in another way than the one that is shown."""
        contents = world.contents
        # An object that has never changed is the same in all worlds of the scene.
        rows = world.touched | self._touched
        if self._soft:  # a shadow depends on what it falls on
            rows |= {child for i in rows if i < len(world) for child in contents[i]}
        if self._hidden is None:
            rows |= set(range(len(world)))
        else:
            both = min(len(hidden), len(self._hidden))
            rows.update(np.flatnonzero(hidden[:both] != self._hidden[:both]).tolist())
        return rows

    def _lay_floor(self, i: int) -> None:
        if self._floor_number != i + 1:
            self._root.attachNewNode(self._part(FLOOR, i + 1), -1)
            self._floor_number = i + 1

    def _remove(self, i: int) -> None:
        placed, shaded = self._placed.pop(i, None), self._shaded.pop(i, None)
        if placed is not None:
            placed.path.removeNode()
        if shaded is not None and shaded.path is not None:
            shaded.path.removeNode()

    def _place_as_recorded(self, i: int, kind: str) -> None:
        before, bake = self._placed.get(i), bake_of(self._name)
        if before is not None and before.seen is None:
            return
        look, place = bake.recorded[i]
        lit_at = place if self._soft else None
        if before is None or (before.look, before.order, before.lit_at) != (look, i, lit_at):
            lamps = self._lamps if self._soft else ()
            node = recorded_node(self._name, look, lit_at, lamps, _number(i), kind, self._look)
            path = self._attach(i, node.makeCopy(), i)
        else:
            path = before.path
        self._placed[i] = _Placed(look, i, path, lit_at)
        _put(path, place)

    def _place(self, world: World, i: int, order: int) -> None:
        seen, solid, before = appearance_of(world, i), solid_of(world, i), self._placed.get(i)
        heading, place = heading_of(solid), place_of(solid)
        lit_at = place if self._soft and i not in world.carried else None
        same = before is not None and before.shows(seen, heading)
        look = before.look if before is not None and same else look_of(seen, heading)
        if before is None or (before.look, before.order, before.lit_at) != (look, order, lit_at):
            lamps = () if lit_at is None else self._lamps
            # A copy shares the triangles, and its place is a property of the node.
            node = made_node(seen, heading, lit_at, lamps, _number(i), self._look).makeCopy()
            path = self._attach(i, node, order)
        else:
            path = before.path
        self._placed[i] = _Placed(look, order, path, lit_at, seen, solid)
        _put(path, place)

    def _attach(self, i: int, node: Any, order: int) -> Any:
        placed = self._placed.pop(i, None)
        if placed is not None:
            placed.path.removeNode()
        return self._root.attachNewNode(node, order)

    def _shade(self, world: World, i: int, order: int) -> None:
        """Lay the shadow of object i."""
        bake, before, on = bake_of(self._name), self._shaded.get(i), world.parents[i]
        changed = not world.touched.isdisjoint((i, *on)) or i >= len(world.scene)
        depends: tuple[object, ...] = ()
        if changed:
            held = i in world.carried
            depends = (solid_of(world, i), order, held, on, *(solid_of(world, p) for p in on))
        if before is not None and _all_same(before.depends, depends):
            return
        if before is not None and before.path is not None:
            before.path.removeNode()
        shade = shade_of(world, i, order, bake.day) if changed else bake.shades.get(i)
        path = None
        if shade is not None:
            path = self._veils.attachNewNode(veil_node(shade).makeCopy(), order)
        self._shaded[i] = _Shaded(path, depends)

    def _part(self, part: str, number: int) -> Any:
        """A part of the room itself."""
        lit_at = Place() if self._soft else None
        return room_node(self._name, part, lit_at, self._lamps, number, self._look).makeCopy()


def _all_same(one: tuple[object, ...], other: tuple[object, ...]) -> bool:
    return len(one) == len(other) and all(
        a is b or (not isinstance(a, Solid) and a == b) for a, b in zip(one, other, strict=True)
    )


def _put(path: Any, place: Place) -> None:
    path.setPosHpr(place.x, place.z, place.y, -place.yaw, 0.0, 0.0)


def _number(i: int) -> int:
    """The instance of object i; 0 for no instance, as there may be more copies than numbers."""
    return i + 1 if i < MOST_INSTANCES else 0


def _left_out(world: World) -> NDArray[np.bool_]:
    """(N,) the objects that are not drawn: what is in something closed or out of the scene, and
    what a program has hidden."""
    if not world.unshown:
        return world.hidden
    hidden = world.hidden.copy()
    hidden[list(world.unshown)] = True
    return hidden


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


@lru_cache(maxsize=_SCENES)
def _scene_graph(scene_name: str, light: str) -> SceneGraph:
    return SceneGraph(scene_name, light)


def scene_graph_of(scene_name: str, light: str = SOFT) -> SceneGraph:
    """The scene graph of a scene in a light; those of recently drawn scenes are kept."""
    with DRAWING:  # otherwise two threads could make two
        return _scene_graph(scene_name, light)
