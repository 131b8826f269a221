"""Programs with several agents in one room, through the official client on the player."""

from __future__ import annotations

import ai2thor.controller
import numpy as np
import pytest
from ai2thor.server import MultiAgentEvent
from floor_plan_1 import APPLE, ISLAND

import er_gym

SIZE = {"width": 90, "height": 60}
SOUTH, NORTH = ({"x": -1.0, "y": 0.9009991, "z": z} for z in (-1.0, 1.0))


@pytest.fixture(scope="module")
def controller(tmp_path_factory):
    """A program's controller; each test begins with a reset."""
    with pytest.MonkeyPatch.context() as environment:
        environment.setenv("HOME", str(tmp_path_factory.mktemp("home")))
        environment.delenv("XDG_CACHE_HOME", raising=False)
        environment.delenv("CUDA_VISIBLE_DEVICES", raising=False)
        started = ai2thor.controller.Controller(
            local_executable_path=er_gym.thor_executable(),
            x_display=":0",
            scene="FloorPlan1",
            **SIZE,
        )
    yield started
    started.stop()


def face_to_face(controller):
    """Two agents that look at each other from 2 m away."""
    controller.reset("FloorPlan1", agentCount=2)
    for agent, (place, heading) in enumerate(((NORTH, 180), (SOUTH, 0))):
        assert controller.step("Teleport", position=place, rotation=heading, agentId=agent)
    return controller.last_event


def test_each_agent_has_an_event_of_its_own(controller):
    event = controller.reset("FloorPlan1", agentCount=2, renderDepthImage=True)
    assert isinstance(event, MultiAgentEvent)
    assert [each.metadata["agentId"] for each in event.events] == [0, 1]
    assert event.metadata is event.events[0].metadata
    event = controller.step("RotateRight", agentId=1)
    first, second = event.events
    assert event.metadata is second.metadata
    assert [each.metadata["lastAction"] for each in event.events] == ["Initialize", "RotateRight"]
    turned = (second.pose_discrete[2] - first.pose_discrete[2]) % 4
    assert turned == 1, "only one of them turns"
    assert first.pose[:2] != second.pose[:2]
    assert (first.frame != second.frame).any()
    assert (first.depth_frame != second.depth_frame).any()
    near = {each.get_object(APPLE)["distance"] for each in event.events}
    assert len(near) == 2, "each has its own distances"


def test_they_see_each_other(controller):
    event = face_to_face(controller)
    there = [each.frame for each in event.events]
    assert controller.step("Teleport", position={**NORTH, "z": 1.75}, agentId=1)
    gone = controller.step("Pass").events[0].frame
    rows, columns = np.nonzero((there[0] != gone).any(axis=-1))
    middle = SIZE["width"] / 2
    assert len(rows) > SIZE["height"] * 2, "a whole figure"
    assert abs(columns.mean() - middle) < 3, "where the other stood, straight ahead"
    shown = there[0][rows, columns]
    assert (shown[:, 0] > 2 * shown[:, 2]).mean() > 0.5, "agent 1 is yellow"
    blue = there[1][..., 2] > 2.0 * there[1][..., 0]
    assert blue[:, SIZE["width"] // 2].sum() > 5, "agent 0 is blue"


def test_they_block_each_other(controller):
    face_to_face(controller)
    moved = 0
    while controller.step("MoveAhead", agentId=1):
        moved += 1
    assert moved == 6, "to 0.5 m, since two bodies of 0.2 m radius fit into 0.4"
    said = controller.last_event.metadata["errorMessage"]
    assert said == "Agent 0 is blocking Agent 1 from moving by (0.0000, 0.0000, 0.2500)."
    assert controller.step("MoveAhead", agentId=1, allowAgentsToIntersect=True)
    assert controller.step("MoveBack", agentId=1), "out of the other"


def test_one_puts_a_thing_down_and_the_other_takes_it(controller):
    face_to_face(controller)
    assert controller.step("PickupObject", objectId=APPLE, forceAction=True, agentId=0)
    held = [each.metadata["inventoryObjects"] for each in controller.last_event.events]
    assert [len(each) for each in held] == [1, 0]
    event = controller.step("PickupObject", objectId=APPLE, forceAction=True, agentId=1)
    assert not event
    assert event.metadata["errorMessage"] == f"{APPLE} is in the hand of agent 0."
    before = event.events[1].get_object(APPLE)
    after = controller.step("MoveBack", agentId=0).events[1].get_object(APPLE)
    assert after["isPickedUp"]
    assert after["position"] != before["position"]
    assert after["visible"] == (after["distance"] <= 1.5)
    assert controller.step("PutObject", objectId=ISLAND, forceAction=True, agentId=0)
    event = controller.step("PickupObject", objectId=APPLE, forceAction=True, agentId=1)
    held = [each.metadata["inventoryObjects"] for each in event.events]
    assert [len(each) for each in held] == [0, 1]


def test_an_agent_that_is_not_there_is_an_error_in_words(controller):
    face_to_face(controller)
    with pytest.raises(ValueError, match="agentId is 2, and agents are 0 to 1"):
        controller.step("MoveAhead", agentId=2)
    with pytest.raises(RuntimeError, match="up to 4 agents, not 5"):
        controller.reset("FloorPlan1", agentCount=5)
    event = controller.reset("FloorPlan1", agentCount=1)
    assert event.events == [event]
    with pytest.raises(ValueError, match="agentId is 1, and the only agent is 0"):
        controller.step("Pass", agentId=1)


def test_four_agents_and_a_camera(controller):
    event = controller.reset("FloorPlan201", agentCount=4)
    places = np.array([each.pose[:2] for each in event.events]) / 1000
    apart = np.linalg.norm(places[:, None] - places, axis=-1)[np.triu_indices(4, 1)]
    assert (apart > 0.4).all()
    start = event.metadata["agent"]
    look = {"x": 20.0, "y": start["rotation"]["y"], "z": 0.0}
    event = controller.step("AddThirdPartyCamera", position=start["position"], rotation=look)
    for each in event.events:
        assert each.frame.shape == (60, 90, 3)
        assert len(each.third_party_camera_frames) == 1
    for number in (3, 1, 2, 0):
        event = controller.step("RotateLeft", agentId=number)
        assert event
        assert event.metadata["agentId"] == number
    assert len({each.pose[2] for each in event.events}) == 1
    assert len({each.frame.tobytes() for each in event.events}) == 4
    event = controller.step("GetReachablePositions", agentId=2)
    answers = [each.metadata["actionReturn"] for each in event.events]
    assert [bool(answer) for answer in answers] == [False, False, True, False]
