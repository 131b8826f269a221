"""Observations and infos of n environments as batches, in the form that Gymnasium defines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from gymnasium import spaces
from gymnasium.vector.utils import concatenate, create_empty_array
from numpy.typing import NDArray

_PLAIN = (int, float, bool)
"""The types whose values become an array of that type; NumPy's numbers do, too."""


class ObservationBatch:
    """The last observation of each environment, in one buffer.

    Args:
        space: of one observation.
        n: the number of environments.
    """

    def __init__(self, space: spaces.Dict, n: int) -> None:
        self._arrays: dict[str, NDArray[Any]] = {}
        self._others: dict[str, tuple[spaces.Space[Any], list[Any], Any]] = {}
        for name, kind in space.spaces.items():
            empty: Any = create_empty_array(kind, n, fn=np.zeros)
            if isinstance(kind, spaces.Box):
                self._arrays[name] = empty
            else:
                self._others[name] = (kind, [None] * n, empty)
        self._names = tuple(space.spaces)

    def put(self, row: int, observation: Mapping[str, Any]) -> None:
        """Keep an environment's observation."""
        for name, array in self._arrays.items():
            array[row] = observation[name]
        for name, (_, items, _) in self._others.items():
            items[row] = observation[name]

    def told(self, copy: bool) -> dict[str, Any]:
        """All observations, (n, …) each; texts as a tuple.

        Args:
            copy: whether the arrays are the caller's own. Otherwise they are the buffer, which the
                next step changes.
        """
        batch: dict[str, Any] = {}
        for name in self._names:
            if name in self._arrays:
                batch[name] = self._arrays[name].copy() if copy else self._arrays[name]
            else:
                kind, items, empty = self._others[name]
                batch[name] = concatenate(kind, items, empty)
        return batch


def batched_infos(
    infos: Sequence[Mapping[str, Any]], rows: Sequence[int], n: int
) -> dict[str, Any]:
    """The infos of some environments as Gymnasium's vector environments tell them.

    Args:
        infos: one of each; all have the same keys.
        rows: whose they are.
        n: the number of all environments.

    Returns:
        For each key an array of n values, 0 or None for the environments that have none; and
        ``_key``, (n,) bool, for which environments there is a value. Numbers and arrays keep their
        type, dictionaries become a dictionary of such arrays, anything else is in an array of
        objects.
    """
    batch: dict[str, Any] = {}
    if not infos:
        return batch
    present = np.zeros(n, dtype=bool)
    present[list(rows)] = True
    every = len(rows) == n
    for key, first in infos[0].items():
        values = [info[key] for info in infos]
        batch[key] = _batched(first, values, rows, n, every)
        batch[f"_{key}"] = present.copy()
    return batch


def _batched(first: Any, values: list[Any], rows: Sequence[int], n: int, every: bool) -> Any:
    """The n values of one key; the type of the first decides, as in Gymnasium."""
    if isinstance(first, dict):
        return batched_infos(values, rows, n)
    if isinstance(first, np.ndarray):
        array = np.zeros((n, *first.shape), first.dtype)
    elif type(first) in _PLAIN or isinstance(first, np.number):
        if every:
            return np.array(values, type(first))
        array = np.zeros(n, type(first))
    else:
        array = np.full(n, None, dtype=object)
    for row, value in zip(rows, values, strict=True):
        array[row] = value
    return array
