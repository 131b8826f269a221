"""The shell of a room: floor, walls, ceiling, skirting boards and a door. These are not objects.

Its colours include the light, which is darker towards edges. Walls have one side, towards the room,
so a camera outside or above looks through them. Windows stand in holes of the walls.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.doorway import WIDTH, Doorway, door, doorway
from er_gym.sim.render.floor_plan import Floats, FloorPlan, Wall
from er_gym.sim.render.lighting import light
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import Palette, mixed, shaded
from er_gym.sim.render.patch import Colour, Patch, merged
from er_gym.sim.render.room_plans import RoomPlan, room_plans

_CEILING: Colour = (0.97, 0.97, 0.95)
_SKIRTING: Colour = (0.93, 0.92, 0.89)
_BOARD, _BOARD_DEPTH = 0.09, 0.015
"""Height and thickness of the skirting board, metres."""
_TILED = 1.3
"""Height up to which a bathroom's walls are tiled, metres."""
_SEAM = 0.02
"""How far surfaces overlap at edges, metres."""
_STRIDE = 1.1
"""Distance between vertices in the middle of a surface, metres."""
_NEAR_EDGES = (0.13, 0.4)
"""Distances from an edge with additional vertices, metres."""
_DARK, _FADES = 0.26, 0.24
"""How much darker a corner is, and the distance within which that fades, metres."""


@dataclass(frozen=True, eq=False)
class RoomShell:
    """Lit triangles by material, in the world's frame.

    Attributes:
        floor: the object of type Floor.
        rest: everything else.
    """

    floor: dict[str, Patch]
    rest: dict[str, Patch]


@dataclass(frozen=True)
class _Band:
    """The covering of a wall between two heights above the floor."""

    low: float
    high: float
    material: str
    colour: Colour
    turns: float


@lru_cache(maxsize=128)
def room_shell(scene_name: str) -> RoomShell:
    """The shell of a scene: of a house, the shells of its rooms."""
    shells = [_of_room(scene_name, room) for room in room_plans(scene_name)]
    if len(shells) == 1:
        return shells[0]
    return RoomShell(
        _together([each.floor for each in shells]), _together([each.rest for each in shells])
    )


def _together(rooms: list[dict[str, Patch]]) -> dict[str, Patch]:
    """The patches of several rooms, by material."""
    materials = dict.fromkeys(material for room in rooms for material in room)
    return {name: merged([room[name] for room in rooms if name in room]) for name in materials}


def _of_room(scene_name: str, room: RoomPlan) -> RoomShell:
    plan, colours = room.plan, room.colours
    floor, rest = Mesh(), Mesh()
    material, turns = room.flooring
    _level(floor, plan, plan.ground, 1.0, colours.floor, material, turns)
    _level(rest, plan, plan.ceiling, -1.0, _CEILING, "plain", 2.0)
    entry = doorway(scene_name)
    for wall in plan.walls:
        holes = tuple(_holes(plan, wall))
        for band in _bands(room.category, colours, plan.ceiling - plan.ground):
            _upright(rest, plan, wall, band, holes)
        for hole in holes:
            _reveal(rest, wall, hole, mixed(colours.wall, (1.0, 1.0, 1.0), 0.5))
        _skirt(rest, plan, wall, holes, entry)
    if entry is not None:
        x, z = entry.at
        rest.add(door(colours, scene_name), turn=("y", entry.yaw), at=(x, plan.ground, z))
    return RoomShell(_lit(floor, plan), _lit(rest, plan))


def _bands(kind: str, colours: Palette, height: float) -> Iterator[_Band]:
    start = 0.0
    if kind == "bathrooms":
        start = _TILED + 0.06
        tile = mixed(colours.wall, (1.0, 1.0, 1.0), 0.35)
        yield _Band(0.0, _TILED, "wall_tiles", tile, 1.2)
        yield _Band(_TILED, start, "plain", mixed(colours.accent, colours.wall, 0.35), 1.0)
    yield _Band(start, height, "plain", colours.wall, 2.0)


# -- surfaces ------------------------------------------------------------------------------------


def _ticks(low: float, high: float, more: tuple[float, ...] = ()) -> Floats:
    """The coordinates of vertices between two edges, closer to each other near the edges."""
    length = high - low
    found = [low, high, *(at for at in more if low < at < high)]
    if length > 3 * _NEAR_EDGES[1]:
        found += [end for off in _NEAR_EDGES for end in (low + off, high - off)]
        start, end = low + _NEAR_EDGES[1], high - _NEAR_EDGES[1]
        found += np.linspace(start, end, 1 + int(np.ceil((end - start) / _STRIDE))).tolist()
    elif length > 2 * _NEAR_EDGES[1]:
        found += [low + _NEAR_EDGES[0], high - _NEAR_EDGES[0]]
    return np.unique(np.round(found, 4))


