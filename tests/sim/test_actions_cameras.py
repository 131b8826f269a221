"""The agent's lens, third-party cameras, and pictures asked for one step at a time."""

from __future__ import annotations

import numpy as np
import pytest
from floor_plan_1 import FRIDGE

from er_gym.sim.controller import EmbeddedController

ACROSS = {"x": 1.0, "z": 1.25, "rotation": 270, "horizon": 0}
"""From here one faces the fridge, whose front is at x = -1.653."""
EYE = {"position": {"x": 1.0, "y": 1.576, "z": 1.25}, "rotation": {"x": 0, "y": 270, "z": 0}}
"""Where the agent's camera is when it stands there, to the millimetre."""
FLAGS = ("renderDepthImage", "renderInstanceSegmentation", "renderSemanticSegmentation")


@pytest.fixture
def drawing():
    controller = EmbeddedController(scene="FloorPlan1", width=160, height=90)
    controller.step("TeleportFull", **ACROSS)
    yield controller
    controller.stop()


def test_change_fov(drawing):
    wide = drawing.step("Pass", renderInstanceSegmentation=True)
    event = drawing.step("ChangeFOV", fieldOfView=40, renderInstanceSegmentation=True)
    assert event.metadata["fov"] == 40
    narrow = event.instance_masks[FRIDGE].sum()
    # Twice as large on each side: tan 45° is 2.75 times tan 20°, and the picture ends before that.
    assert narrow > 2 * wide.instance_masks[FRIDGE].sum()
    assert drawing.reset().metadata["fov"] == 90


@pytest.mark.parametrize("degrees", [float("nan"), float("inf"), None, "wide", {}])
def test_a_field_of_view_that_is_no_number_is_a_value_error(drawing, degrees):
    with pytest.raises(ValueError, match="fieldOfView"):
        drawing.step("ChangeFOV", fieldOfView=degrees)
    assert drawing.step("Pass").metadata["fov"] == 90


@pytest.mark.parametrize("degrees", [0, 180, 181, -1])
def test_a_field_of_view_out_of_range_is_refused(drawing, degrees):
    event = drawing.step("ChangeFOV", fieldOfView=degrees)
    assert "(0, 180) noninclusive" in event.metadata["errorMessage"]
    assert event.metadata["fov"] == 90


@pytest.mark.parametrize("degrees", [5e-324, 1e-320, 1e-9, np.nextafter(180.0, 0.0)])
def test_the_narrowest_and_the_widest_field_of_view_are_drawn(drawing, degrees):
    assert drawing.step("ChangeFOV", fieldOfView=float(degrees)).metadata["lastActionSuccess"]
    assert drawing.step("Pass").frame.shape == drawing.last_event.frame.shape
    assert drawing.step("GetObjectInFrame", x=0.5, y=0.5).frame is not None


@pytest.mark.parametrize("degrees", [0, 180, 181, -1])
def test_so_it_is_of_third_party_cameras(drawing, degrees):
    assert not drawing.step("AddThirdPartyCamera", **EYE, fieldOfView=degrees)
    drawing.step("AddThirdPartyCamera", **EYE)
    assert not drawing.step("UpdateThirdPartyCamera", fieldOfView=degrees)
    assert drawing.step("Pass").metadata["thirdPartyCameras"][0]["fieldOfView"] == 90


def test_a_camera_in_the_agents_place_sees_what_the_agent_sees(drawing):
    event = drawing.step("AddThirdPartyCamera", **EYE)
    (frame,) = event.third_party_camera_frames
    assert frame.shape == event.frame.shape
    assert (frame == event.frame).all(axis=2).mean() > 0.98


