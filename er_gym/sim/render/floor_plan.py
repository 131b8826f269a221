"""The walls of a room seen from above: a rectangle without the areas that nobody can reach.

Walls are not objects, and no record holds them. Each side of the rectangle is just behind the
outermost object on that side. Empty areas where nobody can stand are cut from it: behind pictures,
light switches and windows that hang further inside, and in empty corners. An area is not cut if its
wall would hide an object from where the agent can stand.

Points are (x, z), metres, AI2-THOR's frame.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import Scene, load_scene, scene_category
from er_gym.sim.shell import Opening, Room, Shell
from er_gym.sim.space.room_bounds import room_bounds

Floats = NDArray[np.float64]
_BEHIND = 0.01
"""Distance from an object to the wall behind it, metres."""
_BODY, _ROOM = 0.22, 0.3
"""Least distance from where the agent can stand to a wall with something on it, and to a bare wall,
metres."""
_GAP = 0.6
"""An object farther than this from all others is not in the room, metres."""
_IN_LINE = 0.12
"""Two objects hang on the same wall if their distances to it differ by less, metres."""
_THIN = 0.35
"""Thickness of a window up to which it goes into the wall, metres."""
_STEP = 0.2
"""Shallower recesses get no wall, metres."""
_SHORT = 0.4
"""Narrower recesses get no wall, metres."""
_OVERHANG = 0.25
"""How much farther out than a picture an object beside it may be, metres."""
_CORNER = 0.9
"""Smaller empty corners are not cut, metres."""
_SEEN = 1.7
"""Objects nearer than this must stay visible, metres."""
_HIDDEN = 0.34
"""Share of such an object that a wall may hide."""
_CEILING = 0.1
"""Distance from the top of the scene's bounds down to the ceiling, metres."""
_HALF = 0.01
"""Half the thickness of the walls of houses, metres."""
_THROUGH = 0.03
"""How far a hole in a wall of a house reaches to each side of the wall, metres."""
_STOREY = 2.4
"""The least height of a room, metres."""
_HANGERS = frozenset(
    {
        "LightSwitch", "Painting", "Mirror", "Poster", "Window", "TowelHolder", "HandTowelHolder",
        "ToiletPaperHanger", "Blinds", "Curtains",
    }
)  # fmt: skip
"""Types that hang flat on walls."""
_NOT_BEFORE_WALLS = frozenset({"Floor", "Faucet"})
"""Types that do not show where walls are: the boxes of faucets end inside the wall."""
_INTO_WALLS = {"CounterTop": 0.3, "Fridge": 0.2, "Toilet": 0.08, "Cabinet": 0.06, "Sink": 0.06}
"""How far the boxes of these types may extend into a wall, metres."""
_SHOWERS = frozenset({"ShowerDoor", "ShowerGlass"})
"""Types that towels hang on as well. Behind them is a part of the room where nobody can stand."""


@dataclass(frozen=True)
class Rectangle:
    """A rectangle between a lower and an upper corner."""

    low: tuple[float, float]
    high: tuple[float, float]


@dataclass(frozen=True)
class Wall:
    """A straight stretch of wall.

    Attributes:
        axis: 0 if it is at one x, 1 if it is at one z.
        at: that coordinate.
        sign: 1 or -1, the direction along the axis that it faces.
        low, high: its ends along the other axis.
    """

    axis: int
    at: float
    sign: int
    low: float
    high: float


@dataclass(frozen=True, eq=False)
class FloorPlan:
    """The floor plan of a room.

    Attributes:
        xs (X,), zs (Z,): the lines that divide the room into fields.
        inside: (X - 1, Z - 1) whether each field belongs to the room.
        walls: the walls around it.
        holes: boxes ((3,), (3,)) of the windows, where walls are open.
        ground, ceiling: heights.
        inset: how far the walls stand inside the fields: behind those of a house is another room.
    """

    xs: Floats
    zs: Floats
    inside: NDArray[np.bool_]
    walls: tuple[Wall, ...]
    holes: tuple[tuple[Floats, Floats], ...]
    ground: float
    ceiling: float
    inset: float = 0.0

    def contains(self, point: Floats) -> bool:
        """Whether (x, z) is in the room."""
        i = int(np.searchsorted(self.xs, point[0])) - 1
        k = int(np.searchsorted(self.zs, point[1])) - 1
        rows, columns = self.inside.shape
        return bool(0 <= i < rows and 0 <= k < columns and self.inside[i, k])


