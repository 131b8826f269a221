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

MOST_CHANGES = 5
"""Where more objects than this have moved or appeared, one test of all is quicker."""
_KEPT = 1 << 16
"""Effects that are kept in a process, some 0.3 KB each."""

Numbers = NDArray[np.uint16]
_Effect = tuple[Numbers, Numbers]
_effects: OrderedDict[Hashable, _Effect | None] = OrderedDict()
"""None for an effect that has been asked for once: most are not asked for again."""


def _keep(key: Hashable, effect: _Effect | None) -> None:
    _effects[key] = effect
    if len(_effects) > _KEPT:
        with suppress(KeyError):  # another thread has just dropped the last
            _effects.popitem(last=False)


class Boxes(NamedTuple):
    """Boxes that hide things: (3, M) corners in metres, (M,) owners, the number of the first."""

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


class _Change(NamedTuple):
    """One change: the row of its object, the index of its first new box or of its first sample
    point, and the key of what it hides or of what hides it."""

    row: int
    first: int
    key: Hashable


@dataclass(frozen=True, eq=False)
class Changes:
    """New boxes and moved objects of an arrangement, as seen by the one that it was made from.

    Attributes:
        serial: the number of that arrangement.
        new: the new boxes. old: its own.
        stay: its points. moved: those of the moved objects, where they are now.
        moved_points: (P,) of its points those of the moved objects, None if there are none.
        hiding: the objects that the new boxes belong to.
        hidden: the moved objects.
    """

    serial: int
    new: Boxes
    old: Boxes
    stay: Known
    moved: Known
    moved_points: NDArray[np.bool_] | None
    hiding: Sequence[_Change]
    hidden: Sequence[_Change]

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
        hiding, hidden = [], []
        for i in dict.fromkeys(new.owner.tolist()):
            own = np.flatnonzero(new.owner == i)
            key = (i, new.low[:, own].tobytes(), new.high[:, own].tobytes())
            hiding.append(_Change(i, int(own[0]), key))
        points = moved.groups.points
        for i in dict.fromkeys(moved.owner.tolist()):
            own = np.flatnonzero(moved.owner == i)
            first = int(moved.groups.first[own[0]])
            last = int(moved.groups.first[own[-1]] + moved.groups.count[own[-1]])
            there = points[:, first:last].tobytes()
            hidden.append(_Change(i, first, (i, there, moved.exempt.within[i].tobytes())))
        return Changes(serial, new, old, stay, moved, moved_points, hiding, hidden)

    def hidden_from(self, eye: Floats) -> tuple[list[Numbers], list[Numbers]] | None:
        """Pairs of a sample point and a box on the way to it, in several arrays of each.

        Args:
            eye: (3,) metres.

        Returns:
            None the first time that one of the changes is seen from there.
        """
        at = (self.serial, *eye.tolist())
        new = [key for each in self.changes if (key := (at, each.key)) not in _effects]
        if new:
            for key in new:
                _keep(key, None)
            return None
        found = [*self._by_new_boxes(eye, at), *self._of_moved(eye, at)]
        if self._between is not None:
            moved, pairs = self._between
            point, box = _hits(eye, moved, self.new, pairs)
            found.append((point, box + np.uint16(self.new.first)))
        return [point for point, _ in found], [box for _, box in found]

    @cached_property
    def changes(self) -> Sequence[_Change]:
        """All of them."""
        return (*self.hiding, *self.hidden)

    def _by_new_boxes(self, eye: Floats, at: tuple[float, ...]) -> list[_Effect]:
        """What the new boxes hide of the objects that stay."""
        effects = [_effects.get((at, each.key)) for each in self.hiding]
        unknown = [k for k, effect in enumerate(effects) if effect is None]
        if unknown:
            columns = np.flatnonzero(np.isin(self.new.owner, [self.hiding[k].row for k in unknown]))
            pairs = self._pairs_of_new
            if len(columns) < len(self.new.owner):
                pairs = np.zeros_like(pairs)
                pairs[:, columns] = self._pairs_of_new[:, columns]
            point, box = _hits(eye, self.stay.groups, self.new, pairs)
            owners = self.new.owner.take(box)
            for k in unknown:
                row, first, key = self.hiding[k]
                own = slice(None) if len(unknown) == 1 else owners == row
                effects[k] = point[own], box[own] - np.uint16(first)
                _keep((at, key), effects[k])
        found = []
        for change, effect in zip(self.hiding, effects, strict=True):
            assert effect is not None
            point, box = effect
            if len(point):
                box = box + np.uint16(self.new.first + change.first)
                if self.moved_points is not None:
                    stays = ~self.moved_points.take(point)
                    point, box = point[stays], box[stays]
                found.append((point, box))
        return found

    def _of_moved(self, eye: Floats, at: tuple[float, ...]) -> list[_Effect]:
        """What the boxes that stay hide of the moved objects."""
        effects = [_effects.get((at, each.key)) for each in self.hidden]
        unknown = [k for k, effect in enumerate(effects) if effect is None]
        if unknown:
            groups, pairs = self.moved.groups, self._pairs_of_moved
            if len(unknown) < len(effects):
                rows = [self.hidden[k].row for k in unknown]
                some = np.flatnonzero(np.isin(self.moved.owner, rows))
                groups, pairs = groups.some(some), pairs[some]
            point, box = _hits(eye, groups, self.old, pairs)
            owners = self.moved.point_owner.take(point)
            for k in unknown:
                row, first, key = self.hidden[k]
                own = slice(None) if len(unknown) == 1 else owners == row
                effects[k] = point[own] - np.uint16(first), box[own]
                _keep((at, key), effects[k])
        found = []
        for change, effect in zip(self.hidden, effects, strict=True):
            assert effect is not None
            point, box = effect
            if len(point):
                there = ~self.moved.removed_boxes.take(box)
                found.append((point[there] + np.uint16(change.first), box[there]))
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


def _hits(
    eye: Floats, groups: Targets, boxes: Boxes, pairs: NDArray[np.bool_]
) -> tuple[Numbers, Numbers]:
    point, box = crossings(eye, groups, boxes.low, boxes.high, pairs)
    return point.astype(np.uint16), box.astype(np.uint16)
