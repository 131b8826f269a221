"""The objects of a scene as they are now: poses, states, and which receptacles they are in.

Struct of arrays: row ``i`` of every array is object ``i``. No row is ever removed. An object that
has left the scene (a whole apple after slicing) has ``exists[i]`` False.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.agent import AGENT_HEIGHT
from er_gym.sim.errors import ActionFailed
from er_gym.sim.nesting import Nesting
from er_gym.sim.rotation import unity_rotation
from er_gym.sim.scene import PROPERTIES, STATES, Scene
from er_gym.sim.start_pose import start_pose
from er_gym.sim.world_cache import CacheKey, WorldCache

PROPERTY_COLUMN = {name: column for column, name in enumerate(PROPERTIES)}
STATE_COLUMN = {name: column for column, name in enumerate(STATES)}
_HIDDEN: CacheKey[NDArray[np.bool_]] = CacheKey("hidden objects")


@dataclass(kw_only=True)
class SceneObjects:
    """The objects of a scene, to be read. :class:`er_gym.sim.world.World` can change them.

    Most attributes mirror AI2-THOR's object metadata. N is the number of objects.

    Attributes:
        scene: the scene as recorded.
        object_ids, names, types, asset_ids: N strings each.
        position, rotation: (N, 3) metres and Unity's Euler angles in degrees.
        low, high: (N, 3) corners of the axis-aligned boxes, metres.
        obb: (N, 4, 3) oriented boxes, as :class:`er_gym.sim.scene.Scene` has them.
        properties, states: (N, P) and (N, S) bool; see :meth:`has` and :meth:`state`.
        openness: (N,) 0 closed to 1 open.
        mass: (N,) kilograms.
        exists: (N,) whether the object is in the scene.
        temperature, fill_liquid: N strings each; the liquid of an unfilled object is None.
        parents: for each object the receptacles that it is in, innermost first as recorded.
        controlled: for each object the rows that it switches, None for what cannot be toggled.
        salient_materials: for each object its materials, None where none is recorded.
        held: row of the object in the acting agent's hand, -1 if the hand is empty.
        held_elsewhere: rows of the objects in other agents' hands.
        remains: rows of wholes that were sliced or broken. The metadata still list them.
        disabled: rows that ``EnableObject`` can bring back, with the rows of their contents.
        listed: the only rows that the metadata list, None for all.
        untouched: True until something has changed.
        touched: rows of the objects that have changed since the scene was loaded.
        index: rows by object id.
        cache: what readers have computed from all this.
    """

    scene: Scene
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
    held_elsewhere: tuple[int, ...] = ()
    remains: set[int] = field(default_factory=set)
    disabled: dict[int, tuple[int, ...]] = field(default_factory=dict)
    listed: frozenset[int] | None = None
    untouched: bool = True
    touched: set[int] = field(default_factory=set)
    index: dict[str, int] = field(default_factory=dict)
    cache: WorldCache = field(default_factory=WorldCache)
    _displaced: set[int] = field(default_factory=set)
    _nesting: Nesting | None = None
    _by_type: Mapping[str, tuple[int, ...]] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.object_ids)

    def has(self, i: int, prop: str) -> bool:
        """Whether object i has a property of :data:`er_gym.sim.scene.PROPERTIES`."""
        return bool(self.properties[i, PROPERTY_COLUMN[prop]])

    def state(self, i: int, name: str) -> bool:
        """Whether object i is in a state of :data:`er_gym.sim.scene.STATES`."""
        return bool(self.states[i, STATE_COLUMN[name]])

    def of_type(self, *types: str) -> Iterator[int]:
        """The existing objects of some types, in scene order."""
        rows = sorted(i for name in types for i in self._by_type.get(name, ()))
        return (i for i in rows if self.exists[i])

    def find(self, object_id: str | None) -> int:
        """The row of an object.

        Raises:
            ActionFailed: no object has that id, or the object has been sliced or broken.
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
        """Which objects contain which."""
        if self._nesting is None:
            self._nesting = Nesting.of(self.parents, self.exists)
        return self._nesting

    @property
    def contents(self) -> list[list[int]]:
        """For each object, the rows of the objects in or on it."""
        return self.nesting.contents

    def ancestors(self, i: int) -> set[int]:
        """Every receptacle that object i is in, directly or through others."""
        return set(np.flatnonzero(self.nesting.within[i]).tolist())

    def inside(self, i: int) -> list[int]:
        """The rows of all objects in or on object i, directly or through others, nearest first."""
        found: list[int] = []
        todo = list(self.contents[i])
        while todo:
            child = todo.pop(0)
            if child not in found and child != i:
                found.append(child)
                todo.extend(self.contents[child])
        return found

    def is_shut(self, i: int) -> bool:
        """Whether object i is a receptacle that can be opened and is closed now.

        A toilet never is, because things stand on its cistern and not under its lid.
        """
        return (
            self.has(i, "receptacle")
            and self.has(i, "openable")
            and not self.state(i, "isOpen")
            and self.types[i] != "Toilet"
        )

    @property
    def hidden(self) -> NDArray[np.bool_]:
        """(N,) objects that are in something closed, or out of the scene."""
        found = self.cache.arrangement.get(_HIDDEN)
        if found is None:
            shut = (
                self.properties[:, PROPERTY_COLUMN["receptacle"]]
                & self.properties[:, PROPERTY_COLUMN["openable"]]
            )
            shut &= ~self.states[:, STATE_COLUMN["isOpen"]]
            shut[list(self._by_type.get("Toilet", ()))] = False
            found = ~self.exists | self.nesting.within[:, shut].any(axis=1)
            self.cache.arrangement.put(_HIDDEN, found)
        return found

    @property
    def in_hand(self) -> list[int]:
        """What the acting agent holds and all objects in it; empty when the hand is."""
        return [] if self.held < 0 else [self.held, *self.inside(self.held)]

    @property
    def carried(self) -> list[int]:
        """What any agent holds and all objects in it."""
        if not self.held_elsewhere:
            return self.in_hand
        return [*self.in_hand, *(k for i in self.held_elsewhere for k in (i, *self.inside(i)))]

    def is_held(self, i: int) -> bool:
        """Whether object i itself is in the hand of any agent."""
        return i == self.held or i in self.held_elsewhere

    def displaced(self) -> list[int]:
        """Rows of the objects that have been moved, or put into another receptacle, since the scene
        was loaded."""
        return sorted(self._displaced)

    def is_where_recorded(self, i: int) -> bool:
        """Whether object i has never been moved, so that all knowledge about its recorded pose
        holds."""
        return i < len(self.scene) and i not in self._displaced

    def obb_corners(self, i: int) -> NDArray[np.float64] | None:
        """(8, 3) corners of object i's oriented box in AI2-THOR's order, None if it has none."""
        if np.isnan(self.obb[i, 0, 0]):
            return None
        turn = unity_rotation(self.rotation[i])
        corner, right, up, forward = self.obb[i] @ turn.T
        corner = corner + self.position[i]
        bottom = np.array([corner, corner + right, corner + right + forward, corner + forward])
        return np.concatenate([bottom, bottom + up])
