"""SetObjectPoses, InitialRandomSpawn and ThrowObject."""

from __future__ import annotations

import json
from math import cos, hypot, radians, sin

import numpy as np
import pytest
from floor_plan_1 import APPLE, FRIDGE, ISLAND

from benchmarks.checks.invariants import broken
from er_gym.sim.actions.arrange_objects import id_of_place
from er_gym.sim.controller import EmbeddedController
from er_gym.sim.placement_restrictions import accepts
from er_gym.sim.scene import SCENE_NAMES, load_scene


def loose(room):
    """Everything that SetObjectPoses speaks of."""
    objects = room.event.metadata["objects"]
    return [entry for entry in objects if entry["pickupable"] or entry["moveable"]]


def poses(room):
    return [
        {"objectName": o["name"], "position": o["position"], "rotation": o["rotation"]}
        for o in loose(room)
    ]


def comparable(room):
    """What is said of the objects, less what depends on the agent."""
    changing = ("visible", "isInteractable", "distance")
    return [
        {key: value for key, value in entry.items() if key not in changing}
        for entry in room.event.metadata["objects"]
    ]


def check(room):
    assert list(broken(room.event.metadata)) == []


# -- SetObjectPoses --------------------------------------------------------------------------------


def test_everything_where_it_is_changes_nothing(kitchen):
    before = comparable(kitchen)
    kitchen.do("SetObjectPoses", objectPoses=poses(kitchen))
    assert comparable(kitchen) == before


def test_a_room_that_is_arranged_again_is_the_same_room(kitchen):
    """The second time it is remembered; what was done to the first is not."""
    wanted = moved_apple(kitchen, x=-0.2, z=0.1)
    arranged = []
    for _ in range(3):
        kitchen.event = kitchen.controller.reset("FloorPlan1")
        kitchen.do("SetObjectPoses", objectPoses=wanted)
        arranged.append(json.dumps(kitchen.event.metadata["objects"]))
        check(kitchen)
        kitchen.do("OpenObject", FRIDGE, forceAction=True)
        kitchen.take(next(o["objectId"] for o in loose(kitchen) if o["pickupable"]))
        kitchen.do("DirtyObject", kitchen.one("Mug"), forceAction=True)
        assert json.dumps(kitchen.event.metadata["objects"]) != arranged[-1]
    assert len(set(arranged)) == 1


def test_what_was_changed_before_it_is_arranged_stays_changed(kitchen):
    wanted = moved_apple(kitchen, x=-0.2, z=0.1)
    kitchen.do("SetObjectPoses", objectPoses=wanted)
    kitchen.event = kitchen.controller.reset("FloorPlan1")
    kitchen.do("OpenObject", FRIDGE, forceAction=True)
    kitchen.do("SetObjectPoses", objectPoses=wanted)
    assert kitchen[FRIDGE]["isOpen"]


def test_what_is_not_named_leaves_the_scene(kitchen):
    apple = kitchen[APPLE]
    stays = [pose for pose in poses(kitchen) if pose["objectName"] == apple["name"]]
    kitchen.do("SetObjectPoses", objectPoses=stays)
    assert [entry["objectId"] for entry in loose(kitchen)] == [APPLE]
    assert FRIDGE in kitchen
    check(kitchen)


def moved_apple(room, **place):
    """All poses, with the apple somewhere else."""
    wanted = poses(room)
    (pose,) = (p for p in wanted if p["objectName"] == room[APPLE]["name"])
    pose["position"] = {**pose["position"], **place}
    return wanted


def test_a_thing_goes_exactly_where_it_is_wanted_and_is_named_after_it(kitchen):
    wanted = moved_apple(kitchen, x=-0.2, z=0.1)
    kitchen.do("SetObjectPoses", objectPoses=wanted)
    (apple,) = (o for o in loose(kitchen) if o["objectType"] == "Apple")
    assert apple["position"] == {
        "x": -0.2,
        "y": kitchen[ISLAND] and apple["position"]["y"],
        "z": 0.1,
    }
    assert apple["objectId"] == "Apple|-00.20|+01.15|+00.10"
    assert APPLE not in kitchen
    assert apple["parentReceptacles"] == [ISLAND]
    assert apple["objectId"] in kitchen[ISLAND]["receptacleObjectIds"]
    check(kitchen)


