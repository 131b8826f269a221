"""Rows of numbers that are mostly 0, in a tenth of the memory. Imports no torch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class PackedRows:
    """N rows of D numbers, of which only those other than 0 are kept.

    A hundred thousand observations of object types take gigabytes; packed, they fit beside the
    environments. SciPy's CSR matrix takes a third more, since its places are of 32 bits.

    Attributes:
        values: the numbers other than 0, row after row.
        places: for each its place in its row, 0 to D - 1.
        ends: (N,) for each row the number of values up to its end.
        width: D.
    """

    values: NDArray[np.float32]
    places: NDArray[np.uint16]
    ends: NDArray[np.int64]
    width: int

    @staticmethod
    def of(rows: NDArray[np.float32]) -> PackedRows:
        """Pack (N, D) rows.

        Raises:
            ValueError: a row is longer than 65,536.
        """
        if rows.shape[1] > 2**16:
            raise ValueError(f"rows of {rows.shape[1]:,} numbers; at most {2**16:,} can be packed")
        at, places = rows.nonzero()
        counts = np.bincount(at, minlength=len(rows))
        return PackedRows(
            rows[at, places], places.astype(np.uint16), np.cumsum(counts), rows.shape[1]
        )

    @staticmethod
    def concatenate(parts: Sequence[PackedRows]) -> PackedRows:
        """The rows of several, one after the other; all must have the same width."""
        offsets = np.cumsum([0, *(len(part.values) for part in parts)])
        return PackedRows(
            np.concatenate([part.values for part in parts]),
            np.concatenate([part.places for part in parts]),
            np.concatenate([part.ends + o for part, o in zip(parts, offsets[:-1], strict=True)]),
            parts[0].width,
        )

    def take(self, rows: NDArray[np.intp]) -> PackedRows:
        """These rows, still packed."""
        index, counts = self._index(rows)
        return PackedRows(self.values[index], self.places[index], np.cumsum(counts), self.width)

    def __len__(self) -> int:
        return len(self.ends)

    @property
    def shape(self) -> tuple[int, int]:
        """(N, D)."""
        return len(self), self.width

    def __getitem__(self, rows: NDArray[np.intp]) -> NDArray[np.float32]:
        """(len(rows), D): these rows, unpacked."""
        index, counts = self._index(rows)
        unpacked = np.zeros((len(rows), self.width), np.float32)
        unpacked[np.repeat(np.arange(len(rows)), counts), self.places[index]] = self.values[index]
        return unpacked

    def _index(self, rows: NDArray[np.intp]) -> tuple[NDArray[np.intp], NDArray[np.int64]]:
        """Where the values of some rows are, one after the other, and how many each row has."""
        ends = self.ends[rows]
        begins = np.where(rows > 0, self.ends[rows - 1], 0)
        counts = ends - begins
        before = np.cumsum(counts) - counts
        return np.arange(int(counts.sum())) + np.repeat(begins - before, counts), counts


Column: TypeAlias = PackedRows | NDArray[Any]
"""(N, …) values of N steps: vectors packed, pictures as they are."""


def packed(rows: NDArray[Any]) -> Column:
    """Pack vectors, and leave other arrays."""
    return PackedRows.of(rows) if rows.ndim == 2 and rows.dtype == np.float32 else rows


def concatenated(parts: Sequence[Column]) -> Column:
    """The rows of several columns of one kind."""
    rows = [part for part in parts if isinstance(part, PackedRows)]
    if rows:
        return PackedRows.concatenate(rows)
    return np.concatenate([part for part in parts if isinstance(part, np.ndarray)])


def taken(column: Column, rows: NDArray[np.intp]) -> Column:
    """Some rows of a column."""
    return column.take(rows) if isinstance(column, PackedRows) else column[rows]