def test_cameras_are_told_of_in_order_and_stay_until_reset(drawing):
    drawing.step("AddThirdPartyCamera", **EYE)
    above = {"position": {"x": 0, "y": 2.4, "z": 0}, "rotation": {"x": 90, "y": 0, "z": 0}}
    drawing.step("AddThirdPartyCamera", **above, fieldOfView=60, skyboxColor="white")
    event = drawing.step("MoveBack")
    first, second = event.metadata["thirdPartyCameras"]
    assert (first["thirdPartyCameraId"], second["thirdPartyCameraId"]) == (0, 1)
    assert first["fieldOfView"] == 90
    assert second == {"thirdPartyCameraId": 1, "fieldOfView": 60, **above}
    assert len(event.third_party_camera_frames) == 2
    assert (event.third_party_camera_frames[0] != event.third_party_camera_frames[1]).any()
    event = drawing.reset()
    assert event.metadata["thirdPartyCameras"] == []
    assert event.third_party_camera_frames == []


def test_a_camera_sees_what_changes(drawing):
    def look(action, **arguments):
        return drawing.step(action, **arguments).third_party_camera_frames[0]

    before = look("AddThirdPartyCamera", **EYE)
    assert (look("RotateRight") == before).all()
    assert (look("OpenObject", objectId=FRIDGE, forceAction=True) != before).any()


def test_all_sorts_of_pictures_come_from_each_camera():
    flags = dict.fromkeys(FLAGS, True)
    controller = EmbeddedController(scene="FloorPlan1", width=160, height=90, **flags)
    controller.step("TeleportFull", **ACROSS)
    event = controller.step("AddThirdPartyCamera", **EYE)
    assert event.third_party_depth_frames[0][45, 80] == pytest.approx(2.65283, abs=0.06)
    assert event.third_party_instance_masks[0][FRIDGE][45, 80]
    shown = event.third_party_semantic_segmentation_frames[0]
    assert tuple(shown[45, 80]) == event.object_id_to_color["Fridge"]
    np.testing.assert_allclose(
        event.third_party_depth_frames[0], event.depth_frame, rtol=0.005, atol=0.005
    )
    controller.stop()


def test_update_changes_what_it_is_given_and_nothing_else(drawing):
    drawing.step("AddThirdPartyCamera", **EYE)
    event = drawing.step("UpdateThirdPartyCamera", thirdPartyCameraId=0, position={"y": 2.0})
    (camera,) = event.metadata["thirdPartyCameras"]
    assert camera["position"] == {"x": 1.0, "y": 2.0, "z": 1.25}
    assert camera["rotation"] == EYE["rotation"]
    event = drawing.step("UpdateThirdPartyCamera", rotation={"x": 20.0}, fieldOfView=50)
    (camera,) = event.metadata["thirdPartyCameras"]
    assert camera["position"]["y"] == 2.0
    assert camera["rotation"] == {"x": 20.0, "y": 270, "z": 0}
    assert camera["fieldOfView"] == 50


def test_roll_turns_the_picture(drawing):
    level = drawing.step("AddThirdPartyCamera", **EYE, renderInstanceSegmentation=True)
    over = drawing.step(
        "UpdateThirdPartyCamera", rotation={"z": 180}, renderInstanceSegmentation=True
    )
    upright, upended = (event.third_party_instance_masks[0][FRIDGE] for event in (level, over))
    assert (upright[::-1, ::-1] == upended).mean() > 0.98
    assert (upright == upended).mean() < 0.95


@pytest.mark.parametrize(
    ("action", "arguments", "named"),
    [
        ("AddThirdPartyCamera", {**EYE, "orthographicSize": 2}, "orthographic=True"),
        ("AddThirdPartyCamera", {**EYE, "orthographic": True, "orthographicSize": 0}, "above 0"),
        ("AddThirdPartyCamera", {**EYE, "orthographic": True, "orthographicSize": 1e6}, "1000"),
        ("AddThirdPartyCamera", {**EYE, "position": 5}, "position"),
        ("UpdateThirdPartyCamera", {}, "AddThirdPartyCamera makes one"),
        ("UpdateThirdPartyCamera", {"thirdPartyCameraId": -1}, "camera -1"),
    ],
)
def test_what_no_camera_can_do_is_refused(drawing, action, arguments, named):
    event = drawing.step(action, **arguments)
    assert named in event.metadata["errorMessage"]
    assert event.metadata["thirdPartyCameras"] == []


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"position": EYE["position"]}, "missing the following arguments: rotation"),
        (
            {**EYE, "orthographic": True, "orthographicSize": {"x": 0}},
            "^action: AddThirdPartyCamera has an invalid argument: orthographicSize",
        ),
    ],
)
def test_wrong_calls_raise_value_error(drawing, arguments, named):
    with pytest.raises(ValueError, match=named):
        drawing.step("AddThirdPartyCamera", **arguments)
    assert drawing.step("Pass").metadata["thirdPartyCameras"] == []