@lru_cache(maxsize=128)
def floor_plan(scene_name: str) -> FloorPlan:
    """The floor plan of a scene; of a house, that of all its rooms together."""
    scene = load_scene(scene_name)
    if scene.shell is not None:
        return plan_of_rooms(scene.shell.rooms, scene.shell)
    half = scene.aabb_size / 2
    low, high = scene.aabb_center - half, scene.aabb_center + half
    floor = scene.types.index("Floor")
    plot = _Plot.of(scene)
    cuts = plot.cuts()
    xs, zs, inside = _fields(plot.outer, cuts)
    windows = [i for i, kind in enumerate(scene.types) if kind == "Window"]
    return FloorPlan(
        xs=xs,
        zs=zs,
        inside=inside,
        walls=tuple(_walls(xs, zs, inside)),
        holes=tuple((low[i], high[i]) for i in windows),
        ground=float(high[floor, 1]),
        ceiling=float(max(room_bounds(scene_name)[1][1] - _CEILING, high[floor, 1] + _STOREY)),
    )


def plan_of_rooms(rooms: Sequence[Room], shell: Shell) -> FloorPlan:
    """The plan of some rooms of a house: its walls are those around them, not between them."""
    corners = np.array([corner for room in rooms for corner in room.polygon])
    xs, zs = (np.unique(corners[:, axis].round(4)) for axis in (0, 1))
    x, z = (xs[1:] + xs[:-1]) / 2, (zs[1:] + zs[:-1]) / 2
    inside = np.any([room.contains(x[:, None], z) for room in rooms], axis=0)
    return FloorPlan(
        xs=xs,
        zs=zs,
        inside=inside,
        walls=tuple(
            replace(wall, at=wall.at + wall.sign * _HALF) for wall in _walls(xs, zs, inside)
        ),
        holes=tuple(_hole(opening) for opening in shell.openings),
        ground=shell.ground,
        ceiling=shell.ceiling,
        inset=_HALF,
    )


def _hole(opening: Opening) -> tuple[Floats, Floats]:
    low, high = np.zeros(3), np.zeros(3)
    across, along = 2 * opening.axis, 2 - 2 * opening.axis
    low[across], high[across] = opening.at - _THROUGH, opening.at + _THROUGH
    low[along], high[along] = opening.span
    low[1], high[1] = opening.heights
    return low, high


