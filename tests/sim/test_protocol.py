"""The answers to the official client: keys, types, errors, and events that do not change later."""

from __future__ import annotations

import copy
import json
import pickle

import msgpack
import pytest
from floor_plan_1 import APPLE, FRIDGE, ISLAND
from support import in_one_test

from er_gym.sim.scene import SCENE_NAMES

AGENT_KEYS = [
    "screenWidth",
    "screenHeight",
    "thirdPartyCameras",
    "lastAction",
    "lastActionSuccess",
    "errorCode",
    "errorMessage",
    "actionReturn",
    "sceneName",
    "objects",
    "agent",
    "cameraPosition",
    "inventoryObjects",
    "sceneBounds",
    "colors",
    "fov",
    "heldObjectPose",
    "isSceneAtRest",
]
OBJECT_KEYS = [
    "name",
    "objectId",
    "objectType",
    "assetId",
    "position",
    "rotation",
    "axisAlignedBoundingBox",
    "objectOrientedBoundingBox",
    "distance",
    "visible",
    "isInteractable",
    "parentReceptacles",
    "receptacleObjectIds",
    "controlledObjects",
    "mass",
    "salientMaterials",
    "temperature",
    "openable",
    "isOpen",
    "openness",
    "toggleable",
    "isToggled",
    "breakable",
    "isBroken",
    "sliceable",
    "isSliced",
    "cookable",
    "isCooked",
    "dirtyable",
    "isDirty",
    "canFillWithLiquid",
    "isFilledWithLiquid",
    "fillLiquid",
    "canBeUsedUp",
    "isUsedUp",
    "pickupable",
    "isPickedUp",
    "moveable",
    "receptacle",
    "isHeatSource",
    "isColdSource",
    "isMoving",
]


def assert_plain(value, where="metadata"):
    """Nothing but JSON's own types, exactly: no numpy scalar, no tuple, no enum."""
    assert type(value) in (dict, list, str, int, float, bool, type(None)), f"{where}: {value!r}"
    if isinstance(value, dict):
        for key, item in value.items():
            assert type(key) is str, where
            assert_plain(item, f"{where}.{key}")
    elif isinstance(value, list):
        for index, item in enumerate(value):
            assert_plain(item, f"{where}[{index}]")


# -- metadata --------------------------------------------------------------------------------------


def test_an_event_says(kitchen):
    assert not set(AGENT_KEYS) - kitchen.event.metadata.keys()


def test_every_object_says(kitchen):
    kitchen.do("SliceObject", APPLE, forceAction=True)  # slices say it too
    for entry in kitchen.event.metadata["objects"]:
        assert not set(OBJECT_KEYS) - entry.keys(), entry["objectId"]


def test_values_follow_ai2thor(kitchen):
    """FloorPlan1's facts as AI2-THOR's own metadata has them."""
    metadata = kitchen.event.metadata
    assert metadata["sceneName"] == "FloorPlan1_physics"
    assert (metadata["screenWidth"], metadata["screenHeight"]) == (300, 300)
    assert len(metadata["sceneBounds"]["cornerPoints"]) == 8
    assert metadata["fov"] == 90
    fridge = kitchen[FRIDGE]
    assert fridge["objectType"] == "Fridge"
    assert fridge["openness"] == 0.0
    assert fridge["receptacleObjectIds"] == ["Egg|-02.04|+00.81|+01.24"]
    assert len(fridge["axisAlignedBoundingBox"]["cornerPoints"]) == 8
    apple = kitchen[APPLE]
    assert apple["parentReceptacles"] == [ISLAND]
    assert apple["receptacleObjectIds"] is None
    assert len(apple["objectOrientedBoundingBox"]["cornerPoints"]) == 8
    assert apple["position"]["x"] == pytest.approx(-0.47, abs=0.01)
    away = sum((apple["position"][k] - kitchen.agent["position"][k]) ** 2 for k in "xyz") ** 0.5
    assert apple["distance"] == pytest.approx(away)