# -- maps -----------------------------------------------------------------------------------------


SIZE = 120
IMAGES = {"renderDepthImage": True, "renderInstanceSegmentation": True}


@pytest.fixture
def above():
    """A square picture of all kinds, whose controller is stopped in the end."""
    controller = EmbeddedController(scene="FloorPlan1", width=SIZE, height=SIZE, **IMAGES)
    yield controller
    controller.stop()


def test_a_map_shows_each_thing_where_it_is(above):
    camera = above.step("GetMapViewCameraProperties").metadata["actionReturn"]
    bounds = above.last_event.metadata["sceneBounds"]
    assert camera["position"]["x"] == pytest.approx(bounds["center"]["x"])
    assert camera["position"]["y"] == pytest.approx(bounds["center"]["y"] + bounds["size"]["y"] / 2)
    assert camera["rotation"] == {"x": 90.0, "y": 0.0, "z": 0.0}
    assert camera["orthographic"] is True
    event = above.step("AddThirdPartyCamera", **camera)
    half, at = camera["orthographicSize"], camera["position"]
    assert 2 * half == pytest.approx(max(bounds["size"]["x"], bounds["size"]["z"]))
    checked = 0
    for entry in event.metadata["objects"]:
        mask = event.third_party_instance_masks[0].get(entry["objectId"])
        box = entry["axisAlignedBoundingBox"]
        if mask is None or entry["objectType"] in ("Floor", "Window") or box["size"]["y"] < 0.05:
            continue
        rows, columns = np.nonzero(mask)
        x = at["x"] + ((columns.min() + columns.max() + 1) / SIZE - 1.0) * half
        z = at["z"] + (1.0 - (rows.min() + rows.max() + 1) / SIZE) * half
        if abs(x - box["center"]["x"]) < 0.06 and abs(z - box["center"]["z"]) < 0.06:
            checked += 1
    assert checked > 12
    floor = next(e for e in event.metadata["objects"] if e["objectType"] == "Floor")
    seen = event.third_party_instance_masks[0][floor["objectId"]]
    depth = event.third_party_depth_frames[0]
    assert np.median(depth[seen]) == pytest.approx(at["y"], abs=0.02)  # equally deep everywhere
    assert np.ptp(depth[seen]) < 0.05
    stool = next(e for e in event.metadata["objects"] if e["objectType"] == "CounterTop")
    assert depth[event.third_party_instance_masks[0][stool["objectId"]]].max() < at["y"] - 0.5


def test_the_agents_picture_is_a_map_until_it_is_toggled_back(above):
    before = above.step("Pass")
    camera = above.step("GetMapViewCameraProperties").metadata["actionReturn"]
    above.step("AddThirdPartyCamera", **camera)
    event = above.step("ToggleMapView")
    assert (event.frame == event.third_party_camera_frames[0][..., :3]).all()
    assert (event.frame != before.frame).mean() > 0.5
    assert event.metadata["cameraOrthSize"] == camera["orthographicSize"]
    visible = [e["objectId"] for e in event.metadata["objects"] if e["visible"]]
    assert visible == [e["objectId"] for e in before.metadata["objects"] if e["visible"]]
    assert (above.step("RotateRight").frame == event.frame).all()
    above.step("RotateLeft")
    event = above.step("ToggleMapView")
    assert (event.frame == before.frame).all()
    assert event.metadata["cameraOrthSize"] == 0.0
    above.step("ToggleMapView")
    assert (above.reset("FloorPlan1").frame == before.frame).all()


