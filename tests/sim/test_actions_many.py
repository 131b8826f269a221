"""Actions on many objects; queries about objects and sight; lines and what pictures leave out."""

from __future__ import annotations

import msgpack
import numpy as np
import pytest
from floor_plan_1 import APPLE, FRIDGE

ISLAND = "CounterTop|-00.08|+01.15|00.00"


def test_all_that_is_seen_is_opened_and_closed(kitchen):
    kitchen.go_to(FRIDGE)
    kitchen.do("OpenVisibleObjects")
    opened = [e for e in kitchen.event.metadata["objects"] if e["isOpen"]]
    assert FRIDGE in {e["objectId"] for e in opened}
    assert all(e["openness"] == 1.0 for e in opened)
    kitchen.do("CloseVisibleObjects")
    assert not kitchen[FRIDGE]["isOpen"]
    kitchen.do("SetRandomSeed", seed=7)
    kitchen.do("RandomlyOpenCloseObjects", pOpen=0.3)
    shares = [e["openness"] for e in kitchen.event.metadata["objects"] if e["openable"]]
    assert 0.1 < np.mean([share > 0 for share in shares]) < 0.5
    assert not all(share in (0.0, 1.0) for share in shares)


def test_all_of_a_type_come_into_a_state(kitchen):
    def state(**wanted):
        kitchen.do("SetObjectStates", SetObjectStates=wanted)

    mug = kitchen.one("Mug")
    state(objectType="Mug", stateChange="canFillWithLiquid", isFilledWithLiquid=True)
    assert kitchen[mug]["fillLiquid"] == "water"
    assert not kitchen[kitchen.one("Pot")]["isFilledWithLiquid"]
    state(stateChange="canFillWithLiquid", isFilledWithLiquid=False)
    assert kitchen[mug]["fillLiquid"] is None
    state(stateChange="openable", isOpen=True)
    assert all(e["isOpen"] for e in kitchen.event.metadata["objects"] if e["openable"])
    state(stateChange="sliceable", isSliced=True)
    assert len(kitchen.of_type("AppleSliced")) == 6
    assert "stateChange" in kitchen.refused("SetObjectStates")


def test_questions_about_objects(kitchen):
    assert kitchen.do("ObjectTypeToObjectIds", objectType="counter top") == kitchen.of_type(
        "CounterTop"
    )
    assert kitchen.do("CheckWhatObjectsOn", objectIds=[APPLE]) == {APPLE: [ISLAND]}
    inside = kitchen.do("Contains", FRIDGE, forceAction=True)
    assert inside == kitchen[FRIDGE]["receptacleObjectIds"]
    assert 1.0 < kitchen.do("BBoxDistance", objectId0=APPLE, objectId1=FRIDGE) < 1.3
    hull = np.array(kitchen.do("Get2DSemanticHull", FRIDGE))
    size = kitchen[FRIDGE]["axisAlignedBoundingBox"]["size"]
    assert np.ptp(hull, axis=0) == pytest.approx((size["x"], size["z"]), abs=0.01)
    way = {"origin": {"x": -1, "y": 0.9, "z": 1}, "destination": {"x": -1.1, "y": 0.9, "z": 1}}
    hit = kitchen.do("PerformRaycast", **way)
    assert hit["objectId"] == FRIDGE
    assert hit["hitPoint"]["x"] == pytest.approx(-1.0 - hit["hitDistance"])
    away = {"origin": {"x": -1, "y": 0.9, "z": 1}, "destination": {"x": -1, "y": 2.9, "z": 1}}
    assert "failed to hit" in kitchen.refused("GetObjectHitFromRaycast", **away)
    between = kitchen.do("CheckUnobstructedPathBetweenObjectCenters", objectId0=FRIDGE,
                         objectId1=kitchen.one("GarbageCan"))  # fmt: skip
    assert between["adjacent"] is (between["objectInWay"] == [])


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("narrow", [1e-310, 1e-320, 5e-324])
def test_a_picture_of_almost_no_width_shows_no_point(kitchen, narrow):
    kitchen.do("ChangeFOV", fieldOfView=narrow)
    aside = {"x": 5.0, "y": 0.9, "z": 1.0}
    assert "not in viewport" in kitchen.refused("WorldToViewportPoint", position=aside)


