"""The lines of sight of a world.

Episodes begin alike and return to the same states. So the lines of sight of an arrangement are kept
and found again. Those of a new one are made from the arrangement that it differs from least: the
recorded one, or the one that ``SetObjectPoses`` made.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.remembering import get_or_compute
from er_gym.sim.scene import load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.exemptions import Exemptions
from er_gym.sim.space.line_of_sight import Floats, LinesOfSight, Rectangle
from er_gym.sim.space.outlines import Outlines
from er_gym.sim.space.solids import solid_of
from er_gym.sim.space.solids.sample_points import sample_points
from er_gym.sim.world import World
from er_gym.sim.world_cache import CacheKey

_ARRANGEMENTS_KEPT = 1024
_SAME_PLACE = 1e-6
"""An object whose coordinates and angles differ by less has not moved, metres and degrees."""
_LINES_OF_SIGHT: CacheKey[LinesOfSight] = CacheKey("lines of sight")
_known: OrderedDict[Any, LinesOfSight] = OrderedDict()


def lines_of_sight(world: World) -> LinesOfSight:
    """The lines of sight of the world as it is now."""
    found = world.cache.arrangement.get(_LINES_OF_SIGHT)
    if found is None:
        found = world.cache.arrangement.put(_LINES_OF_SIGHT, _find(world))
    return found


def _find(world: World) -> LinesOfSight:
    base_world = world.base or recorded_world(world.scene.name)
    base = lines_of_sight(base_world)
    if world.untouched:
        return base
    difference = _Difference.between(world, base_world, base)
    if not len(difference.moved) and np.array_equal(difference.concealed, base.concealed):
        return base
    return get_or_compute(
        _known,
        difference.key(world, base),
        _ARRANGEMENTS_KEPT,
        lambda: _update(world, base, difference),
    )


@lru_cache(maxsize=128)
def recorded_world(scene_name: str) -> World:
    """A scene as recorded, with its lines of sight; all share it, so it must not be changed."""
    world = World.load(load_scene(scene_name), Settings())
    world.cache.arrangement.put(_LINES_OF_SIGHT, compute_lines_of_sight(world))
    return world


def compute_lines_of_sight(world: World) -> LinesOfSight:
    """The lines of sight of the world as it is now, without those of any other arrangement."""
    rows = range(len(world))
    points = [sample_points(world, i) for i in rows]
    count = np.array([len(p) for p in points])
    concealed = _concealed(world)
    low, high, owner = _hiding_boxes(world, np.flatnonzero(~concealed).tolist())
    outlines = Outlines.of([solid_of(world, i) for i in rows])
    return LinesOfSight(
        points=np.concatenate(points).astype(np.float32),
        point_owner=np.repeat(np.arange(len(world)), count),
        first_point=count.cumsum() - count,
        point_count=count,
        box_low=low,
        box_high=high,
        box_owner=owner,
        exempt=Exemptions.of(world),
        removed_boxes=np.zeros(len(owner), dtype=bool),
        concealed=concealed,
        extent=_extent(outlines),
        base=None,
        moved_points=None,
        moved_objects=np.arange(len(world)),
        moved_outlines=outlines,
    )


def _concealed(world: World) -> NDArray[np.bool_]:
    """(N,) objects that are in something closed, in a hand or out of the scene."""
    found = world.hidden.copy()
    found[world.carried] = True
    return found


def _hiding_boxes(world: World, rows: Iterable[int]) -> tuple[Floats, Floats, NDArray[np.intp]]:
    """The boxes with which some objects hide others: (M, 3) corners, and (M,) their owners."""
    rows = list(rows)
    hiding = [np.empty((0, 2, 3)), *(solid_of(world, i).hiding for i in rows)]
    boxes = np.concatenate(hiding).astype(np.float32)
    return boxes[:, 0], boxes[:, 1], np.repeat(rows, [len(h) for h in hiding[1:]]).astype(np.intp)


def _extent(outlines: Outlines) -> Rectangle:
    """A rectangle that holds all outlines, whatever their headings."""
    radius = np.hypot(*np.maximum(np.abs(outlines.low), np.abs(outlines.high)).T)[:, None]
    west, south = (outlines.middle - radius).min(axis=0).tolist()
    east, north = (outlines.middle + radius).max(axis=0).tolist()
    return (west, south), (east, north)


def _union(one: Rectangle, other: Rectangle) -> Rectangle:
    """The rectangle around two."""
    ((a, b), (c, d)), ((e, f), (g, h)) = one, other
    return (min(a, e), min(b, f)), (max(c, g), max(d, h))


# -- from one arrangement to another ---------------------------------------------------------------


@dataclass(frozen=True)
class _Difference:
    """How a world differs from another arrangement, in what lines of sight depend on.

    Attributes:
        concealed: (N,) objects that are in something closed, in the hand or out of the scene.
        moved: rows of the other objects that are elsewhere, or in other receptacles, than there.
    """

    concealed: NDArray[np.bool_]
    moved: NDArray[np.intp]

    @staticmethod
    def between(world: World, base_world: World, base: LinesOfSight) -> _Difference:
        """The difference from ``base_world``, whose lines of sight are ``base``."""
        count = len(base_world)
        concealed = _concealed(world)
        displaced = np.array(world.displaced(), dtype=np.intp)
        rows = displaced[~concealed[displaced]]
        if not len(rows):
            return _Difference(concealed, rows)
        new, rows = rows[rows >= count], rows[rows < count]
        apart = np.abs(
            [
                world.low[rows] - base_world.low[rows],
                world.high[rows] - base_world.high[rows],
                world.rotation[rows] - base_world.rotation[rows],
            ]
        )
        moved = (apart > _SAME_PLACE).any(axis=(0, 2))
        within = world.nesting.within[rows]
        moved |= (within[:, :count] != base_world.nesting.within[rows]).any(axis=1)
        moved |= within[:, count:].any(axis=1)
        if base.base is not None:  # that arrangement did not test objects that it had concealed
            moved |= base.concealed[rows]
        return _Difference(concealed, np.concatenate([rows[moved], new]))

    def key(self, world: World, base: LinesOfSight) -> tuple[Any, ...]:
        """Equal for two worlds if their lines of sight are."""
        rows = self.moved
        return (
            base.serial,
            self.concealed.tobytes(),
            rows.tobytes(),
            world.low[rows].tobytes(),
            world.high[rows].tobytes(),
            world.rotation[rows].tobytes(),
            world.nesting.within[rows].tobytes(),
        )


def _update(world: World, base: LinesOfSight, difference: _Difference) -> LinesOfSight:
    """The lines of sight of the world as it is now, from those of another arrangement."""
    concealed, rows = difference.concealed, difference.moved
    count, old = len(world), len(base.point_count)
    was_concealed = np.ones(count, dtype=bool)
    was_concealed[:old] = base.concealed
    moved = np.zeros(count, dtype=bool)
    moved[rows] = True
    added = _hiding_boxes(world, np.flatnonzero(moved | (was_concealed & ~concealed)).tolist())
    owner = np.concatenate([base.box_owner, added[2]])
    is_new = np.arange(len(owner)) >= len(base.box_owner)
    removed = ~is_new & (moved | concealed)[owner]
    removed[: len(base.removed_boxes)] |= base.removed_boxes
    points = _Points(base.points, base.point_owner, base.first_point, base.point_count)
    if len(rows) or count > old:
        points = _update_points(world, base, rows)
    moved_points, outlines, extent = None, None, base.extent
    if len(rows):
        moved_points = moved[points.owner]
        outlines = Outlines.of([solid_of(world, i) for i in rows.tolist()])
        extent = _union(extent, _extent(outlines))
    return LinesOfSight(
        points=points.at,
        point_owner=points.owner,
        first_point=points.first,
        point_count=points.count,
        box_low=np.concatenate([base.box_low, added[0]]),
        box_high=np.concatenate([base.box_high, added[1]]),
        box_owner=owner,
        exempt=Exemptions.of(world),
        removed_boxes=removed,
        concealed=concealed,
        extent=extent,
        base=base,
        moved_points=moved_points,
        moved_objects=rows,
        moved_outlines=outlines,
    )


@dataclass(frozen=True)
class _Points:
    """Sample points, as :class:`LinesOfSight` has them."""

    at: Floats
    owner: NDArray[np.intp]
    first: NDArray[np.intp]
    count: NDArray[np.intp]


def _update_points(world: World, base: LinesOfSight, rows: NDArray[np.intp]) -> _Points:
    """The points of another arrangement, with those of the moved objects where they are now.

    The points of new objects come last.
    """
    old = len(base.point_count)
    points, new = [base.points.copy()], {}
    for i in rows[rows < old].tolist():
        # The object has as many points as before: they are spread over a box of the same size.
        first, count = base.first_point[i], base.point_count[i]
        points[0][first : first + count] = sample_points(world, i).astype(np.float32)
    for i in range(old, len(world)):  # concealed ones too: this may become the base of others
        points.append(sample_points(world, i).astype(np.float32))
        new[i] = len(points[-1])
    if len(world) == old:
        return _Points(points[0], base.point_owner, base.first_point, base.point_count)
    number = np.zeros(len(world), dtype=np.intp)
    number[:old] = base.point_count
    number[list(new)] = list(new.values())
    owner = np.repeat(np.arange(len(world)), number)
    return _Points(np.concatenate(points), owner, number.cumsum() - number, number)
