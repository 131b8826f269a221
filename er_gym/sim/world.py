"""The mutable state of a scene: its objects, the agents and the settings.

Every method that changes something calls :meth:`World.arrangement_changed` or
:meth:`World.state_changed`. They empty the caches, so that readers compute their values again.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim import initial_state
from er_gym.sim.agent import Agent
from er_gym.sim.carrying import Hand, hand_point, poses, still_held
from er_gym.sim.look import OWN, UNSEEDED, Chance, Line, Look
from er_gym.sim.scene import Scene
from er_gym.sim.scene_objects import PROPERTY_COLUMN, STATE_COLUMN, SceneObjects
from er_gym.sim.settings import Settings, ThirdPartyCamera
from er_gym.sim.start_pose import start_pose
from er_gym.sim.waiting import Waiting
from er_gym.sim.world_cache import WorldCache

_STEP = 2.0**-40
"""Metres, about a picometre. Recorded coordinates and multiples of this add without rounding."""


def upright_rotation(rotation: NDArray[np.float64], yaw: float) -> NDArray[np.float64]:
    """(3,) degrees: a rotation with its tilts rounded to quarter turns and with a new heading."""
    x, _, z = np.round(rotation / 90.0) * 90.0 % 360.0
    return np.array([x, yaw % 360.0, z])


def reversible_offset(offset: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) metres: an offset that the opposite offset undoes exactly.

    Other offsets do not cancel out. An object that is carried about, or a drawer that slides out
    and in, would end up elsewhere by its last bits, and a picture may show that.
    """
    return np.asarray(np.round(offset / _STEP) * _STEP)


_KEPT_APART = frozenset(
    {
        *("scene", "settings", "agent", "cameras", "map_view", "cache", "base", "listed"),
        *("look", "chance", "unshown", "lines", "acting", "others", "held_elsewhere"),
    }
)
"""Fields that a snapshot of the objects does not copy."""


