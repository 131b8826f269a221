"""Which boxes never hide which objects."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.space.solids.sample_points import SEEN_FROM_OUTSIDE, SLABS
from er_gym.sim.world import World

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class _Kinds:
    """(N,) what the types of the objects say, and the rows of the cabinets and drawers."""

    from_outside: Mask
    slab: Mask
    carcass: Mask
    fronts: list[int]


@lru_cache(maxsize=512)
def _kinds(types: tuple[str, ...]) -> _Kinds:
    return _Kinds(
        from_outside=np.array([each in SEEN_FROM_OUTSIDE for each in types]),
        slab=np.array([each in SLABS for each in types]),
        carcass=np.array([each == "CounterTop" for each in types]),
        fronts=[i for i, each in enumerate(types) if each in ("Cabinet", "Drawer")],
    )


@dataclass(frozen=True, eq=False)
class Exemptions:
    """The boxes that never hide an object.

    These are its own boxes and those of the receptacles that it is in, with three exceptions. The
    boxes of an object that is seen only from outside do hide its own points. A slab hides what lies
    on it from below. And the carcass of a counter is hollow where it holds a cabinet or a drawer,
    so it does not hide their contents.

    Attributes:
        within: (N, N) bool; row i marks the receptacles that object i is in.
    """

    within: Mask
    _kinds: _Kinds

    @staticmethod
    def of(world: World) -> Exemptions:
        """Those of the world as it is now."""
        return Exemptions(world.nesting.within, _kinds(tuple(world.types)))

    @property
    def arrays(self) -> dict[str, Mask]:
        """What :meth:`of_objects` reads, by the names of the compiled kernel."""
        kinds = self._kinds
        return {
            "within": self.within,
            "from_outside": kinds.from_outside,
            "slab": kinds.slab,
            "carcass": kinds.carcass,
            "in_counter": self._in_counter,
        }

    @cached_property
    def _in_counter(self) -> Mask:
        return np.asarray(self.within[:, self._kinds.fronts].any(axis=1))

    def of_objects(self, rows: NDArray[np.intp], owners: NDArray[np.intp]) -> Mask:
        """(K, M) for K rows of objects, and boxes of M owners."""
        kinds = self._kinds
        found = self.within[rows[:, None], owners] & ~kinds.slab[owners]
        found |= (rows[:, None] == owners) & ~kinds.from_outside[rows][:, None]
        found |= self._in_counter[rows][:, None] & kinds.carcass[owners]
        return np.asarray(found)
