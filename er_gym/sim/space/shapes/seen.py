"""What of a thing is looked for when one asks whether it is visible."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import load_scene
from er_gym.sim.space.rotation import unity_rotation
from er_gym.sim.space.shapes.built_in import hosts
from er_gym.sim.space.shapes.carcass import carcass
from er_gym.sim.space.shapes.placed import upright_box
from er_gym.sim.space.shapes.samples import (
    points_on,
    points_on_face,
    points_on_top,
    surface_fractions,
)

if TYPE_CHECKING:
    from er_gym.sim.world import World

SOLID = ("Drawer", "Cabinet", "CounterTop")
"""Types that are seen from outside only: their own boxes hide the points on their far sides."""
SLABS = ("CounterTop",)
"""Types that hide what lies on them from who looks from below."""
_OUT = 0.01
"""How far before their faces the points of solid things lie, metres."""
Floats = NDArray[np.float64]


def points_to_see(world: World, i: int) -> Floats:
    """(P, 3) points of object i, world frame, metres: as many wherever it is and however it is.

    Most things are looked for all over their boxes, the oriented ones where recorded. Of what is
    built in one sees the front.
    """
    kind = world.types[i]
    if kind == "Floor":
        return points_on_top(np.array([world.low[i], world.high[i]]))
    if kind == "CounterTop" and i < len(world.scene):
        return np.concatenate([_outside(box) for box in carcass(world.scene.name, i).slab])
    if kind in ("Drawer", "Cabinet"):
        middle, size, yaw = upright_box(world, i)
        box = np.array([-size / 2, size / 2])
        points = points_on_face(box, 2, 1, _OUT)
        if kind == "Cabinet" and i not in hosts(world.scene.name):
            sides = [points_on_face(box, axis, sign, _OUT) for axis in (0, 1) for sign in (-1, 1)]
            points = np.concatenate([points, *sides])
        return points @ unity_rotation((0.0, yaw, 0.0)).T + middle
    if np.isnan(world.obb[i, 0, 0]):
        box = np.array([[world.low[i], world.high[i]]])
        return points_on(box)
    corner, edges = world.obb[i, 0], world.obb[i, 1:]
    points = corner + surface_fractions(np.linalg.norm(edges, axis=1)) @ edges
    return points @ unity_rotation(world.rotation[i]).T + world.position[i]


def _outside(box: Floats) -> Floats:
    """Points before all faces of a slab but the lower one."""
    faces = ((1, 1), (0, -1), (0, 1), (2, -1), (2, 1))
    return np.concatenate([points_on_face(box, axis, sign, _OUT) for axis, sign in faces])
