"""Steps and teleports, on FloorPlan1's floor."""

from __future__ import annotations

from typing import Any

import pytest
from floor_plan_1 import APPLE, ISLAND

ISLAND_NAME = "CounterTop_bafd4140"
HEIGHT = 0.900999
"""Of the agent's centre in FloorPlan1, whose floor is at 0."""
CLEAR = {"x": 0.5, "y": HEIGHT, "z": 1.5}
"""A recorded position with recorded positions all round it."""


def position(room: Any) -> tuple[float, float]:
    here = room.agent["position"]
    return here["x"], here["z"]


@pytest.mark.parametrize(
    ("action", "heading", "change"),
    [
        ("MoveAhead", 0, (0, 0.25)),
        ("MoveBack", 0, (0, -0.25)),
        ("MoveLeft", 0, (-0.25, 0)),
        ("MoveRight", 0, (0.25, 0)),
        ("MoveAhead", 90, (0.25, 0)),
        ("MoveRight", 90, (0, -0.25)),
        ("MoveAhead", 180, (0, -0.25)),
        ("MoveLeft", 270, (0, -0.25)),
    ],
)
def test_a_step_goes_one_grid_size_that_way(kitchen, action, heading, change):
    kitchen.do("TeleportFull", position=CLEAR, rotation=heading)
    kitchen.do(action)
    x, z = position(kitchen)
    assert (x - CLEAR["x"], z - CLEAR["z"]) == pytest.approx(change, abs=1e-9)
    assert kitchen.agent["rotation"]["y"] == heading
    assert kitchen.agent["position"]["y"] == pytest.approx(HEIGHT, abs=1e-6)


def test_a_step_is_as_long_as_asked(kitchen):
    kitchen.do("TeleportFull", position=CLEAR, rotation=90)
    kitchen.do("MoveAhead", moveMagnitude=0.5)
    assert position(kitchen) == pytest.approx((1.0, 1.5))
    assert "> 0" in kitchen.refused("MoveAhead", moveMagnitude=0)
    assert position(kitchen) == pytest.approx((1.0, 1.5))


def test_a_step_stays_near_an_object_if_it_has_to(kitchen):
    kitchen.do("TeleportFull", position=CLEAR, rotation=90)
    leash = {"objectId": APPLE, "maxAgentsDistance": 1.2}
    assert "max distance" in kitchen.refused("MoveAhead", moveMagnitude=0.75, **leash)
    assert position(kitchen) == (CLEAR["x"], CLEAR["z"])
    kitchen.do("MoveLeft", **{**leash, "maxAgentsDistance": 5.0})


@pytest.mark.parametrize(
    ("snap", "end"),
    [
        (True, (0.75, 1.75)),  # the nearest point of the grid
        (False, (0.5 + 0.25 * 0.5**0.5, 1.5 + 0.25 * 0.5**0.5)),
    ],
)
def test_a_diagonal_step_ends_on_the_grid_only_if_it_snaps(enter, snap, end):
    room = enter("FloorPlan1", snapToGrid=snap)
    room.do("TeleportFull", position=CLEAR, rotation=45)
    room.do("MoveAhead")
    assert position(room) == pytest.approx(end)


def test_furniture_blocks_and_is_named(kitchen):
    kitchen.do("TeleportFull", x=-1.0, z=0.0, rotation=90)
    assert kitchen.refused("MoveAhead") == (
        f"{kitchen[ISLAND]['name']} is blocking Agent 0 from moving by (0.2500, 0.0000, 0.0000)."
    )
    assert position(kitchen) == (-1.0, 0.0)


def test_a_wall_blocks(kitchen):
    kitchen.do("TeleportFull", x=0.0, z=2.0, rotation=0)
    assert "wall" in kitchen.refused("MoveAhead", moveMagnitude=1.0)


def test_one_long_step_does_not_jump_over_the_island(kitchen):
    kitchen.do("TeleportFull", x=0.75, z=0.0)  # its far side can be stood on
    kitchen.do("TeleportFull", x=-1.0, z=0.0, rotation=90)
    kitchen.refused("MoveAhead", moveMagnitude=1.75)


def test_a_step_stops_short_of_what_is_between_two_free_points(enter):
    """The body is tested along the way: both ends of this one are free, a corner is between."""
    room = enter("FloorPlan1", snapToGrid=False)
    room.do("TeleportFull", x=-0.9, z=1.1, rotation=135)
    room.do("TeleportFull", x=-0.5, z=1.3)
    room.do("TeleportFull", x=-0.9, z=0.9, rotation=45)
    room.refused("MoveAhead", moveMagnitude=0.55)


def test_negative_magnitude_is_refused(kitchen):
    assert "moveMagnitude" in kitchen.refused("MoveAhead", moveMagnitude=-0.25)


@pytest.mark.parametrize("action", ["Teleport", "TeleportFull"])
def test_teleport_sets_the_whole_pose(kitchen, action):
    kitchen.do(action, position=CLEAR, rotation={"y": 270}, horizon=30, standing=False)
    assert kitchen.agent["position"] == pytest.approx(CLEAR, abs=1e-6)
    assert kitchen.agent["rotation"] == {"x": 0, "y": 270, "z": 0}
    assert kitchen.agent["cameraHorizon"] == 30
    assert kitchen.agent["isStanding"] is False


def test_what_a_teleport_does_not_name_stays(kitchen):
    kitchen.do("TeleportFull", position=CLEAR, rotation=90, horizon=30, standing=False)
    kitchen.do("Teleport", x=0.75)
    assert position(kitchen) == (0.75, 1.5)
    assert kitchen.agent["rotation"]["y"] == 90
    assert kitchen.agent["cameraHorizon"] == 30
    assert kitchen.agent["isStanding"] is False


