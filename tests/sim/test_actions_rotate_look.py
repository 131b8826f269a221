"""Turning, tilting, standing and crouching."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize(
    ("action", "arguments", "heading"),
    [
        ("RotateRight", {}, 90),
        ("RotateLeft", {}, 270),
        ("RotateRight", {"degrees": 45}, 45),
        ("RotateLeft", {"degrees": 45}, 315),
        ("RotateRight", {"degrees": -45}, 315),
        ("RotateRight", {"degrees": 0}, 0),
        ("RotateRight", {"degrees": 720.5}, 0.5),
    ],
)
def test_turning(kitchen, action, arguments, heading):
    kitchen.do("TeleportFull", rotation=0)
    kitchen.do(action, **arguments)
    assert kitchen.agent["rotation"]["y"] == pytest.approx(heading)


def test_turning_goes_by_rotate_step_degrees(enter):
    room = enter("FloorPlan1", rotateStepDegrees=30, snapToGrid=False)
    assert room.agent["rotation"]["y"] == 270
    room.do("RotateRight")
    assert room.agent["rotation"]["y"] == 300


@pytest.mark.parametrize(
    ("start", "action", "arguments", "horizon"),
    [
        (0, "LookDown", {}, 30),
        (0, "LookUp", {}, -30),
        (0, "LookDown", {"degrees": 1}, 1),
        (30, "LookDown", {}, 60),
        (60, "LookUp", {"degrees": 88}, -28),
    ],
)
def test_tilting(kitchen, start, action, arguments, horizon):
    kitchen.do("TeleportFull", horizon=start)
    kitchen.do(action, **arguments)
    assert kitchen.agent["cameraHorizon"] == pytest.approx(horizon)


@pytest.mark.parametrize(
    ("start", "action", "arguments"),
    [(-30, "LookUp", {}), (60, "LookDown", {}), (0, "LookDown", {"degrees": 61})],
)
def test_the_camera_tilts_from_30_up_to_60_down(kitchen, start, action, arguments):
    kitchen.do("TeleportFull", horizon=start)
    assert "60" in kitchen.refused(action, **arguments)
    assert kitchen.agent["cameraHorizon"] == start


def test_crouching_lowers_the_camera_and_standing_lifts_it(kitchen):
    def height():
        return kitchen.event.metadata["cameraPosition"]["y"]

    assert height() == pytest.approx(0.901 + 0.675, abs=1e-3)
    assert "standing" in kitchen.refused("Stand")
    kitchen.do("Crouch")
    assert kitchen.agent["isStanding"] is False
    assert height() == pytest.approx(0.901, abs=1e-3)
    assert "crouching" in kitchen.refused("Crouch")
    kitchen.do("Stand")
    assert height() == pytest.approx(1.576, abs=1e-3)
