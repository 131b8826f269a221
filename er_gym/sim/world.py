"""The mutable state of a scene: what is where, in which state, and where the agent is.

Struct of arrays: row ``i`` of every array is object ``i``. Rows are never removed; an object that
is no more (a whole apple after slicing) has ``exists[i]`` False, and is in ``remains`` if the
metadata go on listing it, as AI2-THOR's do of what was cut up. Whoever changes something says so
(:meth:`World.changed`, :meth:`World.restated`), and what is derived from it is worked out anew when
next asked for.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim import recorded
from er_gym.sim.errors import ActionFailed
from er_gym.sim.nesting import Nesting
from er_gym.sim.scene import PROPERTIES, STATES, Scene
from er_gym.sim.space.rotation import unity_rotation
from er_gym.sim.space.shapes import Shape, shape_of
from er_gym.sim.space.shapes.seen import points_to_see
from er_gym.sim.start import start_pose

AGENT_HEIGHT = 0.900999128818512
"""Height of the agent's centre above the top of the scene's Floor, metres, as AI2-THOR has it."""
CAMERA_STANDING, CAMERA_CROUCHING = 0.675, 0.0
"""Height of the camera above the agent's centre, metres."""
HAND_OFFSET = np.array([0.0, -0.16, 0.38])
"""Where the hand is in the camera's frame (right, up, forward), metres."""
_STEP = 2.0**-40
"""Metres, a picometre: recorded coordinates, and whole steps beside them, add without rounding."""
_PROPERTY = {name: column for column, name in enumerate(PROPERTIES)}
_STATE = {name: column for column, name in enumerate(STATES)}


def settled(rotation: NDArray[np.float64], yaw: float) -> NDArray[np.float64]:
    """(3,) degrees: a rotation with its tilts rounded to quarter turns, and another heading."""
    x, _, z = np.round(rotation / 90.0) * 90.0 % 360.0
    return np.array([x, yaw % 360.0, z])