def test_metadata_are_plain_values_that_any_wire_takes(enter):
    room = enter("FloorPlan1", renderInstanceSegmentation=True)
    for action, arguments in [
        ("Pass", {}),
        ("SliceObject", {"objectId": APPLE, "forceAction": True}),
        ("PickupObject", {"objectId": f"{APPLE}|AppleSliced_0", "forceAction": True}),
        ("RotateRight", {"degrees": 30}),
        ("GetReachablePositions", {}),
        ("GetInteractablePoses", {"objectId": FRIDGE, "maxPoses": 5}),
        ("OpenObject", {"objectId": FRIDGE, "openness": 0.5, "forceAction": True}),
        ("DropHandObject", {}),
    ]:
        room.do(action, **arguments)
        metadata = dict(room.event.metadata)
        assert_plain(metadata)
        assert json.loads(json.dumps(metadata, allow_nan=False)) == metadata
        assert msgpack.unpackb(msgpack.packb(metadata)) == metadata


# -- scenes ----------------------------------------------------------------------------------------


def test_scenes_in_build(kitchen):
    names = kitchen.do("GetScenesInBuild")
    assert len(set(names)) == len(names) == 121
    assert names.pop() == "Procedural"
    assert all(name.endswith("_physics") for name in names)
    assert names[0] == "FloorPlan1_physics"
    assert set(kitchen.controller.ithor_scenes()) == set(names)


@in_one_test("scene", SCENE_NAMES)
def test_every_scene_can_be_entered(enter, scene):
    room = enter(scene)
    assert room.event.metadata["lastActionSuccess"]
    assert room.event.metadata["sceneName"] == f"{scene}_physics"
    assert len(room.event.metadata["objects"]) > 20
    json.dumps(dict(room.event.metadata), allow_nan=False)


@pytest.mark.parametrize("scene", ["FloorPlan31", "FloorPlan_Train1_1", "House_1"])
def test_an_unknown_scene_raises_value_error(kitchen, scene):
    with pytest.raises(ValueError, match=scene):
        kitchen.controller.reset(scene)


# -- errors ----------------------------------------------------------------------------------------


def test_a_refusal_is_an_event(kitchen):
    event = kitchen.step("DropHandObject")
    assert not event
    assert event.metadata["lastActionSuccess"] is False
    assert event.metadata["lastAction"] == "DropHandObject"
    assert event.metadata["errorMessage"]
    assert "\n" not in event.metadata["errorMessage"]


def test_a_refusal_raises_for_those_who_ask(kitchen):
    with pytest.raises(RuntimeError, match="empty"):
        kitchen.step("DropHandObject", raise_for_failure=True)


@pytest.mark.parametrize("action", ["PickUpObject", "pass", "", "Fly", None])
def test_an_unknown_action_raises_value_error(kitchen, action):
    with pytest.raises(ValueError, match="no action"):
        kitchen.step(action)


def test_a_misspelt_action_is_told_the_right_one(kitchen):
    with pytest.raises(ValueError, match="PickupObject"):
        kitchen.step("PickUpObject")


NAN, INFINITE = float("nan"), float("inf")


