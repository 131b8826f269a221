"""The heights at which the record shows objects standing in or on receptacles."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np

from er_gym.sim.scene import PROPERTIES, load_scene


@lru_cache(maxsize=128)
def recorded_surfaces(scene_name: str) -> Mapping[int, float]:
    """For each receptacle row, how far above its underside recorded objects stand, metres."""
    scene = load_scene(scene_name)
    bottoms = scene.aabb_center[:, 1] - scene.aabb_size[:, 1] / 2
    lies_in: dict[int, list[float]] = {}
    carried = scene.properties[:, PROPERTIES.index("pickupable")]
    for i in np.flatnonzero(carried):
        for receptacle in scene.parents[i]:
            lies_in.setdefault(receptacle, []).append(bottoms[i] - bottoms[receptacle])
    return {receptacle: float(np.median(heights)) for receptacle, heights in lies_in.items()}
