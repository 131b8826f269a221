"""What agents that did not act are told and see is made when it is read, and is that of then."""

from __future__ import annotations

import numpy as np
import pytest

from er_gym.sim import bystander
from er_gym.sim.controller import BystanderEvent, EmbeddedController
from er_gym.sim.render.view import draw

SCENE = "FloorPlan403"
CAMERA = {"position": {"x": -1.0, "y": 2.0, "z": 1.0}, "rotation": {"x": 45.0, "y": 90.0, "z": 0.0}}
STEPS = (
    (0, {"action": "RotateRight"}),
    (1, {"action": "RotateLeft", "renderInstanceSegmentation": True}),
    (0, {"action": "MoveAhead"}),
    (1, {"action": "LookDown"}),
    (0, {"action": "AddThirdPartyCamera", "fieldOfView": 80.0, **CAMERA}),
    (1, {"action": "MoveAhead", "moveMagnitude": 0.1}),
    (0, {"action": "PickupObject", "objectId": "", "forceAction": True}),
    (1, {"action": "RotateRight"}),
    (0, {"action": "RotateRight"}),
    (1, {"action": "ChangeFOV", "fieldOfView": 50.0}),
    (1, {"action": "Crouch"}),
    (0, {"action": "DropHandObject", "forceAction": True}),
    (0, {"action": "RotateLeft"}),
)


def played(read):
    """All events of the steps, by a program that does this with each."""
    settings = {"width": 32, "height": 24, "renderDepthImage": True}
    controller = EmbeddedController(scene=SCENE, agentCount=2, **settings)
    objects = controller.last_event.metadata["objects"]
    first = next(entry["objectId"] for entry in objects if entry["pickupable"])
    events = []
    for agent, step in STEPS:
        step = {**step, "objectId": first} if "objectId" in step else step
        events.append(controller.step({**step, "agentId": agent}))
        read(events[-1])
    controller.reset("FloorPlan402")
    controller.step("RotateRight")
    return events


def all_of(event):
    """What each agent is told, and each of its pictures as bytes."""
    return [
        [
            dict(each.metadata),
            each.object_id_to_color,
            *(
                None if picture is None else (picture.shape, picture.tobytes())
                for picture in (
                    each.frame,
                    each.depth_frame,
                    each.instance_segmentation_frame,
                    *each.third_party_camera_frames,
                    *each.third_party_depth_frames,
                    *each.instance_masks.values(),
                )
            ),
        ]
        for each in event.events
    ]


@pytest.fixture(scope="module")
def at_once():
    """What a program reads that looks at all of it after each step."""
    kept = []
    played(lambda event: kept.append(all_of(event)))
    return kept


def test_what_is_read_late_is_that_of_its_step(at_once):
    late = [all_of(event) for event in played(lambda event: None)]
    assert late == at_once
    assert len({repr(each) for each in late}) > 5, "the pictures differ from step to step"


def test_all_agents_are_shown_what_the_third_party_cameras_see():
    kept = played(lambda event: None)
    for event in kept:
        first, second = event.events
        cameras = len(event.metadata["thirdPartyCameras"])
        assert len(first.third_party_camera_frames) == cameras
        for a, b in zip(
            first.third_party_camera_frames, second.third_party_camera_frames, strict=True
        ):
            assert np.array_equal(a, b)
    assert cameras == 1


def test_nobody_draws_what_nobody_reads(monkeypatch):
    drawn = []
    monkeypatch.setattr(bystander, "draw", lambda *world: drawn.append(draw(*world)) or drawn[-1])
    controller = EmbeddedController(scene=SCENE, agentCount=2, width=32, height=24)
    del drawn[:]
    event = controller.step("RotateRight")
    other = event.events[1]
    assert other.metadata["agentId"] == 1
    controller.step("LookDown", agentId=1)
    assert not drawn
    assert other.frame.shape == (24, 32, 3)
    assert len(drawn) == 1
    kept = controller.step("RotateRight")
    controller.step("RotateRight", agentId=1)
    controller.step("AddThirdPartyCamera", fieldOfView=80.0, **CAMERA)
    assert len(drawn) == 2, "that of the kept event, before anything but the agents changes"
    assert "frame" not in vars(kept.events[1])
    with pytest.raises(AttributeError, match="no attribute 'picture'"):
        _ = kept.events[1].picture


def test_what_a_program_puts_in_a_pictures_place_stays():
    event = played(lambda event: None)[0]
    other = next(each for each in event.events if type(each) is BystanderEvent)
    own = np.zeros((1, 1, 3), np.uint8)
    other.frame = own
    assert other.depth_frame.shape == (24, 32)
    assert other.frame is own
    assert other.__getstate__()["frame"] is own
