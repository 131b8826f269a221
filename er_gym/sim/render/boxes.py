"""Axis-aligned boxes drawn on the CPU with numpy: colour, depth and which box is seen.

A plain rendering, and honest about it: every box is one flat colour, each face shaded by the way it
faces, with a thin dark line where faces meet. It needs no window, no GPU and no graphics library.

How it works: along the line of sight through a pixel, ``position + z * ray``, the plane x = c lies
at depth z = (c - position.x) / ray.x. So the *inverse* depth of a plane is the map of ``ray.x``
times one number, and a box is drawn with a few multiplications and comparisons of maps, over the
rectangle of pixels that holds it. A line of sight enters a box at the last of the planes that
face the camera and leaves it at the first of those that face away.
"""

from __future__ import annotations

import colorsys
from dataclasses import dataclass
from functools import cache, reduce
from itertools import product
from zlib import crc32

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_gym.sim.render.camera import Camera

NO_BOX = -1
"""The id of a pixel in which no box is seen."""

BACKGROUND = (135, 160, 185)
"""The colour where nothing is: a pale sky."""

# Light on the faces that look along -x, +x, -y, +y, -z, +z: mostly from above.
_SHADES = np.array([0.70, 0.78, 0.50, 1.00, 0.88, 0.82])
# The inner faces of the room in the same order: four walls, floor third, ceiling fourth.
_ROOM_COLORS = np.array(
    [
        (176, 170, 160),
        (188, 182, 171),
        (141, 121, 101),
        (214, 212, 207),
        (199, 193, 182),
        (182, 176, 166),
    ]
)
_OUTLINE = 0.55  # how dark the line between two faces is
_TIE = 1e-3  # of two faces nearer to each other than this fraction of depth, the smaller box's wins
_CORNERS = np.array(list(product((0, 1), repeat=3)))
_EDGES = np.array([(i, i | bit) for i in range(8) for bit in (1, 2, 4) if not i & bit])
_NORMALS = np.array([-1, 1, -1, 1, -1, 1])  # of the six sides, along their axes
_BACKGROUND_SIDE = 6  # of the room: what is behind it
_MICROMETRE = 1e-6

Window = tuple[slice, slice]
"""Rows and columns of a picture."""


@dataclass(frozen=True, eq=False)
class Frames:
    """One picture, top row first.

    Attributes:
        rgb: (H, W, 3) uint8.
        depth: (H, W) float32 metres along the view axis, infinite where nothing is.
        ids: (H, W) int32, the index of the box seen, :data:`NO_BOX` for the room or nothing.
    """

    rgb: NDArray[np.uint8]
    depth: NDArray[np.float32]
    ids: NDArray[np.int32]


@cache
def type_color(object_type: str) -> tuple[int, int, int]:
    """A colour that stands for an object type, the same on every machine and in every run.

    It is no natural colour: the name's CRC-32 chooses hue, saturation and value, so that a type
    can be told from most others. Red, green, blue; 0 to 255.
    """
    digest = crc32(object_type.encode())
    hue, saturation, value = (digest >> 16) / 65536, (digest >> 8 & 255) / 255, (digest & 255) / 255
    red, green, blue = colorsys.hsv_to_rgb(hue, 0.35 + 0.4 * saturation, 0.65 + 0.35 * value)
    return round(255 * red), round(255 * green), round(255 * blue)


def render_boxes(
    camera: Camera,
    boxes_min: ArrayLike,
    boxes_max: ArrayLike,
    colors: ArrayLike,
    *,
    hollow: ArrayLike | None = None,
    room_min: ArrayLike | None = None,
    room_max: ArrayLike | None = None,
    near: float = 0.05,
    background: tuple[int, int, int] = BACKGROUND,
) -> Frames:
    """Draw axis-aligned boxes as a camera sees them.

    Of a box that holds the camera the inner faces are drawn. Where two faces coincide the smaller
    box is seen. The same arguments give the same bytes.

    Args:
        camera: where from, and how large.
        boxes_min, boxes_max: (M, 3) the corners, in metres.
        colors: (M, 3) uint8, each box's colour in full light.
        hollow: (M,) bool, boxes without the faces towards the camera: one sees the inner faces, and
            what is in the box. None: no box is.
        room_min, room_max: (3,) the room whose floor, walls and ceiling are drawn in muted colours
            around everything; it is widened to hold the camera. Both or neither.
        near: what is nearer along the view axis is not drawn, in metres.
        background: the colour where nothing is.
    """
    eye = np.asarray(camera.position, dtype=np.float64)
    low = np.asarray(boxes_min, dtype=np.float64).reshape(-1, 3)
    high = np.asarray(boxes_max, dtype=np.float64).reshape(-1, 3)
    inside = np.zeros(len(low), dtype=bool) if hollow is None else np.asarray(hollow, dtype=bool)
    canvas = _Canvas.blank(camera, near)
    if room_min is not None and room_max is not None:
        # Widened by twice the near distance, no wall is too near to be drawn.
        room_low = np.minimum(room_min, eye - 2 * near)
        room_high = np.maximum(room_max, eye + 2 * near)
        planes = _planes(room_low - eye, room_high - eye)
        canvas.draw(NO_BOX, planes, (slice(None), slice(None)), inside=True)
    planes = _planes(low - eye, high - eye)
    windows = _windows(camera, low, high, near)
    # Large boxes first: they hide most, and of coinciding faces the later is kept.
    for box in np.argsort(-np.prod(high - low, axis=1), kind="stable").tolist():
        if (window := windows[box]) is not None:
            canvas.draw(box, planes[box], window, inside=bool(inside[box]))
    return canvas.frames(np.asarray(colors).reshape(-1, 3), background)


