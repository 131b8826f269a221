"""The mutable state of a scene: what is where, in which state, and where the agent is.

Every method that changes something calls :meth:`World.arrangement_changed` or
:meth:`World.state_changed`. They empty the caches, so that readers work out their values again.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from copy import copy
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim import initial_state
from er_gym.sim.agent import HAND_OFFSET, Agent
from er_gym.sim.scene import Scene
from er_gym.sim.scene_objects import PROPERTY_COLUMN, STATE_COLUMN, SceneObjects
from er_gym.sim.settings import Settings, ThirdPartyCamera
from er_gym.sim.space.rotation import unity_rotation
from er_gym.sim.start_pose import start_pose
from er_gym.sim.world_cache import WorldCache

_STEP = 2.0**-40
"""Metres, a picometre: recorded coordinates, and whole steps beside them, add without rounding."""


def upright_rotation(rotation: NDArray[np.float64], yaw: float) -> NDArray[np.float64]:
    """(3,) degrees: a rotation with its tilts rounded to quarter turns, and another heading."""
    x, _, z = np.round(rotation / 90.0) * 90.0 % 360.0
    return np.array([x, yaw % 360.0, z])


def reversible_offset(offset: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) metres: an offset after which the opposite one leads back to the same place exactly.

    The sums of others do not: what is carried about or slid out and in would end up elsewhere by
    its last bits, which a picture may show.
    """
    return np.asarray(np.round(offset / _STEP) * _STEP)


_KEPT_APART = frozenset({"scene", "settings", "agent", "cameras", "cache", "base", "listed"})
"""Fields that a snapshot of the objects does not copy."""


