"""Carcasses of counters, between and behind their cabinets: drawn, but not objects."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from er_gym.sim.render.lighting import lit_colours
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import palette
from er_gym.sim.render.patch import Patch
from er_gym.sim.render.shapes.joinery import carcass_colour, panels
from er_gym.sim.scene import load_scene
from er_gym.sim.space.solids.built_in import Box
from er_gym.sim.space.solids.carcass import carcass


@lru_cache(maxsize=128)
def carcasses(scene_name: str) -> dict[str, Patch]:
    """Lit triangles by material, in the world's frame."""
    scene, mesh, floor, tall = load_scene(scene_name), Mesh(), 0.0, 1.0
    for i, kind in enumerate(scene.types):
        if kind != "CounterTop":
            continue
        found = carcass(scene_name, i)
        if found.own:
            continue
        floor, tall = found.floor, found.under - found.floor
        # The panels are made on the floor, because light depends on the height above it.
        fitted: list[Box] = [
            ((low[0], low[1] - floor, low[2]), (high[0], high[1] - floor, high[2]))
            for low, high in found.fitted.tolist()
        ]
        panels(mesh, found.footprint, (0.0, tall), fitted, carcass_colour(palette(scene_name)))
    return {name: _lit(name, patch, floor, tall) for name, patch in mesh.patches().items()}


def _lit(material: str, patch: Patch, floor: float, tall: float) -> Patch:
    return Patch(
        patch.vertices + np.array([0.0, floor, 0.0], np.float32),
        patch.normals,
        patch.uv,
        np.clip(lit_colours(material, patch, 0.0, tall, 0.0), 0.0, 1.0),
        patch.triangles,
    )
