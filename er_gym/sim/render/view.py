"""What the agent's camera shows: plain boxes, coloured by object type.

A stand-in that is honest about what it is: every object is drawn as the box that the record gives
it. Depth and instance ids are exact for those boxes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.metadata import instance_color
from er_gym.sim.render.boxes import render_boxes, type_color
from er_gym.sim.render.camera import Camera
from er_gym.sim.space.shapes import solid_part
from er_gym.sim.world import World

_NOT_DRAWN = frozenset({"Floor", "Shelf", "ShelvingUnit", "SinkBasin", "BathtubBasin"})
"""The room shell shows the floor; the others' boxes are the air above or inside something."""
_MIN_THICKNESS = 0.01


@dataclass(frozen=True)
class View:
    """Pictures from the agent's camera, top row first.

    Attributes:
        rgb: (H, W, 3) uint8.
        depth: (H, W) float32 metres along the line of view, None unless asked for.
        instances: (H, W, 3) uint8 colours as in the metadata's ``colors``, None unless asked for.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32] | None = None
    instances: NDArray[np.uint8] | None = None


def draw(world: World) -> View:
    """Draw the world as the agent sees it now."""
    settings, agent = world.settings, world.agent
    rows = [i for i in np.flatnonzero(~world.hidden).tolist() if world.types[i] not in _NOT_DRAWN]
    low, high = world.low[rows].copy(), world.high[rows].copy()
    hollow = np.zeros(len(rows), dtype=bool)
    for k, i in enumerate(rows):
        part = solid_part(world.types[i], world.has(i, "pickupable"))
        if part is not None and part.bottom > 0:
            low[k, 1] += (high[k, 1] - low[k, 1]) * part.bottom
        if world.has(i, "receptacle") and world.has(i, "openable") and world.state(i, "isOpen"):
            hollow[k] = True
    thin = high - low < _MIN_THICKNESS
    high[thin] = low[thin] + _MIN_THICKNESS
    half = world.scene.aabb_size / 2
    frames = render_boxes(
        Camera(
            agent.camera,
            agent.rotation,
            agent.horizon,
            settings.field_of_view,
            settings.width,
            settings.height,
        ),
        low,
        high,
        np.array([type_color(world.types[i]) for i in rows], dtype=np.uint8),
        hollow=hollow,
        room_min=(world.scene.aabb_center - half).min(axis=0),
        room_max=(world.scene.aabb_center + half).max(axis=0),
    )
    instances = None
    if settings.render_instances:
        palette = np.array([instance_color(world.object_ids[i]) for i in rows] + [(0, 0, 0)])
        instances = palette.astype(np.uint8)[frames.ids]
    return View(frames.rgb, frames.depth if settings.render_depth else None, instances)