@dataclass(frozen=True, eq=False)
class _Plot:
    """The data that a floor plan is made from.

    Attributes:
        places: (P, 2) where the agent can stand.
        low, high: (N, 2) boxes of the objects, without the Floor.
        windows, hangers: (N,) whether each object is one.
        bathroom: has showers and recesses that are neither reachable nor objects.
        outer: the rectangle around everything.
    """

    places: Floats
    low: Floats
    high: Floats
    windows: NDArray[np.bool_]
    hangers: NDArray[np.bool_]
    bathroom: bool
    outer: Rectangle

    @staticmethod
    def of(scene: Scene) -> _Plot:
        kept = [i for i, kind in enumerate(scene.types) if kind not in _NOT_BEFORE_WALLS]
        center, half = scene.aabb_center[kept][:, ::2], scene.aabb_size[kept][:, ::2] / 2
        kinds = [scene.types[i] for i in kept]
        windows = np.array([kind == "Window" for kind in kinds])
        showers = [k for k, kind in enumerate(kinds) if kind in _SHOWERS]
        hangers = np.array([kind in _HANGERS for kind in kinds])
        low, high, places = center - half, center + half, scene.reachable
        for k in showers:
            hangers &= (low > high[k] + 0.1).any(axis=1) | (high < low[k] - 0.1).any(axis=1)
        into = np.array([_INTO_WALLS.get(kind, 0.0) for kind in kinds])
        hung = [hangers & (half[:, axis] < 0.5 * _THIN) for axis in (0, 1)]
        sides = [
            (
                -_side(-places, -high, -low, windows, into, hung[axis], axis),
                _side(places, low, high, windows, into, hung[axis], axis),
            )
            for axis in (0, 1)
        ]
        return _Plot(
            places=places,
            low=low,
            high=high,
            windows=windows,
            hangers=hangers,
            bathroom=scene_category(scene.name) == "bathrooms",
            outer=Rectangle((sides[0][0], sides[1][0]), (sides[0][1], sides[1][1])),
        )

    def cuts(self) -> list[Rectangle]:
        """The areas that do not belong to the room."""
        found: list[Rectangle] = []
        corners = () if self.bathroom else self._corners()
        for choices in itertools.chain(self._behind_hangers(), corners):
            best = next((cut for cut in choices if not self._hides(cut)), None)
            if best is not None:
                found.append(best)
        return found

    def _behind_hangers(self) -> Iterator[Iterator[Rectangle]]:
        for i in np.flatnonzero(self.hangers).tolist():
            size = self.high[i] - self.low[i]
            axis = int(size.argmin())
            if size[axis] < min(_THIN, 0.7 * size[1 - axis]):
                yield self._behind(i, axis, -1)
                yield self._behind(i, axis, 1)

    def _behind(self, i: int, axis: int, sign: int) -> Iterator[Rectangle]:
        """The areas behind hanger i, the largest first, if its wall is on the side ``sign``."""
        along, end = 1 - axis, sign * (self.outer.high if sign > 0 else self.outer.low)[axis]
        left, right = float(self.low[i, along]), float(self.high[i, along])
        near, far, low, high = self._blocking(axis, sign)
        # Objects beside it may stick out a little more.
        start, beside = self._plane(i, axis, sign), (low < right - 0.02) & (high > left + 0.02)
        for reach in np.sort(far[beside & (near < start)]):
            if start < reach < start + _OVERHANG:
                start = float(reach)
        ahead = far > start + 0.03
        if end - start < _STEP or (beside & ahead).any():
            return
        first = max([self.outer.low[along], *high[ahead & (high <= left + 0.02)].tolist()])
        last = min([self.outer.high[along], *low[ahead & (low >= right - 0.02)].tolist()])
        across = (min(sign * start, sign * end), max(sign * start, sign * end))
        for a, b in ((first, last), (left, last), (first, right), (left, right)):
            if b - a > _SHORT:
                yield _rectangle(axis, across, (a, b))

    def _blocking(self, axis: int, sign: int) -> tuple[Floats, Floats, Floats, Floats]:
        """The boxes that limit a cut: their near and far sides, and their ends along the other
        axis."""
        low = np.concatenate([self.low - _BEHIND, self.places - _BODY])
        high = np.concatenate([self.high + _BEHIND, self.places + _BODY])
        near, far = (low, high) if sign > 0 else (-high, -low)
        ends = far[:, axis].copy()
        # Windows go into the wall.
        ends[: len(self.low)] = self._faces(axis, sign) + _BEHIND
        return near[:, axis], ends, low[:, 1 - axis], high[:, 1 - axis]

    def _plane(self, i: int, axis: int, sign: int) -> float:
        """How far out the wall behind hanger i is: of several hangers almost in line, the
        outermost."""
        faces = self._faces(axis, sign)
        near = self.hangers & (np.abs(faces - faces[i]) < _IN_LINE)
        return float(faces[near].max()) + _BEHIND

    def _faces(self, axis: int, sign: int) -> Floats:
        """(N,) how far out the back of each object is; of windows the front."""
        return _faces(
            *((self.low, self.high) if sign > 0 else (-self.high, -self.low)), self.windows, axis
        )

    def _corners(self) -> Iterator[Iterator[Rectangle]]:
        """The empty rectangles at each of the four corners, the largest first."""
        outer_low, outer_high = np.array(self.outer.low), np.array(self.outer.high)
        low = np.concatenate([self.low - _BEHIND, self.places - _ROOM])
        high = np.concatenate([self.high + _BEHIND, self.places + _ROOM])
        for signs in itertools.product((-1, 1), repeat=2):
            sign = np.array(signs)
            corner = np.where(sign > 0, outer_high, outer_low)
            away = np.where(sign > 0, corner - high, low - corner)
            sizes = _empty(np.maximum(away, 0.0), outer_high - outer_low)
            yield (_between(corner, corner - sign * size) for size in sizes if min(size) > _CORNER)

    def _hides(self, cut: Rectangle) -> bool:
        """Whether a cut would hide an object from a position near it."""
        low, high = np.array(cut.low) + 0.02, np.array(cut.high) - 0.02
        beside = np.linalg.norm(self.places - np.clip(self.places, low, high), axis=1) < _SEEN
        places = self.places[beside]
        nearest = np.clip(places[:, None], self.low, self.high)
        near = np.linalg.norm(nearest - places[:, None], axis=2) < _SEEN
        place, thing = np.nonzero(near)
        hidden = np.zeros(len(place))
        shares = list(itertools.product((0.1, 0.5, 0.9), repeat=2))
        for share in shares:
            point = self.low[thing] + np.array(share) * (self.high - self.low)[thing]
            hidden += _crosses(places[place], point, low, high)
        return bool((hidden > _HIDDEN * len(shares)).any())


