"""Removed and restored objects, points, pushes and shortest paths, in FloorPlan1."""

from __future__ import annotations

from itertools import pairwise
from math import dist

import pytest
from floor_plan_1 import APPLE, BOWL, FRIDGE, ISLAND

CABINET = "Cabinet|+00.68|+00.50|-02.20"


def place(room, object_id):
    return tuple(room[object_id]["position"].values())


def test_what_is_removed_is_no_more(kitchen):
    kitchen.do("RemoveFromScene", APPLE)
    assert APPLE not in kitchen
    assert APPLE not in kitchen[ISLAND]["receptacleObjectIds"]
    assert APPLE in kitchen.refused("RemoveFromScene", APPLE)
    kitchen.refused("EnableObject", APPLE)


def test_several_are_removed_or_none(kitchen):
    kitchen.refused("RemoveFromScene", objectIds=[APPLE, "Nothing"])
    assert APPLE in kitchen
    kitchen.do("RemoveFromScene", objectIds=[APPLE, BOWL, APPLE])
    assert APPLE not in kitchen
    assert BOWL not in kitchen


def test_what_is_disabled_comes_back_as_it_was(kitchen):
    kitchen.take(APPLE)
    kitchen.put(BOWL)
    before = kitchen[APPLE]["parentReceptacles"]
    kitchen.do("DisableObject", BOWL)
    assert BOWL not in kitchen
    assert BOWL not in (kitchen[APPLE]["parentReceptacles"] or ())
    kitchen.do("EnableObject", BOWL)
    assert kitchen[APPLE]["parentReceptacles"] == before
    assert kitchen[BOWL]["receptacleObjectIds"] == [APPLE]


def test_all_of_a_type_go_but_never_the_floor(kitchen):
    kitchen.do("DisableAllObjectsOfType", objectId="Cabinet")
    assert kitchen.of_type("Cabinet") == []
    assert "stands on it" in kitchen.refused("DisableAllObjectsOfType", objectType="Floor")


def test_copies_that_come_in_a_shut_fridge_are_seen_once_it_is_open(kitchen):
    """Their sample points are counted though they were shut away when the room was arranged."""
    egg = kitchen.one("Egg")
    loose = [
        {"objectName": e["name"], "position": e["position"], "rotation": e["rotation"]}
        for e in kitchen.event.metadata["objects"]
        if e["pickupable"] or e["moveable"]
    ]
    again = next(pose for pose in loose if pose["objectName"] == kitchen[egg]["name"])
    kitchen.do("SetObjectPoses", objectPoses=[*loose, again])
    kitchen.do("OpenObject", FRIDGE, forceAction=True)
    assert len(kitchen.of_type("Egg")) == 2


def test_a_filter_leaves_the_others_out_of_the_metadata_alone(kitchen):
    kitchen.do("SetObjectFilter", objectIds=[APPLE, "Nothing"])
    assert [entry["objectId"] for entry in kitchen.event.metadata["objects"]] == [APPLE]
    kitchen.do("OpenObject", FRIDGE, forceAction=True)
    kitchen.do("ResetObjectFilter")
    assert kitchen[FRIDGE]["isOpen"]


def test_poses_keep_what_is_moveable_if_asked(kitchen):
    apple = kitchen[APPLE]
    pose = {
        "objectName": apple["name"],
        "position": apple["position"],
        "rotation": apple["rotation"],
    }
    moveable = {e["objectId"] for e in kitchen.event.metadata["objects"] if e["moveable"]}
    kitchen.do("SetObjectPoses", objectPoses=[pose], skipMoveable=True, enablePhysicsJitter=False)
    left = {e["objectId"] for e in kitchen.event.metadata["objects"]}
    assert moveable
    assert moveable <= left
    assert BOWL not in left


def test_a_thing_is_put_where_a_receptacle_has_a_point(kitchen):
    points = kitchen.do("GetSpawnCoordinatesAboveReceptacle", CABINET)
    assert any(
        kitchen.step("PlaceObjectAtPoint", APPLE, position=p).metadata["lastActionSuccess"]
        for p in points
    )
    assert kitchen[APPLE]["parentReceptacles"] == [CABINET]
    bowl = dict(zip("xyz", place(kitchen, BOWL), strict=True))
    before = kitchen[APPLE]
    assert "not clear" in kitchen.refused("PlaceObjectAtPoint", APPLE, position=bowl)
    assert kitchen[APPLE] == before
    kitchen.do("TeleportObject", APPLE, position=bowl, forceAction=True, forceKinematic=True)
    assert place(kitchen, APPLE) == pytest.approx(tuple(bowl.values()))


def test_what_is_pushed_slides_that_way(kitchen):
    kitchen.go_to(APPLE)
    before, yaw = place(kitchen, APPLE), kitchen.agent["rotation"]["y"]
    kitchen.do("DirectionalPush", APPLE, moveMagnitude=10, pushAngle=-yaw, forceAction=True)
    after = place(kitchen, APPLE)
    assert after[2] - before[2] == pytest.approx(0.1)
    assert after[:2] == pytest.approx(before[:2])
    assert "push/pull" in kitchen.refused("PushObject", FRIDGE, moveMagnitude=10, forceAction=True)


