"""The faces of boxes with sharp edges and with cut edges, computed once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray


def fans(counts: Sequence[int]) -> NDArray[np.int32]:
    """(F, 3) triangles of convex polygons whose corners follow one another."""
    found, first = [], 0
    for count in counts:
        found += [(first, first + k, first + k + 1) for k in range(1, count - 1)]
        first += count
    return np.array(found, dtype=np.int32).reshape(-1, 3)


FACES = "xXyYzZ"
"""Letters for the faces of a box; capital letters are on the positive side."""
SQUARE = np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])


def _box_faces() -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """For a box of half-size 1: (6, 4, 3) corners, (6, 3) normals, (6, 2, 3) spans of its faces."""
    corners, normals, spread = np.zeros((6, 4, 3)), np.zeros((6, 3)), np.zeros((6, 2, 3))
    for k, face in enumerate(FACES):
        axis = "xyz".index(face.lower())
        u, v = ((2, 1), (0, 2), (0, 1))[axis]
        corners[k, :, axis] = normals[k, axis] = 1.0 if face.isupper() else -1.0
        corners[k, :, u], corners[k, :, v] = SQUARE.T
        spread[k, 0, u] = spread[k, 1, v] = 1.0
    return corners, normals, spread


BOX_CORNERS, BOX_NORMALS, BOX_SPREAD = _box_faces()
SIGNS = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])


def _cut_box() -> tuple[NDArray[np.intp], NDArray[np.float64], NDArray[np.intp], list[int]]:
    """The polygons of a box with cut edges.

    Returns:
        (V, 2) for each vertex the nearest corner of the box and the axis of the nearest face; (V,
        3) normals; (V, 2) the two axes along which each polygon is flattest; and the number of
        vertices of each polygon.
    """
    corners: list[tuple[int, int]] = []
    normals: list[NDArray[np.float64]] = []
    counts: list[int] = []

    def corner(values: Mapping[int, int]) -> int:
        return sum((values[axis] > 0) << (2 - axis) for axis in range(3))

    def polygon(ring: list[tuple[int, int]], out: NDArray[np.float64]) -> None:
        corners.extend(ring)
        normals.extend([out] * len(ring))
        counts.append(len(ring))

    for axis in range(3):
        u, v = (k for k in range(3) if k != axis)
        for s in (-1, 1):
            out = np.zeros(3)
            out[axis] = s
            polygon([(corner({axis: s, u: a, v: b}), axis) for a, b in SQUARE.astype(int)], out)
        for a in (-1, 1):  # the edges along this axis
            for b in (-1, 1):
                low, high = (corner({axis: s, u: a, v: b}) for s in (-1, 1))
                out = np.zeros(3)
                out[u], out[v] = a, b
                polygon([(low, u), (high, u), (high, v), (low, v)], out)
    for k, sign in enumerate(SIGNS):
        polygon([(k, 0), (k, 1), (k, 2)], sign.astype(np.float64))
    steepest = np.abs(normals).argmax(axis=1)
    flat = np.array([[k for k in range(3) if k != axis] for axis in steepest.tolist()])
    return np.array(corners), np.array(normals), flat, counts


CUT_CORNERS, CUT_NORMALS, CUT_FLAT, CUT_COUNTS = _cut_box()
