"""Axis-aligned boxes with open doors, as AI2-THOR reports them.

AI2-THOR's axis-aligned box encloses all colliders of an object, including an open door. Visibility
and collisions do not use these boxes: they use the object's solid, without the door.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.solids import solid_of
from er_gym.sim.world import World

_SWINGING = ("Fridge",)
"""Types whose door is as wide as they are and opens by a quarter turn. Cabinets are left out: they
have one door or two, and the record does not say which. The same holds for other swinging doors."""
_QUARTER = np.pi / 2


def boxes_with_doors(world: World) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """(N, 3) corners of the axis-aligned boxes of all objects, open doors included, metres."""
    ajar = [i for i in world.of_type(*_SWINGING) if world.openness[i] > 0.0]
    if not ajar:
        return world.low, world.high
    low, high = world.low.copy(), world.high.copy()
    for i in ajar:
        corners = _swept(world, i)
        low[i] = np.minimum(low[i], corners.min(axis=0))
        high[i] = np.maximum(high[i], corners.max(axis=0))
    return low, high


def _swept(world: World, i: int) -> NDArray[np.float64]:
    """(4, 3) corners of the area that the door of object i sweeps, at the height of its middle."""
    solid = solid_of(world, i)
    left, right = solid.upright[:, :, 0].min(), solid.upright[:, :, 0].max()
    front = solid.upright[:, :, 2].max()
    edge = front + (right - left) * np.sin(_QUARTER * world.openness[i])
    yaw = np.radians(solid.yaw)
    across = np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
    ahead = np.array([np.sin(yaw), 0.0, np.cos(yaw)])
    middle = solid.middle.copy()
    middle[1] = (world.low[i, 1] + world.high[i, 1]) / 2
    corners = product((left, right), (front, edge))
    return np.array([middle + x * across + z * ahead for x, z in corners])
