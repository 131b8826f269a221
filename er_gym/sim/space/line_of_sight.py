"""What can be seen from where, in one arrangement of a scene's objects.

An arrangement differs from the recorded one in a few objects. What is known about the recorded
lines of sight still holds for all others. So each arrangement tests only the lines to the changed
objects, and those that cross a place where a changed object was or is.
:mod:`er_gym.sim.space.line_of_sight_builder` makes these records from a world.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from itertools import count as counter
from math import hypot
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.remembering import get_or_compute
from er_gym.sim.space.changes import MOST_CHANGES, Boxes, Changes, Known
from er_gym.sim.space.compiled_sight import CompiledSight, kernel
from er_gym.sim.space.exemptions import Exemptions
from er_gym.sim.space.frustum import Lens, in_frustum
from er_gym.sim.space.outlines import Outlines
from er_gym.sim.space.rays import Targets, blocked_by, crossings

_MOST_IN_GROUP = 26
"""Sample points, those of a small object, that are tested against a box together. If the box does
not reach between the eye and the group, the points are not tested one by one."""
_VIEWPOINTS_KEPT = 1024
_ANSWERS_KEPT = 2048
_VIEWS_KEPT = 512

T = TypeVar("T")
Floats = NDArray[np.float32]

Rectangle = tuple[tuple[float, float], tuple[float, float]]
"""Lower and upper corner, x and z, metres."""


@dataclass(frozen=True, eq=False)
class Viewpoint:
    """What blocks the view from one camera position.

    Attributes:
        blocked_point, blocking_box: (H,) pairs of a sample point and a box on the way to it.
        clear_points: (C,) the sample points of objects in the open that nothing hides, and perhaps
            hidden ones outside of the picture.
    """

    blocked_point: NDArray[np.uint16]
    blocking_box: NDArray[np.uint16]
    clear_points: NDArray[np.uint16]


@dataclass(frozen=True, eq=False)
class LinesOfSight:
    """The lines of sight of one arrangement, with N objects, P sample points and M boxes.

    The object in the agent's hand hides nothing here and is not looked for: it is always visible.

    Attributes:
        points: (P, 3) sample points of all objects, metres, object after object.
        point_owner: (P,) the object that each point belongs to.
        first_point, point_count: (N,) index of each object's first point, and their number.
        box_low, box_high: (M, 3) corners of the boxes that hide things, metres.
        box_owner: (M,) the object that each box belongs to.
        exempt: which boxes never hide an object: its own, and those of the receptacles that it is
            in.
        removed_boxes: (M,) the boxes of earlier arrangements that are no longer there.
        concealed: (N,) objects that are in something closed, in the hand or out of the scene.
        extent: a rectangle around everything.
        base: the arrangement that this one was made from, None if it was computed as a whole.
        moved_points: (P,) the points about which ``base`` says nothing, None if there are none.
        moved_objects: (K,) rows of the objects that are not where ``base`` has them; all if that
            is None.
        moved_outlines: the outlines of these objects, None if there are none.
        serial: a number that no other arrangement has.
    """

    points: Floats
    point_owner: NDArray[np.intp]
    first_point: NDArray[np.intp]
    point_count: NDArray[np.intp]
    box_low: Floats
    box_high: Floats
    box_owner: NDArray[np.intp]
    exempt: Exemptions
    removed_boxes: NDArray[np.bool_]
    concealed: NDArray[np.bool_]
    extent: Rectangle
    base: LinesOfSight | None
    moved_points: NDArray[np.bool_] | None
    moved_objects: NDArray[np.intp]
    moved_outlines: Outlines | None
    serial: int = field(default_factory=counter().__next__)
    _viewpoints: OrderedDict[Any, Viewpoint] = field(default_factory=OrderedDict)
    _views: OrderedDict[Any, NDArray[np.bool_]] = field(default_factory=OrderedDict)
    _answers: OrderedDict[Any, Any] = field(default_factory=OrderedDict)

    # -- asking ----------------------------------------------------------------------------------

    def viewpoint(self, camera: NDArray[np.float64], lens: Lens | None = None) -> Viewpoint:
        """What blocks the view from a (3,) camera position, metres.

        Args:
            lens: leave out what is not in this picture; the recorded arrangement, from which all
                others are made, leaves out nothing.
        """
        lens = None if self.base is None else lens
        return get_or_compute(
            self._viewpoints,
            (*camera.tolist(), lens),
            _VIEWPOINTS_KEPT,
            lambda: self._look_from(camera, lens),
        )

    def look(self, camera: NDArray[np.float64], lens: Lens) -> NDArray[np.bool_]:
        """(N,) the objects with a sample point that is in the picture and that nothing hides.

        Args:
            camera: (3,) its position, metres.
        """
        if kernel() is not None:
            return self._compiled.look(camera, lens)
        seen = np.zeros(len(self.point_count), dtype=bool)
        seen[self.point_owner[self.clear_in_view(camera, lens)]] = True
        return seen

    @cached_property
    def _compiled(self) -> CompiledSight:
        return CompiledSight(
            points=self.points,
            first_point=self.first_point,
            point_count=self.point_count,
            box_low=self.box_low,
            box_high=self.box_high,
            box_owner=self.box_owner,
            removed=self.removed_boxes,
            concealed=self.concealed,
            **self.exempt.arrays,
        )

    def clear_in_view(self, camera: NDArray[np.float64], lens: Lens) -> NDArray[np.uint16]:
        """The sample points in a picture that nothing hides."""
        clear = self.viewpoint(camera, lens).clear_points
        return clear[self._in_view(camera, lens).take(clear)]

    def _in_view(self, camera: NDArray[np.float64], lens: Lens) -> NDArray[np.bool_]:
        """(P,) the points that are inside a picture, whatever hides them."""
        if self.base is not None and self.points is self.base.points:
            return self.base._in_view(camera, lens)
        return get_or_compute(
            self._views,
            (*camera.tolist(), lens),
            _VIEWS_KEPT,
            # Four times as fast as coordinates in rows.
            lambda: in_frustum((self.coordinates - camera[:, None]).T, *lens),
        )

    def _look_from(self, camera: NDArray[np.float64], lens: Lens | None) -> Viewpoint:
        point = box = np.empty(0, dtype=np.uint16)
        if self.base is not None:
            known = self.base.viewpoint(camera, lens)
            stays = ~self.removed_boxes.take(known.blocking_box)
            if self.moved_points is not None:
                stays &= ~self.moved_points.take(known.blocked_point)
            point, box = known.blocked_point[stays], known.blocking_box[stays]
        eye = camera.astype(np.float32)
        known_changes = None if self._changes is None else self._changes.hidden_from(eye)
        if known_changes is not None:
            crossed, by = known_changes
            point, box = np.concatenate([point, *crossed]), np.concatenate([box, *by])
        elif self._tests is not None:
            targets, low, high, number, pairs = self._tests
            if lens is not None:
                # A group also counts where a point between it and the next group is in view.
                view = np.logical_or.reduceat(self._in_view(camera, lens), targets.first)
                pairs = pairs & view[:, None]
            hit, by_box = crossings(eye, targets, low, high, pairs)
            point = np.concatenate([point, hit.astype(np.uint16)])
            box = np.concatenate([box, number.take(by_box)])
        clear = self._in_the_open.copy()
        clear[point] = False
        return Viewpoint(point, box, clear.nonzero()[0].astype(np.uint16))

    @cached_property
    def _in_the_open(self) -> NDArray[np.bool_]:
        return np.asarray(~self.concealed[self.point_owner])

    @cached_property
    def coordinates(self) -> Floats:
        """(3, P) the points' x, y and z, metres."""
        if self.base is not None and self.points is self.base.points:
            return self.base.coordinates
        return np.ascontiguousarray(self.points.T)

    @cached_property
    def exempt_boxes(self) -> NDArray[np.bool_]:
        """(N, M) the boxes that never hide an object."""
        return self.exempt.of_objects(np.arange(len(self.point_count)), self.box_owner)

    @cached_property
    def _pairs_to_test(self) -> NDArray[np.bool_]:
        """(N, M) the boxes that have to be tested for an object's points."""
        if self.base is None:
            return ~self.exempt_boxes
        # An object that stays is tested against new boxes only, one that has moved against all.
        moved = np.zeros(len(self.point_count), dtype=bool)
        moved[self.moved_objects] = True
        is_new = np.arange(len(self.box_owner)) >= len(self.base.box_owner)
        return ~self.exempt_boxes & np.where(moved[:, None], ~self.removed_boxes, is_new)

    @cached_property
    def _changes(self) -> Changes | None:
        """What differs from the base, if that is little."""
        base = self.base
        if base is None:
            return None
        first_new = len(base.box_owner)
        if len({*self.box_owner[first_new:].tolist(), *self.moved_objects.tolist()}) > MOST_CHANGES:
            return None
        new = slice(first_new, None)
        owner, groups = base._groups
        own_owner, own_groups = self._groups
        mine = np.flatnonzero(np.isin(own_owner, self.moved_objects))
        return Changes.of(
            base.serial,
            Boxes(*_across(self.box_low[new], self.box_high[new]), self.box_owner[new], first_new),
            Boxes(*base._corners, base.box_owner, 0),
            Known(base.point_owner, owner, groups, base.exempt, base.removed_boxes),
            Known(
                self.point_owner,
                own_owner[mine],
                own_groups.some(mine),
                self.exempt,
                self.removed_boxes,
            ),
            self.moved_points,
        )

    @cached_property
    def _corners(self) -> tuple[Floats, Floats]:
        """(3, M) corners of the boxes, metres."""
        return _across(self.box_low, self.box_high)

    @cached_property
    def _groups(self) -> tuple[NDArray[np.intp], Targets]:
        """The points in small groups, each of one object: (K,) the objects, and the groups."""
        if self.base is not None and self.point_count is self.base.point_count:
            return self._groups_of_base(self.base)
        number = -(-self.point_count // _MOST_IN_GROUP)
        owner = np.repeat(np.arange(len(number)), number)
        place = np.arange(len(owner)) - np.repeat(number.cumsum() - number, number)
        first = place * self.point_count[owner] // number[owner]
        count = (place + 1) * self.point_count[owner] // number[owner] - first
        first += self.first_point[owner]
        low = np.minimum.reduceat(self.coordinates, first, axis=1)
        high = np.maximum.reduceat(self.coordinates, first, axis=1)
        return owner, Targets(self.coordinates, first, count, low, high)

    def _groups_of_base(self, base: LinesOfSight) -> tuple[NDArray[np.intp], Targets]:
        """The groups of another arrangement, with the points where they are now."""
        owner, groups = base._groups
        if self.points is base.points:
            return owner, groups
        low, high = groups.low.copy(), groups.high.copy()
        moved = np.zeros(len(self.point_count), dtype=bool)
        moved[self.moved_objects] = True
        for k in moved[owner].nonzero()[0].tolist():
            group = self.coordinates[:, groups.first[k] : groups.first[k] + groups.count[k]]
            low[:, k], high[:, k] = group.min(axis=1), group.max(axis=1)
        return owner, Targets(self.coordinates, groups.first, groups.count, low, high)

    @cached_property
    def _tests(
        self,
    ) -> tuple[Targets, Floats, Floats, NDArray[np.uint16], NDArray[np.bool_]] | None:
        """The groups and the boxes that occur in ``_pairs_to_test``; None if there are none.

        Returns:
            The groups; (3, M) lower and upper corners of the boxes; their (M,) numbers; and the
            (K, M) pairs of a group and a box.
        """
        owner, groups = self._groups
        tested = np.flatnonzero(np.any(self._pairs_to_test, axis=1)[owner])
        if not len(tested):
            return None
        pairs = self._pairs_to_test[owner[tested]]
        boxes = np.flatnonzero(np.any(pairs, axis=0))
        return (
            groups.some(tested),
            *_across(self.box_low[boxes], self.box_high[boxes]),
            boxes.astype(np.uint16),
            pairs[:, boxes],
        )

    def unobstructed(self, eyes: NDArray[np.float64], points: Floats, i: int) -> NDArray[np.bool_]:
        """(E, Q) whether nothing hides a point of object i from an eye.

        Args:
            eyes: (E, 3) camera positions, metres.
            points: (Q, 3) metres.
        """
        if kernel() is not None:
            return self._compiled.unobstructed(eyes, points, i)
        origins = eyes.astype(np.float32)
        # A box that does not reach into the space between eyes and points hides nothing.
        nearest = np.minimum(origins.min(axis=0), points.min(axis=0))
        farthest = np.maximum(origins.max(axis=0), points.max(axis=0))
        between = ~self.removed_boxes & ~self.exempt.of_objects(np.array([i]), self.box_owner)[0]
        between &= ((self.box_high >= nearest) & (self.box_low <= farthest)).all(axis=1)
        blocked = blocked_by(
            np.repeat(origins, len(points), axis=0),
            np.tile(points, (len(eyes), 1)),
            self.box_low[between],
            self.box_high[between],
        )
        return np.asarray(~blocked.any(axis=1).reshape(len(eyes), -1))

    def within_distance(
        self, position: NDArray[np.float64], distance: float
    ) -> NDArray[np.bool_] | None:
        """(N,) whether each object is within a distance of a (3,) position; None if all are.

        Args:
            distance: along the floor, metres.
        """
        x, _, z = position.tolist()
        (west, south), (east, north) = self.extent
        if hypot(max(x - west, east - x), max(z - south, north - z)) <= distance:
            return None
        return np.asarray(self._gaps(position[[0, 2]]) <= distance)

    def _gaps(self, here: NDArray[np.float64]) -> NDArray[np.float64]:
        found = np.zeros(len(self.point_count))
        if self.base is not None:
            base = self.base
            gaps = base.cached(("gaps", *here.tolist()), lambda: base._gaps(here))
            found[: len(gaps)] = gaps
        if self.moved_outlines is not None:
            found[self.moved_objects] = self.moved_outlines.gaps(here[None])[0]
        return found

    def cached(self, question: Any, compute: Callable[[], T]) -> T:
        """The answer to a question about this arrangement, computed once."""
        found: T = get_or_compute(self._answers, question, _ANSWERS_KEPT, compute)
        return found


def _across(low: Floats, high: Floats) -> tuple[Floats, Floats]:
    """(3, M) corners of (M, 3) ones, each in one piece of memory."""
    return np.ascontiguousarray(low.T), np.ascontiguousarray(high.T)
