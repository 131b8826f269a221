"""What the few changes to an arrangement hide, each remembered by itself.

An agent opens, takes and puts things, and each such change soon meets many others. What a new box
hides of the objects that stay, and what the boxes that stay hide of a moved object, does not depend
on the other changes. So both are remembered for each change and camera position, and a new
arrangement of known changes needs no ray but those between the changes.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.exemptions import Exemptions
from er_gym.sim.space.rays import Floats, Targets, crossings

MOST_CHANGES = 24
"""With more new boxes and moved objects than this, one test of all is quicker."""
_KEPT = 1 << 16
"""Effects that are kept in a process, some 0.3 KB each."""

Numbers = NDArray[np.uint16]
_effects: OrderedDict[Hashable, tuple[Numbers, Numbers]] = OrderedDict()


def _keep(key: Hashable, effect: tuple[Numbers, Numbers]) -> tuple[Numbers, Numbers]:
    _effects[key] = effect
    if len(_effects) > _KEPT:
        with suppress(KeyError):  # another thread has just dropped the last
            _effects.popitem(last=False)
    return effect


class Boxes(NamedTuple):
    """Boxes that hide things: (M, 3) corners in metres, (M,) owners, the number of the first."""

    low: Floats
    high: Floats
    owner: NDArray[np.intp]
    first: int


class Known(NamedTuple):
    """Groups of sample points, (K,) their owners, (P,) the owners of all points, and which boxes
    need no test for them."""

    point_owner: NDArray[np.intp]
    owner: NDArray[np.intp]
    groups: Targets
    exempt: Exemptions
    removed_boxes: NDArray[np.bool_]


class _Moved(NamedTuple):
    """A moved object: its row, the index of its first point, and the key of what hides it."""

    row: int
    first_point: int
    key: Hashable


@dataclass(frozen=True, eq=False)
class Changes:
    """New boxes and moved objects of an arrangement, as seen by the one that it was made from.

    Attributes:
        serial: the number of that arrangement.
        new: the new boxes. old: its own.
        stay: its points. moved: those of the moved objects, where they are now.
        moved_points: (P,) of its points those of the moved objects, None if there are none.
    """

    serial: int
    new: Boxes
    old: Boxes
    stay: Known
    moved: Known
    moved_points: NDArray[np.bool_] | None
    box_keys: Sequence[Hashable]
    objects: Sequence[_Moved]

    @staticmethod
    def of(
        serial: int,
        new: Boxes,
        old: Boxes,
        stay: Known,
        moved: Known,
        moved_points: NDArray[np.bool_] | None,
    ) -> Changes:
        """With the keys of what is remembered: all that it depends on."""
        boxes = [
            (owner, low.tobytes(), high.tobytes())
            for owner, low, high in zip(new.owner.tolist(), new.low, new.high, strict=True)
        ]
        objects = []
        points = moved.groups.points
        for i in dict.fromkeys(moved.owner.tolist()):
            own = np.flatnonzero(moved.owner == i)
            first = int(moved.groups.first[own[0]])
            last = int(moved.groups.first[own[-1]] + moved.groups.count[own[-1]])
            there = points[:, first:last].tobytes()
            objects.append(_Moved(i, first, (i, there, moved.exempt.within[i].tobytes())))
        return Changes(serial, new, old, stay, moved, moved_points, boxes, objects)

    def hidden_from(self, eye: Floats) -> tuple[list[Numbers], list[Numbers]]:
        """Pairs of a sample point and a box on the way to it, in several arrays of each.

        Args:
            eye: (3,) metres.
        """
        at = (self.serial, *eye.tolist())
        found = [*self._by_new_boxes(eye, at), *self._of_moved(eye, at)]
        if self._between is not None:
            moved, pairs = self._between
            point, box = crossings(eye, moved, *_corners(self.new), pairs)
            found.append(_numbers(point, box + self.new.first))
        return [point for point, _ in found], [box for _, box in found]

    def _by_new_boxes(self, eye: Floats, at: tuple[float, ...]) -> list[tuple[Numbers, Numbers]]:
        """What the new boxes hide of the objects that stay."""
        if not self.box_keys:
            return []
        keys = [(at, key) for key in self.box_keys]
        effects = [_effects.get(key) for key in keys]
        unknown = [k for k, effect in enumerate(effects) if effect is None]
        if unknown:
            low, high = _corners(self.new)
            point, box = crossings(
                eye,
                self.stay.groups,
                low[:, unknown],
                high[:, unknown],
                self._pairs_of_new[:, unknown],
            )
            for j, k in enumerate(unknown):
                effects[k] = _keep(keys[k], _numbers(point[box == j], None))
        number, found = self.new.first, list[tuple[Numbers, Numbers]]()
        for k, effect in enumerate(effects):
            assert effect is not None
            hidden = effect[0]
            if self.moved_points is not None and len(hidden):
                hidden = hidden[~self.moved_points.take(hidden)]
            if len(hidden):
                found.append((hidden, np.full(len(hidden), number + k, np.uint16)))
        return found

    def _of_moved(self, eye: Floats, at: tuple[float, ...]) -> list[tuple[Numbers, Numbers]]:
        """What the boxes that stay hide of the moved objects."""
        if not self.objects:
            return []
        keys = [(at, each.key) for each in self.objects]
        effects = [_effects.get(key) for key in keys]
        unknown = [k for k, effect in enumerate(effects) if effect is None]
        if unknown:
            rows = [self.objects[k].row for k in unknown]
            some = np.flatnonzero(np.isin(self.moved.owner, rows))
            point, box = crossings(
                eye, self.moved.groups.some(some), *_corners(self.old), self._pairs_of_moved[some]
            )
            owners = self.moved.point_owner.take(point)
            for k, row in zip(unknown, rows, strict=True):
                own = owners == row
                first = self.objects[k].first_point
                effects[k] = _keep(keys[k], _numbers(point[own] - first, box[own]))
        found = []
        for thing, effect in zip(self.objects, effects, strict=True):
            assert effect is not None
            points, boxes = effect
            if len(points):
                there = ~self.moved.removed_boxes.take(boxes)
                found.append((points[there] + np.uint16(thing.first_point), boxes[there]))
        return found

    @cached_property
    def _pairs_of_new(self) -> NDArray[np.bool_]:
        """(K, M) the new boxes to test for each group of points that stays."""
        count = len(self.stay.exempt.within)
        old = self.new.owner < count  # nothing that stays is in an object that is new itself
        exempt = np.zeros((count, len(self.new.owner)), dtype=bool)
        exempt[:, old] = self.stay.exempt.of_objects(np.arange(count), self.new.owner[old])
        return ~exempt[self.stay.owner]

    @cached_property
    def _pairs_of_moved(self) -> NDArray[np.bool_]:
        """(K, M) the old boxes to test for each group of points that has moved."""
        exempt = self.moved.exempt.of_objects(self.moved.owner, self.old.owner)
        return ~exempt & ~self.stay.removed_boxes

    @cached_property
    def _between(self) -> tuple[Targets, NDArray[np.bool_]] | None:
        """The moved groups with the new boxes to test for them, None if there are none."""
        pairs = ~self.moved.exempt.of_objects(self.moved.owner, self.new.owner)
        return (self.moved.groups, pairs) if pairs.any() else None


def _corners(boxes: Boxes) -> tuple[Floats, Floats]:
    return np.ascontiguousarray(boxes.low.T), np.ascontiguousarray(boxes.high.T)


_NO_BOX = np.empty(0, dtype=np.uint16)


def _numbers(point: NDArray[np.intp], box: NDArray[np.intp] | None) -> tuple[Numbers, Numbers]:
    return point.astype(np.uint16), _NO_BOX if box is None else box.astype(np.uint16)
