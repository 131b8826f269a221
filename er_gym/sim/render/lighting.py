"""Light, computed once for each vertex: there are no lamps at run time.

It consists of light from above, a key light and a weak fill light, and of darkness near the floor.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.materials import MATERIALS
from er_gym.sim.render.patch import Patch, rotation

_KEY = np.array([0.35, 0.82, 0.45]) / np.linalg.norm([0.35, 0.82, 0.45])
_FILL = np.array([-0.7, 0.2, -0.5]) / np.linalg.norm([-0.7, 0.2, -0.5])
_REACH = 0.45
"""Height up to which it is darker near the floor, metres."""


def light(normals: NDArray[np.float32]) -> NDArray[np.float32]:
    """(V,) brightness of surfaces with world normals (V, 3)."""
    hemisphere = 0.5 + 0.16 * normals[:, 1]
    key = 0.42 * np.clip(normals @ _KEY, 0.0, 1.0)
    return np.asarray(hemisphere + key + 0.14 * np.clip(normals @ _FILL, 0.0, 1.0), np.float32)


def lit_colours(
    material: str, patch: Patch, yaw: float, tall: float, height: float
) -> NDArray[np.float32]:
    """(V, 3) the colours of a patch in the light of the room.

    Args:
        yaw: heading of the object, degrees.
        tall: its height, metres.
        height: of its underside above the floor, metres.
    """
    if MATERIALS[material].glows:
        return patch.colours
    normals = patch.normals @ rotation("y", yaw).T.astype(np.float32)
    level = light(normals)
    low = 0.0 if height < 0.1 else -0.05
    rise = np.clip((patch.vertices[:, 1] - low) / max(min(_REACH, 0.8 * tall), 1e-3), 0.0, 1.0)
    level *= np.where(normals[:, 1] > 0.7, 1.0, 0.66 + 0.34 * rise)
    level *= 1.0 - 0.3 * np.clip(-normals[:, 1], 0.0, 1.0)
    return np.asarray(patch.colours * level[:, None], np.float32)