def test_questions_about_sight(kitchen):
    kitchen.go_to(APPLE)
    seen = [e["objectId"] for e in kitchen.event.metadata["objects"] if e["visible"]]
    assert kitchen.do("GetVisibleObjects") == seen
    assert kitchen.do("GetVisibleObjects", objectIds=[APPLE, FRIDGE], maxDistance=0.01) == []
    assert 0.0 < kitchen.do("ApproxPercentScreenObjectOccupies", APPLE) < 0.2
    point = kitchen.do("WorldToViewportPoint", position=kitchen[APPLE]["position"])
    assert kitchen.do("GetObjectInFrame", x=point["x"], y=point["y"]) == APPLE
    camera = {"position": {"x": -0.47, "y": 2.0, "z": 0.4}, "rotation": {"x": 89, "y": 0, "z": 0}}
    kitchen.do("AddThirdPartyCamera", **camera)
    below = kitchen.do("ObjectsVisibleFromThirdPartyCamera", thirdPartyCameraIndex=0)
    assert APPLE in below
    near = kitchen.do("GetVisibleObjects", thirdPartyCameraIndex=0, maxDistance=0.5)
    assert APPLE in near
    assert set(near) < set(below)
    assert "no third-party camera 1" in kitchen.refused(
        "GetVisibleObjects", thirdPartyCameraIndex=1
    )
    poses = kitchen.do("GetInteractablePoses", APPLE)
    old = kitchen.do("PositionsFromWhichItemIsInteractable", APPLE)
    assert sorted(old["x"]) == sorted(pose["x"] for pose in poses)


def test_pictures_show_paths_and_leave_out_what_is_hidden(enter):
    room = enter("FloorPlan402", width=60, height=45)
    room.controller.headless = False  # pictures are wanted here alone
    try:
        start = room.step("Pass").frame
        at, yaw = room.agent["position"], np.radians(room.agent["rotation"]["y"])
        ahead = [
            {"x": at["x"] + far * np.sin(yaw), "y": 0.0, "z": at["z"] + far * np.cos(yaw)}
            for far in (0.2, 0.9)
        ]
        room.do("HideAllObjects")
        bare = room.event.frame
        assert (bare != start).any()
        room.do("LookDown", degrees=60)
        floor = room.event.frame
        room.do("VisualizeGrid")
        lined = room.event.frame
        assert (lined != floor).any()
        room.do("VisualizePath", positions=ahead, pathWidth=0.3)
        saved = msgpack.unpackb(msgpack.packb(room.controller.world_state()))
        pathed = room.event.frame
        assert (pathed != lined).any()
        room.do("HideVisualizedPath")
        assert (room.event.frame == lined).all()
        room.do("UnhideAllObjects")
        room.controller.restore_world(saved)
        assert (room.step("Pass").frame == pathed).all()
        assert "empty" in room.refused("VisualizePath", positions=[])
    finally:
        room.controller.headless = True


def test_an_agent_is_moved_by_global_axes_and_at_random(kitchen):
    kitchen.do("TeleportFull", x=-1.0, z=1.5, rotation=90)
    kitchen.do("MoveGlobal", x=0.0, z=0.25)
    assert kitchen.agent["position"]["z"] == pytest.approx(1.75)
    assert kitchen.agent["rotation"]["y"] == 90.0
    places = kitchen.do("RandomlyMoveAgent", randomSeed=5)
    assert kitchen.agent["position"] in places


def test_no_type_is_no_object(kitchen):
    assert kitchen.do("ObjectTypeToObjectIds", objectType=None) == []
    assert kitchen.do("NumberOfPositionsObjectsOfTypeAreVisibleFrom", objectType=None) == {}
