"""The heights of agent and camera and the room's bounds agree with the recorded ones."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.checks.comparisons.captured import WITHIN, Rooms, faces, held_out, rooms
from er_gym.sim.scene import load_scene
from er_gym.sim.space.room_bounds import room_bounds


@pytest.fixture(scope="module")
def compared(captures) -> Rooms:
    return rooms(captures)


def test_the_agent_and_its_camera_are_at_the_recorded_height(compared) -> None:
    assert abs(compared.agent).max() <= 0.01
    assert abs(compared.camera).max() <= 1e-3


OUT_OF_BOUNDS = {
    # The ceiling only: it is 0.7 to 1.2 m higher than over like things in other rooms.
    *(f"FloorPlan{n}" for n in (210, 213, 219, 319)),
    # Sides: something is drawn outside of the recorded floor, or the floor ends elsewhere.
    *(f"FloorPlan{n}" for n in (4, 19, 201, 204, 310, 419, 428)),
    # The room captured is another.
    "FloorPlan410",
}
"""Where the record of objects does not tell how far the room reaches: docs/fidelity.md."""


def test_bounds_agree_but_where_it_is_known_that_they_do_not(compared) -> None:
    assert set(compared.missed) == OUT_OF_BOUNDS
    assert compared.faces_right >= 0.88


def test_slacks_chosen_from_the_other_scenes_serve_most_scenes_too(captures) -> None:
    off = abs(np.array(list(held_out(captures).values())))
    assert (off <= WITHIN).all(axis=1).sum() >= 24
    assert (off <= WITHIN).mean() >= 0.86


def test_what_was_captured_as_floorplan410_is_recorded_as_floorplan411(captures) -> None:
    capture = captures["FloorPlan410"]
    assert set(capture["visible"]) <= set(load_scene("FloorPlan411").object_ids)
    assert not set(capture["visible"]) & set(load_scene("FloorPlan410").object_ids)
    assert (
        abs(faces(capture["sceneBounds"]) - np.concatenate(room_bounds("FloorPlan411"))).max() < 0.2
    )


def test_missed_bounds_are_those_farther_off_than_a_quarter_of_a_metre() -> None:
    off = np.zeros((2, 6))
    off[0, 4], off[1, 0] = 0.24, -0.26
    found = Rooms(np.zeros(2), np.zeros(2), {"near": off[0], "far": off[1]})
    assert list(found.missed) == ["far"]
    assert found.faces_right == pytest.approx(11 / 12)
