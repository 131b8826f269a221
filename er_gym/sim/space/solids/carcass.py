"""Counters: the slab, which is the CounterTop object, and the carcass under it, not an object.

The recorded box of nearly every counter is a slab 2 cm thick. Cabinets and drawers under it are
objects. The carcass between and behind them is not an object. Only a few counters reach down to the
floor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import PROPERTIES, Scene, load_scene
from er_gym.sim.space.recorded_surfaces import recorded_surfaces
from er_gym.sim.space.solids.built_in import Front, Rectangle, built_in, fronts
from er_gym.sim.space.solids.counter_tops import rectangles

SLAB = 0.035
"""Thickness of a counter's slab, metres."""
SUNK = 0.001
"""How far a slab ends below the objects on it, metres, because some of them are very thin."""
LET_IN = frozenset({"Sink", "Bathtub"})
"""Types that are let into a slab."""
LIP = 0.02
"""How far they overlap the edge of their hole, metres."""
_BACK = 0.03
"""How far the carcass stands back from the slab's edges, metres."""
_FAR_BACK = 0.3
"""The same, at most, if nothing is built in under the counter, metres."""
_BEHIND = 0.01
"""How far behind the fronts of built-in objects the carcass ends, metres."""
_DEEP = 0.35
"""Fronts farther in than this do not limit the carcass on its whole side, metres."""
_TOUCH = 0.05
"""Parts of a counter that are no farther apart than this have no edge between them, metres."""
TALL = 0.3
"""A counter with a higher box is its own carcass, metres."""
_NARROW = 0.3
"""A narrower counter with nothing built in under it is a shelf, metres."""
_NICHE = 0.02
"""Free space around an object that stands under a counter, metres."""
_LEAST = 0.08
"""Narrower pieces of a carcass are dropped, metres."""
_MOST_OF_IT = 0.75
"""A slab with a larger share on its carcass is not tested for hiding: it juts out too little."""
_ON_THE_FLOOR = 0.1
_OPEN_UNDER = frozenset({"Shelf", "ShelvingUnit"})
"""Fixed types under a counter that are open at their front."""


@dataclass(frozen=True, eq=False)
class Carcass:
    """The parts of a counter, in the world's frame, metres.

    Attributes:
        slab: (S, 2, 3) boxes, with holes for sinks.
        footprint: the rectangles on the floor that the carcass stands on.
        fitted: (K, 2, 3) boxes of the built-in cabinets and drawers.
        holes: (H, 2, 3) boxes of the sinks.
        floor, under: heights of the carcass's underside and top.
        own: whether the carcass is part of the counter's own box.
    """

    slab: NDArray[np.float64]
    footprint: tuple[Rectangle, ...]
    fitted: NDArray[np.float64]
    holes: NDArray[np.float64]
    floor: float
    under: float
    own: bool

    @property
    def hiding(self) -> NDArray[np.float64]:
        """(B, 2, 3) boxes that hide what is behind them. They are few, because each costs time.

        These are the carcass up to the top, hollow at sinks, and the slab if it juts out far.
        """
        found: list[NDArray[np.float64]] = []
        top = self.under + SLAB
        pits = [(low[0], low[2], high[0], high[2]) for low, high in self.holes]
        for rectangle in self.footprint:
            found += [_box(piece, self.floor, top) for piece in without(rectangle, pits)]
            for pit, (low, _) in zip(pits, self.holes, strict=True):
                piece = _common(rectangle, pit)
                if piece is not None and low[1] > self.floor:
                    found.append(_box(piece, self.floor, float(low[1])))
        covered = sum((x1 - x0) * (z1 - z0) for x0, z0, x1, z1 in self.footprint)
        whole = np.prod((self.slab[:, 1] - self.slab[:, 0])[:, [0, 2]], axis=1).sum()
        if covered < _MOST_OF_IT * whole:
            found += list(self.slab)
        return _stacked(found)


@lru_cache(maxsize=512)
def carcass(scene_name: str, i: int) -> Carcass:
    """The carcass of recorded counter i."""
    scene = load_scene(scene_name)
    half = scene.aabb_size[i] / 2
    low, high = scene.aabb_center[i] - half, scene.aabb_center[i] + half
    top = slab_top(scene_name, i)
    parts = [_flat(corners) for corners in rectangles(scene_name, i)]
    origin = np.array([scene.aabb_center[i, 0], low[1], scene.aabb_center[i, 2]])
    fitted = [(kind, np.array(box) + origin) for kind, box in built_in(scene_name, i)]
    let_in = [b for kind, b in fitted if kind in LET_IN and b[0, 1] < top - 0.05 < b[1, 1]]
    holes = _stacked(let_in)
    holes[:, 0, [0, 2]] += LIP
    holes[:, 1, [0, 2]] -= LIP
    pits = [_flat(box[:, [0, 2]]) for box in holes]
    under, tall = top - SLAB, bool(high[1] - low[1] > TALL)
    floor_row = scene.types.index("Floor")
    floor = float(scene.aabb_center[floor_row, 1] + scene.aabb_size[floor_row, 1] / 2)
    footprint: list[Rectangle] = []
    if fitted or tall or min(scene.aabb_size[i, [0, 2]]) > _NARROW:
        row = list(fronts(scene_name, i))
        niches = [] if tall else list(_niches(scene, floor, under))
        for k, part in enumerate(parts):
            others = parts[:k] + parts[k + 1 :]
            rest = _set_back(part, others, row, bool(fitted) or tall)
            open_to = [_open(rest, niche) for niche in niches]
            open_to += [_before(front, rest) for front in row]
            footprint += without(rest, [hole for hole in open_to if hole is not None])
    return Carcass(
        slab=_stacked([_box(p, under, top) for part in parts for p in without(part, pits)]),
        footprint=tuple(p for p in footprint if min(p[2] - p[0], p[3] - p[1]) > _LEAST),
        fitted=_stacked([box for kind, box in fitted if kind not in LET_IN]),
        holes=holes,
        floor=floor,
        under=under,
        own=tall,
    )


