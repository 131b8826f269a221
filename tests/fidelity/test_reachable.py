"""Where the agent can stand, beside the recorded positions and clear of furniture."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.perf.comparisons.reachable import Reachable, pieces, reachable


@pytest.fixture(scope="module")
def compared() -> Reachable:
    return reachable()


def test_at_the_recorded_step_positions_are_the_recorded_ones(compared) -> None:
    assert compared.exact == 120


def test_a_finer_grid_keeps_clear_of_furniture_and_inside_the_room(compared) -> None:
    assert compared.positions > 70000
    assert compared.in_furniture == 0
    assert compared.outside == 0
    assert compared.in_doubt < 0.01 * compared.positions


def test_a_finer_grid_is_connected_where_the_record_is(compared) -> None:
    assert compared.connected == 120


def test_pieces_are_counted_by_steps_along_the_axes() -> None:
    corner = np.array([[0.0, 0.0], [0.25, 0.0], [0.5, 0.25], [1.0, 1.0]])
    assert pieces(corner, 0.25) == 3
