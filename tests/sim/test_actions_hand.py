"""The hand: moved and turned with what it holds, put to rest, and kept by snapshots.

The numbers about FloorPlan28's soap bottle are those of AI2-THOR's own tests.
"""

from __future__ import annotations

import msgpack
import numpy as np
import pytest

from er_gym.sim.rotation import unity_angles, unity_rotation

SOAP, POT = "SoapBottle|-00.84|+00.93|-03.76", "Pot|-00.61|+00.80|-03.42"


@pytest.fixture
def room(enter):
    """FloorPlan28 with the soap bottle in hand, in the middle of the floor, looking south."""
    room = enter("FloorPlan28")
    room.take(SOAP)
    room.do("TeleportFull", x=-1.5, y=0.901, z=-1.5, rotation=180, horizon=0, standing=True)
    return room


def hand(room):
    return room.event.metadata["heldObjectPose"]


def test_angles_come_back_from_their_matrix():
    for angles in ((0, 0, 0), (30, 200, 350), (90, 180, 0), (270, 45, 0), (10.5, 0.25, 180)):
        assert unity_angles(unity_rotation(angles)) == pytest.approx(angles, abs=1e-5)
    again = unity_angles(unity_rotation((90.0, 270.0, 270.0)))
    assert unity_rotation(again) == pytest.approx(unity_rotation((90.0, 270.0, 270.0)), abs=1e-7)


@pytest.mark.parametrize("offset", [(0, 0, 0.1), (0.1, 0.1, 0.1), (0.05, -0.1, 0.1)])
def test_the_hand_moves_along_the_cameras_axes(room, offset):
    before, thing = hand(room), room[SOAP]["position"]
    right, up, ahead = offset
    room.do("MoveHeldObject", right=right, up=up, ahead=ahead)
    after = hand(room)
    assert after["rotation"] == before["rotation"]
    moved = [after["localPosition"][axis] - before["localPosition"][axis] for axis in "xyz"]
    assert moved == pytest.approx(offset, abs=1e-3)
    went = [room[SOAP]["position"][axis] - thing[axis] for axis in "xyz"]
    assert went == pytest.approx((-right, up, -ahead), abs=1e-3)  # it looks south


def test_each_direction_has_a_name(room):
    start = hand(room)["position"]
    for name in ("Ahead", "Up", "Right", "Back", "Down", "Left"):
        room.do(f"MoveHeldObject{name}", moveMagnitude=0.1)
    assert hand(room)["position"] == pytest.approx(start, abs=1e-9)
    room.do("MoveHandAhead", moveMagnitude=0.1)
    room.do("MoveAhead")
    assert hand(room)["localPosition"]["z"] == pytest.approx(0.38)  # at rest again


def test_a_hand_stays_in_reach_in_view_and_clear(room):
    assert "max visibility distance" in room.refused("MoveHeldObject", ahead=1.3)
    assert "viewport" in room.refused("MoveHeldObject", up=0.9)
    assert "Hand's Path" in room.refused("MoveHeldObject", up=-0.6, ahead=0.7, right=-0.9)
    room.do("DropHeldObject")
    assert "holding an item" in room.refused("MoveHeldObject", ahead=0.1)
    assert "no object is being held" in room.refused("RotateHeldObject", pitch=90)


@pytest.mark.parametrize(
    ("by", "rotation"),
    [
        ({"pitch": 90}, (90, 180, 0)),
        ({"yaw": 90}, (0, 270, 0)),
        ({"roll": 90}, (0, 180, 270)),
        ({"pitch": 90, "yaw": 90, "roll": 90}, (90, 0, 0)),
        ({"rotation": {"x": 90, "y": 180, "z": 0}}, (90, 0, 0)),
    ],
)
def test_the_hand_turns_as_ai2thors_tests_expect(room, by, rotation):
    before = hand(room)
    room.do("RotateHeldObject", **by)
    after = hand(room)
    assert after["position"] == pytest.approx(before["position"], abs=1e-3)
    assert tuple(after["rotation"].values()) == pytest.approx(rotation, abs=1e-3)
    assert tuple(before["localRotation"].values()) == (0, 0, 0)
    if "rotation" in by:
        assert after["localRotation"] == pytest.approx(by["rotation"], abs=1e-3)