def extent(thing):
    """How far an object's oriented box reaches along x, y and z."""
    corners = thing["objectOrientedBoundingBox"]["cornerPoints"]
    return tuple(max(axis) - min(axis) for axis in zip(*corners, strict=True))


def test_rotation_turns_the_box(kitchen):
    wanted = poses(kitchen)
    knife = next(o for o in loose(kitchen) if o["objectType"] == "Knife")
    (pose,) = (p for p in wanted if p["objectName"] == knife["name"])
    before = extent(knife)
    pose["rotation"] = {**pose["rotation"], "y": pose["rotation"]["y"] + 90}
    kitchen.do("SetObjectPoses", objectPoses=wanted)
    after = next(o for o in loose(kitchen) if o["name"] == knife["name"])
    assert extent(after) == pytest.approx((before[2], before[1], before[0]))
    size = after["axisAlignedBoundingBox"]["size"]
    assert tuple(size.values()) == pytest.approx(extent(after))
    assert after["rotation"]["y"] == pytest.approx(pose["rotation"]["y"])


def test_a_thing_named_twice_is_copied(kitchen):
    wanted = poses(kitchen)
    count = len(loose(kitchen))
    (apple,) = (p for p in wanted if p["objectName"] == kitchen[APPLE]["name"])
    copy = {**apple, "position": {**apple["position"], "x": apple["position"]["x"] + 0.3}}
    kitchen.do("SetObjectPoses", objectPoses=[*wanted, copy])
    assert len(loose(kitchen)) == count + 1
    assert len(kitchen.of_type("Apple")) == 2
    assert len({entry["name"] for entry in loose(kitchen)}) == count + 1
    check(kitchen)


def test_in_the_air_things_stay_unless_they_may_fall(kitchen):
    wanted = moved_apple(kitchen, x=1.0, y=1.5, z=1.0)
    kitchen.do("SetObjectPoses", objectPoses=wanted)
    (apple,) = (o for o in loose(kitchen) if o["objectType"] == "Apple")
    assert apple["position"]["y"] == 1.5
    assert apple["parentReceptacles"] is None
    kitchen.event = kitchen.controller.reset()
    kitchen.do("SetObjectPoses", objectPoses=wanted, placeStationary=False)
    (apple,) = (o for o in loose(kitchen) if o["objectType"] == "Apple")
    assert apple["position"]["y"] < 0.2
    assert apple["parentReceptacles"] == [kitchen.one("Floor")]
    check(kitchen)


def test_what_is_held_leaves_the_hand(kitchen):
    kitchen.take(APPLE)
    wanted = moved_apple(kitchen, x=-0.2, y=1.15, z=0.1)
    kitchen.do("SetObjectPoses", objectPoses=wanted)
    assert kitchen.inventory == []
    check(kitchen)
    kitchen.take(kitchen.one("Apple"))
    others = [pose for pose in poses(kitchen) if "Apple" not in pose["objectName"]]
    kitchen.do("SetObjectPoses", objectPoses=others)
    assert kitchen.inventory == []
    assert kitchen.of_type("Apple") == []
    check(kitchen)


def test_an_unknown_name_is_refused_without_a_trace(kitchen):
    wrong = [*poses(kitchen), {"objectName": APPLE, "position": {}, "rotation": {}}]
    assert repr(APPLE) in kitchen.refused("SetObjectPoses", objectPoses=wrong)
    fixed = [{"objectName": kitchen[FRIDGE]["name"], "position": {}, "rotation": {}}]
    kitchen.refused("SetObjectPoses", objectPoses=fixed)


def test_a_pose_that_is_none_is_refused(kitchen):
    for wrong in ([{"objectName": "Apple"}], "all", 3, None):
        assert "objectPoses" in kitchen.refused("SetObjectPoses", objectPoses=wrong)
    kitchen.do("SetObjectPoses", objectPoses=[])
    assert len(loose(kitchen)) > 20


# -- InitialRandomSpawn ----------------------------------------------------------------------------


def places(room):
    return {o["name"]: tuple(o["position"].values()) for o in room.event.metadata["objects"]}


