"""The agent's and the camera's height and the room's bounds, beside the recorded ones."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.perf.comparisons.room import Rooms, rooms


@pytest.fixture(scope="module")
def compared(captures) -> Rooms:
    return rooms(captures)


def test_the_agent_and_its_camera_are_at_the_recorded_height(compared) -> None:
    assert abs(compared.agent).max() <= 0.01
    assert abs(compared.camera).max() <= 1e-3


OUT_OF_BOUNDS = {
    # The ceiling only: it is not where the highest object suggests.
    *(f"FloorPlan{n}" for n in (13, 210, 213, 219, 228, 304, 319, 422)),
    # Sides: the recorded floor ends elsewhere than the bounds.
    *(f"FloorPlan{n}" for n in (4, 19, 201, 204, 310, 401, 410, 419, 428)),
}
"""Where the record of objects does not tell how far the room reaches: docs/fidelity.md."""


def test_bounds_agree_but_where_it_is_known_that_they_do_not(compared) -> None:
    assert set(compared.missed) == OUT_OF_BOUNDS
    assert compared.faces_right >= 0.85


def test_missed_bounds_are_those_farther_off_than_a_quarter_of_a_metre() -> None:
    off = np.zeros((2, 6))
    off[0, 4], off[1, 0] = 0.24, -0.26
    found = Rooms(np.zeros(2), np.zeros(2), {"near": off[0], "far": off[1]})
    assert list(found.missed) == ["far"]
    assert found.faces_right == pytest.approx(11 / 12)
