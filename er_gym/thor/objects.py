"""The objects of an AI2-THOR event as arrays.

The environment judges all objects at every step, which is faster with arrays than with a dictionary
for each object. An event of the embedded engine hands over the engine's own arrays, so its metadata
need not be made. An event of Unity is read entry by entry.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.initial_state import USED_UP
from er_gym.sim.lazy_metadata import LazyMetadata
from er_gym.sim.metadata import inventory
from er_gym.sim.object_metadata import objects
from er_gym.sim.remembering import get_or_compute
from er_gym.sim.scene import PROPERTIES, STATES, Scene
from er_gym.sim.space.door_boxes import boxes_with_doors
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World
from er_gym.sim.world_cache import CacheKey
from er_gym.thor.object_types import OBJECT_TYPES

TYPES = tuple(OBJECT_TYPES)
"""Object types by number."""
KIND_OF = {name: number for number, name in enumerate(TYPES)}
PROPERTY_OF_STATE: Mapping[str, str] = {
    "isOpen": "openable",
    "isToggled": "toggleable",
    "isBroken": "breakable",
    "isSliced": "sliceable",
    "isCooked": "cookable",
    "isDirty": "dirtyable",
    "isFilledWithLiquid": "canFillWithLiquid",
}
"""AI2-THOR's states, each with the property of the objects that can have it. ``isUsedUp`` is left
out, since it is False for every object in AI2-THOR's metadata."""
_STATES = tuple(PROPERTY_OF_STATE)
ENTRY_KEYS = frozenset(
    {"objectId", "objectType", "isPickedUp", "parentReceptacles", "isOpen", "isToggled"}
)
"""The keys of the entries that :meth:`ObjectTable.entries` returns."""


@dataclass(frozen=True, eq=False)
class ObjectTable:
    """The N objects of a scene in one state, in scene order. The agent's pose does not matter.

    The engine returns the same table until something other than the agent changes. Arrays are
    read-only by agreement. Two kinds of objects are left out: objects of types that are not in
    :data:`OBJECT_TYPES`, and whole objects of which only parts are left (:func:`is_present`).

    Attributes:
        ids: the ``objectId`` of each object.
        row: object id to row.
        kinds: (N,) the index of each object's type in :data:`TYPES`.
        has: (N,) bool for each of AI2-THOR's properties and each state of
            :data:`PROPERTY_OF_STATE`, by its name in the metadata: ``"pickupable"``, ``"isOpen"``.
            ``canBeUsedUp`` comes from the type, since it is False for every object in the metadata.
        centre: (N, 3) the centre of each object's axis-aligned box, world frame, metres.
        size: (N, 3) the size of each object's axis-aligned box, metres.
        parents: the rows of the receptacles in which each object lies, innermost first.
        contents: the rows of the objects that lie in each object.
        controlled: the rows of the objects that each object controls, as a stove knob controls its
            burner.
        held: the row of the object in the agent's hand, -1 if the hand is empty.
        derived: a cache of what follows from all attributes except ``centre``. Tables share it if
            they differ only in that.
    """

    ids: tuple[str, ...]
    row: Mapping[str, int]
    kinds: NDArray[np.intp]
    has: Mapping[str, NDArray[np.bool_]]
    centre: NDArray[np.float64]
    size: NDArray[np.float64]
    parents: Sequence[Sequence[int]]
    contents: Sequence[Sequence[int]]
    controlled: Sequence[Sequence[int]]
    held: int
    derived: dict[str, object] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.ids)

    def type_of(self, k: int) -> str:
        """The type of object k."""
        return TYPES[int(self.kinds[k])]

    def of_type(self, object_type: str) -> list[int]:
        """The rows of all objects of a type, in scene order."""
        kind = KIND_OF.get(object_type, -1)
        return np.flatnonzero(self.kinds == kind).tolist()

    def entries(self, object_types: Iterable[str]) -> list[dict[str, Any]]:
        """Parts of the metadata of the objects of some types, and of the receptacles they lie in.

        :data:`ENTRY_KEYS` lists the keys. The whole metadata takes a hundred times as long to make.
        """
        rows = [row for name in set(object_types) for row in self.of_type(name)]
        holders = {holder for k in rows for holder in self.parents[k]}
        return [
            {
                "objectId": self.ids[k],
                "objectType": self.type_of(k),
                "isPickedUp": k == self.held,
                "parentReceptacles": [self.ids[holder] for holder in self.parents[k]],
                "isOpen": bool(self.has["isOpen"][k]),
                "isToggled": bool(self.has["isToggled"][k]),
            }
            for k in sorted({*rows, *holders})
        ]

    @cached_property
    def volume(self) -> NDArray[np.float64]:
        """(N,) the volume of each object's axis-aligned box, m³."""
        return np.asarray(self.size[:, 0] * self.size[:, 1] * self.size[:, 2])

    @cached_property
    def face(self) -> NDArray[np.float64]:
        """(N,) the area of the largest face of each object's axis-aligned box, m²."""
        x, y, z = self.size.T
        return np.asarray(np.maximum(np.maximum(x * y, y * z), x * z))


def is_present(entry: Mapping[str, Any]) -> bool:
    """Whether an object of the metadata can be found in the scene.

    AI2-THOR still lists an object that was sliced, and an egg that was broken. The parts are
    objects of their own.
    """
    if entry.get("isSliced"):
        return False
    return not (entry.get("isBroken") and entry["objectType"] == "Egg")


_STATE_COLUMNS = [STATES.index(name) for name in _STATES]
_Seen = tuple[ObjectTable, NDArray[np.bool_], NDArray[np.bool_]]