@dataclass(kw_only=True)
class World(SceneObjects):
    """A scene's objects, the agents in it and the settings; made by :meth:`World.load`.

    Attributes:
        settings: what ``Initialize`` set.
        agent: the pose of the agent that acts.
        acting: the id of the agent that acts.
        others: what belongs to the agents that do not, by their ids: :mod:`er_gym.sim.crew`.
        cameras: the third-party cameras.
        map_view: whether the agent's picture shows the room from above (``ToggleMapView``).
        hand: the hand while it is not at rest, None while it is.
        look: the materials and lights that were drawn at random.
        chance: what random actions without a seed of their own draw by.
        unshown: rows that pictures leave out (``HideObject``).
        lines: what pictures show beside the room (``VisualizePath``).
        base: a snapshot of the arrangement that ``SetObjectPoses`` made last, None if it made
            none. It must not be changed.
    """

    settings: Settings
    agent: Agent
    acting: int = 0
    others: Mapping[int, Waiting] = field(default_factory=dict)
    base: World | None = None
    cameras: tuple[ThirdPartyCamera, ...] = ()
    map_view: bool = False
    hand: Hand | None = None
    look: Look = OWN
    chance: Chance = UNSEEDED
    unshown: frozenset[int] = frozenset()
    lines: tuple[Line, ...] = ()

    @staticmethod
    def load(scene: Scene, settings: Settings) -> World:
        """The scene as recorded, with the agent at AI2-THOR's start pose."""
        half = scene.aabb_size / 2
        world = World(
            scene=scene,
            settings=settings,
            agent=Agent(np.zeros(3)),
            object_ids=list(scene.object_ids),
            names=list(scene.names),
            types=list(scene.types),
            asset_ids=list(scene.asset_ids),
            position=scene.position.copy(),
            rotation=scene.rotation.copy(),
            low=scene.aabb_center - half,
            high=scene.aabb_center + half,
            obb=scene.obb.copy(),
            properties=initial_state.properties(scene),
            states=scene.states.copy(),
            openness=scene.openness.copy(),
            mass=scene.mass.copy(),
            exists=np.ones(len(scene.object_ids), dtype=bool),
            temperature=list(scene.temperature),
            fill_liquid=[None] * len(scene.object_ids),
            parents=list(initial_state.parents(scene)),
            controlled=list(scene.controlled),
            salient_materials=list(scene.salient_materials),
        )
        world.index = {object_id: i for i, object_id in enumerate(world.object_ids)}
        world._nesting = initial_state.nesting(scene)
        world._by_type = initial_state.rows_by_type(scene)
        start = start_pose(scene.name)
        position = np.array([start.x, world.standing_height, start.z])
        world.agent = Agent(position, start.rotation)
        return world

    def enter(self, scene: Scene) -> None:
        """Become another scene, as recorded; the settings and what chance draws by stay."""
        fresh = World.load(scene, self.settings)
        fresh.chance = self.chance
        vars(self).update(vars(fresh))

    def snapshot(self) -> World:
        """A copy of the objects as they are now, which :meth:`restore` takes. It becomes
        :attr:`base`."""
        self.base = replace(self, **_objects(self))
        self.base.wait({})  # it is compared with others, and nobody acts in it
        return self.base

    def restore(self, kept: World) -> None:
        """Put every object into the state of a snapshot of the same scene.

        The agent stays where it is. Both worlds share what was computed from the arrangement until
        something moves.
        """
        for name, value in _objects(kept).items():
            setattr(self, name, value)
        self.base = kept

    def _shift(self, rows: list[int], offset: NDArray[np.float64]) -> None:
        offset = reversible_offset(offset)
        self.position[rows] += offset
        self.low[rows] += offset
        self.high[rows] += offset
        self._displace(rows)

    def _touch(self, rows: Iterable[int]) -> None:
        """Forget the cached values of some objects that depend on their states."""
        self.untouched = False
        for i in rows:
            self.touched.add(i)
            self.cache.object_changed(i)

    def _displace(self, rows: Iterable[int]) -> None:
        """Forget the cached values of some objects that depend on their states or places."""
        rows = list(rows)
        self._touch(rows)
        self._displaced.update(rows)
        self.cache.objects_moved(rows)

    def changed(self, rows: Iterable[int]) -> None:
        """Note that objects may have changed in any way, and that others may have been added."""
        self._displace(rows)
        self.index = {object_id: i for i, object_id in enumerate(self.object_ids)}
        by_type: dict[str, list[int]] = {}
        for i, name in enumerate(self.types):
            by_type.setdefault(name, []).append(i)
        self._by_type = {name: tuple(rows) for name, rows in by_type.items()}
        self._renested()

    def forget(self) -> None:
        """Empty all caches, so that readers compute their values again."""
        self.cache = WorldCache()
        self._nesting = None

    # -- changing --------------------------------------------------------------------------------

    def arrangement_changed(self) -> None:
        """Note that an object has moved, opened or closed."""
        self.state_changed()
        self.cache.arrangement_changed()

    def state_changed(self) -> None:
        """Note that the state of an object has changed, but not its place."""
        self.untouched = False
        self.cache.state_changed()

    def _renested(self) -> None:
        """Note that an object is in other receptacles."""
        self._nesting = None
        self.arrangement_changed()

    def set_state(self, i: int, name: str, value: bool) -> None:
        """Put object i into a state of :data:`er_gym.sim.scene.STATES`, or out of it."""
        self.states[i, STATE_COLUMN[name]] = value
        self._touch([i, *(self.controlled[i] or ())])  # a burner glows while its knob is on
        if name == "isOpen":
            self.arrangement_changed()
        else:
            self.state_changed()

    def set_temperature(self, i: int, temperature: str) -> None:
        """Set the temperature of object i: "Hot", "Cold" or "RoomTemp"."""
        self.temperature[i] = temperature
        self._touch([i])

    def set_mass(self, i: int, mass: float) -> None:
        """Set the mass of object i, kilograms."""
        self.mass[i] = mass
        self._touch([i])
        self.state_changed()

    def set_property(self, i: int, name: str, value: bool) -> None:
        """Set or clear a property of object i."""
        self.properties[i, PROPERTY_COLUMN[name]] = value
        self._touch([i])
        self.arrangement_changed()

    def relocate(self, i: int, parents: Sequence[int]) -> None:
        """Put object i, with everything in it, into other receptacles."""
        within = self.inside(i)
        moving = {i, *within}
        self._touch([*self.parents[i], *parents])
        self._displace(moving)
        self.parents[i] = tuple(parents)
        for child in within:
            self._touch(self.parents[child])
            own = tuple(p for p in self.parents[child] if p in moving)
            self.parents[child] = (*own, *(p for p in parents if p not in own))
        self._renested()

    def relocate_alone(self, i: int, parents: Sequence[int]) -> None:
        """Put object i into other receptacles; its contents keep theirs."""
        self._touch([*self.parents[i], *parents])
        self._displace([i, *self.inside(i)])
        self.parents[i] = tuple(parents)
        self._renested()

    def turn(self, i: int, yaw: float) -> None:
        """Turn object i about the vertical to a heading in degrees, with its box.

        Its tilts are rounded to quarter turns: a leaning object is set straight, a lying one stays
        flat.
        """
        self.rotation[i] = upright_rotation(self.rotation[i], yaw)
        corners = self.obb_corners(i)
        if corners is not None:
            self.low[i], self.high[i] = corners.min(axis=0), corners.max(axis=0)
        self._displace([i])
        self.arrangement_changed()

    def move_by(self, i: int, offset: NDArray[np.float64]) -> None:
        """Shift object i by (3,) metres, with everything in it."""
        self._shift([i, *self.inside(i)], offset)
        self.arrangement_changed()

    def set_pose(
        self, i: int, position: NDArray[np.float64], rotation: NDArray[np.float64]
    ) -> None:
        """Put object i, without its contents, at a position (3,) in metres and a rotation (3,) in
        degrees.

        Its box follows. A box that is recorded without an orientation moves but does not turn.
        """
        offset = position - self.position[i]
        self.position[i], self.rotation[i] = position, rotation
        corners = self.obb_corners(i)
        if corners is None:
            self.low[i] += offset
            self.high[i] += offset
        else:
            self.low[i], self.high[i] = corners.min(axis=0), corners.max(axis=0)
        self._displace([i])
        self.arrangement_changed()

    def rename(self, i: int, object_id: str) -> None:
        """Give object i another id, which no other object may have."""
        del self.index[self.object_ids[i]]
        self.object_ids[i] = object_id
        self.index[object_id] = i
        self._touch([i, *self.parents[i], *self.contents[i]])
        self.state_changed()

    def remove(self, i: int) -> None:
        """Take object i out of the scene; its contents stay where they are."""
        self.release(i)
        for child in self.contents[i]:
            self.parents[child] = tuple(p for p in self.parents[child] if p != i)
            self._displace([child])
        self._touch(self.parents[i])
        self._displace([i])
        self.parents[i] = ()
        self.exists[i] = False
        self._renested()

    def cut_up(self, i: int, state: str) -> None:
        """Replace a whole by its parts, which exist already. The metadata go on listing the whole.

        Args:
            state: the new state of the whole, ``"isSliced"`` or ``"isBroken"``.
        """
        self.remove(i)
        self.remains.add(i)
        self.set_state(i, state, True)

    def disable(self, i: int) -> None:
        """Take object i out of the scene until :meth:`enable` brings it back."""
        self.disabled[i] = tuple(self.contents[i])
        self.remove(i)

    def enable(self, i: int) -> tuple[int, ...]:
        """Bring a disabled object back, into no receptacle yet, and return the rows of its former
        contents."""
        lay_in_it = self.disabled.pop(i)
        self.exists[i] = True
        self._displace([i])
        self._renested()
        return lay_in_it

    def place_agent(self, agent: Agent, *, keep_hand: bool = False) -> None:
        """Put the agent at a pose, with the object that it holds.

        Args:
            keep_hand: leave the hand as it is, and do not put it to rest.
        """
        self.agent = agent
        if self.held >= 0:
            if self.hand is None:
                self.carry()
            else:
                self.pose_hand(self.hand if keep_hand else None)

    def carry(self) -> None:
        """Move the held object to the hand."""
        centre = (self.low[self.held] + self.high[self.held]) / 2
        # The held object hides nothing, so lines of sight stay valid: no `arrangement_changed`.
        self._shift(self.in_hand, hand_point(self.agent, self.hand) - centre)

    def pose_hand(self, hand: Hand | None) -> None:
        """Move and turn the hand, with what it holds; None puts it to rest."""
        before, self.hand = self.hand, hand
        if hand is not None and hand.turn is not None:
            for row, position, rotation in list(poses(self, self.agent, hand)):
                self.set_pose(row, position, rotation)
        elif before is not None:
            origin = self.position[self.held].copy()
            for each in list(still_held(self, before)):
                at = origin + each.offset
                self.set_pose(each.row, at, np.array(each.rotation))
                self.low[each.row], self.high[each.row] = at + each.low, at + each.high
        self.carry()

    def let_go(self) -> None:
        """Empty the hand, which then is at rest."""
        self.held, self.hand = -1, None

    def release(self, i: int) -> None:
        """Empty the hand that holds object i, if any does."""
        if i == self.held:
            self.let_go()
        elif i in self.held_elsewhere:
            self.wait(
                {
                    number: replace(other, held=-1, hand=None) if other.held == i else other
                    for number, other in self.others.items()
                }
            )

    def wait(self, others: Mapping[int, Waiting]) -> None:
        """Let these be the agents that do not act."""
        self.others = others
        self.held_elsewhere = tuple(each.held for each in others.values() if each.held >= 0)

    def add_object(self, like: int, object_id: str, object_type: str, name: str) -> int:
        """Append a copy of an object under another id and type; returns its row."""
        row = len(self)
        for array in ("position", "rotation", "low", "high", "obb", "properties", "states"):
            old = getattr(self, array)
            setattr(self, array, np.concatenate([old, old[like : like + 1]]))
        for array in ("openness", "mass", "exists"):
            old = getattr(self, array)
            setattr(self, array, np.append(old, old[like]))
        self.object_ids.append(object_id)
        self.names.append(name)
        self.types.append(object_type)
        self.asset_ids.append("")
        self.temperature.append(self.temperature[like])
        self.fill_liquid.append(None)
        self.parents.append(self.parents[like])
        self.controlled.append(None)
        self.salient_materials.append(self.salient_materials[like])
        self.index[object_id] = row
        of_type = (*self._by_type.get(object_type, ()), row)
        self._by_type = {**self._by_type, object_type: of_type}
        self._touch(self.parents[row])
        self._displace([row])
        self._renested()
        return row

    def configure(self, **changes: object) -> None:
        """Change settings by name."""
        self.settings = replace(self.settings, **changes)  # type: ignore[arg-type]


def _objects(world: World) -> dict[str, Any]:
    """Copies of the fields that describe a world's objects, with a cache of their own."""
    copies = {
        each.name: copy(getattr(world, each.name))
        for each in fields(world)
        if each.name not in _KEPT_APART
    }
    return {**copies, "cache": world.cache.snapshot()}