def test_a_recorded_pose_is_taken_as_it_is_written(kitchen):
    pose = {**CLEAR, "rotation": 90, "standing": True, "horizon": 0}  # as GetInteractablePoses says
    kitchen.do("Teleport", position=pose, rotation=450, horizon=60.00001526)
    assert kitchen.agent["rotation"]["y"] == 90
    assert kitchen.agent["cameraHorizon"] == 60.00001526


@pytest.mark.parametrize(
    ("where", "why"),
    [
        ({"x": 0.0, "z": 0.0}, ISLAND_NAME),
        ({"x": 50.0, "z": 0.0}, "out of scene bounds"),
        ({"x": -1.0, "z": 1.5, "horizon": 60.1}, "Each horizon must be in [-30:60]. You gave 60.1"),
        ({"x": -1.0, "z": 1.5, "horizon": -31}, "Each horizon must be in [-30:60]. You gave -31"),
        ({"horizon": 75}, "Each horizon"),
        ({"rotation": {"x": 0.01, "y": 90.0, "z": 0.0}}, "pitch or roll"),
        ({"rotation": {"x": 0.0, "y": 90.0, "z": -0.5}}, "pitch or roll"),
        ({"x": 1e30, "z": 0.0}, "wall"),
        ({"x": -1.0, "y": 2.0, "z": 1.5}, "height"),
        ({"x": -1.0, "y": HEIGHT + 0.06, "z": 1.5}, "height"),
        ({"x": -1.0, "y": HEIGHT - 0.06, "z": 1.5}, "height"),
        ({"x": -0.3, "z": 1.15}, ISLAND_NAME),  # its edge is at 1.01, the body reaches 0.2 m
    ],
)
def test_teleport_off_the_floor_is_refused(kitchen, where, why):
    before = kitchen.agent
    assert why in kitchen.refused("TeleportFull", **where)
    assert kitchen.agent == before


def test_force_waives_bounds_horizon_and_tilt(kitchen):
    kitchen.do(
        "TeleportFull", x=50.0, z=0.0, horizon=75.0, rotation={"x": 5, "y": 90}, forceAction=True
    )
    assert position(kitchen) == (50.0, 0.0)
    assert kitchen.agent["cameraHorizon"] == 75.0


def test_force_teleports_into_furniture(kitchen):
    kitchen.do("TeleportFull", x=0.0, z=0.0, forceAction=True)
    assert position(kitchen) == (0.0, 0.0)


def test_a_forced_teleport_keeps_its_height(kitchen):
    kitchen.do("TeleportFull", **{**CLEAR, "y": 1.5}, forceAction=True)
    assert kitchen.agent["position"] == pytest.approx({**CLEAR, "y": 1.5})
    assert "height" in kitchen.refused("Teleport", x=0.75)  # 1.5 m is where it would stay
    kitchen.do("Teleport", **CLEAR)
    assert kitchen.agent["position"] == pytest.approx(CLEAR, abs=1e-6)


@pytest.mark.parametrize("z", [1.5, 1.47, 1.53])
@pytest.mark.parametrize("x", [0.5, 0.58, 0.61])
def test_teleport_goes_where_the_body_has_room_on_or_off_the_grid(kitchen, x, z):
    kitchen.do("Teleport", x=x, y=HEIGHT + 0.03, z=z)
    assert kitchen.agent["position"] == pytest.approx({"x": x, "y": HEIGHT, "z": z}, abs=1e-6)


def test_the_agents_own_position_is_reachable_to_the_last_digit(enter):
    room = enter("FloorPlan1", snapToGrid=False)
    room.do("Teleport", x=0.5123456789, y=HEIGHT, z=1.5987654321)
    own = room.agent["position"]
    assert (own["x"], own["z"]) == (0.5123456789, 1.5987654321)
    assert own in room.do("GetReachablePositions")


def test_who_stands_in_furniture_can_step_out_of_it(enter):
    room = enter("FloorPlan1", snapToGrid=False)
    room.do("TeleportFull", x=-0.5, z=0.0, rotation=270, forceAction=True)
    room.refused("MoveAhead", moveMagnitude=0.2)  # into the island's edge
    room.do("TeleportFull", x=-0.8, z=0.0, rotation=270, forceAction=True)
    room.do("MoveAhead", moveMagnitude=0.2)


def test_a_horizon_beyond_the_vertical_is_refused(kitchen):
    assert "horizon" in kitchen.refused("TeleportFull", horizon=100)


def test_a_forced_horizon_is_told_between_half_turns(kitchen):
    kitchen.do("TeleportFull", horizon=400, forceAction=True)
    assert kitchen.agent["cameraHorizon"] == pytest.approx(40)
    kitchen.do("TeleportFull", horizon=1e308, forceAction=True)
    assert abs(kitchen.agent["cameraHorizon"]) <= 180
    kitchen.step("PickupObject", x=0.5, y=0.5)  # which draws what is seen


def test_what_is_held_goes_along(kitchen):
    kitchen.do("TeleportFull", position=CLEAR, rotation=0)
    kitchen.take(APPLE)
    before = kitchen[APPLE]["position"]
    kitchen.do("MoveRight", moveMagnitude=0.5)
    after = kitchen[APPLE]["position"]
    assert after["x"] - before["x"] == pytest.approx(0.5)
    assert (after["y"], after["z"]) == pytest.approx((before["y"], before["z"]))