def objects_of(event: Any) -> _Seen:
    """The objects of an event, (N,) whether each is visible, and (N,) whether it is interactable.

    In Unity an object behind glass is visible but not interactable. The embedded engine has no such
    objects: there, the two are the same.
    """
    metadata = event.metadata
    if isinstance(metadata, LazyMetadata):
        world = metadata.source
        if isinstance(world, World) and _is_whole(world):
            return _of_world_seen(world)
    return _of_entries(metadata)


def objects_in(world: World) -> _Seen:
    """The same for the embedded engine's world as it is now."""
    if _is_whole(world):
        return _of_world_seen(world)
    # Something has been sliced, broken or taken away.
    return _of_entries({"objects": objects(world), "inventoryObjects": inventory(world)})


def _is_whole(world: World) -> bool:
    """Whether the table can be read off the world: nothing has been taken away, nor added to a
    house."""
    return bool(world.exists.all()) and (
        world.scene.shell is None or len(world) == len(world.scene)
    )


def _of_world_seen(world: World) -> _Seen:
    table, seen = _of_world(world), visible(world)
    if len(table) < len(seen):
        seen = seen[: len(table)]
    return table, seen, seen


def _of_entries(metadata: Mapping[str, Any]) -> _Seen:
    entries = [e for e in metadata["objects"] if e["objectType"] in KIND_OF and is_present(e)]
    ids = tuple(e["objectId"] for e in entries)
    row = {object_id: k for k, object_id in enumerate(ids)}

    def rows(name: str) -> list[tuple[int, ...]]:
        return [tuple(row[i] for i in entry[name] or () if i in row) for entry in entries]

    def box(name: str) -> NDArray[np.float64]:
        boxes = [entry["axisAlignedBoundingBox"][name] for entry in entries]
        return np.array([(b["x"], b["y"], b["z"]) for b in boxes]).reshape(-1, 3)

    has = {
        name: np.array([bool(e.get(name)) for e in entries], dtype=bool)
        for name in (*PROPERTIES, *_STATES)
    }
    has["canBeUsedUp"] = np.array([e["objectType"] in USED_UP for e in entries], dtype=bool)
    held = metadata["inventoryObjects"]
    table = ObjectTable(
        ids=ids,
        row=row,
        kinds=np.array([KIND_OF[e["objectType"]] for e in entries], dtype=np.intp),
        centre=box("center"),
        size=box("size"),
        parents=rows("parentReceptacles"),
        contents=rows("receptacleObjectIds"),
        controlled=rows("controlledObjects"),
        held=row.get(held[0]["objectId"], -1) if held else -1,
        has=has,
    )
    seen, in_reach = (
        np.array([bool(entry[name]) for entry in entries], dtype=bool)
        for name in ("visible", "isInteractable")
    )
    return table, seen, in_reach


@dataclass(frozen=True, eq=False)
class _Names:
    """The part of a table that does not depend on the state of the objects."""

    ids: tuple[str, ...]
    row: Mapping[str, int]
    kinds: NDArray[np.intp]
    controlled: tuple[tuple[int, ...], ...]

    @staticmethod
    def of(source: Scene | World) -> _Names:
        ids = tuple(source.object_ids)
        types = source.types
        if not KIND_OF.keys() >= set(types):  # the walls and doors of a house come last
            types = types[: next(k for k, name in enumerate(types) if name not in KIND_OF)]
            ids = ids[: len(types)]
        return _Names(
            ids=ids,
            row={object_id: k for k, object_id in enumerate(ids)},
            kinds=np.array([KIND_OF[name] for name in types], dtype=np.intp),
            controlled=tuple(tuple(rows or ()) for rows in source.controlled[: len(types)]),
        )


@lru_cache(maxsize=128)
def _recorded_names(scene: Scene) -> _Names:
    return _Names.of(scene)


def _names(world: World) -> _Names:
    recorded = _recorded_names(world.scene)
    # Tuples of the same string objects are compared by identity, so this costs next to nothing.
    ids = tuple(world.object_ids)
    if len(recorded.ids) < len(world.scene):
        ids = ids[: len(recorded.ids)]
    return recorded if ids == recorded.ids else _Names.of(world)


_DERIVED_KEPT = 1024
"""What follows from so many tables is kept in a process, some 15 KB each."""
_derived: OrderedDict[Any, dict[str, object]] = OrderedDict()
_TABLE: CacheKey[ObjectTable] = CacheKey("object table")


def _of_world(world: World) -> ObjectTable:
    """The table of the world's present state; cached until the world changes."""
    found = world.cache.state.get(_TABLE)
    if found is None:
        found = world.cache.state.put(_TABLE, _table(world))
    elif world.held >= 0:  # the held object moves with the agent
        low, high = boxes_with_doors(world)
        found = replace(found, centre=((low + high) / 2)[: len(found)])
    return found


def _table(world: World) -> ObjectTable:
    names = _names(world)
    low, high = boxes_with_doors(world)
    flags = np.concatenate([world.properties, world.states[:, _STATE_COLUMNS]], axis=1).T.copy()
    parents, size, contents = tuple(world.parents), high - low, world.contents
    count = len(names.ids)
    if count < len(world):
        flags, size = flags[:, :count].copy(), size[:count]
        parents, contents = parents[:count], contents[:count]
    all_but_centre = (names.ids, flags.tobytes(), size.tobytes(), parents, world.held)
    return ObjectTable(
        ids=names.ids,
        row=names.row,
        kinds=names.kinds,
        has=dict(zip((*PROPERTIES, *_STATES), flags, strict=True)),
        centre=((low + high) / 2)[:count],
        size=size,
        parents=parents,
        contents=contents,
        controlled=names.controlled,
        held=world.held,
        derived=get_or_compute(_derived, all_but_centre, _DERIVED_KEPT, dict),
    )
