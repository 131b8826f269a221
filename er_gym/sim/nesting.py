"""Which objects contain which, directly and through other objects."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.remembering import get_or_compute

_KEPT = 1024
"""Nestings that are kept in a process, some 15 KB each."""
_known: OrderedDict[Any, Nesting] = OrderedDict()


@dataclass(frozen=True, eq=False)
class Nesting:
    """The containment of N objects.

    Attributes:
        contents: for each object, the rows of the objects in or on it, in scene order.
        within: (N, N) bool; row i marks the receptacles that object i is in, directly or through
            others.
    """

    contents: list[list[int]]
    within: NDArray[np.bool_]

    @staticmethod
    def of(parents: Sequence[Sequence[int]], exists: NDArray[np.bool_]) -> Nesting:
        """The nesting for each object's receptacles. Objects that do not exist are in none.

        Worlds share it, so it must not be changed.
        """
        key = tuple(map(tuple, parents)), exists.tobytes()
        return get_or_compute(_known, key, _KEPT, lambda: Nesting._of(parents, exists))

    @staticmethod
    def _of(parents: Sequence[Sequence[int]], exists: NDArray[np.bool_]) -> Nesting:
        count = len(parents)
        contents: list[list[int]] = [[] for _ in range(count)]
        there = exists.tolist()
        for i, lies_in in enumerate(parents):
            if there[i]:
                for parent in lies_in:
                    contents[parent].append(i)
        within = np.zeros((count, count), dtype=bool)
        depth = [len(lies_in) for lies_in in parents]
        within[np.repeat(np.arange(count), depth), list(chain.from_iterable(parents))] = True
        while True:  # a few rounds, since nesting is shallow: a fork in a pan on a burner
            steps = within.astype(np.float32)
            through = within | (steps @ steps > 0.0)
            if (through == within).all():
                return Nesting(contents, within)
            within = through