def test_the_same_seed_gives_the_same_room_and_another_another(enter):
    found = []
    for seed in (5, 5, 6):
        room = enter("FloorPlan1")
        room.do("InitialRandomSpawn", randomSeed=seed)
        found.append(json.dumps(room.event.metadata["objects"]))
    assert found[0] == found[1] != found[2]


def test_what_can_be_carried_moves_and_the_rest_does_not(kitchen):
    before = places(kitchen)
    fixed = {o["name"] for o in kitchen.event.metadata["objects"]} - {
        o["name"] for o in loose(kitchen) if o["pickupable"]
    }
    kitchen.do("InitialRandomSpawn", randomSeed=1)
    after = places(kitchen)
    moved = {name for name in after if after[name] != before[name]}
    assert not moved & fixed
    assert len(moved) > 0.8 * (len(before) - len(fixed))


@pytest.mark.parametrize("scene", SCENE_NAMES[::8])
def test_things_lie_where_they_may_and_nothing_is_broken(enter, scene):
    room = enter(scene)
    before = places(room)
    room.do("InitialRandomSpawn", randomSeed=2)
    types = {o["objectId"]: o["objectType"] for o in room.event.metadata["objects"]}
    for thing in loose(room):
        if thing["pickupable"] and before[thing["name"]] != tuple(thing["position"].values()):
            (parent,) = thing["parentReceptacles"]
            assert accepts(thing["objectType"], types[parent])
            x, y, z = (thing["position"][axis] for axis in "xyz")
            assert thing["objectId"] == id_of_place(thing["objectType"], (x, y, z))
    check(room)


def test_force_visible_leaves_out_what_opens(kitchen):
    before = places(kitchen)
    kitchen.do("InitialRandomSpawn", randomSeed=3, forceVisible=True)
    opens = {o["objectId"] for o in kitchen.event.metadata["objects"] if o["openable"]}
    moved = [o for o in loose(kitchen) if tuple(o["position"].values()) != before[o["name"]]]
    assert len(moved) > 10
    assert not any(opens & set(o["parentReceptacles"]) for o in moved)


def on_counters(room):
    return {
        i for counter in room.of_type("CounterTop") for i in room[counter]["receptacleObjectIds"]
    }


def test_exclusions_are_kept(kitchen):
    kitchen.do(
        "InitialRandomSpawn",
        randomSeed=4,
        excludedReceptacles=["CounterTop", "Drawer"],
        excludedObjectIds=[APPLE],
    )
    assert kitchen[APPLE]["parentReceptacles"] == [ISLAND]
    still_there = on_counters(kitchen)
    kitchen.event = kitchen.controller.reset()
    assert still_there <= on_counters(kitchen)


@pytest.mark.parametrize("seed", [3, 5, 7])
def test_a_bowl_is_not_put_onto_the_table_that_stands_in_it(enter, seed):
    room = enter("FloorPlan323")
    table, bowl = room.one("SideTable"), room.one("Bowl")
    name, wanted = room[table]["name"], poses(room)
    for pose in wanted:
        if pose["objectName"] == name:
            pose["position"] = room[bowl]["axisAlignedBoundingBox"]["center"]
    room.do("SetObjectPoses", objectPoses=wanted)
    (table,) = (o["objectId"] for o in room.event.metadata["objects"] if o["name"] == name)
    assert bowl in room[table]["parentReceptacles"]
    room.do("InitialRandomSpawn", randomSeed=seed)
    assert table not in room[table]["parentReceptacles"]
    check(room)


def test_what_is_held_is_put_somewhere_too(kitchen):
    kitchen.take(APPLE)
    kitchen.do("InitialRandomSpawn", randomSeed=1)
    assert kitchen.inventory == []
    check(kitchen)


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"numPlacementAttempts": 0}, "numPlacementAttempts"),
        ({"numDuplicatesOfType": [{"objectType": "Mug", "count": 2}]}, "numDuplicatesOfType"),
        ({"allowFloor": True}, "allowFloor"),
    ],
)
def test_what_it_cannot_do_it_says(kitchen, arguments, named):
    assert named in kitchen.refused("InitialRandomSpawn", **arguments)