def _level(
    mesh: Mesh,
    plan: FloorPlan,
    height: float,
    up: float,
    colour: Colour,
    material: str,
    turns: float,
) -> None:
    """A floor or a ceiling, made of the room's fields."""
    xs, zs = (
        np.unique(np.concatenate([_ticks(a, b) for a, b in itertools.pairwise(lines.tolist())]))
        for lines in (plan.xs, plan.zs)
    )
    x, z = (xs[1:] + xs[:-1]) / 2, (zs[1:] + zs[:-1]) / 2
    kept = plan.inside[
        np.ix_(np.searchsorted(plan.xs, x) - 1, np.searchsorted(plan.zs, z) - 1)
    ]  # fmt: skip
    points = np.stack(np.meshgrid(xs, [height], zs, indexing="ij"), axis=-1).reshape(-1, 3)
    uv = points[:, ::2] / turns
    if np.ptp(plan.zs) > np.ptp(plan.xs):  # boards run along the longer side
        uv = uv[:, ::-1]
    _grid(mesh, points, uv, (0.0, up, 0.0), colour, material, kept)


def _grid(
    mesh: Mesh,
    points: Floats,
    uv: Floats,
    out: tuple[float, float, float],
    colour: Colour,
    material: str,
    kept: NDArray[np.bool_],
) -> None:
    """The fields (A - 1, B - 1) of a grid of points (A * B, 3) for which ``kept`` is true."""
    rows, columns = kept.shape
    corner = np.add.outer(np.arange(rows) * (columns + 1), np.arange(columns))[kept]
    a, b, c, d = corner, corner + 1, corner + columns + 2, corner + columns + 1
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    used, faces = np.unique(faces, return_inverse=True)
    if len(used):
        normals = np.tile(out, (len(used), 1))
        mesh.triangles(material, points[used], normals, uv[used], colour, faces.reshape(-1, 3))


def _world(wall: Wall, along: Floats, heights: Floats, depth: float = 0.0) -> Floats:
    """(K, 3) points from their distance along a wall, their height, and their depth behind the
    wall."""
    points = np.empty((len(along), 3))
    points[:, 2 * wall.axis] = wall.at - wall.sign * depth
    points[:, 2 - 2 * wall.axis] = along
    points[:, 1] = heights
    return points


def _out(wall: Wall) -> tuple[float, float, float]:
    sign = float(wall.sign)
    return (sign, 0.0, 0.0) if wall.axis == 0 else (0.0, 0.0, sign)


def _upright(
    mesh: Mesh, plan: FloorPlan, wall: Wall, band: _Band, holes: tuple[_Hole, ...]
) -> None:
    """A wall between two heights, with holes."""
    low, high = plan.ground + band.low, plan.ground + band.high
    along = _ticks(wall.low, wall.high, tuple(end for h in holes for end in (h.left, h.right)))
    edges = tuple(end for h in holes for end in (h.low, h.high))
    heights = np.unique(np.concatenate([[low, high], _ticks(plan.ground, plan.ceiling, edges)]))
    heights = heights[(heights >= low - 1e-6) & (heights <= high + 1e-6)]
    middle = (along[1:] + along[:-1]) / 2, (heights[1:] + heights[:-1]) / 2
    kept = np.ones((len(along) - 1, len(heights) - 1), dtype=bool)
    for hole in holes:
        kept &= ~np.outer(
            (hole.left < middle[0]) & (middle[0] < hole.right),
            (hole.low < middle[1]) & (middle[1] < hole.high),
        )
    low_end, high_end = _ends(plan, wall)
    along[0], along[-1] = low_end, high_end
    heights[heights <= plan.ground] -= _SEAM
    heights[heights >= plan.ceiling] += _SEAM
    s, y = np.meshgrid(along, heights, indexing="ij")
    uv = np.stack([s.ravel(), y.ravel() - plan.ground], axis=1) / band.turns
    points = _world(wall, s.ravel(), y.ravel())
    _grid(mesh, points, uv, _out(wall), band.colour, band.material, kept)


def _ends(plan: FloorPlan, wall: Wall) -> tuple[float, float]:
    """The ends of a wall, a little behind the walls that it meets, so that no gap shows."""
    ends = []
    for end, outward in ((wall.low, -1.0), (wall.high, 1.0)):
        beyond = _world(wall, np.array([end + 0.01 * outward]), np.zeros(1), -0.01)[0, ::2]
        if plan.inset:  # the walls that it meets have moved: towards it, or away from it
            ends.append(end + plan.inset * outward if plan.contains(beyond) else end)
        else:
            ends.append(end if plan.contains(beyond) else end + _SEAM * outward)
    return ends[0], ends[1]


# -- windows and skirting boards -----------------------------------------------------------------


@dataclass(frozen=True)
class _Hole:
    """A hole in a wall: from ``left`` to ``right`` along it, from ``low`` to ``high``, metres."""

    left: float
    right: float
    low: float
    high: float
    depth: float


