"""The solid of one object: the boxes that it is made of, where it is now."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.rotation import unity_rotation
from er_gym.sim.scene_objects import SceneObjects
from er_gym.sim.space.recorded_surfaces import recorded_surfaces
from er_gym.sim.space.solids.box_transforms import trimmed, turned
from er_gym.sim.space.solids.carcass import carcass
from er_gym.sim.space.solids.counter_tops import rectangles
from er_gym.sim.space.solids.facing import facings
from er_gym.sim.space.solids.families import family, parts
from er_gym.sim.space.solids.kept_until_moved import kept_until_moved

_HOB, _UNDER = 0.03, 0.004
"""How much wider than its burners a stove is at least, and how far it is below them, metres."""


@dataclass(frozen=True)
class Solid:
    """The boxes that an object is made of; metres.

    Attributes:
        middle: (3,) middle of its box, world frame.
        yaw: heading of its front, degrees.
        upright: (K, 2, 3) corners of its parts about ``middle``, before the turn by ``yaw``.
        boxes: (K, 2, 3) the parts as axis-aligned boxes of the world (see
            :func:`er_gym.sim.space.solids.box_transforms.turned`).
        hiding: (H, 2, 3) boxes of the world that hide what is behind them.
    """

    middle: NDArray[np.float64]
    yaw: float
    upright: NDArray[np.float64]
    boxes: NDArray[np.float64]
    hiding: NDArray[np.float64]


@kept_until_moved("solids")
def solid_of(world: SceneObjects, i: int) -> Solid:
    """The solid of object i at its present place."""
    if world.types[i] == "CounterTop" and i < len(world.scene):
        return _counter(world, i)
    walls = {} if world.scene.shell is None else world.scene.shell.walls
    if i in walls:
        middle = (world.low[i] + world.high[i]) / 2
        return Solid(middle, 0.0, walls[i] - middle, walls[i], walls[i])
    if world.types[i] == "StoveBurner" and i == next(world.of_type("StoveBurner")):
        return _with_stove(world, i)
    return _of_family(world, i)


def _of_family(world: SceneObjects, i: int) -> Solid:
    middle, size, yaw = upright_box(world, i)
    standing = recorded_surfaces(world.scene.name).get(i)
    made_of, hiding = parts(
        world.types[i],
        world.has(i, "pickupable"),
        tuple(size.round(3).tolist()),
        None if standing is None else round(min(max(standing, 0.0), size[1]), 3),
    )
    upright = made_of - size / 2
    boxes = turned(np.concatenate([upright, hiding - size / 2]), yaw) + middle
    hides = boxes[len(upright) :]
    if not family(world.types[i], world.has(i, "pickupable")).snug:
        hides = trimmed(hides)
    return Solid(middle, yaw, upright, boxes[: len(upright)], hides)


def upright_box(
    world: SceneObjects, i: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Middle (3,), size (3,) and heading of object i's box; the size is that before the turn."""
    if np.isnan(world.obb[i, 0, 0]):
        fronts = facings(world.scene.name)
        yaw = float(fronts[i]) if i < len(fronts) else 0.0
        size = world.high[i] - world.low[i]
        size = size[[2, 1, 0]] if round(yaw / 90.0) % 2 else size
        return (world.low[i] + world.high[i]) / 2, size, yaw
    x, yaw, z = world.rotation[i].tolist()
    tilt, turn = unity_rotation((x, 0.0, z)), unity_rotation((0.0, yaw, 0.0))
    corner, *edges = world.obb[i] @ tilt.T
    middle = world.position[i] + turn @ (corner + sum(edges) / 2)
    return middle, np.abs(edges).sum(axis=0), yaw


def _with_stove(world: SceneObjects, i: int) -> Solid:
    """A burner. The first one of a kitchen also stands for the stove, which is not an object.

    The stove hides what is behind it, from the floor to just below the burners. It is a little
    wider than they are.
    """
    burner, rows = _of_family(world, i), list(world.of_type("StoveBurner"))
    low, high = world.low[rows].min(axis=0), world.high[rows].max(axis=0)
    stove = np.array([low, high]) + np.array([[-_HOB, 0.0, -_HOB], [_HOB, 0.0, _HOB]])
    stove[:, 1] = world.high[next(world.of_type("Floor")), 1], low[1] - _UNDER
    return replace(burner, hiding=stove[None])


def _counter(world: SceneObjects, i: int) -> Solid:
    """A counter without the area where the agent walks. Its slab and its carcass hide things."""
    middle = (world.low[i] + world.high[i]) / 2
    tops = rectangles(world.scene.name, i)
    boxes = np.empty((len(tops), 2, 3))
    boxes[:, :, [0, 2]] = tops
    boxes[:, 0, 1], boxes[:, 1, 1] = world.low[i, 1], world.high[i, 1]
    return Solid(middle, 0.0, boxes - middle, boxes, carcass(world.scene.name, i).hiding)