WRONG_CALLS = [
    ("MoveAhead", {"agentId": 1}, "agentId is 1, and the only agent is 0"),
    ("Pass", {"agentId": "all"}, "agentId is all"),
    ("Pass", {"agentId": -1}, "agentId is -1"),
    ("PickupObject", {}, "objectId"),
    ("PutObject", {}, "objectId"),
    ("GetInteractablePoses", {}, "objectId"),
    ("PickupObject", {"objectId": [APPLE]}, "objectId"),
    ("PickupObject", {"objectId": APPLE, "force": True}, "force"),
    ("PickupObject", {"objectId": APPLE, "forceAction": "perhaps"}, "forceAction"),
    ("PickupObject", {"objectId": APPLE, "forceAction": None}, "forceAction"),
    ("PickupObject", {"objectId": APPLE, "x": 0.5, "y": 0.5}, "objectId"),
    ("PickupObject", {"x": 0.5}, "y"),
    ("RotateRight", {"degrees": "far"}, "degrees"),
    ("RotateRight", {"degrees": NAN}, "degrees"),
    ("RotateRight", {"degrees": INFINITE}, "degrees"),
    ("MoveAhead", {"moveMagnitude": NAN}, "moveMagnitude"),
    ("MoveAhead", {"moveMagnitude": INFINITE}, "moveMagnitude"),
    ("Pass", {"renderDepthImage": True}, "renderDepthImage"),
    ("TeleportFull", {"x": NAN}, "x"),
    ("TeleportFull", {"horizon": NAN}, "horizon"),
    ("TeleportFull", {"standing": "upright"}, "standing"),
    ("OpenObject", {"objectId": FRIDGE, "openness": NAN}, "openness"),
    ("GetReachablePositions", {"gridSize": NAN}, "gridSize"),
    ("ChangeResolution", {"x": 300}, "y"),
]
REFUSED = [
    ("PickupObject", {"objectId": None}, "None"),
    ("PickupObject", {"objectId": 7}, "'7'"),
    ("LookDown", {"degrees": -INFINITE}, "degrees"),
    ("LookDown", {"degrees": -1}, "positive degree"),
    ("TeleportFull", {"position": {"x": 0, "y": 1, "z": INFINITE}}, "position"),
    ("TeleportFull", {"position": [0, 1, 0]}, "position"),
    ("TeleportFull", {"rotation": NAN}, "rotation"),
    ("GetReachablePositions", {"gridSize": 0}, "grid"),
    ("GetReachablePositions", {"maxStepCount": 1}, "Too many steps"),
    ("GetReachablePositions", {"maxStepCount": 1, "gridSize": 1e308}, "Too many steps"),
    ("GetInteractablePoses", {"objectId": FRIDGE, "rotations": [NAN]}, "rotations"),
    ("GetInteractablePoses", {"objectId": FRIDGE, "horizons": "all"}, "horizons"),
    ("GetInteractablePoses", {"objectId": FRIDGE, "maxPoses": 0}, "maxPoses"),
    ("GetInteractablePoses", {"objectId": FRIDGE, "maxPoses": -3}, "maxPoses"),
    ("GetInteractablePoses", {"objectId": FRIDGE, "maxDistance": 0}, "maxDistance"),
    ("Initialize", {"gridSize": -1}, "grid size"),
    ("Initialize", {"gridSize": 5.5}, "grid size"),
    ("Initialize", {"gridSize": "fine"}, "gridSize"),
    ("Initialize", {"fieldOfView": 180}, "fov"),
    ("Initialize", {"rotateStepDegrees": 0}, "rotateStepDegrees"),
    ("Initialize", {"timeScale": 0}, "Time scale"),
    ("Initialize", {"agentMode": "arm"}, "agentMode"),
    ("Initialize", {"agentCount": 5}, "agents"),
    ("ChangeResolution", {"x": 0, "y": 300}, "x"),
    ("Reset", {"sceneName": "FloorPlan31"}, "FloorPlan31"),
    ("Reset", {"sceneName": [1]}, "sceneName"),
]


@pytest.mark.parametrize(("action", "arguments", "named"), WRONG_CALLS)
def test_a_wrong_call_raises_value_error_and_changes_nothing(kitchen, action, arguments, named):
    before = kitchen.event.metadata
    with pytest.raises(ValueError, match=named) as caught:
        kitchen.step(action, **arguments)
    assert "\n" not in str(caught.value)
    after = kitchen.step("Pass").metadata
    assert after["objects"] == before["objects"]
    assert after["agent"] == before["agent"]


@pytest.mark.parametrize(("action", "arguments", "named"), REFUSED)
def test_what_an_action_refuses_is_an_event_and_changes_nothing(kitchen, action, arguments, named):
    before = kitchen.event.metadata
    assert named in kitchen.refused(action, **arguments)
    assert kitchen.event.metadata["errorCode"] is None
    assert kitchen.agent == before["agent"]


def test_the_next_action_after_an_error_is_none_the_worse(kitchen):
    with pytest.raises(ValueError, match="no action"):
        kitchen.step("Fly")
    kitchen.do("RotateRight")
    assert kitchen.event.metadata["errorCode"] is None


