"""Objects that are built into furniture, as recorded: sinks, cabinets and drawers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from er_gym.sim.scene import load_scene
from er_gym.sim.space.solids.facing import SIDES, facings

Box = tuple[tuple[float, float, float], tuple[float, float, float]]
"""Low and high corner, metres."""
Rectangle = tuple[float, float, float, float]
"""Low x and z, high x and z, metres."""
_FITTED = frozenset({"Cabinet", "Drawer", "Sink", "Bathtub"})
_HOSTS = frozenset({"CounterTop", "Desk", "SideTable", "DiningTable", "CoffeeTable"})
_CASES = frozenset({"Dresser", "TVStand", "ShelvingUnit"})
"""Types that are drawn without regard to the objects built into them."""
_MARGIN = 0.05
"""How far a built-in object may stick out, metres."""


@lru_cache(maxsize=4096)
def built_in(scene_name: str, i: int) -> tuple[tuple[str, Box], ...]:
    """Type and box of each object that is built into recorded object i, in i's own frame.

    The frame is upright and has object i's heading (a counter's frame is not turned). Its origin is
    the middle of the underside.
    """
    scene = load_scene(scene_name)
    if i >= len(scene) or scene.types[i] not in _HOSTS:
        return ()
    counter = scene.types[i] == "CounterTop"
    middle = scene.aabb_center[i]
    underside = middle[1] - scene.aabb_size[i, 1] / 2
    yaw = np.radians(0.0 if counter else round(facings(scene_name)[i] / 90.0) * 90.0)
    right, ahead = (np.cos(yaw), -np.sin(yaw)), (np.sin(yaw), np.cos(yaw))
    found = []
    for k in fitted_rows(scene_name, i):
        away = scene.aabb_center[k] - middle
        x, z = (float(np.dot(way, away[[0, 2]])) for way in (right, ahead))
        w, d = (float(np.dot(np.abs(way), scene.aabb_size[k, [0, 2]])) for way in (right, ahead))
        y, h = float(scene.aabb_center[k, 1] - underside), float(scene.aabb_size[k, 1])
        low, high = (x - w / 2, y - h / 2, z - d / 2), (x + w / 2, y + h / 2, z + d / 2)
        found.append((scene.types[k], (_rounded(low), _rounded(high))))
    return tuple(found)


@lru_cache(maxsize=128)
def hosts(scene_name: str) -> Mapping[int, int]:
    """The row of the object that each built-in object is built into; the last one of several."""
    scene = load_scene(scene_name)
    found = [i for i, kind in enumerate(scene.types) if kind in _HOSTS | _CASES]
    return {k: i for i in found for k in fitted_rows(scene_name, i)}


def fitted_rows(scene_name: str, i: int) -> list[int]:
    """The rows of the objects that are built into object i."""
    scene = load_scene(scene_name)
    half = scene.aabb_size[i] / 2 + _MARGIN
    away = scene.aabb_center - scene.aabb_center[i]
    below = -2.0 if scene.types[i] == "CounterTop" else -half[1]
    inside = (abs(away) <= half)[:, [0, 2]].all(axis=1) & (below < away[:, 1])
    inside &= away[:, 1] < half[1]
    return [k for k in np.flatnonzero(inside).tolist() if scene.types[k] in _FITTED]


@dataclass(frozen=True)
class Front:
    """The front of a cabinet or a drawer, in the world's frame.

    Attributes:
        axis: 0 if the front is at one x, 1 if it is at one z.
        sign: 1 or -1, the direction along the axis that it faces.
        at: that coordinate, metres.
        low, high: its ends along the other axis, metres.
    """

    axis: int
    sign: int
    at: float
    low: float
    high: float


def fronts(scene_name: str, i: int) -> Iterator[Front]:
    """The fronts of the cabinets and drawers that are built in under counter i."""
    scene, headings = load_scene(scene_name), facings(scene_name)
    for k in fitted_rows(scene_name, i):
        if scene.types[k] not in ("Cabinet", "Drawer"):
            continue
        axis, sign = SIDES[round(headings[k] / 90.0) % 4]
        middle, half = scene.aabb_center[k, [0, 2]], scene.aabb_size[k, [0, 2]] / 2
        low, high = ((middle + way * half)[1 - axis] for way in (-1, 1))
        at = float(middle[axis] + sign * half[axis])
        yield Front(axis, sign, at, float(low), float(high))


def _rounded(corner: tuple[float, float, float]) -> tuple[float, float, float]:
    x, y, z = (round(value, 3) for value in corner)
    return x, y, z
