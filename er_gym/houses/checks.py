"""What can be wrong with a house."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from er_gym.sim.house.build import house_scene
from er_gym.sim.scene import Scene

_DEEP = 0.01
"""How far two boxes may reach into each other, metres."""
_FLAT = frozenset({"Floor", "Wall", "Doorway", "Doorframe", "Window"})
_LEAST = 0.5
"""The least floor in each room on which the agent can stand, square metres."""


def problems(house: Mapping[str, Any]) -> list[str]:
    """What is wrong with a house that can be built: rooms that the agent cannot enter, and things
    that stand inside others, outside of the house, or in a wall."""
    scene = house_scene(house)
    return [*_closed_rooms(scene), *_inside_others(scene)]


def _closed_rooms(scene: Scene) -> Iterator[str]:
    assert scene.shell is not None
    x, z = scene.reachable.T
    for room in scene.shell.rooms:
        area = np.count_nonzero(room.contains(x, z)) * 0.25**2
        if area < _LEAST:
            yield f"the agent cannot walk in {room.id} ({area:.2f} m2)"


def _inside_others(scene: Scene) -> Iterator[str]:
    half = scene.aabb_size / 2
    low, high = scene.aabb_center - half, scene.aabb_center + half
    rows = [i for i, kind in enumerate(scene.types) if kind not in _FLAT]
    own = [_whole(scene.object_ids[i]) for i in range(len(scene))]
    for number, i in enumerate(rows):
        for k in rows[number + 1 :]:
            related = own[i] == own[k] or _holds(scene, own, i, k) or _holds(scene, own, k, i)
            if (
                not related
                and (np.minimum(high[i], high[k]) - np.maximum(low[i], low[k]) > _DEEP).all()
            ):
                yield f"{scene.object_ids[i]} and {scene.object_ids[k]} are inside each other"
    assert scene.shell is not None
    for boxes in scene.shell.walls.values():
        for wall_low, wall_high in boxes:
            deep = (np.minimum(high, wall_high) - np.maximum(low, wall_low)).min(axis=1)
            for i in rows:
                if deep[i] > _DEEP:
                    yield f"{scene.object_ids[i]} stands in a wall"


def _holds(scene: Scene, own: list[str], outer: int, inner: int) -> bool:
    """Whether an object lies in another one, or in a part of it."""
    return any(own[p] == own[outer] for p in scene.parents[inner])


def _whole(object_id: str) -> str:
    """The id of the object that a part belongs to."""
    return "|".join(object_id.split("|")[:4])
