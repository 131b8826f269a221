"""The official client on the embedded engine: frames, depth, masks, sizes, and no shared state."""

from __future__ import annotations

import hashlib
import json
import multiprocessing
import subprocess
import sys

import numpy as np
import pytest
from floor_plan_1 import APPLE, FRIDGE

from er_gym.sim.controller import EmbeddedController

ACROSS = {"x": 1.0, "z": 1.25, "rotation": 270, "horizon": 0}
"""From here one faces the fridge, 2.65 m away: its box ends at x = -1.653."""


@pytest.fixture(scope="module")
def drawing():
    controller = EmbeddedController(
        scene="FloorPlan1",
        width=160,
        height=90,
        renderDepthImage=True,
        renderInstanceSegmentation=True,
        visibilityDistance=20,
    )
    yield controller
    controller.stop()


@pytest.fixture
def view(drawing):
    drawing.reset("FloorPlan1")
    event = drawing.step("TeleportFull", **ACROSS)
    assert event.metadata["lastActionSuccess"]
    return event


def test_headless_has_no_frame(kitchen):
    assert kitchen.event.frame is None


def test_frames_are_rgb(view):
    assert view.frame.shape == (90, 160, 3)
    assert view.frame.dtype == np.uint8
    assert view.frame.std() > 1  # it shows something


def test_frames_show_what_changes(drawing, view):
    turned = drawing.step("RotateRight", degrees=90)
    assert (turned.frame != view.frame).any()
    assert turned.frame is not view.frame


def test_without_the_flags_there_is_neither_depth_nor_mask():
    controller = EmbeddedController(scene="FloorPlan1", width=40, height=30)
    event = controller.last_event
    assert event.frame.shape == (30, 40, 3)
    assert event.depth_frame is None
    assert event.instance_segmentation_frame is None
    controller.stop()


def test_a_step_without_an_image_is_possible(drawing):
    assert drawing.step("Pass", renderImage=False).frame is None
    assert drawing.step("Pass").frame is not None


def test_depth_is_in_metres(view):
    """The fridge's front is at x = -1.653, the camera at x = 1, looking along -x."""
    depth = view.depth_frame
    assert depth.shape == (90, 160)
    assert depth.dtype == np.float32
    on_fridge = view.instance_masks[FRIDGE]
    assert on_fridge[45, 80]
    assert depth[45, 80] == pytest.approx(1.0 + 1.65283, abs=0.06)  # its handles stick out
    assert np.isfinite(depth).all()
    assert (depth > 0).all()


def test_masks_boxes_and_colours_agree(view):
    colours = {entry["name"]: tuple(entry["color"]) for entry in view.metadata["colors"]}
    ids = {entry["objectId"] for entry in view.metadata["objects"]}
    types = {entry["objectType"] for entry in view.metadata["objects"]}
    assert set(colours) == ids | types
    assert len(set(colours.values())) == len(colours)
    shown = ids & set(view.instance_masks)
    assert FRIDGE in shown
    for name in shown:
        mask = view.instance_masks[name]
        assert (view.instance_segmentation_frame[mask] == colours[name]).all()
        rows, columns = np.nonzero(mask)
        left, top, right, bottom = view.instance_detections2D[name]
        assert (left, top) == (columns.min(), rows.min())
        assert right - columns.max() in (0, 1)
        assert bottom - rows.max() in (0, 1)


def test_the_right_side_up_and_round(drawing, view):
    """The floor is in the lower half; a turn to the right moves things to the left."""
    depth = view.depth_frame
    assert depth[-1].mean() < depth[45].mean()
    rows, columns = np.nonzero(view.instance_masks[FRIDGE])
    turned = drawing.step("RotateRight", degrees=20)
    assert np.nonzero(turned.instance_masks[FRIDGE])[1].mean() < columns.mean() - 5
    down = drawing.step("TeleportFull", **{**ACROSS, "horizon": 20})
    assert np.nonzero(down.instance_masks[FRIDGE])[0].mean() < rows.mean() - 5


def test_what_is_shut_away_is_in_no_mask(drawing, view):
    egg = "Egg|-02.04|+00.81|+01.24"
    assert egg not in view.instance_masks
    assert APPLE in view.instance_masks


def test_resolution_changes_by_action_and_by_reset():
    controller = EmbeddedController(scene="FloorPlan1", width=64, height=48)
    event = controller.step("ChangeResolution", x=100, y=50)
    assert event.frame.shape == (50, 100, 3)
    event = controller.reset("FloorPlan1", width=320, height=200)
    assert event.frame.shape == (200, 320, 3)
    assert (event.metadata["screenWidth"], event.metadata["screenHeight"]) == (320, 200)
    assert controller.reset("FloorPlan2").frame.shape == (200, 320, 3)
    controller.stop()


