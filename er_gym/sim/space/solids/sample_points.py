"""What of a thing is looked for when one asks whether it is visible."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import Scene
from er_gym.sim.scene_objects import SceneObjects
from er_gym.sim.space.rotation import unity_rotation
from er_gym.sim.space.solids.built_in import hosts
from er_gym.sim.space.solids.carcass import carcass
from er_gym.sim.space.solids.solid import upright_box
from er_gym.sim.space.solids.surface_points import (
    INSET,
    ROUND,
    points_on_face,
    points_on_top,
    surface_fractions,
)
from er_gym.sim.world_cache import ObjectCacheKey

SEEN_FROM_OUTSIDE = ("Drawer", "Cabinet", "CounterTop", "StoveBurner")
"""Types that are seen from outside only: their own boxes hide the points on their far sides."""
SLABS = (
    "CounterTop", "Desk", "CoffeeTable", "SideTable", "DiningTable", "Dresser", "TVStand", "Sofa",
    "ArmChair", "Bed", "Sink",
)  # fmt: skip
"""Types that hide what lies on them from who looks from below or behind.

What lies in other things, a bowl or a bin, is in the midst of their boxes.
"""
_ROUND = frozenset(
    {
        "Faucet",
        "FloorLamp",
        "DeskLamp",
        "GarbageCan",
        "HousePlant",
        "StoveBurner",
        "StoveKnob",
        "Toilet",
    }
)
"""What is round though it cannot be carried."""
_SQUARE = frozenset(
    {"Book", "Box", "CellPhone", "Cloth", "Laptop", "Newspaper", "Pillow", "TissueBox", "Towel"}
)
"""What fills its box though it can be carried."""
_OUT = 0.01
"""How far before their faces the points of solid things lie, metres."""
_BOARD = 0.015
"""How far below its upper side one looks for the edges of a shelf, metres."""
_CLOSE = 0.2
"""How far apart the points of a front are, metres: one stands close to it."""
Floats = NDArray[np.float64]


_SAMPLE_POINTS: ObjectCacheKey[Floats] = ObjectCacheKey("sample points", until_moved=True)


@lru_cache(maxsize=128)
def _recorded_points(scene: Scene) -> dict[int, Floats]:
    """The points of a scene's objects where they are recorded, filled by :func:`sample_points`."""
    return {}


def sample_points(world: SceneObjects, i: int) -> Floats:
    """(P, 3) points of object i, world frame, metres; kept until the object moves.

    The object is visible if the agent sees any of them. Their number does not depend on where the
    object is or in which state.
    """
    recorded = world.is_where_recorded(i)
    kept = _recorded_points(world.scene) if recorded else world.cache.of_objects(_SAMPLE_POINTS)
    points = kept.get(i)
    if points is None:
        points = kept[i] = _make_points(world, i)
    return points


def _make_points(world: SceneObjects, i: int) -> Floats:
    """(P, 3) points of object i, world frame, metres: as many wherever it is and however it is.

    Most things are looked for all over their boxes, the oriented ones where recorded; of what is
    built in one sees the front, of a shelf the board.
    """
    kind = world.types[i]
    if kind == "Floor":
        return points_on_top(np.array([world.low[i], world.high[i]]))
    if kind == "CounterTop" and i < len(world.scene):
        return np.concatenate([_slab(box) for box in carcass(world.scene.name, i).slab])
    if kind == "Drawer" or kind in _POINTS_FROM_OUTSIDE:
        middle, size, yaw = upright_box(world, i)
        built_in = i in hosts(world.scene.name)
        box = np.array([-size / 2, size / 2])
        if kind == "Drawer":
            points: Floats = _drawer(box, world.state(i, "isOpen"))
        else:
            points = _POINTS_FROM_OUTSIDE[kind](box, built_in)
        return np.asarray(points @ unity_rotation((0.0, yaw, 0.0)).T + middle)
    inset = INSET
    if kind in _ROUND or (kind not in _SQUARE and world.has(i, "pickupable")):
        inset = ROUND
    if np.isnan(world.obb[i, 0, 0]):
        size = world.high[i] - world.low[i]
        return np.asarray(world.low[i] + surface_fractions(size, inset) * size)
    corner, edges = world.obb[i, 0], world.obb[i, 1:]
    points = corner + surface_fractions(np.linalg.norm(edges, axis=1), inset) @ edges
    return np.asarray(points @ unity_rotation(world.rotation[i]).T + world.position[i])


def _front(box: Floats) -> Floats:
    return points_on_face(box, 2, 1, _OUT, _CLOSE)


def _drawer(box: Floats, is_open: bool) -> Floats:
    """The front; of one that is open also the upper side, which whoever opened it looks down on."""
    front, top = _front(box), points_on_face(box, 1, 1, _OUT)
    return np.concatenate([front, top if is_open else np.resize(front, top.shape)])


def _cabinet(box: Floats, built_in: bool) -> Floats:
    """The front, and all but the back of one that is not built in."""
    if built_in:
        return _front(box)
    # Every other one: the front is what shows, and each point costs time.
    sides = [points_on_face(box, axis, sign, _OUT)[::2] for axis in (0, 1) for sign in (-1, 1)]
    return np.concatenate([_front(box), *sides])


def _shelf(box: Floats, built_in: bool) -> Floats:
    """The upper side of the board that the room above it is named after, and its edges."""
    board = box.copy()
    board[:, 1] = box[0, 1] - 2 * _BOARD, box[0, 1]
    return _slab(board, 0.005, 0.0)


_POINTS_FROM_OUTSIDE = {"Cabinet": _cabinet, "Shelf": _shelf}


def _slab(box: Floats, above: float = _OUT, out: float = _OUT) -> Floats:
    """Points on the upper side of something flat, and one row along each of its edges."""
    top = points_on_face(box, 1, 1, above)
    rows = []
    for axis in (0, 2):
        for edge, beyond in ((box[0, axis], -out), (box[1, axis], out)):
            nearest = np.abs(top[:, axis] - edge)
            row = top[nearest < nearest.min() + 1e-9].copy()
            row[:, axis], row[:, 1] = edge + beyond, box[:, 1].mean()
            rows.append(row)
    return np.concatenate([top, *rows])