def test_what_is_held_turns_about_its_middle_and_back_at_rest(room):
    before = room[SOAP]
    room.do("RotateHeldObject", pitch=90)
    low, high = before["axisAlignedBoundingBox"], room[SOAP]["axisAlignedBoundingBox"]
    assert high["center"] == pytest.approx(low["center"], abs=1e-6)
    assert high["size"]["y"] < low["size"]["y"] - 0.03  # it lies
    room.do("RotateRight", manualInteract=True)
    assert hand(room)["rotation"]["x"] == pytest.approx(90, abs=1e-3)
    assert room[SOAP]["axisAlignedBoundingBox"]["size"]["y"] == pytest.approx(high["size"]["y"])
    room.do("RotateLeft")
    assert room[SOAP]["rotation"] == before["rotation"]
    assert room[SOAP]["position"] == pytest.approx(before["position"], abs=1e-9)


def test_a_liquid_pours_out_of_what_is_tipped(enter):
    room = enter("FloorPlan28")
    room.do("FillObjectWithLiquid", POT, forceAction=True)
    room.take(POT)
    room.do("TeleportFull", x=-1.5, y=0.901, z=-1.5, rotation=180, horizon=0, standing=True)
    for _ in range(3):
        room.do("RotateHeldObject", pitch=30)
    assert room[POT]["isFilledWithLiquid"]
    room.do("RotateHeldObject", pitch=1)
    assert (room[POT]["isFilledWithLiquid"], room[POT]["fillLiquid"]) == (False, None)


def test_contents_fall_out_of_what_is_turned_over(enter):
    room = enter("FloorPlan1")
    bowl, egg = room.one("Bowl"), room.one("Egg")
    room.do("OpenObject", room.one("Fridge"), forceAction=True)
    room.take(egg)
    room.do("PutObject", bowl, forceAction=True)
    room.take(bowl)
    room.do("TeleportFull", x=-1.0, y=0.901, z=1.5, rotation=180, horizon=0, standing=True)
    room.do("RotateHeldObject", rotation={"x": 90, "y": 0, "z": 0})
    assert room[egg]["parentReceptacles"] == [bowl]
    room.do("RotateHeldObject", rotation={"x": 180, "y": 0, "z": 0})
    assert bowl not in room[egg]["parentReceptacles"]
    assert room[egg]["axisAlignedBoundingBox"]["center"]["y"] < 1.0
    assert room.inventory == [bowl]


def test_a_state_holds_the_hand(room):
    controller = room.controller
    room.do("MoveHeldObjectAhead", moveMagnitude=0.2)
    room.do("RotateHeldObject", roll=45)
    saved, thing, pose = controller.world_state(), room[SOAP], hand(room)
    saved = msgpack.unpackb(msgpack.packb(saved))
    room.do("MoveBack")
    assert hand(room) != pose
    controller.restore_world(saved)
    room.do("Pass")
    assert (room[SOAP], hand(room)) == (thing, pose)
    room.do("MoveBack")
    assert np.abs(hand(room)["localPosition"]["z"] - 0.38) < 1e-9


def test_a_refused_put_leaves_what_is_tilted_as_it_was_to_the_last_digit(room, monkeypatch):
    counter = next(each for each in room.event.metadata["objects"] if each["receptacle"])
    monkeypatch.setattr("er_gym.sim.actions.pick_place.free_spots", lambda *args, **more: iter(()))
    for x, y, z in ((90, 30, 0), (45, 30, 0), (-30, 15, 11), (-30, 30, 11)):
        for turns in (0, 1):
            room.do("RotateHand", x=-30, y=30, z=0)
            room.do("MoveHeldObjectDown", moveMagnitude=0.05)
            for _ in range(turns):
                room.do("RotateRight")
            room.do("RotateHandRelative", x=180)
            room.do("RotateHeldObject", pitch=90)
            room.do("RotateHand", x=x, y=y, z=z)
            before = room[SOAP]
            said = room.refused("PutObject", counter["objectId"], forceAction=True)
            assert "has no free space" in said
            assert room[SOAP] == before