@dataclass(frozen=True, eq=False)
class _Canvas:
    """The picture being drawn.

    Attributes:
        rays: (3, H, W), see :meth:`Camera.rays`.
        inverse_depth: (H, W) of what is seen so far, 0 where nothing is.
        limit: the inverse depth of the near plane.
        seen: (H, W) which face is seen so far: 8 x box + side, sides 0 to 5 in the order of
            ``_SHADES``. The room counts as box -1, and its side 6 is the background.
    """

    rays: NDArray[np.float32]
    inverse_depth: NDArray[np.float32]
    limit: float
    seen: NDArray[np.int32]

    @classmethod
    def blank(cls, camera: Camera, near: float) -> _Canvas:
        size = (camera.height, camera.width)
        background = np.full(size, 8 * NO_BOX + _BACKGROUND_SIDE, dtype=np.int32)
        return cls(camera.rays(), np.zeros(size, dtype=np.float32), 1 / near, background)

    def draw(self, box: int, planes: NDArray[np.float64], window: Window, *, inside: bool) -> None:
        """Draw one box over what is there.

        Args:
            box: its index.
            planes: (6,) see :func:`_planes`.
            window: the pixels it may touch.
            inside: draw its inner faces, not the outer.
        """
        outer = np.flatnonzero(planes * _NORMALS < 0).tolist()  # the sides that face the camera
        inner = np.flatnonzero(planes * _NORMALS > 0).tolist()
        slopes = (1 / planes).tolist()
        crossings = [self.rays[side // 2][window] * slopes[side] for side in range(6)]
        leave = reduce(np.maximum, [crossings[side] for side in inner])
        surface, sides = leave, inner
        if outer:
            enter = reduce(np.minimum, [crossings[side] for side in outer])
            if not inside:
                surface, sides = enter, outer
        inverse_depth, seen = self.inverse_depth[window], self.seen[window]
        hit = surface * (1 + _TIE) > inverse_depth
        hit &= surface <= self.limit
        if outer:
            hit &= enter >= leave
        np.copyto(inverse_depth, surface, where=hit)
        np.copyto(seen, 8 * box + sides[0], where=hit)
        for side in sides[1:]:
            np.copyto(seen, 8 * box + side, where=hit & (crossings[side] == surface))

    def frames(self, colors: NDArray[np.uint8], background: tuple[int, int, int]) -> Frames:
        """The finished picture."""
        with np.errstate(divide="ignore"):
            depth = np.reciprocal(self.inverse_depth)
        faces = np.zeros((len(colors) + 1, 8, 3))
        faces[0, :6] = _ROOM_COLORS
        faces[0, _BACKGROUND_SIDE] = background
        faces[1:, :6] = colors[:, None] * _SHADES[:, None]
        palette = faces.reshape(-1, 3)
        entries = self.seen + np.int32(8)
        outline = np.zeros(entries.shape, dtype=bool)
        outline[:, 1:] = entries[:, 1:] != entries[:, :-1]
        outline[1:] |= entries[1:] != entries[:-1]
        entries += outline * np.int32(len(palette))
        lit_and_dark = np.concatenate([palette, _OUTLINE * palette]).astype(np.uint8)
        return Frames(lit_and_dark.take(entries, axis=0), depth, self.seen >> 3)


def _planes(low: NDArray[np.float64], high: NDArray[np.float64]) -> NDArray[np.float64]:
    """Where the planes of the sides of boxes lie from the eye, none nearer than a micrometre.

    Args:
        low, high: (..., 3) the corners relative to the eye.

    Returns:
        (..., 6) along their axes, in the order of ``_SHADES``.
    """
    low = np.where(np.abs(low) < _MICROMETRE, -_MICROMETRE, low)
    high = np.where(np.abs(high) < _MICROMETRE, _MICROMETRE, high)
    return np.stack([low, high], axis=-1).reshape(*low.shape[:-1], 6)


def _windows(
    camera: Camera, low: NDArray[np.float64], high: NDArray[np.float64], near: float
) -> list[Window | None]:
    """For each box the rectangle of pixels that holds it, None where that is empty."""
    corners = camera.to_view(np.where(_CORNERS, high[:, None], low[:, None]))  # (M, 8, 3)
    start, end = corners[:, _EDGES[:, 0]], corners[:, _EDGES[:, 1]]  # (M, 12, 3)
    # Where an edge passes the near plane, the point there bounds what can be seen of the box.
    passes = (start[..., 2] < near) != (end[..., 2] < near)
    with np.errstate(divide="ignore", invalid="ignore"):
        part = (near - start[..., 2]) / (end[..., 2] - start[..., 2])
        cuts = start + part[..., None] * (end - start)
    points = camera.to_pixels(np.concatenate([corners, cuts], axis=1))[..., :2]
    valid = np.concatenate([corners[..., 2] >= near, passes], axis=1)[..., None]
    size = (camera.width, camera.height)
    first = np.where(valid, points, np.inf).min(axis=1).clip(0, size)
    last = np.where(valid, points, -np.inf).max(axis=1).clip(0, size)
    return [
        (slice(y0, y1), slice(x0, x1)) if x0 < x1 and y0 < y1 else None
        for (x0, y0), (x1, y1) in zip(
            np.floor(first).astype(int).tolist(), np.ceil(last).astype(int).tolist(), strict=True
        )
    ]