def slab_top(scene_name: str, i: int) -> float:
    """Height of recorded counter i's upper side, from the objects that the record shows on it."""
    scene = load_scene(scene_name)
    height = float(scene.aabb_size[i, 1])
    surface = recorded_surfaces(scene_name).get(i, height)
    return float(scene.aabb_center[i, 1]) - height / 2 + min(max(surface, 0.0), height) - SUNK


def _set_back(
    part: Rectangle, others: Sequence[Rectangle], row: Sequence[Front], fitted: bool
) -> Rectangle:
    """The carcass under one part of a counter: a little narrower, or much if nothing is built in.

    It is not narrower on a side where another part follows. On a side with fronts it ends at them.
    """
    x0, z0, x1, z1 = part
    back = _BACK if fitted else min(_FAR_BACK, 0.2 * min(x1 - x0, z1 - z0))
    beside = (
        (x0 - _TOUCH, z0, x0, z1), (x0, z0 - _TOUCH, x1, z0),
        (x1, z0, x1 + _TOUCH, z1), (x0, z1, x1, z1 + _TOUCH),
    )  # fmt: skip
    found = []
    for k, side in enumerate(beside):
        axis, sign = k % 2, 1 if k > 1 else -1
        if any(_common(side, other) is not None for other in others):
            found.append(part[k])
            continue
        edge = sign * part[k] - back
        before = [
            sign * f.at - _BEHIND
            for f in row
            if (f.axis, f.sign) == (axis, sign) and _before(f, part)
        ]
        near = [at for at in before if at > edge - _DEEP]
        found.append(sign * min(edge, max(near, default=edge)))
    return found[0], found[1], found[2], found[3]


def _before(front: Front, part: Rectangle) -> Rectangle | None:
    """The area of a part in front of a front, None if the front is not in the part."""
    ends, near, far = list(part), front.axis, front.axis + 2
    at = front.at - front.sign * _BEHIND
    if not part[near] < at < part[far]:
        return None
    ends[near if front.sign > 0 else far] = at
    ends[1 - front.axis], ends[3 - front.axis] = front.low, front.high
    return _common(part, (ends[0], ends[1], ends[2], ends[3]))


def _open(part: Rectangle, niche: Rectangle) -> Rectangle | None:
    """The area of a part that a niche takes up, as far as the nearest side; None if it takes up
    none."""
    common = _common(part, niche)
    if common is None:
        return None
    gaps = [abs(part[k] - common[k]) for k in range(4)]
    nearest = min(range(4), key=gaps.__getitem__)
    a, b, c, e = (part[k] if k == nearest else common[k] for k in range(4))
    return a, b, c, e


def _niches(scene: Scene, floor: float, under: float) -> list[Rectangle]:
    """The areas of objects that stand under a counter without being built in."""
    found = []
    moves = scene.properties[:, [PROPERTIES.index(name) for name in ("moveable", "pickupable")]]
    for j in range(len(scene)):
        low = scene.aabb_center[j] - scene.aabb_size[j] / 2
        high = low + scene.aabb_size[j]
        stands = moves[j].any() and low[1] < floor + _ON_THE_FLOOR
        if (stands or scene.types[j] in _OPEN_UNDER) and low[1] < under:
            found.append((low[0] - _NICHE, low[2] - _NICHE, high[0] + _NICHE, high[2] + _NICHE))
    return found


def without(rectangle: Rectangle, holes: Sequence[Rectangle]) -> list[Rectangle]:
    """A rectangle cut into pieces that leave holes open."""
    x0, z0, x1, z1 = rectangle
    for k, hole in enumerate(holes):
        common = _common(rectangle, hole)
        if common is not None:
            a, b, c, e = common
            pieces = ((x0, z0, x1, b), (x0, e, x1, z1), (x0, b, a, e), (c, b, x1, e))
            real = [p for p in pieces if p[2] - p[0] > 1e-6 and p[3] - p[1] > 1e-6]
            return [q for p in real for q in without(p, holes[k + 1 :])]
    return [rectangle]


def _common(one: Rectangle, other: Rectangle) -> Rectangle | None:
    a, b = max(one[0], other[0]), max(one[1], other[1])
    c, e = min(one[2], other[2]), min(one[3], other[3])
    return (a, b, c, e) if a < c and b < e else None


def _flat(corners: NDArray[np.float64]) -> Rectangle:
    (x0, z0), (x1, z1) = corners.tolist()
    return x0, z0, x1, z1


def _box(rectangle: Rectangle, low: float, high: float) -> NDArray[np.float64]:
    x0, z0, x1, z1 = rectangle
    return np.array([(x0, low, z0), (x1, high, z1)])


def _stacked(boxes: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.array(boxes, dtype=np.float64).reshape(-1, 2, 3)
