"""The objects of the world as AI2-THOR 5 metadata.

Only ``visible``, ``isInteractable`` and ``distance`` depend on the agent. Everything else is made
for many objects at once and kept in the world's cache until the object changes. The kept values
are shared: use :func:`objects` to read or pack them and :func:`writable_objects` for a caller that
may change them.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterator, Sequence
from itertools import product
from math import isnan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.copy_on_read import CopyOnReadDict
from er_gym.sim.rotation import unity_rotation
from er_gym.sim.scene import PROPERTIES, STATES
from er_gym.sim.space.door_boxes import boxes_with_doors
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World
from er_gym.sim.world_cache import ObjectCacheKey

Entry = dict[str, Any]
Parts = tuple[Entry, Entry, Entry]
"""An object's metadata without the agent's part: all values, the single ones, the nested ones."""

_AABB_CORNERS = np.array(list(product((1.0, 0.0), repeat=3)))
"""Corners of an axis-aligned box in AI2-THOR's order, as fractions of its size."""
_OBB_CORNERS = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1], [0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]],
    dtype=float,
)
"""Corners of an oriented box in AI2-THOR's order, in edges from corner 0."""
_ENTRIES: ObjectCacheKey[Parts] = ObjectCacheKey("metadata")
_SCENES_KEPT = 128
_RECEPTACLE = PROPERTIES.index("receptacle")
_NEVER = {"canBeUsedUp": False, "isUsedUp": False}
"""AI2-THOR 5 reports these values for every object: they are placeholders in its ``SimObjPhysics``.
``UseUpObject`` works nevertheless."""


def vector(values: Sequence[float] | NDArray[np.float64]) -> dict[str, float]:
    """Three numbers as AI2-THOR writes a point or a rotation."""
    x, y, z = values.tolist() if isinstance(values, np.ndarray) else map(float, values)
    return {"x": x, "y": y, "z": z}


def box(low: NDArray[np.float64], high: NDArray[np.float64]) -> dict[str, Any]:
    """A box between two (3,) corners as AI2-THOR writes it."""
    return {
        "center": vector((low + high) / 2),
        "size": vector(high - low),
        "cornerPoints": (low + _AABB_CORNERS * (high - low)).tolist(),
    }


def objects(world: World) -> list[Entry]:
    """The metadata of every object, in scene order. The caller must not change nested values."""
    return [
        {**entry, "visible": seen, "isInteractable": seen, "distance": away}
        for (entry, _, _), seen, away in _parts(world)
    ]


def writable_objects(world: World) -> list[Entry]:
    """The same metadata, which the caller may change."""
    found: list[Entry] = []
    for (_, single, nested), seen, away in _parts(world):
        entry = CopyOnReadDict(single, visible=seen, isInteractable=seen, distance=away)
        entry.shared = nested
        found.append(entry)
    return found


def _parts(world: World) -> Iterator[tuple[Parts, bool, float]]:
    """For every listed object its metadata, whether it is visible, and its distance in metres."""
    entries = world.cache.of_objects(_ENTRIES)
    rows = _listed(world)
    stale = [i for i in rows if i not in entries]
    if world.untouched and len(stale) == len(world):
        entries.update(_as_recorded(world))
    elif stale:
        entries.update(zip(stale, _entries(world, stale), strict=True))
    seen = visible(world).tolist()
    distance = np.linalg.norm(world.position - world.agent.position, axis=1).tolist()
    return ((entries[i], seen[i], distance[i]) for i in rows)


def _listed(world: World) -> list[int]:
    """The rows that the metadata list: existing objects, and wholes that were sliced or broken."""
    listed = world.exists
    if world.remains:
        listed = listed.copy()
        listed[list(world.remains)] = True
    rows: list[int] = np.flatnonzero(listed).tolist()
    return rows if world.listed is None else [i for i in rows if i in world.listed]


_recorded: OrderedDict[str, dict[int, Parts]] = OrderedDict()


def _as_recorded(world: World) -> dict[int, Parts]:
    """The metadata of an unchanged scene, kept for recently used scenes."""
    name = world.scene.name
    if name not in _recorded:
        rows = list(range(len(world)))
        _recorded[name] = dict(zip(rows, _entries(world, rows), strict=True))
        if len(_recorded) > _SCENES_KEPT:
            _recorded.popitem(last=False)
    return _recorded[name]


def _entries(world: World, rows: list[int]) -> list[Parts]:
    """The metadata of some objects, without the values that depend on the agent."""
    low, high = (corners[rows] for corners in boxes_with_doors(world))
    turned = world.obb[rows] @ np.swapaxes(unity_rotation(world.rotation[rows]), 1, 2)
    oriented = turned[:, :1] + _OBB_CORNERS @ turned[:, 1:] + world.position[rows, None]
    columns = zip(
        rows,
        world.position[rows].tolist(),
        world.rotation[rows].tolist(),
        ((low + high) / 2).tolist(),
        (high - low).tolist(),
        (low[:, None] + _AABB_CORNERS * (high - low)[:, None]).tolist(),
        oriented.tolist(),
        world.properties[rows].tolist(),
        world.states[rows].tolist(),
        world.openness[rows].tolist(),
        world.mass[rows].tolist(),
        strict=True,
    )
    ids, contents = world.object_ids, world.contents
    made = []
    for i, at, turn, centre, size, corners, obb, has, states, openness, mass in columns:
        controlled, materials = world.controlled[i], world.salient_materials[i]
        single = {
            "name": world.names[i],
            **dict(zip(PROPERTIES, has, strict=True)),
            **dict(zip(STATES, states, strict=True)),
            **_NEVER,
            "openness": openness,
            "fillLiquid": world.fill_liquid[i],
            "temperature": world.temperature[i],
            "mass": mass,
            "objectType": world.types[i],
            "objectId": ids[i],
            "assetId": world.asset_ids[i],
            "isPickedUp": world.is_held(i),
            "isMoving": False,
        }
        nested = {
            "position": dict(zip("xyz", at, strict=True)),
            "rotation": dict(zip("xyz", turn, strict=True)),
            "salientMaterials": None if materials is None else list(materials),
            "receptacleObjectIds": [ids[c] for c in contents[i]] if has[_RECEPTACLE] else None,
            "parentReceptacles": [ids[p] for p in world.parents[i]] or None,
            "controlledObjects": None if controlled is None else [ids[c] for c in controlled],
            "axisAlignedBoundingBox": {
                "center": dict(zip("xyz", centre, strict=True)),
                "size": dict(zip("xyz", size, strict=True)),
                "cornerPoints": corners,
            },
            "objectOrientedBoundingBox": (None if isnan(obb[0][0]) else {"cornerPoints": obb}),
        }
        made.append(({**single, **nested}, single, nested))
    return made
