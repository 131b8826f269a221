"""Triangles of one material, and the types that meshes are described in.

An object's own frame is AI2-THOR's: x to its right, y up, z to its front. Lengths are metres,
angles degrees. Colours are red, green and blue from 0 to 1; more than 1 glows.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, radians, sin
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Colour = tuple[float, float, float]
Triple = tuple[float, float, float]
Axis = Literal["x", "y", "z"]
PLAIN = "plain"


@dataclass(frozen=True, eq=False)
class Patch:
    """Triangles of one material.

    Attributes:
        vertices, normals: (V, 3). uv: (V, 2), in turns of the texture. colours: (V, 3).
        triangles: (F, 3) indices of vertices.
    """

    vertices: NDArray[np.float32]
    normals: NDArray[np.float32]
    uv: NDArray[np.float32]
    colours: NDArray[np.float32]
    triangles: NDArray[np.int32]


def merged(patches: Sequence[Patch]) -> Patch:
    """Patches merged into one, with unit normals and triangles that face along them."""
    starts = np.cumsum([0, *(len(p.vertices) for p in patches[:-1])])
    vertices = np.concatenate([p.vertices for p in patches])
    normals = np.concatenate([p.normals for p in patches])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-9)
    faces = np.concatenate([p.triangles + s for p, s in zip(patches, starts, strict=True)])
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    # The frame is left-handed, so the cross product points inwards.
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), normals[faces].sum(axis=1)) > 0
    faces[inward] = faces[inward][:, [0, 2, 1]]
    return Patch(
        vertices,
        normals,
        np.concatenate([p.uv for p in patches]),
        np.concatenate([p.colours for p in patches]),
        faces.astype(np.int32),
    )


def rotation(axis: Axis, degrees: float) -> NDArray[np.float64]:
    """(3, 3) turn about an axis; about y clockwise seen from above, as headings go."""
    c, s = cos(radians(degrees)), sin(radians(degrees))
    return np.array(
        {
            "x": [[1, 0, 0], [0, c, -s], [0, s, c]],
            "y": [[c, 0, s], [0, 1, 0], [-s, 0, c]],
            "z": [[c, -s, 0], [s, c, 0], [0, 0, 1]],
        }[axis]
    )