# -- events stay as they were ----------------------------------------------------------------------


def test_an_event_does_not_change_when_the_world_moves_on(kitchen):
    kitchen.go_to(FRIDGE)
    kept = kitchen.event
    remembered = copy.deepcopy(dict(kept.metadata))
    kitchen.do("OpenObject", FRIDGE)
    kitchen.take(APPLE)
    kitchen.do("PutObject", FRIDGE)
    kitchen.do("RotateRight")
    kitchen.do("SliceObject", APPLE, forceAction=True)
    kitchen.controller.reset("FloorPlan2")
    assert dict(kept.metadata) == remembered


@pytest.mark.parametrize(
    ("action", "arguments"),
    [
        ("OpenObject", {"objectId": FRIDGE, "forceAction": True}),
        ("PickupObject", {"objectId": APPLE, "forceAction": True}),
        ("SliceObject", {"objectId": APPLE, "forceAction": True}),
        ("RotateRight", {}),
        ("TeleportFull", {"x": 0.5, "z": 1.5}),
        ("Initialize", {"visibilityDistance": 0.2}),
        ("ChangeResolution", {"x": 50, "y": 400}),
        ("DropHandObject", {}),
        ("Reset", {"sceneName": "FloorPlan2"}),
    ],
)
def test_an_event_that_is_read_late_says_what_was(enter, action, arguments):
    """Whether metadata are read at once, or only after the world has changed, is all the same."""
    said = []
    for late in (False, True):
        room = enter("FloorPlan1")
        room.step("TeleportFull", x=-1.0, z=1.0, rotation=270, horizon=0)
        kept = room.event.metadata
        if not late:
            said.append(json.dumps(dict(kept)))
        room.step(action, **arguments)
        if late:
            said.append(json.dumps(dict(kept)))
    assert said[0] == said[1]


@pytest.mark.parametrize(
    "read",
    [
        lambda m: m["objects"],
        lambda m: m.get("objects"),
        lambda m: dict(m)["objects"],
        lambda m: {**m}["objects"],
        lambda m: dict(m.items())["objects"],
        lambda m: dict(zip(m.keys(), m.values(), strict=True))["objects"],
        lambda m: copy.copy(m)["objects"],
        lambda m: copy.deepcopy(m)["objects"],
        lambda m: m.copy()["objects"],
        lambda m: pickle.loads(pickle.dumps(m))["objects"],
        lambda m: json.loads(json.dumps(m))["objects"],
        lambda m: msgpack.unpackb(msgpack.packb(m))["objects"],
        lambda m: (m | {})["objects"],
        lambda m: ({} | m)["objects"],
        lambda m: {k: m[k] for k in m}["objects"],
        lambda m: m.setdefault("objects", []),
        lambda m: m.pop("objects"),
    ],
)
def test_objects_are_there_however_they_are_read(kitchen, read):
    expected = kitchen.step("Pass").metadata["objects"]
    assert len(expected) == 77
    again = kitchen.step("Pass")
    assert isinstance(again.metadata, dict)
    assert read(getattr(again.metadata, "_raw_metadata", again.metadata)) == expected


def test_what_a_caller_does_to_an_event_does_not_reach_the_world(kitchen):
    positions = kitchen.do("GetReachablePositions")
    first, count = dict(positions[0]), len(positions)
    positions[0]["x"] = 99.0
    positions.clear()
    again = kitchen.do("GetReachablePositions")
    assert (again[0], len(again)) == (first, count)


def test_what_a_caller_does_to_the_bounds_or_to_an_entry_does_not_reach_the_world(kitchen):
    """Deeper values of objects are shared between events: docs/fidelity.md says so."""
    bounds = kitchen.event.metadata["sceneBounds"]["center"]["x"]
    kitchen[APPLE]["isSliced"] = True
    kitchen.event.metadata["sceneBounds"]["center"]["x"] = 99.0
    kitchen.do("Pass")
    assert not kitchen[APPLE]["isSliced"]
    assert kitchen.event.metadata["sceneBounds"]["center"]["x"] == bounds