def _holes(plan: FloorPlan, wall: Wall) -> Iterator[_Hole]:
    """The holes for windows that go through a wall."""
    axis, along, rim = 2 * wall.axis, 2 - 2 * wall.axis, 0.004
    for low, high in plan.holes:
        front, back = (low, high) if wall.sign < 0 else (-high, -low)
        at = -wall.sign * wall.at
        left, right = max(low[along] - rim, wall.low), min(high[along] + rim, wall.high)
        through = front[axis] < at + 0.02 and back[axis] > at + 0.012
        if through and right - left > 0.05:
            yield _Hole(
                float(left),
                float(right),
                max(float(low[1]) - rim, plan.ground),
                min(float(high[1]) + rim, plan.ceiling),
                float(back[axis]) - at,
            )


def _reveal(mesh: Mesh, wall: Wall, hole: _Hole, colour: Colour) -> None:
    """The inside of a hole, as deep as the wall is thick."""
    corners = ((hole.left, hole.low), (hole.right, hole.low), (hole.right, hole.high),
               (hole.left, hole.high))  # fmt: skip
    along, height = np.mean(corners, axis=0)
    middle = _world(wall, np.array([along]), np.array([height]))[0]
    for one, other in zip(corners, (*corners[1:], corners[0]), strict=True):
        ends = np.array([one, other])
        front = _world(wall, ends[:, 0], ends[:, 1])
        back = _world(wall, ends[::-1, 0], ends[::-1, 1], hole.depth)
        out = middle - front.mean(axis=0)
        out[np.abs(out) < np.abs(out).max()] = 0.0
        mesh.triangles(
            "plain", np.concatenate([front, back]), np.tile(out, (4, 1)), np.zeros((4, 2)), colour,
            [(0, 1, 2), (0, 2, 3)],
        )  # fmt: skip


def _skirt(
    mesh: Mesh, plan: FloorPlan, wall: Wall, holes: tuple[_Hole, ...], entry: Doorway | None
) -> None:
    """A skirting board along a wall, with gaps at windows and doors that reach the floor."""
    gaps = [(h.left, h.right) for h in holes if h.low < plan.ground + _BOARD]
    if entry is not None and entry.wall == wall:
        gaps.append((entry.along - WIDTH / 2, entry.along + WIDTH / 2))
    start = wall.low
    for left, right in (*sorted(gaps), (wall.high, wall.high)):
        if left - start > 0.02:
            _board(mesh, plan.ground, wall, start, left)
        start = max(start, right)


def _board(mesh: Mesh, ground: float, wall: Wall, left: float, right: float) -> None:
    ends = np.array([left, right, right, left])
    top, bottom = ground + _BOARD, ground
    front = _world(wall, ends, np.array([bottom, bottom, top, top]), -_BOARD_DEPTH)
    shelf = _world(wall, ends, np.full(4, top))
    shelf[:2] = front[[3, 2]]
    faces, uv = [(0, 1, 2), (0, 2, 3)], np.zeros((4, 2))
    mesh.triangles("plain", front, np.tile(_out(wall), (4, 1)), uv, _SKIRTING, faces)
    mesh.triangles(
        "plain", shelf, np.tile((0.0, 1.0, 0.0), (4, 1)), uv, shaded(_SKIRTING, 0.9), faces
    )


# -- light ---------------------------------------------------------------------------------------


def _lit(mesh: Mesh, plan: FloorPlan) -> dict[str, Patch]:
    """The patches of a mesh with the light of the room in their colours."""
    return {
        material: Patch(
            patch.vertices,
            patch.normals,
            patch.uv,
            np.clip(patch.colours * _level_of_light(plan, patch)[:, None], 0.0, 1.0),
            patch.triangles,
        )
        for material, patch in mesh.patches().items()
    }


def _level_of_light(plan: FloorPlan, patch: Patch) -> NDArray[np.float32]:
    """(V,) brightness: more even on walls than on objects, and darker towards edges."""
    up = patch.normals[:, 1]
    level = np.where(np.abs(up) < 0.5, 0.62 + 0.5 * light(patch.normals), light(patch.normals))
    level = np.where(up < -0.5, 0.95, level)
    points = patch.vertices + 0.02 * patch.normals
    for away in _distances(plan, points, patch.normals):
        level = level * (1.0 - _DARK * np.exp(-away / _FADES))
    return np.asarray(level, np.float32)


def _distances(
    plan: FloorPlan, points: NDArray[np.float32], normals: NDArray[np.float32]
) -> Iterator[NDArray[np.float32]]:
    """(V,) distances of points to the floor, the ceiling and each wall.

    The distance is infinite if the point is not in front of the wall, or if its surface lies along
    the wall: that wall does not darken it.
    """
    lies_along = np.abs(normals) > 0.7
    for away in (points[:, 1] - plan.ground, plan.ceiling - points[:, 1]):
        yield np.where(lies_along[:, 1], np.inf, np.maximum(away, 0.0))
    for wall in plan.walls:
        away = wall.sign * (points[:, 2 * wall.axis] - wall.at)
        along = points[:, 2 - 2 * wall.axis]
        before = (away > -1.5 * _SEAM) & (wall.low - 1e-3 < along) & (along < wall.high + 1e-3)
        before &= ~lies_along[:, 2 * wall.axis]
        yield np.where(before, np.maximum(away, 0.0), np.inf)