def test_settings_hold_over_resets_and_can_be_changed_by_them():
    controller = EmbeddedController(scene="FloorPlan1", headless=True, gridSize=0.5, fieldOfView=60)
    for scene in ("FloorPlan1", "FloorPlan2"):
        event = controller.reset(scene)
        assert event.metadata["fov"] == 60
        x = controller.step("GetReachablePositions").metadata["actionReturn"][0]["x"]
        assert x % 0.5 == 0
    assert controller.reset("FloorPlan1", fieldOfView=100).metadata["fov"] == 100
    controller.stop()


def test_two_controllers_know_nothing_of_each_other():
    one, other = (EmbeddedController(scene="FloorPlan1", headless=True) for _ in range(2))
    before = json.dumps(dict(other.step("Pass").metadata))
    one.step("SliceObject", objectId=APPLE, forceAction=True, raise_for_failure=True)
    one.step("OpenObject", objectId=FRIDGE, forceAction=True, raise_for_failure=True)
    one.reset("FloorPlan3")
    assert json.dumps(dict(other.step("Pass").metadata)) == before
    assert one.last_event.metadata["sceneName"] == "FloorPlan3_physics"
    one.stop()
    other.stop()


@pytest.mark.parametrize("name", ["server_class", "platform", "local_executable_path", "host"])
def test_what_chooses_a_unity_build_is_a_type_error(name):
    with pytest.raises(TypeError, match=name) as caught:
        EmbeddedController(scene="FloorPlan1", **{name: None})
    assert "backend='unity'" in str(caught.value)


def test_a_wrong_setting_ends_a_program_and_an_unknown_one_does_not():
    with pytest.raises(RuntimeError, match=r"range \(0,5\]"):
        EmbeddedController(scene="FloorPlan1", headless=True, gridSize=-0.1)
    controller = EmbeddedController(scene="FloorPlan1", headless=True, gridWidth=-0.1)
    controller.stop()


def played() -> list[str]:
    """Some of everything, and the digests of what it did; frames included."""
    controller = EmbeddedController(
        scene="FloorPlan1", width=64, height=48, renderInstanceSegmentation=True
    )
    digests = []
    for action, arguments in [
        ("Pass", {}),
        ("GetInteractablePoses", {"objectId": FRIDGE, "maxPoses": 20}),
        ("OpenObject", {"objectId": FRIDGE, "forceAction": True}),
        ("SliceObject", {"objectId": APPLE, "forceAction": True}),
        ("PickupObject", {"objectId": f"{APPLE}|AppleSliced_4", "forceAction": True}),
        ("PutObject", {"objectId": FRIDGE, "forceAction": True}),
        ("RotateLeft", {"degrees": 33}),
        ("GetReachablePositions", {}),
    ]:
        event = controller.step(action, **arguments)
        assert event.metadata["lastActionSuccess"], event.metadata["errorMessage"]
        said = json.dumps(dict(event.metadata), allow_nan=False).encode()
        digests.append(hashlib.sha256(said + event.frame.tobytes()).hexdigest())
    controller.stop()
    return digests


def test_the_same_actions_give_the_same_metadata_in_another_process(monkeypatch):
    monkeypatch.setenv("PYTHONHASHSEED", "12345")  # of the other process
    context = multiprocessing.get_context("spawn")
    with context.Pool(1) as pool:
        assert pool.apply(played) == played()


WITHOUT = """
import sys
from er_gym.sim.controller import EmbeddedController
controller = EmbeddedController(scene="FloorPlan1", headless=True)
assert not {"botocore", "flask", "requests"} & sys.modules.keys()
import ai2thor.build, ai2thor.controller
assert issubclass(ai2thor.build.requests.exceptions.ConnectionError, OSError)
import requests
assert ai2thor.build.requests.head is requests.head
assert ai2thor.controller.ai2thor.wsgi_server.WsgiServer.server_type == "WSGI"
import ai2thor.wsgi_server
assert ai2thor.wsgi_server is sys.modules["ai2thor.wsgi_server"]
assert "flask" in sys.modules
from aws_requests_auth.boto_utils import get_credentials
import os
os.environ.update(AWS_ACCESS_KEY_ID="mine", AWS_SECRET_ACCESS_KEY="secret")
assert ai2thor.build.boto_auth().aws_host == "s3-us-west-2.amazonaws.com"
"""


def test_the_client_comes_without_what_talks_to_unity_and_with_it_when_it_is_used():
    subprocess.run([sys.executable, "-c", WITHOUT], check=True)