def _faces(low: Floats, high: Floats, windows: NDArray[np.bool_], axis: int) -> Floats:
    thin = windows & (high[:, axis] - low[:, axis] < _THIN)
    return np.where(thin, low[:, axis] + 0.03, high[:, axis])


def _side(
    places: Floats,
    low: Floats,
    high: Floats,
    windows: NDArray[np.bool_],
    into: Floats,
    hung: NDArray[np.bool_],
    axis: int,
) -> float:
    """The wall's coordinate on the side of higher coordinates.

    The wall is just behind all objects. If something hangs there and no object extends behind it
    too far, the wall is behind the hanging object.
    """
    standing = float(places[:, axis].max()) + _ROOM
    starts, ends = low[:, axis], _faces(low, high, windows, axis) + _BEHIND
    far, near = _outermost(standing, starts, ends), _outermost(standing, starts, ends - into)
    backs = ends[hung & (near - _IN_LINE < ends) & (ends <= far)]
    return max(near, float(backs.max())) if len(backs) else far


def _outermost(found: float, starts: Floats, ends: Floats) -> float:
    """The far end of the objects that follow one another without large gaps."""
    for start, end in sorted(zip(starts.tolist(), ends.tolist(), strict=True)):
        if start < found + _GAP:
            found = max(found, end)
    return found


def _between(one: Floats, other: Floats) -> Rectangle:
    (x0, z0), (x1, z1) = np.sort([one, other], axis=0).tolist()
    return Rectangle((x0, z0), (x1, z1))


def _rectangle(axis: int, across: tuple[float, float], along: tuple[float, float]) -> Rectangle:
    (a, b), (c, d) = across, along
    return Rectangle((a, c), (b, d)) if axis == 0 else Rectangle((c, a), (d, b))


def _empty(away: Floats, most: Floats) -> list[tuple[float, float]]:
    """Sizes of rectangles at (0, 0) without any of the points (K, 2); the largest area first."""
    found, width = [], float(most[0])
    for x, z in sorted(away.tolist(), key=lambda point: float(point[1])):
        if x < width:
            found.append((width, float(z)))
            width = x
    found.append((width, float(most[1])))
    return sorted(found, key=lambda size: -size[0] * size[1])


def _crosses(start: Floats, end: Floats, low: Floats, high: Floats) -> NDArray[np.bool_]:
    """(K,) whether each line between (K, 2) points crosses a rectangle."""
    step = end - start
    step = np.where(np.abs(step) < 1e-9, 1e-9, step)
    one, two = (low - start) / step, (high - start) / step
    enters, leaves = np.minimum(one, two).max(axis=1), np.maximum(one, two).min(axis=1)
    return np.asarray((enters < leaves) & (leaves > 0) & (enters < 1))


def _fields(
    outer: Rectangle, cuts: Iterable[Rectangle]
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """The lines along x and z that divide the room into fields, and whether each field is in it."""
    kept = list(cuts)
    lines = []
    for axis in (0, 1):
        ends = [outer.low[axis], outer.high[axis]]
        ends += [end for cut in kept for end in (cut.low[axis], cut.high[axis])]
        lines.append(np.unique(np.clip(np.round(ends, 4), ends[0], ends[1])))
    xs, zs = lines
    x, z = (xs[1:] + xs[:-1]) / 2, (zs[1:] + zs[:-1]) / 2
    inside = np.ones((len(x), len(z)), dtype=bool)
    for cut in kept:
        inside &= ~np.outer(
            (cut.low[0] < x) & (x < cut.high[0]), (cut.low[1] < z) & (z < cut.high[1])
        )
    return xs, zs, inside


def _walls(xs: Floats, zs: Floats, inside: NDArray[np.bool_]) -> Iterator[Wall]:
    """The straight walls around the fields that are inside."""
    for axis, (lines, across) in enumerate(((xs, zs), (zs, xs))):
        fields = np.pad(inside if axis == 0 else inside.T, ((1, 1), (0, 0)))
        for k, at in enumerate(lines.tolist()):
            for sign in (-1, 1):
                behind, here = fields[k : k + 2][::sign]
                edge = np.flatnonzero(np.diff(np.pad((here & ~behind).astype(int), 1)))
                for first, last in edge.reshape(-1, 2).tolist():
                    yield Wall(axis, at, sign, float(across[first]), float(across[last]))
