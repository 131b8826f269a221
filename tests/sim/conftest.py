"""Fixtures: one headless controller for all tests, reset for each."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from math import atan2, hypot, radians, remainder, tau
from typing import Any

import pytest

from er_gym.sim.controller import EmbeddedController


def discomfort(pose: dict[str, Any], point: dict[str, float]) -> float:
    """How badly a pose is suited to look at a point: metres away plus radians amiss."""
    away = hypot(point["x"] - pose["x"], point["z"] - pose["z"])
    heading = atan2(point["x"] - pose["x"], point["z"] - pose["z"]) - radians(pose["rotation"])
    below = atan2(pose["y"] + 0.675 - point["y"], away) - radians(pose["horizon"])
    return away + abs(remainder(heading, tau)) + abs(below)


class Room:
    """A scene at its start, and short ways to say what is done in it and what comes of that."""

    def __init__(self, controller: Any, scene: str, **settings: Any) -> None:
        self.controller = controller
        self.event = controller.reset(scene, **settings)

    def __getitem__(self, object_id: str) -> dict[str, Any]:
        """An object's metadata now."""
        return self.event.get_object(object_id)

    def __contains__(self, object_id: str) -> bool:
        return self.event.get_object(object_id) is not None

    def of_type(self, object_type: str) -> list[str]:
        """The ids of all objects of a type."""
        objects = self.event.metadata["objects"]
        return [entry["objectId"] for entry in objects if entry["objectType"] == object_type]

    def one(self, object_type: str) -> str:
        """The id of the first object of a type."""
        return self.of_type(object_type)[0]

    @property
    def agent(self) -> dict[str, Any]:
        return self.event.metadata["agent"]

    @property
    def inventory(self) -> list[str]:
        return [entry["objectId"] for entry in self.event.metadata["inventoryObjects"]]

    def step(self, action: str, object_id: str | None = None, **arguments: Any) -> Any:
        if object_id is not None:
            arguments["objectId"] = object_id
        self.event = self.controller.step(action=action, **arguments)
        return self.event

    def do(self, action: str, object_id: str | None = None, **arguments: Any) -> Any:
        """Do something that has to succeed; returns its ``actionReturn``."""
        metadata = self.step(action, object_id, **arguments).metadata
        assert metadata["lastActionSuccess"], metadata["errorMessage"]
        assert metadata["errorMessage"] == ""
        return metadata["actionReturn"]

    def refused(self, action: str, object_id: str | None = None, **arguments: Any) -> str:
        """Do something that has to be refused without a trace; returns why it was."""
        before = self.event.metadata["objects"]
        metadata = self.step(action, object_id, **arguments).metadata
        assert not metadata["lastActionSuccess"]
        assert metadata["errorMessage"]
        assert metadata["objects"] == before
        return metadata["errorMessage"]

    def go_to(self, object_id: str, **filters: Any) -> None:
        """Go to where an object can be handled, is near and in the middle of the picture."""
        centre = self[object_id]["axisAlignedBoundingBox"]["center"]
        poses = self.do("GetInteractablePoses", object_id, standings=[True], **filters)
        assert poses, f"{object_id} can be handled from nowhere"
        self.do("TeleportFull", **min(poses, key=lambda pose: discomfort(pose, centre)))
        assert self[object_id]["visible"]

    def take(self, object_id: str) -> None:
        self.do("PickupObject", object_id, forceAction=True)

    def put(self, object_id: str) -> None:
        self.do("PutObject", object_id, forceAction=True)


@pytest.fixture(scope="session")
def one_controller() -> Iterator[Any]:
    controller = EmbeddedController(headless=True)
    yield controller
    controller.stop()


@pytest.fixture
def enter(one_controller: Any) -> Callable[..., Room]:
    """A function from a scene's name, and settings for ``Initialize``, to the room."""
    # The client keeps settings from one reset to the next; another test's are not wanted here.
    one_controller.initialization_parameters = {}
    return lambda scene, **settings: Room(one_controller, scene, **settings)


@pytest.fixture
def kitchen(enter: Callable[..., Room]) -> Room:
    """FloorPlan1: a kitchen island, a sink with a sponge in it, a fridge with an egg in it."""
    return enter("FloorPlan1")
