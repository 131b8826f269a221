"""The points of an object that make it visible if the agent sees one of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.rotation import unity_rotation
from er_gym.sim.scene_objects import SceneObjects
from er_gym.sim.space.solids.built_in import hosts
from er_gym.sim.space.solids.carcass import carcass
from er_gym.sim.space.solids.kept_until_moved import kept_until_moved
from er_gym.sim.space.solids.solid import upright_box
from er_gym.sim.space.solids.surface_points import (
    INSET,
    ROUND,
    points_on_face,
    points_on_top,
    surface_fractions,
)

SEEN_FROM_OUTSIDE = ("Drawer", "Cabinet", "CounterTop", "StoveBurner", "Wall")
"""Types that are seen only from outside: their own boxes hide the points on their far sides."""
SLABS = (
    "CounterTop", "Desk", "CoffeeTable", "SideTable", "DiningTable", "Dresser", "TVStand", "Sofa",
    "ArmChair", "Bed", "Sink",
)  # fmt: skip
"""Types that hide the objects on them from a camera below or behind them.

Objects in other receptacles, such as a bowl or a bin, are in the middle of their boxes.
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
"""Round types that cannot be picked up."""
_SQUARE = frozenset(
    {"Book", "Box", "CellPhone", "Cloth", "Laptop", "Newspaper", "Pillow", "TissueBox", "Towel"}
)
"""Types that can be picked up and fill their boxes."""
_OUT = 0.01
"""Distance of the points from the faces of types seen only from outside, metres."""
_BOARD = 0.015
"""How far below a shelf's upper side the points on its edges lie, metres."""
_CLOSE = 0.2
"""Distance between the points of a front, metres: the agent stands close to it."""
Floats = NDArray[np.float64]


@kept_until_moved("sample points")
def sample_points(world: SceneObjects, i: int) -> Floats:
    """(P, 3) points of object i, world frame, metres.

    The object is visible if the agent sees any of them. Their number does not depend on where the
    object is or in which state. Most objects have points all over their boxes, which are the
    oriented ones where recorded. A built-in object has points on its front, a shelf on its board.
    """
    kind = world.types[i]
    if kind == "Floor":
        return points_on_top(np.array([world.low[i], world.high[i]]))
    if kind == "Wall" and world.scene.shell is not None:
        return np.concatenate([_both_sides(box) for box in world.scene.shell.walls[i]])
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
    """The front. An open drawer also has its upper side, which an agent that opened it looks down
    on."""
    front, top = _front(box), points_on_face(box, 1, 1, _OUT)
    return np.concatenate([front, top if is_open else np.resize(front, top.shape)])


def _cabinet(box: Floats, built_in: bool) -> Floats:
    """The front, and every side but the back of a cabinet that is not built in."""
    if built_in:
        return _front(box)
    # Every other point of the sides will do: each point costs time, and the front is mostly seen.
    sides = [points_on_face(box, axis, sign, _OUT)[::2] for axis in (0, 1) for sign in (-1, 1)]
    return np.concatenate([_front(box), *sides])


def _shelf(box: Floats, built_in: bool) -> Floats:
    """The upper side and the edges of the board under the space that the record calls a shelf."""
    board = box.copy()
    board[:, 1] = box[0, 1] - 2 * _BOARD, box[0, 1]
    return _slab(board, 0.005, 0.0)


_POINTS_FROM_OUTSIDE = {"Cabinet": _cabinet, "Shelf": _shelf}


def _both_sides(box: Floats) -> Floats:
    """Points on the two large sides of a piece of wall."""
    axis = 0 if box[1, 0] - box[0, 0] < box[1, 2] - box[0, 2] else 2
    return np.concatenate([points_on_face(box, axis, sign, _OUT, 2.0) for sign in (-1, 1)])


def _slab(box: Floats, above: float = _OUT, out: float = _OUT) -> Floats:
    """Points on the upper side of a flat box, and one row along each of its edges."""
    top = points_on_face(box, 1, 1, above)
    rows = []
    for axis in (0, 2):
        for edge, beyond in ((box[0, axis], -out), (box[1, axis], out)):
            nearest = np.abs(top[:, axis] - edge)
            row = top[nearest < nearest.min() + 1e-9].copy()
            row[:, axis], row[:, 1] = edge + beyond, box[:, 1].mean()
            rows.append(row)
    return np.concatenate([top, *rows])
