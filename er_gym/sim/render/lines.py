"""Lines in the room as flat ribbons, with a small post at each end of a path."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.look import Line
from er_gym.sim.render.pieces import VERTEX, Piece

_COLOUR, _START, _END = (40, 120, 235), (40, 190, 70), (225, 50, 40)
_POST, _TALL = 0.05, 0.25
"""Half the width of a post, and its height, metres."""
_LIFT = 0.004
"""Of a ribbon above its points, metres: they mostly lie on the floor."""
Quads = list[tuple[NDArray[np.float64], tuple[int, int, int]]]


def line_piece(line: Line) -> Piece | None:
    """The triangles of a line, in the room's frame; None for a line that has no length."""
    points, quads = np.array(line.points), Quads()
    for start, end in pairwise(points):
        way = end - start
        length = float(np.hypot(way[0], way[2]))
        aside = (
            np.array([way[2], 0.0, -way[0]]) / length if length > 1e-6 else np.array([1.0, 0, 0])
        )
        edge, up = aside * line.width / 2, np.array([0.0, _LIFT, 0.0])
        quads.append((np.array([start - edge, end - edge, end + edge, start + edge]) + up, _COLOUR))
    if line.posts:
        quads += [*_post(points[0], _START), *_post(points[-1], _END)]
    return _piece(quads) if quads else None


def _post(at: NDArray[np.float64], colour: tuple[int, int, int]) -> Quads:
    """Two upright squares that cross."""
    found = []
    for axis in (0, 2):
        out = np.zeros(3)
        out[axis] = _POST
        top = np.array([0.0, _TALL, 0.0])
        found.append((np.array([at - out, at + out, at + out + top, at - out + top]), colour))
    return found


def _piece(quads: Quads) -> Piece:
    vertices = np.zeros(4 * len(quads), dtype=VERTEX)
    vertices["at"] = np.concatenate([corners for corners, _ in quads])[:, [0, 2, 1]]
    vertices["colour"][:, :3] = np.repeat([colour for _, colour in quads], 4, axis=0)
    normals = np.zeros((len(vertices), 4), np.int8)
    normals[:, 1] = 127
    # Both sides, since one looks at lines from anywhere.
    sides = np.array([(0, 1, 2), (0, 2, 3), (2, 1, 0), (3, 2, 0)])
    faces = (sides[None] + 4 * np.arange(len(quads))[:, None, None]).reshape(-1, 3)
    small = len(vertices) < 65536
    indices = faces.astype(np.uint16) if small else faces.astype(np.uint32)
    return Piece("glowing", vertices, normals, indices)