@dataclass(kw_only=True)
class World(SceneObjects):
    """A scene's objects, the agent in it and the settings; made by :meth:`World.load`.

    Attributes:
        settings: what ``Initialize`` set.
        agent: the agent's pose.
        cameras: the third-party cameras.
        base: a snapshot of the arrangement that ``SetObjectPoses`` made last, None if it made
            none. It must not be changed.
    """

    settings: Settings
    agent: Agent
    base: World | None = None
    cameras: tuple[ThirdPartyCamera, ...] = ()

    @staticmethod
    def load(scene: Scene, settings: Settings) -> World:
        """The scene as recorded, with the agent where AI2-THOR starts it."""
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

    def snapshot(self) -> World:
        """The objects as they are now, to be restored by :meth:`restore`; they are its :attr:`base`
        from now on."""
        self.base = replace(self, **_objects(self))
        return self.base

    def restore(self, kept: World) -> None:
        """Put every object into the state of a snapshot of the same scene.

        The agent stays where it is. What has been worked out from where things are is shared, until
        something is moved.
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
        """Forget what was said of some objects."""
        self.untouched = False
        for i in rows:
            self.touched.add(i)
            self.cache.object_changed(i)

    def _displace(self, rows: Iterable[int]) -> None:
        """Forget that too, and what was worked out from where they are and what they lie in."""
        rows = list(rows)
        self._touch(rows)
        self._displaced.update(rows)
        self.cache.objects_moved(rows)

    def forget(self) -> None:
        """Forget what readers have worked out; they work it out again when next asked for it."""
        self.cache = WorldCache()
        self._nesting = None

    # -- changing --------------------------------------------------------------------------------

    def arrangement_changed(self) -> None:
        """Say that something is elsewhere than it was, or has been opened or shut."""
        self.state_changed()
        self.cache.arrangement_changed()

    def state_changed(self) -> None:
        """Say that something is in another state than it was, where it is."""
        self.untouched = False
        self.cache.state_changed()

    def _renested(self) -> None:
        """Say that something lies elsewhere than it did."""
        self._nesting = None
        self.arrangement_changed()

    def set_state(self, i: int, name: str, value: bool) -> None:
        """Put object i into a state of :data:`er_gym.sim.scene.STATES`, or out of it."""
        self.states[i, STATE_COLUMN[name]] = value
        self._touch([i, *(self.controlled[i] or ())])  # a burner glows by its knob
        if name == "isOpen":
            self.arrangement_changed()
        else:
            self.state_changed()

    def set_temperature(self, i: int, temperature: str) -> None:
        """Make object i "Hot", "Cold" or "RoomTemp"."""
        self.temperature[i] = temperature
        self._touch([i])

    def set_mass(self, i: int, mass: float) -> None:
        """Give object i another mass, kilograms."""
        self.mass[i] = mass
        self._touch([i])
        self.state_changed()

    def set_property(self, i: int, name: str, value: bool) -> None:
        """Give object i a property, or take it away."""
        self.properties[i, PROPERTY_COLUMN[name]] = value
        self._touch([i])
        self.arrangement_changed()

    def relocate(self, i: int, parents: Sequence[int]) -> None:
        """Say in which receptacles object i lies from now on; what lies in it goes along."""
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
        """Say in which receptacles object i lies; what lies in it does not change."""
        self._touch([*self.parents[i], *parents])
        self._displace([i, *self.inside(i)])
        self.parents[i] = tuple(parents)
        self._renested()

    def turn(self, i: int, yaw: float) -> None:
        """Turn object i about the vertical to a heading in degrees, its box following.

        What was leaning is set straight, to the nearest quarter turn: what lay flat lies flat.
        """
        self.rotation[i] = upright_rotation(self.rotation[i], yaw)
        corners = self.obb_corners(i)
        if corners is not None:
            self.low[i], self.high[i] = corners.min(axis=0), corners.max(axis=0)
        self._displace([i])
        self.arrangement_changed()

    def move_by(self, i: int, offset: NDArray[np.float64]) -> None:
        """Shift object i by (3,) metres, and what lies in it with it."""
        self._shift([i, *self.inside(i)], offset)
        self.arrangement_changed()

    def set_pose(
        self, i: int, position: NDArray[np.float64], rotation: NDArray[np.float64]
    ) -> None:
        """Put object i, alone, at (3,) metres and degrees, its box following.

        A box that is recorded without its orientation moves and does not turn.
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
        """Give object i another id, which nothing else has."""
        del self.index[self.object_ids[i]]
        self.object_ids[i] = object_id
        self.index[object_id] = i
        self._touch([i, *self.parents[i], *self.contents[i]])
        self.state_changed()

    def remove(self, i: int) -> None:
        """Take object i out of the scene; what lies in it stays where it is."""
        if i == self.held:
            self.held = -1
        for child in self.contents[i]:
            self.parents[child] = tuple(p for p in self.parents[child] if p != i)
            self._displace([child])
        self._touch(self.parents[i])
        self._displace([i])
        self.parents[i] = ()
        self.exists[i] = False
        self._renested()

    def cut_up(self, i: int, state: str) -> None:
        """Take a whole away of which there are parts now; the metadata go on listing it.

        Args:
            state: what it is from now on, ``"isSliced"`` or ``"isBroken"``.
        """
        self.remove(i)
        self.remains.add(i)
        self.set_state(i, state, True)

    def disable(self, i: int) -> None:
        """Take object i out of the scene until it is brought back by :meth:`enable`."""
        self.disabled[i] = tuple(self.contents[i])
        self.remove(i)

    def enable(self, i: int) -> tuple[int, ...]:
        """Bring back what was disabled, in no receptacle yet; returns what lay in it."""
        lay_in_it = self.disabled.pop(i)
        self.exists[i] = True
        self._displace([i])
        self._renested()
        return lay_in_it

    def place_agent(self, agent: Agent) -> None:
        """Put the agent somewhere; what it holds goes along."""
        self.agent = agent
        if self.held >= 0:
            self.carry()

    def carry(self) -> None:
        """Bring the held object to where the hand is."""
        centre = (self.low[self.held] + self.high[self.held]) / 2
        heading = unity_rotation(np.array([self.agent.horizon, self.agent.rotation, 0.0]))
        hand = self.agent.camera + heading @ HAND_OFFSET
        # What is in the hand hides nothing, so lines of sight stay as they were: no `changed`.
        self._shift(self.in_hand, hand - centre)

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
    """Copies of all that is said of a world's objects; what they look like is to be found anew."""
    copies = {
        each.name: copy(getattr(world, each.name))
        for each in fields(world)
        if each.name not in _KEPT_APART
    }
    return {**copies, "cache": world.cache.snapshot()}
