"""Programs that pour, walk a shortest path, empty a room and repaint it, as the world's do.

Each runs through the official client on the player. The arguments of neighbouring versions are
taken and refused as the client of 5.0.0 does.
"""

from __future__ import annotations

from math import atan2, degrees, hypot

import ai2thor.controller
import ai2thor.util.metrics
import numpy as np
import pytest

import er_gym
from er_gym.sim.controller import EmbeddedController


@pytest.fixture(scope="module")
def controller(tmp_path_factory):
    """One program after another, in one process of the player."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("HOME", str(tmp_path_factory.mktemp("home")))
        for name in ("XDG_CACHE_HOME", "CUDA_VISIBLE_DEVICES"):
            patch.delenv(name, raising=False)
        controller = ai2thor.controller.Controller(
            local_executable_path=er_gym.thor_executable(),
            x_display=":0",
            scene="FloorPlan28",
            width=300,
            height=300,
            commit_id="0" * 40,  # chooses a build, where none is named
            enhanced_physics_determinism=True,
        )
        yield controller
        controller.stop()


def do(controller, action, **arguments):
    event = controller.step(action, **arguments)
    assert event, event.metadata["errorMessage"]
    return event


def one(event, kind):
    return next(o for o in event.metadata["objects"] if o["objectType"] == kind)


def test_a_pot_is_filled_carried_and_poured_out(controller):
    event = controller.reset("FloorPlan28")
    pot = one(event, "Pot")["objectId"]
    do(controller, "FillObjectWithLiquid", objectId=pot, fillLiquid="wine", forceAction=True)
    do(controller, "PickupObject", objectId=pot, forceAction=True)
    do(controller, "TeleportFull", x=-1.5, y=0.9, z=-1.5, rotation=180, horizon=30, standing=True)
    do(controller, "MoveHeldObject", ahead=0.1, right=0.05, up=0.1)
    for angle in (20, 50):
        event = do(controller, "RotateHeldObject", rotation={"x": angle, "y": 0, "z": 0})
        assert event.get_object(pot)["fillLiquid"] == "wine"
    for angle in (120, 150, 180):
        event = do(controller, "RotateHeldObject", rotation={"x": angle, "y": 0, "z": 0})
        if not event.get_object(pot)["isFilledWithLiquid"]:
            break
    assert event.get_object(pot)["fillLiquid"] is None
    assert event.metadata["hand"]["localRotation"]["x"] == pytest.approx(60, abs=1e-3)  # 120
    do(controller, "DropHeldObject")
    assert controller.last_event.metadata["inventoryObjects"] == []


def test_a_shortest_path_is_walked_to_its_end(controller):
    controller.reset("FloorPlan28", gridSize=0.05, snapToGrid=False)
    goal = do(controller, "GetReachablePositions").metadata["actionReturn"][-1]
    path = do(controller, "GetShortestPathToPoint", target=goal).metadata["actionReturn"]["corners"]
    assert ai2thor.util.metrics.path_distance(path) < 6.0
    do(controller, "VisualizePath", positions=path)
    for corner in path[1:]:
        here = controller.last_event.metadata["agent"]["position"]
        dx, dz = corner["x"] - here["x"], corner["z"] - here["z"]
        yaw = degrees(atan2(dx, dz))
        do(controller, "Teleport", rotation={"x": 0, "y": yaw, "z": 0})
        if hypot(dx, dz) > 1e-3:
            do(controller, "MoveAhead", moveMagnitude=hypot(dx, dz))
    here = controller.last_event.metadata["agent"]["position"]
    assert (here["x"], here["z"]) == pytest.approx((goal["x"], goal["z"]), abs=0.01)


def places(event):
    return {o["objectId"]: o["position"] for o in event.metadata["objects"]}


def test_a_room_is_emptied_and_filled_again(controller):
    before = controller.reset("FloorPlan28", gridSize=0.25, snapToGrid=True)
    loose = [o for o in before.metadata["objects"] if o["pickupable"]]
    for thing in loose:
        event = do(controller, "DisableObject", objectId=thing["objectId"])
    assert not any(o["pickupable"] for o in event.metadata["objects"])
    for thing in loose:
        event = do(controller, "EnableObject", objectId=thing["objectId"])
    assert places(event) == places(before)
    for thing in loose:
        event = do(controller, "RemoveFromScene", objectId=thing["objectId"])
    assert len(event.metadata["objects"]) == len(before.metadata["objects"]) - len(loose)
    assert controller.reset("FloorPlan28").metadata["objects"] == before.metadata["objects"]


def test_materials_are_randomised_by_a_seed(controller):
    """What AI2-THOR's own test of SetRandomSeed asks for."""
    frames = []
    for _ in range(2):
        first = controller.reset().frame
        assert (do(controller, "SetRandomSeed", seed=42).frame == first).all()
        frames.append(do(controller, "RandomizeMaterials").frame)
        assert np.abs(first.astype(float) - frames[-1]).mean() > 10
    assert (frames[0] == frames[1]).all()
    do(controller, "SetRandomSeed", seed=41)
    other = do(controller, "RandomizeMaterials").frame
    assert np.abs(other.astype(float) - frames[0]).mean() > 10


@pytest.mark.parametrize("make", [ai2thor.controller.Controller, EmbeddedController])
def test_what_the_client_refuses_is_refused_in_its_words(make, controller):
    arguments = {"start_unity": False} if make is ai2thor.controller.Controller else {}
    if make is EmbeddedController:
        with pytest.raises(ValueError, match="no longer an allowed initialization parameter"):
            make(agentControllerType="physics", headless=True, **arguments)
        ours = make(scene="FloorPlan402", headless=True, commit_id="none", enhanced_physics=1)
        assert ours.reset(agentControllerType="physics", commit_id="none")
        with pytest.raises(ValueError, match="no RoboTHOR scene such as FloorPlan_Train1_1"):
            ours.reset("FloorPlan_Train1_1")
    else:
        assert controller.reset(agentControllerType="physics", commit_id="none")
        with pytest.raises(ValueError, match="not contained in build"):
            controller.reset("FloorPlan_Train1_1")
        controller.initialization_parameters = {}
        for mode in ("arm", "drone", "stretch", "locobot"):
            with pytest.raises(RuntimeError, match=f"agentMode 'default' only, not '{mode}'"):
                controller.reset(agentMode=mode)
        controller.initialization_parameters = {}