def test_shortest_ways_go_round_the_island(kitchen):
    start, end = {"x": -1.0, "y": 0.9, "z": 0.0}, {"x": 0.75, "y": 0.9, "z": 0.0}
    path = kitchen.do("GetShortestPathToPoint", position=start, **end)["corners"]
    ways = [(corner["x"], corner["z"]) for corner in path]
    length = sum(dist(one, other) for one, other in pairwise(ways))
    assert ways[0] == (-1.0, 0.0)
    assert ways[-1] == (0.75, 0.0)
    assert len(ways) > 2
    assert 2.0 < length < 5.0
    assert kitchen.do("GetShortestPath", objectId=FRIDGE, position=start)["corners"]
    assert "disambiguate" in kitchen.refused("GetShortestPath", objectType="Cabinet")
    kitchen.refused("GetShortestPathToPoint", position=start, x=0.0, y=0.9, z=0.0)


def test_the_expert_gets_there(kitchen):
    goal = {"x": 0.75, "y": 0.9, "z": 0.0}
    kitchen.do("TeleportFull", x=-1.0, z=0.0)
    for _ in range(40):
        action = kitchen.do("ObjectNavExpertAction", position=goal)
        if action is None:
            break
        kitchen.do(action)
    here = kitchen.agent["position"]
    assert (here["x"], here["z"]) == pytest.approx((0.75, 0.0))


def test_a_point_of_the_picture_is_a_point_of_the_room(kitchen):
    kitchen.do("TeleportFull", x=-1.0, z=1.0, rotation=270, horizon=0)
    point = kitchen.do("GetCoordinateFromRaycast", x=0.5, y=0.5)
    box = kitchen[FRIDGE]["axisAlignedBoundingBox"]
    front = box["center"]["x"] + box["size"]["x"] / 2
    assert point["x"] == pytest.approx(front, abs=0.1)
    assert (point["y"], point["z"]) == pytest.approx((0.901 + 0.675, 1.0), abs=0.02)
    assert "[0:1]" in kitchen.refused("GetCoordinateFromRaycast", x=1.5, y=0.5)


def test_a_ray_stops_where_ai2thors_own_tests_expect(enter):
    room = enter("FloorPlan28", width=300, height=300)
    room.do("TeleportFull", x=-1.5, y=0.901, z=-1.5, rotation=90, horizon=0, standing=True)
    for at, expected, error in (
        ((0.5, 0.5), (-0.34426, 1.57600, -1.5), 1e-3),
        ((0.5, 0.2), (-0.34426, 2.26944, -1.5), 1e-3),
        ((0.25, 0.5), (-0.60374, 1.57600, -1.05187), 0.016),  # a door is not as thick as its box
    ):
        point = room.do("GetCoordinateFromRaycast", x=at[0], y=at[1])
        assert tuple(point.values()) == pytest.approx(expected, abs=error)


def test_a_failed_look_answers_with_its_words(kitchen):
    event = kitchen.step("GetObjectInFrame", x=2.0, y=0.5)
    assert event.metadata["actionReturn"] == event.metadata["errorMessage"] != ""


def test_a_mass_is_told(kitchen):
    kitchen.do("SetMassProperties", APPLE, mass=2.5, drag=1, angularDrag=1)
    assert kitchen[APPLE]["mass"] == 2.5
    kitchen.refused("SetMassProperties", FRIDGE, mass=2.5, drag=1, angularDrag=1)


@pytest.mark.parametrize(
    ("settings", "why"),
    [
        ({"gridSize": 5.1}, "(0,5]"),
        ({"gridSize": -1}, "(0,5]"),
    ],
)
def test_initialize_refuses_in_words(kitchen, settings, why):
    assert why in kitchen.refused("Initialize", **settings)


def test_initialize_takes_what_is_legal(enter):
    room = enter("FloorPlan1", gridSize=0.001, fieldOfView=179.5, visibilityDistance=-1)
    assert room.event.metadata["fov"] == 179.5
    room.do("MoveAhead", moveMagnitude=0.01)


def test_the_hand_touches_what_the_picture_shows_and_pushes_it(kitchen):
    pose = kitchen.do("GetInteractablePoses", objectId=APPLE, horizons=[30.0], maxPoses=1)[0]
    kitchen.do("TeleportFull", **pose)
    points = [(k % 20 / 20, k // 20 / 20) for k in range(400)]
    shown = (p for p in points if kitchen.step("GetObjectInFrame", x=p[0], y=p[1]).metadata)
    x, y = next(p for p in shown if kitchen.event.metadata["actionReturn"] == APPLE)
    before = kitchen[APPLE]["position"]
    ahead = {"x": 0.0, "y": 0.0, "z": 1.0}
    push = {"x": x, "y": y, "direction": ahead, "moveMagnitude": 10.0}
    assert not kitchen.do("TouchThenApplyForce", **push, handDistance=0.1)["didHandTouchSomething"]
    assert kitchen[APPLE]["position"] == before
    touched = kitchen.do("TouchThenApplyForce", **push, handDistance=2.0)
    assert touched["objectId"] == APPLE
    assert 0.0 < touched["armsLength"] < 2.0
    assert kitchen[APPLE]["position"] != before
