"""Every refusal is one line of readable length, and nothing is raised."""

from __future__ import annotations

import warnings

import pytest

from er_gym.sim.engine import Engine

LONG = "x" * 5000


@pytest.fixture(scope="module")
def engine():
    return Engine(8, 8)


@pytest.mark.parametrize(
    "request_",
    [
        {"action": LONG},
        {"action": [LONG]},
        {"action": "a\nb"},
        {"action": "Pass", LONG: 1},
        {"action": "Pass", "a\nb": 1},
        {"action": "Pass", "speed": LONG},
        {"action": "LookUp", "degrees": [LONG]},
        {"action": "TeleportFull", "rotation": {"x": LONG}},
        {"action": "Initialize", "agentMode": LONG},
        {"action": "Initialize", "agentCount": 10**400},
        {"action": "FillObjectWithLiquid", "objectId": "Mug", "fillLiquid": LONG},
        {
            "action": "SetObjectPoses",
            "objectPoses": [{"objectName": LONG, "position": {}, "rotation": {}}],
        },
        {"action": "ChangeResolution", "x": 10**400, "y": 1},
        {"action": "InitialRandomSpawn", "numPlacementAttempts": -(10**400)},
    ],
    ids=lambda request: str(request)[:50],
)
def test_a_refusal_can_be_read(engine, request_):
    metadata, _ = engine.step({**request_, "renderImage": False})
    message = metadata["errorMessage"]
    assert not metadata["lastActionSuccess"]
    assert 0 < len(message) < 1500
    assert len(message.splitlines()) == 1


def test_short_values_are_told_whole(engine):
    metadata, _ = engine.step({"action": "LookUp", "degrees": "steep", "renderImage": False})
    assert "degrees (==steep). Cannot convert to: float" in metadata["errorMessage"]
    metadata, _ = engine.step({"action": "ChangeResolution", "x": 0, "y": 1, "renderImage": False})
    assert metadata["errorMessage"] == "x must be within 1 and 8192, not 0."


@pytest.mark.parametrize(
    "request_",
    [
        {"action": "MoveAhead", "moveMagnitude": 1e308},
        {"action": "MoveLeft", "moveMagnitude": 1001.0},
        {"action": "Teleport", "x": 1e308},
        {"action": "TeleportFull", "position": {"x": 0.0, "y": 0.9, "z": -1e308}},
        {"action": "TeleportFull", "y": 1e308, "forceAction": True},
    ],
    ids=str,
)
def test_beyond_all_measure_is_refused_and_nothing_overflows(engine, request_):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        metadata, _ = engine.step({**request_, "renderImage": False})
    assert "wall" in metadata["errorMessage"]


def test_poses_beyond_all_measure_are_none(engine):
    far = {"x": 1e308, "y": 0.9, "z": -1e308}
    request = {"action": "GetInteractablePoses", "positions": [far, {**far, "x": 0.0}]}
    objects = engine.step({"action": "Pass", "renderImage": False})[0]["objects"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        metadata, _ = engine.step(
            {**request, "objectId": objects[0]["objectId"], "renderImage": False}
        )
    assert metadata["actionReturn"] == []
