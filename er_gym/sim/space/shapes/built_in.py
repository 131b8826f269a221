"""What is built into furniture, as recorded: sinks in counters, cabinets and drawers under them."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from er_gym.sim.scene import load_scene
from er_gym.sim.space.shapes.facing import facings

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Low and high corner, metres."""
_FITTED = frozenset({"Cabinet", "Drawer", "Sink", "Bathtub"})
_HOSTS = frozenset({"CounterTop", "Desk", "SideTable", "DiningTable", "CoffeeTable"})
_MARGIN = 0.05
"""How far what is built in may stick out, metres."""


@lru_cache(maxsize=4096)
def built_in(scene_name: str, i: int) -> tuple[tuple[str, Box], ...]:
    """Type and box of what is built into recorded object i, in its own frame.

    The frame is upright and turned to its heading (a counter's is not turned); its origin is the
    middle of the underside.
    """
    scene = load_scene(scene_name)
    if i >= len(scene) or scene.types[i] not in _HOSTS:
        return ()
    counter = scene.types[i] == "CounterTop"
    half = scene.aabb_size[i] / 2 + _MARGIN
    middle = scene.aabb_center[i]
    underside = middle[1] - scene.aabb_size[i, 1] / 2
    yaw = np.radians(0.0 if counter else round(facings(scene_name)[i] / 90.0) * 90.0)
    right, ahead = (np.cos(yaw), -np.sin(yaw)), (np.sin(yaw), np.cos(yaw))
    found = []
    for k, kind in enumerate(scene.types):
        away = scene.aabb_center[k] - middle
        below = -2.0 if counter else -half[1]
        if kind in _FITTED and (abs(away) <= half)[[0, 2]].all() and below < away[1] < half[1]:
            x, z = (float(np.dot(way, away[[0, 2]])) for way in (right, ahead))
            w, d = (
                float(np.dot(np.abs(way), scene.aabb_size[k, [0, 2]])) for way in (right, ahead)
            )
            y, h = float(scene.aabb_center[k, 1] - underside), float(scene.aabb_size[k, 1])
            low, high = (x - w / 2, y - h / 2, z - d / 2), (x + w / 2, y + h / 2, z + d / 2)
            found.append((kind, (_rounded(low), _rounded(high))))
    return tuple(found)


def _rounded(corner: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (round(value, 3) for value in corner)
    return x, y, z