def test_a_seed_is_a_number(kitchen):
    with pytest.raises(ValueError, match="randomSeed"):
        kitchen.step("InitialRandomSpawn", randomSeed="lucky")


# -- ids against the record ------------------------------------------------------------------------


def test_ids_are_written_as_the_record_writes_them():
    """Those that come of places: parts of things (a tap in a sink) carry the whole's id."""
    right = total = 0
    for name in SCENE_NAMES[::10]:
        scene = load_scene(name)
        for object_id, kind, position in zip(
            scene.object_ids, scene.types, scene.position, strict=True
        ):
            if object_id.count("|") == 3:
                total += 1
                right += object_id == id_of_place(kind, position)
    assert right / total > 0.9  # some have been moved since they were named


# -- ThrowObject -----------------------------------------------------------------------------------


def flight(room, magnitude):
    """How far ahead of where it would be dropped a thrown apple lies, and to the side, metres."""
    lies = []
    for action, arguments in (
        ("DropHandObject", {}),
        ("ThrowObject", {"moveMagnitude": magnitude}),
    ):
        room.event = room.controller.reset("FloorPlan201")
        room.do("TeleportFull", x=-4.5, z=4.0, rotation=180, horizon=0)
        ball = room.one("RemoteControl")
        room.take(ball)
        room.do(action, **arguments)
        assert room.inventory == []
        check(room)
        box = room[ball]["axisAlignedBoundingBox"]["center"]
        lies.append((box["x"], box["z"]))
    (x0, z0), (x1, z1) = lies
    ahead = (x1 - x0) * sin(radians(180)) + (z1 - z0) * cos(radians(180))
    return ahead, hypot(x1 - x0, z1 - z0)


def test_a_throw_goes_straight_ahead_and_farther_the_harder(enter):
    room = enter("FloorPlan201")
    soft, soft_way = flight(room, 30)
    hard, hard_way = flight(room, 100)
    assert 0.2 <= soft < hard <= 1.05
    assert soft_way == pytest.approx(soft, abs=0.01)
    assert hard_way == pytest.approx(hard, abs=0.01)
    assert flight(room, 1e5)[0] <= 2.05


def test_throwing_without_force_is_dropping(enter):
    assert flight(enter("FloorPlan201"), 0)[1] == 0


def test_an_empty_hand_throws_nothing(kitchen):
    assert "empty" in kitchen.refused("ThrowObject", moveMagnitude=100)
    assert "moveMagnitude" in kitchen.refused("ThrowObject", moveMagnitude=-1)


@pytest.mark.parametrize("scene", ["FloorPlan224", "FloorPlan7", "FloorPlan301"])
def test_what_rests_stays_where_it_is_put_and_the_rest_falls(scene: str) -> None:
    """A rearrangement's poses are those of things at rest: on chairs, too, whose boxes hold air."""
    with EmbeddedController(scene=scene, headless=True) as controller:
        controller.step("InitialRandomSpawn", randomSeed=1)
        loose = [
            entry
            for entry in controller.last_event.metadata["objects"]
            if entry["pickupable"] or entry["moveable"]
        ]
        poses = [
            {"objectName": o["name"], "position": dict(o["position"]), "rotation": o["rotation"]}
            for o in loose
        ]
        controller.reset(scene)
        event = controller.step("SetObjectPoses", objectPoses=poses, placeStationary=False)
        now = {entry["name"]: entry for entry in event.metadata["objects"]}
        away = [
            max(abs(now[o["name"]]["position"][axis] - o["position"][axis]) for axis in "xyz")
            for o in loose
        ]
        assert np.mean(np.array(away) < 0.01) > 0.95
        tables = ("CounterTop", "DiningTable", "CoffeeTable", "Desk", "Dresser")
        high = next(
            o
            for o in loose
            if o["pickupable"] and o["parentReceptacles"][0].split("|")[0] in tables
        )
        pose = next(pose for pose in poses if pose["objectName"] == high["name"])
        pose["position"]["y"] += 0.3
        controller.reset(scene)
        event = controller.step("SetObjectPoses", objectPoses=poses, placeStationary=False)
        fallen = next(e for e in event.metadata["objects"] if e["name"] == high["name"])
        assert fallen["position"]["y"] < pose["position"]["y"] - 0.2