def whole_steps(offset: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3,) metres: an offset after which the opposite one leads back to the same place exactly.

    The sums of others do not: what is carried about or slid out and in would end up elsewhere by
    its last bits, which a picture may show.
    """
    return np.asarray(np.round(offset / _STEP) * _STEP)


@dataclass(frozen=True)
class Agent:
    """The agent's pose: position (3,) of its centre in metres, degrees, AI2-THOR's frame."""

    position: NDArray[np.float64]
    rotation: float = 0.0
    horizon: float = 0.0
    standing: bool = True

    @property
    def camera(self) -> NDArray[np.float64]:
        """Position (3,) of the camera, metres."""
        lift = CAMERA_STANDING if self.standing else CAMERA_CROUCHING
        return np.asarray(self.position + np.array([0.0, lift, 0.0]))


@dataclass(frozen=True)
class Settings:
    """What ``Initialize`` sets; lengths in metres, angles in degrees."""

    grid_size: float = 0.25
    snap_to_grid: bool = True
    visibility_distance: float = 1.5
    field_of_view: float = 90.0
    rotate_step: float = 90.0
    width: int = 300
    height: int = 300
    render_depth: bool = False
    render_instances: bool = False
    render_classes: bool = False

    @property
    def draws_colors(self) -> bool:
        """Whether objects are drawn in colours of their own."""
        return self.render_instances or self.render_classes


@dataclass(frozen=True)
class ThirdPartyCamera:
    """A camera that nobody carries: (3,) metres, (3,) Unity angles and vertical degrees."""

    position: tuple[float, float, float]
    rotation: tuple[float, float, float]
    field_of_view: float


_Entry = tuple[dict[str, Any], dict[str, Any], dict[str, Any]]
_NOT_OBJECTS = frozenset(
    {"scene", "settings", "agent", "cameras", "derived", "arrangement", "looks", "base", "listed"}
)
"""What a snapshot of the objects has no copy of."""


@dataclass
class World:
    """A scene being lived in. Made by :meth:`World.load`.

    Attributes mirror AI2-THOR's object metadata, one row an object: ``position``, ``rotation``,
    ``low`` and ``high`` (corners of the axis-aligned box) are (N, 3), metres and degrees;
    ``properties`` and ``states`` are (N, P) and (N, S) bool, see :meth:`has` and :meth:`state`.
    ``untouched`` is True until something has been changed. ``base`` is how the room was arranged
    before, by ``SetObjectPoses``, if it was; it is not to be changed.
    ``remains`` are the rows of wholes that were cut up; ``disabled`` those of objects that
    ``EnableObject`` may bring back, with what lay in them. ``listed`` are the only objects that the
    metadata list, None for all.
    ``parents[i]`` are the receptacles that object i is in, innermost first as recorded.
    ``entries`` is where :mod:`er_gym.sim.metadata` keeps what it said of objects that have not
    changed since, ``looks`` where the renderer does; ``touched`` are the objects that something has
    happened to since the scene was loaded. ``derived`` holds what is worked out from the whole
    state, until it changes, and ``arrangement`` what is from where things are and whether they are
    open.
    """

    scene: Scene
    settings: Settings
    agent: Agent
    object_ids: list[str]
    names: list[str]
    types: list[str]
    asset_ids: list[str]
    position: NDArray[np.float64]
    rotation: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    obb: NDArray[np.float64]
    properties: NDArray[np.bool_]
    states: NDArray[np.bool_]
    openness: NDArray[np.float64]
    mass: NDArray[np.float64]
    exists: NDArray[np.bool_]
    temperature: list[str]
    fill_liquid: list[str | None]
    parents: list[tuple[int, ...]]
    controlled: list[tuple[int, ...] | None]
    salient_materials: list[tuple[str, ...] | None]
    held: int = -1
    remains: set[int] = field(default_factory=set)
    disabled: dict[int, tuple[int, ...]] = field(default_factory=dict)
    listed: frozenset[int] | None = None
    untouched: bool = True
    base: World | None = None
    cameras: tuple[ThirdPartyCamera, ...] = ()
    index: dict[str, int] = field(default_factory=dict)
    derived: dict[str, object] = field(default_factory=dict)
    arrangement: dict[str, object] = field(default_factory=dict)
    _displaced: set[int] = field(default_factory=set)
    _shapes: dict[int, Shape] = field(default_factory=dict)
    _samples: dict[int, NDArray[np.float64]] = field(default_factory=dict)
    entries: dict[int, _Entry] = field(default_factory=dict)
    looks: dict[int, object] = field(default_factory=dict)
    touched: set[int] = field(default_factory=set)
    _nesting: Nesting | None = None
    _by_type: Mapping[str, tuple[int, ...]] = field(default_factory=dict)

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
            properties=recorded.properties(scene),
            states=scene.states.copy(),
            openness=scene.openness.copy(),
            mass=scene.mass.copy(),
            exists=np.ones(len(scene.object_ids), dtype=bool),
            temperature=list(scene.temperature),
            fill_liquid=[None] * len(scene.object_ids),
            parents=list(recorded.parents(scene)),
            controlled=list(scene.controlled),
            salient_materials=list(scene.salient_materials),
        )
        world.index = {object_id: i for i, object_id in enumerate(world.object_ids)}
        world._nesting = recorded.nesting(scene)
        world._by_type = recorded.rows_by_type(scene)
        start = start_pose(scene.name)
        position = np.array([start.x, world.standing_height, start.z])
        world.agent = Agent(position, start.rotation)
        return world

    def snapshot(self) -> World:
        """The objects as they are now, to be restored by :meth:`become`; they are its :attr:`base`
        from now on."""
        self.base = replace(self, **_objects(self))
        return self.base

    def become(self, kept: World) -> None:
        """Put every object into the state of a snapshot of the same scene.

        The agent stays where it is. What has been worked out from where things are is shared, until
        something is moved.
        """
        for name, value in _objects(kept).items():
            setattr(self, name, value)
        self.base = kept

    # -- reading ---------------------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self.object_ids)

    def has(self, i: int, prop: str) -> bool:
        """Whether object i has a property of :data:`er_gym.sim.scene.PROPERTIES`."""
        return bool(self.properties[i, _PROPERTY[prop]])

    def state(self, i: int, name: str) -> bool:
        """Whether object i is in a state of :data:`er_gym.sim.scene.STATES`."""
        return bool(self.states[i, _STATE[name]])

    def of_type(self, *types: str) -> Iterator[int]:
        """The existing objects of some types, in scene order."""
        rows = sorted(i for name in types for i in self._by_type.get(name, ()))
        return (i for i in rows if self.exists[i])

    def find(self, object_id: str | None) -> int:
        """The row of an object.

        Raises:
            ActionFailed: there is none of that id, or it has been cut up.
        """
        i = None if object_id is None else self.index.get(object_id)
        if i is not None and i in self.remains:
            how = "sliced" if self.state(i, "isSliced") else "broken"
            raise ActionFailed(f"{object_id} is {how}: only its parts are there.")
        if i is None or not self.exists[i]:
            raise ActionFailed(f"No object with ID {object_id!r:.200} is in {self.scene.name}.")
        return i

    @property
    def ground(self) -> float:
        """Height of the floor, metres."""
        floor = self.scene.types.index("Floor")
        return float(self.scene.aabb_center[floor, 1] + self.scene.aabb_size[floor, 1] / 2)

    @property
    def standing_height(self) -> float:
        """Height of the agent's centre where it stands on the floor, metres."""
        return self.ground + AGENT_HEIGHT + start_pose(self.scene.name).lift

    @property
    def nesting(self) -> Nesting:
        """What lies in what."""
        if self._nesting is None:
            self._nesting = Nesting.of(self.parents, self.exists)
        return self._nesting

    @property
    def contents(self) -> list[list[int]]:
        """For each object, the rows of what lies in or on it."""
        return self.nesting.contents

    def ancestors(self, i: int) -> set[int]:
        """Every receptacle that object i is in, directly or through others."""
        return set(np.flatnonzero(self.nesting.within[i]).tolist())

    def inside(self, i: int) -> list[int]:
        """Everything in or on object i, directly or through others, nearest first."""
        found: list[int] = []
        todo = list(self.contents[i])
        while todo:
            child = todo.pop(0)
            if child not in found and child != i:
                found.append(child)
                todo.extend(self.contents[child])
        return found

    def is_shut(self, i: int) -> bool:
        """Whether i is a receptacle that opens and is closed now.

        A toilet never is: things stand on its cistern, not under its lid.
        """
        return (
            self.has(i, "receptacle")
            and self.has(i, "openable")
            and not self.state(i, "isOpen")
            and self.types[i] != "Toilet"
        )

    @property
    def hidden(self) -> NDArray[np.bool_]:
        """(N,) which objects lie in something shut, or are no more."""
        found = self.arrangement.get("hidden")
        if not isinstance(found, np.ndarray):
            shut = (
                self.properties[:, _PROPERTY["receptacle"]]
                & self.properties[:, _PROPERTY["openable"]]
            )
            shut &= ~self.states[:, _STATE["isOpen"]]
            shut[list(self._by_type.get("Toilet", ()))] = False
            found = ~self.exists | self.nesting.within[:, shut].any(axis=1)
            self.arrangement["hidden"] = found
        return found

    @property
    def in_hand(self) -> list[int]:
        """The held object and all that lies in it; empty when the hand is."""
        return [] if self.held < 0 else [self.held, *self.inside(self.held)]

    def displaced(self) -> list[int]:
        """Objects that may be elsewhere, or in something else, than when the scene was loaded."""
        return sorted(self._displaced)

    def _as_recorded(self, i: int) -> bool:
        return i < len(self.scene) and i not in self._displaced

    def shape(self, i: int) -> Shape:
        """What object i is made of, where it is now."""
        kept = recorded.shapes(self.scene) if self._as_recorded(i) else self._shapes
        found = kept.get(i)
        if found is None:
            found = kept[i] = shape_of(self, i)
        return found

    def obb_corners(self, i: int) -> NDArray[np.float64] | None:
        """(8, 3) corners of object i's oriented box in AI2-THOR's order, None where none is."""
        if np.isnan(self.obb[i, 0, 0]):
            return None
        turn = unity_rotation(self.rotation[i])
        corner, right, up, forward = self.obb[i] @ turn.T
        corner = corner + self.position[i]
        bottom = np.array([corner, corner + right, corner + right + forward, corner + forward])
        return np.concatenate([bottom, bottom + up])

    def sample_points(self, i: int) -> NDArray[np.float64]:
        """(P, 3) points of object i that the agent may see; :func:`points_to_see`."""
        kept = recorded.samples(self.scene) if self._as_recorded(i) else self._samples
        points = kept.get(i)
        if points is None:
            points = points_to_see(self, i)
            kept[i] = points
        return points

    def _shift(self, rows: list[int], offset: NDArray[np.float64]) -> None:
        offset = whole_steps(offset)
        self.position[rows] += offset
        self.low[rows] += offset
        self.high[rows] += offset
        self._displace(rows)

    def _touch(self, rows: Iterable[int]) -> None:
        """Forget what was said of some objects."""
        self.untouched = False
        for i in rows:
            self.touched.add(i)
            self.entries.pop(i, None)
            self.looks.pop(i, None)

    def _displace(self, rows: Iterable[int]) -> None:
        """Forget that too, and what was worked out from where they are and what they lie in."""
        rows = list(rows)
        self._touch(rows)
        self._displaced.update(rows)
        for i in rows:
            self._samples.pop(i, None)
            self._shapes.pop(i, None)

    # -- changing --------------------------------------------------------------------------------

    def changed(self) -> None:
        """Say that something is elsewhere than it was, or has been opened or shut."""
        self.restated()
        self.arrangement = {}  # not cleared: other worlds may be arranged like this, see become()

    def restated(self) -> None:
        """Say that something is in another state than it was, where it is."""
        self.untouched = False
        self.derived.clear()

    def _renested(self) -> None:
        """Say that something lies elsewhere than it did."""
        self._nesting = None
        self.changed()

    def set_state(self, i: int, name: str, value: bool) -> None:
        """Put object i into a state of :data:`er_gym.sim.scene.STATES`, or out of it."""
        self.states[i, _STATE[name]] = value
        self._touch([i, *(self.controlled[i] or ())])  # a burner glows by its knob
        if name == "isOpen":
            self.changed()
        else:
            self.restated()

    def set_temperature(self, i: int, temperature: str) -> None:
        """Make object i "Hot", "Cold" or "RoomTemp"."""
        self.temperature[i] = temperature
        self._touch([i])

    def set_mass(self, i: int, mass: float) -> None:
        """Give object i another mass, kilograms."""
        self.mass[i] = mass
        self._touch([i])
        self.restated()

    def set_property(self, i: int, name: str, value: bool) -> None:
        """Give object i a property, or take it away."""
        self.properties[i, _PROPERTY[name]] = value
        self._touch([i])
        self.changed()

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
        self.rotation[i] = settled(self.rotation[i], yaw)
        corners = self.obb_corners(i)
        if corners is not None:
            self.low[i], self.high[i] = corners.min(axis=0), corners.max(axis=0)
        self._displace([i])
        self.changed()

    def move_by(self, i: int, offset: NDArray[np.float64]) -> None:
        """Shift object i by (3,) metres, and what lies in it with it."""
        self._shift([i, *self.inside(i)], offset)
        self.changed()

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
        self.changed()

    def rename(self, i: int, object_id: str) -> None:
        """Give object i another id, which nothing else has."""
        del self.index[self.object_ids[i]]
        self.object_ids[i] = object_id
        self.index[object_id] = i
        self._touch([i, *self.parents[i], *self.contents[i]])
        self.restated()

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
        if each.name not in _NOT_OBJECTS
    }
    return {**copies, "derived": {}, "arrangement": world.arrangement, "looks": {}}