def test_an_orthographic_camera_is_updated_and_becomes_a_pinhole_again(above):
    camera = above.step("GetMapViewCameraProperties").metadata["actionReturn"]
    whole = above.step("AddThirdPartyCamera", **camera).third_party_camera_frames[0]
    half = camera["orthographicSize"] / 2
    event = above.step("UpdateThirdPartyCamera", orthographicSize=half)
    near = event.third_party_camera_frames[0]
    middle = slice(SIZE // 4, 3 * SIZE // 4)
    assert np.abs(near[::2, ::2].astype(int) - whole[middle, middle]).mean() < 20
    event = above.step("UpdateThirdPartyCamera", position={"x": 0.3})
    assert (event.third_party_camera_frames[0] != near).any()
    refused = above.step("UpdateThirdPartyCamera", orthographic=False, orthographicSize=1)
    assert "orthographic=True" in refused.metadata["errorMessage"]
    event = above.step("UpdateThirdPartyCamera", orthographic=False)
    pinhole = above.step("AddThirdPartyCamera", position={**camera["position"], "x": 0.3},
                         rotation=camera["rotation"])  # fmt: skip
    first, second = pinhole.third_party_camera_frames
    assert (first == second).all()


# -- pictures for one step -------------------------------------------------------------------------


ATTRIBUTES = ("depth_frame", "instance_segmentation_frame", "semantic_segmentation_frame")


@pytest.mark.parametrize(("flag", "attribute"), list(zip(FLAGS, ATTRIBUTES, strict=True))[1:])
def test_a_flag_holds_for_one_step(drawing, flag, attribute):
    assert getattr(drawing.step("Pass"), attribute) is None
    assert getattr(drawing.step("Pass", **{flag: True}), attribute) is not None
    after = drawing.step("Pass")
    assert getattr(after, attribute) is None
    assert after.metadata["colors"] is None


OLD_NAMES = {FLAGS[1]: "renderObjectImage", FLAGS[2]: "renderClassImage"}


@pytest.mark.parametrize(("flag", "old"), list(OLD_NAMES.items()))
def test_initialize_switches_a_flag_on_and_off_under_either_name(drawing, flag, old):
    assert drawing.reset(**{old: True}).metadata["colors"]
    drawing.initialization_parameters = {}
    assert drawing.reset(**{flag: True}).metadata["colors"]
    assert drawing.reset(**{flag: False}).metadata["colors"] is None


def test_semantic_segmentation_has_one_colour_a_type(drawing):
    event = drawing.step("Pass", **dict.fromkeys(FLAGS[1:], True))
    colours = event.object_id_to_color
    fridge = event.instance_masks[FRIDGE]
    assert fridge.any()
    assert (event.semantic_segmentation_frame[fridge] == colours["Fridge"]).all()
    types = {entry["objectType"] for entry in event.metadata["objects"]}
    assert types <= set(colours)
    shown = {tuple(colour) for colour in event.semantic_segmentation_frame.reshape(-1, 3).tolist()}
    assert shown - {(0, 0, 0)} <= {colours[name] for name in types}


def test_one_frame_is_not_another_events(drawing):
    one, other = drawing.step("Pass"), drawing.step("Pass")
    one.frame[:] = 0
    assert other.frame.any()
    assert drawing.step("Pass").frame.any()


def test_object_in_frame(drawing):
    event = drawing.step("GetObjectInFrame", x=0.5, y=0.5)
    assert event.metadata["actionReturn"] == FRIDGE
    assert not drawing.step("GetObjectInFrame", x=0.5, y=0.5, checkVisible=True)  # 2.65 m away
    assert not drawing.step("GetObjectInFrame", x=0.5, y=0.0)  # the ceiling
    beyond = drawing.step("GetObjectInFrame", x=0.5, y=1.5)
    assert "x/y must be in [0:1]" in beyond.metadata["errorMessage"]
