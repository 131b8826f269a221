"""Forms that several families share: lying and leaning objects, and round pictures."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from math import atan2, degrees, hypot, pi

import numpy as np

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.patch import Colour, Triple


def laid(size: Triple, build: Callable[[Triple], Mesh]) -> Mesh:
    """A thin object, lying or standing so that its thickness is the shortest side of its box.

    Args:
        build: makes it lying, from its width, thickness and depth.
    """
    w, h, d = size
    if h <= min(w, d):
        return build(size)
    mesh, upright = Mesh(), Mesh()
    width, thick = (w, d) if d <= w else (d, w)
    upright.add(build((width, thick, h)), at=(0, h / 2, -thick / 2), turn=("x", 90))
    mesh.add(upright, turn=("y", 0 if d <= w else 90))
    return mesh


def lying(build: Callable[[Triple], Mesh]) -> Callable[[Appearance], Mesh]:
    """The shape of a thin object that only its size decides; see :func:`laid`."""

    @wraps(build)
    def shape(appearance: Appearance) -> Mesh:
        return laid(appearance.size, build)

    return shape


def leant(size: Triple, thick: float, build: Callable[[float], Mesh]) -> Mesh:
    """A long object from end to end of its box, askew if the box is wide.

    Args:
        thick: its thickness, metres.
        build: makes it standing, from its length.
    """
    x, y, z = (max(side - 1.3 * thick, 0.0) for side in size)
    level, length = hypot(x, z), hypot(x, y, z)
    mesh, tilted = Mesh(), Mesh()
    long = length + thick * max(x, y, z) / max(length, 1e-6)
    # Its upper end leans back, against the object behind it.
    tilt = -degrees(atan2(level, y))
    tilted.add(
        build(long), at=(0, (size[1] - long) / 2, 0), turn=("x", tilt), about=(0, long / 2, 0)
    )
    mesh.add(tilted, turn=("y", degrees(atan2(x, z))))
    return mesh


def roundel(
    width: float, height: float, colour: Colour, material: str, *, segments: int = 16
) -> Mesh:
    """A round picture around the origin that faces forwards, upright for a viewer there."""
    mesh, angle = Mesh(), np.arange(segments) / segments * 2 * pi
    x, y, flat = np.cos(angle) / 2, np.sin(angle) / 2, np.zeros(segments)
    corners = np.stack([x * width, y * height, flat], axis=1)
    uv = np.stack([0.5 - 0.98 * x, 0.5 + 0.98 * y], axis=1)
    fan = [(0, k, k + 1) for k in range(1, segments - 1)]
    mesh.triangles(material, corners, np.tile((0, 0, 1), (segments, 1)), uv, colour, fan)
    return mesh
