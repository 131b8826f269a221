"""Packed rows give back what was packed."""

from __future__ import annotations

import numpy as np
import pytest

from agents.rl.packed import PackedRows


def test_rows_come_back_in_any_order() -> None:
    random = np.random.default_rng(0)
    rows = random.random((9, 40)).astype("f") * (random.random((9, 40)) < 0.2)
    rows[4] = 0
    packed = PackedRows.concatenate([PackedRows.of(rows[:3]), PackedRows.of(rows[3:])])
    some = np.array([8, 0, 4, 0, 3])
    assert packed.shape == rows.shape
    assert np.array_equal(packed[some], rows[some])
    assert np.array_equal(packed.take(some)[np.arange(5)], rows[some])
    nothing = PackedRows.of(rows[:0])
    assert nothing[np.arange(0)].shape == (0, 40)
    assert len(PackedRows.concatenate([nothing, packed])) == 9


def test_rows_that_are_too_long_are_refused() -> None:
    with pytest.raises(ValueError, match="at most 65,536"):
        PackedRows.of(np.zeros((1, 2**16 + 1), np.float32))
