"""Meshes, put together from simple solids.

An object's own frame is AI2-THOR's: x to its right, y up, z to its front. The origin is in the
middle of its underside. Lengths are metres, angles degrees. Colours are red, green and blue from 0
to 1; more than 1 glows. The order of corners matters only for :meth:`Mesh.quad`: triangles are
turned to face along their normals.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from math import pi
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_gym.sim.render.box_faces import (
    BOX_CORNERS,
    BOX_NORMALS,
    BOX_SPREAD,
    CUT_CORNERS,
    CUT_COUNTS,
    CUT_FLAT,
    CUT_NORMALS,
    FACES,
    SIGNS,
    SQUARE,
    fans,
)
from er_gym.sim.render.patch import PLAIN, Axis, Patch, Triple, merged, rotation

_AXES: Mapping[str, tuple[int, int, int]] = {"x": (1, 2, 0), "y": (0, 1, 2), "z": (0, 2, 1)}
"""The axes of a solid made about y that become x, y and z of a solid about each axis."""


class Mesh:
    """The solids of one object, by material."""

    def __init__(self) -> None:
        self._parts: dict[str, list[Patch]] = {}

    def patches(self) -> dict[str, Patch]:
        """The triangles of each material."""
        return {material: merged(parts) for material, parts in self._parts.items()}

    def __bool__(self) -> bool:
        return bool(self._parts)

    # -- putting together ------------------------------------------------------------------------

    def add(
        self,
        other: Mesh,
        *,
        at: ArrayLike = (0.0, 0.0, 0.0),
        turn: tuple[Axis, float] | None = None,
        about: ArrayLike = (0.0, 0.0, 0.0),
        scale: ArrayLike = 1.0,
    ) -> None:
        """Add another mesh: scaled, then turned about a point, then shifted.

        A door is ``mesh.add(door, turn=("y", -90 * openness), about=hinge)``.
        """
        matrix = np.eye(3) if turn is None else rotation(*turn)
        factor = np.broadcast_to(np.asarray(scale, dtype=np.float64), 3)
        pivot = np.asarray(about, dtype=np.float64)
        for material, parts in other._parts.items():
            for p in parts:
                vertices = (p.vertices * factor - pivot) @ matrix.T + pivot + np.asarray(at)
                normals = p.normals / factor @ matrix.T
                self.triangles(material, vertices, normals, p.uv, p.colours, p.triangles)

    def triangles(
        self,
        material: str,
        vertices: ArrayLike,
        normals: ArrayLike,
        uv: ArrayLike,
        colour: ArrayLike,
        triangles: ArrayLike,
    ) -> None:
        """Add triangles; a colour for all, or (V, 3) one for each vertex."""
        points = np.asarray(vertices, dtype=np.float32).reshape(-1, 3)
        patch = Patch(
            points,
            np.asarray(normals, dtype=np.float32).reshape(-1, 3),
            np.asarray(uv, dtype=np.float32).reshape(-1, 2),
            np.broadcast_to(np.asarray(colour, dtype=np.float32), points.shape),
            np.asarray(triangles, dtype=np.int32).reshape(-1, 3),
        )
        self._parts.setdefault(material, []).append(patch)

    # -- flat things -----------------------------------------------------------------------------

    def quad(
        self,
        corners: ArrayLike,
        colour: ArrayLike,
        material: str = PLAIN,
        *,
        uv: ArrayLike = ((0, 0), (1, 0), (1, 1), (0, 1)),
        both: bool = False,
    ) -> None:
        """A quadrangle; its corners go anticlockwise seen from the front. ``both``: it has two
        fronts."""
        points = np.asarray(corners, dtype=np.float64)
        normal = np.cross(points[2] - points[0], points[1] - points[0])
        for out in (normal, -normal) if both else (normal,):
            self.triangles(
                material, points, np.tile(out, (4, 1)), uv, colour, [(0, 1, 2), (0, 2, 3)]
            )

    def panel(
        self,
        at: Triple,
        size: tuple[float, float],
        colour: ArrayLike,
        material: str = PLAIN,
        *,
        facing: Literal["x", "X", "y", "Y", "z", "Z"] = "Z",
        turns: float | None = None,
    ) -> None:
        """An upright or level rectangle (width, height) about a middle point.

        A picture on it is upright for a viewer in front of it.

        Args:
            facing: the axis that it faces; a capital letter is the positive direction.
            turns: metres of one repeat of the texture; None for the texture once over the whole.
        """
        w, h = size[0] / 2, size[1] / 2
        right, up = {
            "Z": ((-1, 0, 0), (0, 1, 0)),
            "z": ((1, 0, 0), (0, 1, 0)),
            "X": ((0, 0, 1), (0, 1, 0)),
            "x": ((0, 0, -1), (0, 1, 0)),
            "Y": ((-1, 0, 0), (0, 0, -1)),
            "y": ((-1, 0, 0), (0, 0, 1)),
        }[facing]
        r, u, middle = np.array(right), np.array(up), np.array(at)
        corners = [middle + a * w * r + b * h * u for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
        repeat = (1.0, 1.0) if turns is None else (size[0] / turns, size[1] / turns)
        uv = np.array([(0, 0), (1, 0), (1, 1), (0, 1)]) * repeat
        out = np.zeros(3)
        out["xyz".index(facing.lower())] = 1.0 if facing.isupper() else -1.0
        faces = [(0, 1, 2), (0, 2, 3)]
        self.triangles(material, corners, np.tile(out, (4, 1)), uv, colour, faces)

    # -- solids ----------------------------------------------------------------------------------

    def box(
        self,
        at: Triple,
        size: Triple,
        colour: ArrayLike,
        material: str = PLAIN,
        *,
        faces: str = "xXyYzZ",
        taper: float = 1.0,
        turns: float = 1.0,
    ) -> None:
        """A box about a middle point.

        Args:
            faces: the visible faces.
            taper: width of its top as a share of its bottom's.
            turns: metres of one repeat of the texture.
        """
        half = np.abs(np.asarray(size, dtype=np.float64)) / 2
        kept = [FACES.index(face) for face in faces]
        corners, scale = BOX_CORNERS[kept] * half, BOX_SPREAD[kept] @ half
        uv = SQUARE * scale[:, None] / turns
        if taper != 1.0:
            corners[corners[..., 1] > 0] *= (taper, 1.0, taper)
        self.triangles(
            material,
            corners.reshape(-1, 3) + np.asarray(at),
            np.repeat(BOX_NORMALS[kept], 4, axis=0),
            uv.reshape(-1, 2),
            colour,
            fans([4] * len(kept)),
        )

    def rounded(
        self,
        at: Triple,
        size: Triple,
        colour: ArrayLike,
        radius: float,
        material: str = PLAIN,
        *,
        turns: float = 1.0,
    ) -> None:
        """A box whose edges and corners are cut off at ``radius``, so that they catch the light."""
        half = np.abs(np.asarray(size, dtype=np.float64)) / 2
        cut = min(radius, *(0.9 * half))
        # Each corner has three points, one on each of its faces.
        points = np.repeat((SIGNS * (half - cut))[:, None], 3, axis=1)
        for axis in range(3):
            points[:, axis, axis] = SIGNS[:, axis] * half[axis]

        found = points[CUT_CORNERS[:, 0], CUT_CORNERS[:, 1]]
        uv = np.take_along_axis(found, CUT_FLAT, axis=1) / turns
        self.triangles(material, found + np.asarray(at), CUT_NORMALS, uv, colour, fans(CUT_COUNTS))

    def lathe(
        self,
        profile: Iterable[tuple[float, float]],
        colour: ArrayLike,
        material: str = PLAIN,
        *,
        at: Triple = (0.0, 0.0, 0.0),
        axis: Axis = "y",
        segments: int = 14,
        squash: tuple[float, float] = (1.0, 1.0),
        smooth: bool = True,
        turns: tuple[float, float] = (1.0, 1.0),
    ) -> None:
        """A surface of revolution: a profile of (radius, height) swept about an axis.

        The outside is on the left of the profile. A profile that goes up at the outside, in over
        the top and down at the inside makes a vessel.

        Args:
            colour: one colour, or (2 * (segments + 1), 3) for the lower and the upper end of every
                band.
            squash: factors of the radius along the two other axes.
            turns: repeats of the texture around, and metres of height of one repeat.
        """
        line = np.asarray(list(profile), dtype=np.float64)
        step = np.diff(line, axis=0)
        out = np.stack([step[:, 1], -step[:, 0]], axis=1)
        out /= np.maximum(np.linalg.norm(out, axis=1, keepdims=True), 1e-9)
        below, above = out.copy(), out.copy()
        if smooth:  # smooth shading where the profile bends only a little
            bends = (out[:-1] * out[1:]).sum(axis=1) > 0.5
            below[1:][bends] += out[:-1][bends]
            above[:-1][bends] += out[1:][bends]
        ends = np.stack([line[:-1], line[1:]], axis=1)[..., None]  # (S, 2, 2, 1): radius, height
        leaning = np.stack([below, above], axis=1)[..., None]
        angle = np.arange(segments + 1) / segments * 2 * pi
        c, s = np.cos(angle), np.sin(angle)
        points = np.empty((len(step), 2, len(angle), 3))
        normals, uv = np.empty_like(points), np.empty((*points.shape[:3], 2))
        points[..., 0], points[..., 2] = ends[:, :, 0] * c, ends[:, :, 0] * s
        points[..., 1] = ends[:, :, 1]
        points *= (squash[0], 1.0, squash[1])
        normals[..., 0], normals[..., 2] = leaning[:, :, 0] * c, leaning[:, :, 0] * s
        normals[..., 1] = leaning[:, :, 1]
        normals /= (squash[0], 1.0, squash[1])
        uv[..., 0], uv[..., 1] = angle / (2 * pi) * turns[0], ends[:, :, 1] / turns[1]
        first = np.arange(segments)
        second = first + len(angle)
        lower = np.stack([first, first + 1, second], axis=1)
        upper = np.stack([first + 1, second + 1, second], axis=1)
        start = 2 * len(angle) * np.arange(len(step))[:, None, None]
        round_below, round_above = line[:-1, 0] > 1e-6, line[1:, 0] > 1e-6  # and not a point
        faces = [(lower + start)[round_below], (upper + start)[round_above]]
        order, shades = list(_AXES[axis]), np.asarray(colour, dtype=np.float32)
        self.triangles(
            material,
            points.reshape(-1, 3)[:, order] + np.asarray(at),
            normals.reshape(-1, 3)[:, order],
            uv.reshape(-1, 2),
            shades if shades.ndim == 1 else np.tile(shades, (len(step), 1)),
            np.concatenate([part.reshape(-1, 3) for part in faces]),
        )

    def cylinder(
        self,
        at: Triple,
        radius: float,
        height: float,
        colour: ArrayLike,
        material: str = PLAIN,
        *,
        top: float | None = None,
        axis: Axis = "y",
        segments: int = 12,
    ) -> None:
        """A cylinder about a middle point; ``top`` is the radius at its upper end, for cones."""
        upper, half = radius if top is None else top, height / 2
        profile = [(0.0, -half), (radius, -half), (upper, half), (0.0, half)]
        self.lathe(profile, colour, material, at=at, axis=axis, segments=segments)

    def ball(
        self,
        at: Triple,
        size: Triple,
        colour: ArrayLike,
        material: str = PLAIN,
        *,
        segments: int = 12,
        rings: int = 8,
    ) -> None:
        """An ellipsoid about a middle point."""
        t = np.linspace(-pi / 2, pi / 2, rings + 1)
        radius = np.cos(t) / 2 * size[0]
        radius[[0, -1]] = 0.0
        profile = list(zip(radius.tolist(), (np.sin(t) / 2 * size[1]).tolist(), strict=True))
        squash = (1.0, size[2] / size[0])
        self.lathe(profile, colour, material, at=at, segments=segments, squash=squash)

    def prism(
        self,
        outline: ArrayLike,
        low: float,
        high: float,
        colour: ArrayLike,
        material: str = PLAIN,
        *,
        axis: Axis = "y",
        turns: float = 1.0,
    ) -> None:
        """A prism: a convex outline (K, 2), extended along an axis from ``low`` to ``high``.

        The outline is in (x, z) for y, in (z, y) for x, in (x, y) for z.
        """
        ring = np.asarray(outline, dtype=np.float64)
        u, v = {"y": (0, 2), "x": (2, 1), "z": (0, 1)}[axis]
        w = "xyz".index(axis)
        middle = ring.mean(axis=0)

        def lift(points: NDArray[np.float64], height: float) -> NDArray[np.float64]:
            found = np.zeros((len(points), 3))
            found[:, u], found[:, v], found[:, w] = points[:, 0], points[:, 1], height
            return found

        fan = [(0, k, k + 1) for k in range(1, len(ring) - 1)]
        for height, sign in ((low, -1.0), (high, 1.0)):
            out = np.zeros(3)
            out[w] = sign
            self.triangles(
                material,
                lift(ring, height),
                np.tile(out, (len(ring), 1)),
                ring / turns,
                colour,
                fan,
            )
        for a, b in zip(ring, np.roll(ring, -1, axis=0), strict=True):
            side = b - a
            normal = np.array([side[1], -side[0]])
            normal *= np.sign(normal @ ((a + b) / 2 - middle)) or 1.0
            out = np.zeros(3)
            out[u], out[v] = normal
            pair = np.array([a, b])
            corners = np.concatenate([lift(pair, low), lift(pair[::-1], high)])
            along = float(np.linalg.norm(side)) / turns
            uv = [(0, low / turns), (along, low / turns), (along, high / turns), (0, high / turns)]
            self.triangles(
                material, corners, np.tile(out, (4, 1)), uv, colour, [(0, 1, 2), (0, 2, 3)]
            )

    def tube(
        self,
        path: ArrayLike,
        radius: float,
        colour: ArrayLike,
        material: str = PLAIN,
        *,
        segments: int = 7,
    ) -> None:
        """A round rod along a path (K, 3), closed at both ends."""
        points = np.asarray(path, dtype=np.float64)
        for a, b in itertools.pairwise(points):
            along = b - a
            length = float(np.linalg.norm(along))
            if length < 1e-9:
                continue
            up = along / length
            side = np.cross(up, (0.0, 0.0, 1.0) if abs(up[2]) < 0.9 else (1.0, 0.0, 0.0))
            side /= np.linalg.norm(side)
            frame = np.stack([side, up, np.cross(side, up)])
            rod = Mesh()
            rod.cylinder(
                (0.0, length / 2, 0.0), radius, length, colour, material, segments=segments
            )
            for name, parts in rod._parts.items():
                for p in parts:
                    self.triangles(
                        name,
                        p.vertices @ frame + a,
                        p.normals @ frame,
                        p.uv,
                        p.colours,
                        p.triangles,
                    )

    def skin(
        self,
        rings: ArrayLike,
        colour: ArrayLike,
        material: str = PLAIN,
        *,
        closed: bool = True,
        smooth: bool = True,
        both: bool = False,
        turns: tuple[float, float] = (1.0, 1.0),
    ) -> None:
        """A surface through rings of points (R, K, 3): a lathe with a free cross-section.

        Rings that go up at the outside, in over the top and down at the inside make a vessel. Each
        ring must go round in the direction from +x to +z.

        Args:
            colour: one for all, or (R, K, 3).
            closed: whether rings return to their first point; if not, the surface is a sheet.
            smooth: whether a ring is shaded smoothly where it bends by less than 60 degrees.
            both: whether the surface has two fronts.
            turns: repeats of the texture along a ring, and from the first ring to the last.
        """
        points = np.asarray(rings, dtype=np.float64)
        tints = np.broadcast_to(np.asarray(colour, dtype=np.float64), points.shape)
        if closed:
            points, tints = (np.concatenate([a, a[:, :1]], axis=1) for a in (points, tints))
        r, k = points.shape[0] - 1, points.shape[1] - 1
        out = np.cross(points[1:, 1:] - points[:-1, :-1], points[:-1, 1:] - points[1:, :-1])
        out /= np.maximum(np.linalg.norm(out, axis=2, keepdims=True), 1e-9)
        left, right = out.copy(), out.copy()
        if smooth:
            before, after = np.roll(out, 1, axis=1), np.roll(out, -1, axis=1)
            if not closed:
                before[:, 0], after[:, -1] = out[:, 0], out[:, -1]
            left += before * ((before * out).sum(axis=2, keepdims=True) > 0.5)
            right += after * ((after * out).sum(axis=2, keepdims=True) > 0.5)
        place = [np.s_[:-1, :-1], np.s_[:-1, 1:], np.s_[1:, 1:], np.s_[1:, :-1]]
        corners = np.stack([points[at] for at in place], axis=2).reshape(-1, 3)
        tint = np.stack([tints[at] for at in place], axis=2).reshape(-1, 3)
        normals = np.stack([left, right, right, left], axis=2).reshape(-1, 3)
        u, v = np.linspace(0, turns[0], k + 1), np.linspace(0, turns[1], r + 1)
        grid = np.stack(np.meshgrid(u, v), axis=2)
        uv = np.stack([grid[at] for at in place], axis=2).reshape(-1, 2)
        first = 4 * np.arange(r * k)[:, None]
        faces = (first[:, None] + [[0, 1, 2], [0, 2, 3]]).reshape(-1, 3)
        for side in (1, -1) if both else (1,):
            self.triangles(material, corners, side * normals, uv, tint, faces)
