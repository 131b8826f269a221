"""What can be seen from where, in one arrangement of a scene's objects.

Episodes begin alike and return to the same states, so what was found out is kept (:func:`sights`).
An arrangement differs from the recorded one in a few objects: what was found out about that holds
but for those, so only lines of sight to them, and through where they were and are, are looked at.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import count as counter
from math import hypot
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.rays import Targets, blocked_by, crossings
from er_gym.sim.space.reach import Outlines
from er_gym.sim.space.solids import solid_of
from er_gym.sim.space.solids.sample_points import SLABS, SOLID, sample_points
from er_gym.sim.world import World
from er_gym.sim.world_cache import CacheKey

_RUN = 26
"""So many points, those of a small box, are held against a box at once before each is by itself."""
_ARRANGEMENTS = 1024
_VIEWPOINTS = 1024
_ANSWERS = 2048

Found = TypeVar("Found")
Floats = NDArray[np.float32]


_Rectangle = tuple[tuple[float, float], tuple[float, float]]
"""Corners x, z, metres."""


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """What is in the way of what, seen from one camera position.

    Attributes:
        point, box: (H,) which boxes are crossed on the way to which sample points.
        clear: (C,) the points that nothing hides and that are not shut away.
    """

    point: NDArray[np.uint16]
    box: NDArray[np.uint16]
    clear: NDArray[np.uint16]


@dataclass(frozen=True, eq=False)
class Sights:
    """The lines of sight of one arrangement.

    What is in the agent's hand hides nothing here and is not looked for: it is always seen.

    Attributes:
        points: (P, 3) sample points of all objects, metres; those of one object lie together.
        of: (P,) whose each is. first, count: (N,) where each object's points begin, how many.
        low, high: (M, 3) corners of boxes that hide things; whose: (M,) whose they are.
        own: (N, M) the boxes of each object and of what it lies in or on, which do not hide it.
        gone: (M,) boxes of earlier arrangements that are not there any more.
        pairs: (N, M) which boxes are to be asked about for whose points.
        away: (N,) which objects are shut away, in the hand or no more.
        reach: corners x, z of a rectangle around everything, metres.
        before: the arrangement that this one was made from by a few changes; None of the recorded
            one. A room that was arranged anew as a whole comes in between.
        anew: (P,) the points about which that one says nothing, None if there are none.
        moved: (K,) rows of the objects that are not where they were then.
        moved_outlines: theirs, from above; those of all objects in the recorded arrangement.
        number: its own.
    """

    points: Floats
    of: NDArray[np.intp]
    first: NDArray[np.intp]
    count: NDArray[np.intp]
    low: Floats
    high: Floats
    whose: NDArray[np.intp]
    own: NDArray[np.bool_]
    gone: NDArray[np.bool_]
    pairs: NDArray[np.bool_]
    away: NDArray[np.bool_]
    reach: _Rectangle
    before: Sights | None
    anew: NDArray[np.bool_] | None
    moved: NDArray[np.intp]
    moved_outlines: Outlines | None
    number: int = field(default_factory=counter().__next__)
    _viewpoints: OrderedDict[tuple[float, ...], Viewpoint] = field(default_factory=OrderedDict)
    _answers: OrderedDict[Any, Any] = field(default_factory=OrderedDict)

    # -- asking ----------------------------------------------------------------------------------

    def viewpoint(self, camera: NDArray[np.float64]) -> Viewpoint:
        """From a (3,) camera position."""
        return _kept(
            self._viewpoints, tuple(camera.tolist()), _VIEWPOINTS, lambda: self._look_from(camera)
        )

    def _look_from(self, camera: NDArray[np.float64]) -> Viewpoint:
        point = box = np.empty(0, dtype=np.uint16)
        if self.before is not None:
            recorded = self.before.viewpoint(camera)
            stays = ~self.gone.take(recorded.box)
            if self.anew is not None:
                stays &= ~self.anew.take(recorded.point)
            point, box = recorded.point[stays], recorded.box[stays]
        if self._questions is not None:
            targets, low, high, number, pairs = self._questions
            crossed, by = crossings(camera.astype(np.float32), targets, low, high, pairs)
            point = np.concatenate([point, crossed.astype(np.uint16)])
            box = np.concatenate([box, number.take(by)])
        clear = self._showing.copy()
        clear[point] = False
        return Viewpoint(point, box, clear.nonzero()[0].astype(np.uint16))

    @cached_property
    def _showing(self) -> NDArray[np.bool_]:
        return np.asarray(~self.away[self.of])

    @cached_property
    def axes(self) -> Floats:
        """(3, P) the points' coordinates, each axis by itself."""
        if self.before is not None and self.points is self.before.points:
            return self.before.axes
        return np.ascontiguousarray(self.points.T)

    @cached_property
    def _runs(self) -> tuple[NDArray[np.intp], Targets]:
        """The points in runs of a few, all of one object each: (K,) which, and the runs."""
        if self.before is not None and self.count is self.before.count:
            return self._runs_again(self.before)
        number = -(-self.count // _RUN)
        whose = np.repeat(np.arange(len(number)), number)
        place = np.arange(len(whose)) - np.repeat(number.cumsum() - number, number)
        first = place * self.count[whose] // number[whose]
        count = (place + 1) * self.count[whose] // number[whose] - first
        first += self.first[whose]
        low = np.minimum.reduceat(self.axes, first, axis=1)
        high = np.maximum.reduceat(self.axes, first, axis=1)
        return whose, Targets(self.axes, first, count, low, high)

    def _runs_again(self, before: Sights) -> tuple[NDArray[np.intp], Targets]:
        """The same runs as in another arrangement, where the points are now."""
        whose, runs = before._runs
        if self.points is before.points:
            return whose, runs
        low, high = runs.low.copy(), runs.high.copy()
        moved = np.zeros(len(self.count), dtype=bool)
        moved[self.moved] = True
        for k in moved[whose].nonzero()[0].tolist():
            run = self.axes[:, runs.first[k] : runs.first[k] + runs.count[k]]
            low[:, k], high[:, k] = run.min(axis=1), run.max(axis=1)
        return whose, Targets(self.axes, runs.first, runs.count, low, high)

    @cached_property
    def _questions(
        self,
    ) -> tuple[Targets, Floats, Floats, NDArray[np.uint16], NDArray[np.bool_]] | None:
        """The runs of points, and the boxes, that are in any of the pairs; None if there are none.

        Returns:
            The runs; (3, M) corners of the boxes, and their numbers; (K, M) the pairs.
        """
        whose, runs = self._runs
        asked = np.flatnonzero(np.any(self.pairs, axis=1)[whose])
        if not len(asked):
            return None
        pairs = self.pairs[whose[asked]]
        boxes = np.flatnonzero(np.any(pairs, axis=0))
        return (
            Targets(
                self.axes,
                runs.first[asked],
                runs.count[asked],
                runs.low[:, asked],
                runs.high[:, asked],
            ),
            np.ascontiguousarray(self.low[boxes].T),
            np.ascontiguousarray(self.high[boxes].T),
            boxes.astype(np.uint16),
            pairs[:, boxes],
        )

    def clear(self, eyes: NDArray[np.float64], points: Floats, i: int) -> NDArray[np.bool_]:
        """(E, Q) which (Q, 3) points of object i nothing hides from which (E, 3) positions."""
        origins = eyes.astype(np.float32)
        # What does not reach into the space between them all hides nothing.
        nearest = np.minimum(origins.min(axis=0), points.min(axis=0))
        farthest = np.maximum(origins.max(axis=0), points.max(axis=0))
        between = ~self.gone & ~self.own[i]
        between &= ((self.high >= nearest) & (self.low <= farthest)).all(axis=1)
        blocked = blocked_by(
            np.repeat(origins, len(points), axis=0),
            np.tile(points, (len(eyes), 1)),
            self.low[between],
            self.high[between],
        )
        return np.asarray(~blocked.any(axis=1).reshape(len(eyes), -1))

    def within(self, position: NDArray[np.float64], distance: float) -> NDArray[np.bool_] | None:
        """(N,) which objects are no farther than a distance from a (3,) position; metres.

        None when all are.
        """
        x, _, z = position.tolist()
        (west, south), (east, north) = self.reach
        if hypot(max(x - west, east - x), max(z - south, north - z)) <= distance:
            return None
        return np.asarray(self._gaps(position[[0, 2]]) <= distance)

    def _gaps(self, here: NDArray[np.float64]) -> NDArray[np.float64]:
        found = np.zeros(len(self.count))
        if self.before is not None:
            before = self.before
            gaps = before.remembered(("gaps", *here.tolist()), lambda: before._gaps(here))
            found[: len(gaps)] = gaps
        if self.moved_outlines is not None:
            found[self.moved] = self.moved_outlines.gaps(here[None])[0]
        return found

    def remembered(self, question: Any, answer: Callable[[], Found]) -> Found:
        """The answer to a question about this arrangement, worked out once."""
        found: Found = _kept(self._answers, question, _ANSWERS, answer)
        return found


def _kept(
    memory: OrderedDict[Any, Found], question: Any, limit: int, answer: Callable[[], Found]
) -> Found:
    """What is remembered, or worked out and remembered now; the longest unused is forgotten.

    Several threads may ask: what one finds there another may forget in the meantime.
    """
    with suppress(KeyError):
        known: Found = memory[question]
        memory.move_to_end(question)
        return known
    memory[question] = found = answer()
    if len(memory) > limit:
        memory.popitem(last=False)
    return found


# -- arrangements ----------------------------------------------------------------------------------


def _boxes(world: World, rows: Iterable[int]) -> tuple[Floats, Floats, NDArray[np.intp]]:
    """(M, 3) corners of what some objects hide things with, and (M,) whose they are."""
    rows = list(rows)
    hiding = [np.empty((0, 2, 3)), *(solid_of(world, i).hiding for i in rows)]
    boxes = np.concatenate(hiding).astype(np.float32)
    return boxes[:, 0], boxes[:, 1], np.repeat(rows, [len(h) for h in hiding[1:]]).astype(np.intp)


def _own(world: World, whose: NDArray[np.intp]) -> NDArray[np.bool_]:
    """(N, M) which boxes hide nothing of which object: its own, and those of what it lies in.

    Of what is seen from outside only, the own ones do; and a slab hides what lies on it. The
    carcass of a counter is hollow where an open cabinet or drawer in it is.
    """
    solid = np.isin(world.types, SOLID)
    mine = (np.arange(len(world))[:, None] == whose) & ~solid[:, None]
    slabs = np.isin(world.types, SLABS)
    found = mine | (world.nesting.within[:, whose] & ~slabs[whose])
    in_counter = world.nesting.within[:, list(world.of_type("Cabinet", "Drawer"))].any(axis=1)
    carcasses = np.isin(world.types, "CounterTop")[whose]
    found[np.ix_(in_counter, carcasses)] = True
    return np.asarray(found)


def _rectangle(outlines: Outlines) -> _Rectangle:
    """One that holds all parts, however they are turned."""
    radius = np.hypot(*np.maximum(np.abs(outlines.low), np.abs(outlines.high)).T)[:, None]
    west, south = (outlines.middle - radius).min(axis=0).tolist()
    east, north = (outlines.middle + radius).max(axis=0).tolist()
    return (west, south), (east, north)


def _both(one: _Rectangle, other: _Rectangle) -> _Rectangle:
    """The rectangle around two."""
    ((a, b), (c, d)), ((e, f), (g, h)) = one, other
    return (min(a, e), min(b, f)), (max(c, g), max(d, h))


def sights_anew(world: World) -> Sights:
    """The sights of the world as it is now, whatever is known of other arrangements."""
    rows = range(len(world))
    points = [sample_points(world, i) for i in rows]
    count = np.array([len(p) for p in points])
    of = np.repeat(np.arange(len(world)), count)
    away = world.hidden.copy()
    away[world.in_hand] = True
    low, high, whose = _boxes(world, np.flatnonzero(~away).tolist())
    own = _own(world, whose)
    outlines = Outlines.of([solid_of(world, i) for i in rows])
    return Sights(
        points=np.concatenate(points).astype(np.float32),
        of=of,
        first=count.cumsum() - count,
        count=count,
        low=low,
        high=high,
        whose=whose,
        own=own,
        gone=np.zeros(len(whose), dtype=bool),
        pairs=~own,
        away=away,
        reach=_rectangle(outlines),
        before=None,
        anew=None,
        moved=np.arange(len(world)),
        moved_outlines=outlines,
    )


_SIGHTS: CacheKey[Sights] = CacheKey("sights")


@lru_cache(maxsize=128)
def _as_recorded(scene_name: str) -> World:
    world = World.load(load_scene(scene_name), Settings())
    world.cache.arrangement.put(_SIGHTS, sights_anew(world))
    return world


_SAME = 1e-6
"""What has moved by less than this is where it was, metres."""


@dataclass(frozen=True)
class _Difference:
    """How the world differs from another arrangement, in what lines of sight depend on.

    Attributes:
        away: (N,) which objects are shut away, in the hand or no more.
        elsewhere: rows of the others that are not where they were, or lie in something else.
    """

    away: NDArray[np.bool_]
    elsewhere: NDArray[np.intp]

    @staticmethod
    def of(world: World, base: World, before: Sights) -> _Difference:
        """From ``base``, whose sights are known."""
        count = len(base)
        away = world.hidden.copy()
        away[world.in_hand] = True
        displaced = np.array(world.displaced(), dtype=np.intp)
        rows = displaced[~away[displaced]]
        if not len(rows):
            return _Difference(away, rows)
        new, rows = rows[rows >= count], rows[rows < count]
        apart = np.abs(
            [
                world.low[rows] - base.low[rows],
                world.high[rows] - base.high[rows],
                world.rotation[rows] - base.rotation[rows],
            ]
        )
        moved = (apart > _SAME).any(axis=(0, 2))
        within = world.nesting.within[rows]
        moved |= (within[:, :count] != base.nesting.within[rows]).any(axis=1)
        moved |= within[:, count:].any(axis=1)
        if before.before is not None:  # nothing was found out there about what was shut away
            moved |= before.away[rows]
        return _Difference(away, np.concatenate([rows[moved], new]))

    def key(self, world: World, before: Sights) -> tuple[Any, ...]:
        """What the arrangement can be known again by."""
        rows = self.elsewhere
        return (
            before.number,
            self.away.tobytes(),
            rows.tobytes(),
            world.low[rows].tobytes(),
            world.high[rows].tobytes(),
            world.rotation[rows].tobytes(),
            world.nesting.within[rows].tobytes(),
        )


def _changed(world: World, before: Sights, difference: _Difference) -> Sights:
    """The sights of the world as it is now, by what is different from another arrangement."""
    away, elsewhere = difference.away, difference.elsewhere
    count, old = len(world), len(before.count)
    was_away = np.ones(count, dtype=bool)
    was_away[:old] = before.away
    moved = np.zeros(count, dtype=bool)
    moved[elsewhere] = True
    come = _boxes(world, np.flatnonzero(moved | (was_away & ~away)).tolist())
    low = np.concatenate([before.low, come[0]])
    high = np.concatenate([before.high, come[1]])
    whose = np.concatenate([before.whose, come[2]])
    is_new = np.arange(len(whose)) >= len(before.whose)
    gone = ~is_new & (moved | away)[whose]
    gone[: len(before.gone)] |= before.gone
    own = _own(world, whose)
    # Of what stays, only what has come has to be asked about; of what moved, all that is there.
    pairs = ~own & np.where(moved[:, None], ~gone, is_new)
    points, of, first, number = before.points, before.of, before.first, before.count
    if len(elsewhere) or count > old:
        points, of, first, number = _with_points(world, before, elsewhere)
    anew, outlines, reach = None, None, before.reach
    if len(elsewhere):
        anew = moved[of]
        outlines = Outlines.of([solid_of(world, i) for i in elsewhere.tolist()])
        reach = _both(reach, _rectangle(outlines))
    return Sights(
        points=points,
        of=of,
        first=first,
        count=number,
        low=low,
        high=high,
        whose=whose,
        own=own,
        gone=gone,
        pairs=pairs,
        away=away,
        reach=reach,
        before=before,
        anew=anew,
        moved=elsewhere,
        moved_outlines=outlines,
    )


_Points = tuple[Floats, NDArray[np.intp], NDArray[np.intp], NDArray[np.intp]]


def _with_points(world: World, before: Sights, elsewhere: NDArray[np.intp]) -> _Points:
    """The recorded points, with those of what moved where they are now; new objects' at the end.

    Returns:
        ``points``, ``of``, ``first`` and ``count`` of the :class:`Sights` to be.
    """
    old = len(before.count)
    points, new = [before.points.copy()], {}
    for i in elsewhere[elsewhere < old].tolist():
        # As many as it had: they are spread over a box of the same size.
        own = sample_points(world, i).astype(np.float32)
        points[0][before.first[i] : before.first[i] + before.count[i]] = own
    for i in range(old, len(world)):  # what is shut away too: this may be another's `before`
        points.append(sample_points(world, i).astype(np.float32))
        new[i] = len(points[-1])
    if len(world) == old:
        return points[0], before.of, before.first, before.count
    number = np.zeros(len(world), dtype=np.intp)
    number[:old] = before.count
    number[list(new)] = list(new.values())
    of = np.repeat(np.arange(len(world)), number)
    return np.concatenate(points), of, number.cumsum() - number, number


_known: OrderedDict[Any, Sights] = OrderedDict()


def sights(world: World) -> Sights:
    """The sights of the world as it is now: those found before, if it was like this before."""
    found = world.cache.arrangement.get(_SIGHTS)
    if found is None:
        found = world.cache.arrangement.put(_SIGHTS, _found(world))
    return found


def _found(world: World) -> Sights:
    base = world.base or _as_recorded(world.scene.name)
    before = sights(base)
    if world.untouched:
        return before
    difference = _Difference.of(world, base, before)
    if not len(difference.elsewhere) and np.array_equal(difference.away, before.away):
        return before
    return _kept(
        _known,
        difference.key(world, before),
        _ARRANGEMENTS,
        lambda: _changed(world, before, difference),
    )
