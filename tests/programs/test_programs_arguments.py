"""Programs that pass what other versions of AI2-THOR took, and name things by where they are seen.

Each runs through the official client on the player, as it would on the Unity build.
"""

from __future__ import annotations

import ai2thor.controller
import pytest
from floor_plan_1 import APPLE, FRIDGE

import er_gym


@pytest.fixture
def program(monkeypatch, tmp_path):
    """A function that starts a controller as a program does; the client's files stay in a folder of
    the test's."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    started = []

    def start(**arguments):
        given = {"scene": "FloorPlan1", "width": 300, "height": 300, **arguments}
        controller = ai2thor.controller.Controller(
            local_executable_path=er_gym.thor_executable(), x_display=":0", **given
        )
        started.append(controller)
        return controller

    yield start
    for controller in started:
        controller.stop()


def test_reset_takes_what_any_version_took(program):
    controller = program(
        agentMode="default",
        visibilityDistance=1.5,
        gridSize=0.25,
        snapGrid=False,
        cameraY=0.675,
        movementGaussianSigma=0.005,
        rotateGaussianSigma=0.5,
        useMassThreshold=True,
        massThreshold=10,
        autoSimulation=False,
        cameraNearPlane=0.01,
        alwaysReturnVisibleRange=True,
        renderFlowImage=True,
        agentControllerType_="physics",
        visibilityScheme="Distance",
    )
    event = controller.reset("FloorPlan2", quality="Medium", server_timeout=3, local={"any": [1]})
    assert event.metadata["lastActionSuccess"]
    assert event.metadata["sceneName"] == "FloorPlan2_physics"
    with pytest.warns(DeprecationWarning, match="continuous"):
        program(continuous=True, continuousMode=True).stop()


def test_what_means_nothing_ends_a_program_in_words(program):
    controller = program()
    for wrong, words in (
        ({"gridSize": -0.25}, "grid size must be in the range"),
        ({"gridSize": 0.25, "fieldOfView": 180}, "noninclusive"),
        ({"fieldOfView": 90, "rotateStepDegrees": 0}, "rotateStepDegrees"),
        ({"rotateStepDegrees": 90, "agentCount": 5}, "up to 4 agents"),
    ):
        with pytest.raises(RuntimeError, match=words):
            controller.reset("FloorPlan1", **wrong)
    controller.reset("FloorPlan1", agentCount=1)
    assert controller.step("Pass")


def test_actions_take_the_arguments_of_ai2thor_5(program):
    controller = program()
    for action in ("MoveAhead", "MoveBack", "MoveLeft", "MoveRight"):
        controller.step(action, moveMagnitude=0.25, forceAction=True, manualInteract=False)
    for action in ("RotateLeft", "RotateRight"):
        assert controller.step(action, degrees="45", forceAction=True, manualInteract=True)
    assert controller.step("RotateLook", rotation=90, horizon=31, response="ignored")
    assert controller.last_event.metadata["agent"]["cameraHorizon"] == pytest.approx(31)
    assert controller.step("LookUp", degrees=1, forceAction=True, speed=[])
    with pytest.raises(ValueError, match="called with invalid argument: 'speeed'"):
        controller.step("MoveAhead", speeed=1)
    assert controller.last_event.metadata["errorCode"] == "InvalidArgument"
    with pytest.raises(ValueError, match="missing the following arguments: objectId"):
        controller.step("PickupObject", forceAction=True)
    with pytest.raises(ValueError, match=r"degrees \(==\{'y': 3\}\). Cannot convert to: float"):
        controller.step("RotateRight", degrees={"y": 3})
    with pytest.raises(ValueError, match="Invalid action: moveahead"):
        controller.step("moveahead")


def test_a_search_by_distance_and_step_count(program):
    controller = program()
    near = controller.step("GetInteractablePoses", objectId=FRIDGE).metadata["actionReturn"]
    far = controller.step("GetInteractablePoses", objectId=FRIDGE, maxDistance=5)
    assert len(far.metadata["actionReturn"]) > 1.5 * len(near)
    aligned = controller.step("GetReachablePositions", maxStepCount=1000).metadata["actionReturn"]
    assert not controller.step("GetReachablePositions", maxStepCount=1)
    controller.step("Teleport", position={"x": 0.5, "y": 0.9, "z": 1.5}, rotation=49.1)
    turned = controller.step("GetReachablePositions", directionsRelativeAgent=True)
    agent = turned.metadata["agent"]["position"]
    assert {"x": agent["x"], "z": agent["z"]} in [
        {"x": pytest.approx(p["x"]), "z": pytest.approx(p["z"])}
        for p in turned.metadata["actionReturn"]
    ]
    assert 0.8 < len(turned.metadata["actionReturn"]) / len(aligned) < 1.2
    assert turned.metadata["actionReturn"] != aligned


def centre_of(mask):
    """The middle pixel of a mask, as fractions of the picture from its upper left corner."""
    rows, columns = mask.nonzero()
    middle = abs(rows - rows.mean()) + abs(columns - columns.mean())
    k = middle.argmin()
    return {"x": (columns[k] + 0.5) / mask.shape[1], "y": (rows[k] + 0.5) / mask.shape[0]}


def see(controller, object_id):
    """Go to where an object is seen, and return the point of the picture that shows it."""
    poses = controller.step(
        "GetInteractablePoses", objectId=object_id, horizons=[0, 30], standings=[True]
    ).metadata["actionReturn"]
    for pose in poses:
        event = controller.step("TeleportFull", **pose)
        if object_id in event.instance_masks and event.instance_masks[object_id].sum() > 50:
            return centre_of(event.instance_masks[object_id])
    raise AssertionError(f"{object_id} is seen from nowhere")


def test_a_kitchen_is_handled_by_screen_coordinates(program):
    controller = program(renderInstanceSegmentation=True)

    def at(action, object_id, **arguments):
        point = see(controller, object_id)
        event = controller.step(action, **point, **arguments)
        assert event, event.metadata["errorMessage"]
        return event.get_object(object_id)

    assert at("OpenObject", FRIDGE, openness=0.5)["openness"] == 0.5
    assert not at("CloseObject", FRIDGE)["isOpen"]
    assert at("PickupObject", APPLE)["isPickedUp"]
    counter = "CounterTop|-00.08|+01.15|00.00"
    assert APPLE in at("PutObject", counter, forceAction=True)["receptacleObjectIds"]
    lamp = "LightSwitch|+02.33|+01.31|-00.16"
    assert not at("ToggleObjectOff", lamp)["isToggled"]
    assert at("ToggleObjectOn", lamp)["isToggled"]
    at_apple = see(controller, APPLE)
    assert controller.step("SliceObject", **at_apple)
    assert any(o["objectType"] == "AppleSliced" for o in controller.last_event.metadata["objects"])


def test_a_point_outside_the_picture_is_a_failed_event(program):
    controller = program()
    for action in ("OpenObject", "PickupObject", "ToggleObjectOn", "CookObject", "BreakObject"):
        event = controller.step(action, x=1.5, y=0.5)
        assert not event
        assert "[0:1]" in event.metadata["errorMessage"]
        assert event.metadata["errorCode"] is None
    with pytest.raises(ValueError, match="'objectId'"):
        controller.step("OpenObject", objectId=FRIDGE, x=0.5, y=0.5)
