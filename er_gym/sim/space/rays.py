"""Lines of sight against axis-aligned boxes.

A box that contains the eye or the target does not block: recorded boxes of concave objects (a
chair, an L-shaped counter) contain air. All computations use the slab method in single precision.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

_EPSILON = np.float32(1e-3)
_ALMOST_ONE = np.float32(1.0) - _EPSILON
_TINY = np.float32(1e-9)

Floats = NDArray[np.float32]


def _inverse(direction: Floats) -> Floats:
    """1 / direction, in place. Values next to zero count as a small number."""
    direction[np.abs(direction) < _TINY] = _TINY
    return np.asarray(np.divide(np.float32(1.0), direction, out=direction))


def blocked_by(
    origins: Floats, targets: Floats, box_min: Floats, box_max: Floats
) -> NDArray[np.bool_]:
    """Which boxes stand between each origin and its target; every pair is tested.

    Args:
        origins: (R, 3) or (1, 3), metres, world frame.
        targets: (R, 3).
        box_min, box_max: (M, 3) corners.

    Returns:
        (R, M) bool.
    """
    inverse = _inverse(targets - origins)
    enter = np.full((len(targets), len(box_min)), -np.inf, dtype=np.float32)
    leave = np.full_like(enter, np.inf)
    for axis in range(3):
        scale = inverse[:, axis, None]
        first = (box_min[None, :, axis] - origins[:, axis, None]) * scale
        second = (box_max[None, :, axis] - origins[:, axis, None]) * scale
        np.maximum(enter, np.minimum(first, second), out=enter)
        np.minimum(leave, np.maximum(first, second), out=leave)
    return (enter > _EPSILON) & (enter <= leave) & (leave < _ALMOST_ONE)


@dataclass(frozen=True, eq=False)
class Targets:
    """Points to look at, in K groups of consecutive points.

    Attributes:
        points: (3, P) metres, world frame.
        first, count: (K,) index of each group's first point, and its number of points.
        low, high: (3, K) corners of the box around each group.
    """

    points: Floats
    first: NDArray[np.intp]
    count: NDArray[np.intp]
    low: Floats
    high: Floats

    def some(self, groups: NDArray[np.intp]) -> Targets:
        """Some of the groups."""
        return Targets(
            self.points,
            self.first[groups],
            self.count[groups],
            self.low[:, groups],
            self.high[:, groups],
        )


def crossings(
    eye: Floats, targets: Targets, box_min: Floats, box_max: Floats, pairs: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Which boxes stand between one eye and which points, for some pairs of groups and boxes.

    The result equals that of :func:`blocked_by`. This function is faster: a box that does not reach
    between the eye and a group hides no point of the group.

    Args:
        eye: (3,).
        box_min, box_max: (3, M) corners.
        pairs: (K, M) bool, the boxes to test for each group.

    Returns:
        (H,) points and (H,) boxes, a pair for each line of sight that a box blocks.
    """
    at = eye[:, None]
    nearest, farthest = np.minimum(targets.low, at), np.maximum(targets.high, at)
    overlap = box_max[:, None] >= nearest[:, :, None]
    overlap &= box_min[:, None] <= farthest[:, :, None]
    between = overlap[0]
    between &= overlap[1]
    between &= overlap[2]
    between &= pairs
    group, box = between.nonzero()
    if not len(group):
        return group, box
    count = targets.count[group]
    ends = count.cumsum()
    point = np.arange(ends[-1])
    point += np.repeat(targets.first[group] - ends + count, count)
    boxes = np.repeat(box, count)
    if len(point) < targets.points.shape[1]:
        scale = _inverse(targets.points.take(point, axis=1) - at)
    else:
        scale = _inverse(targets.points - at).take(point, axis=1)
    near, far = (box_min - at).take(boxes, axis=1), (box_max - at).take(boxes, axis=1)
    near *= scale
    far *= scale
    # Where the lines enter and leave the spaces between planes, as fractions of their length.
    enter = np.maximum.reduce(np.minimum(near, far))
    leave = np.minimum.reduce(np.maximum(near, far, out=far))
    crossed = (enter > _EPSILON) & (enter <= leave) & (leave < _ALMOST_ONE)
    return point[crossed], boxes[crossed]
