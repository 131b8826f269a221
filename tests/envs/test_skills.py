"""The poses to which skills take the agent."""

from __future__ import annotations

from math import atan2, degrees, hypot
from typing import Any

import numpy as np
import pytest

from er_gym.envs import skills
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks.task import AgentPose, type_of_id
from er_gym.thor import make_controller, objects_of

Point = tuple[float, float, float]


def discomfort(at: Point, rotation: float, horizon: float, centre: Point) -> float:
    dx, dz = centre[0] - at[0], centre[2] - at[2]
    distance = hypot(dx, dz)
    aside = abs((degrees(atan2(dx, dz)) - rotation + 180) % 360 - 180)
    below = abs(degrees(atan2(at[1] + 0.675 - centre[1], max(distance, 0.1))) - horizon)
    return aside / 45 + below / 45 + abs(distance - 0.7)


def most_comfortable(positions: list[Point], centre: Point) -> AgentPose:
    """The first of the best among the twelve nearest positions, pose by pose."""
    near = sorted(
        positions,
        key=lambda p: (round(hypot(p[0] - centre[0], p[2] - centre[2]), 6), p[0], p[2]),
    )[:12]
    poses = [(p, r, h) for p in near for r in (0, 90, 180, 270) for h in (-30, 0, 30, 60)]
    position, rotation, horizon = min(poses, key=lambda pose: discomfort(*pose, centre))
    return AgentPose(*position, rotation, horizon)


@pytest.mark.parametrize("scene", ["FloorPlan3", "FloorPlan218", "FloorPlan325", "FloorPlan421"])
def test_the_best_view_is_the_most_comfortable_of_all(scene: str) -> None:
    with make_controller(scene=scene, gridSize=0.1, headless=True) as controller:
        found = controller.step(action="GetReachablePositions").metadata["actionReturn"]
        centres = objects_of(controller.last_event)[0].centre.tolist()
    positions = [(p["x"], p["y"], p["z"]) for p in found]
    on_the_grid = [(x, 1.0, z + 0.05) for x, _, z in positions[::9]]  # equally good ones abound
    floor = skills.Reachable(found[::-1])
    for centre in (*map(tuple, centres), *on_the_grid):
        assert skills._best_view(floor, *centre) == most_comfortable(positions, centre)


def test_a_pose_without_room_is_taken_only_by_force() -> None:
    outside = AgentPose(50.0, 0.9, 50.0, 0.0, 0.0)
    with make_controller(scene="FloorPlan1", gridSize=0.25, headless=True) as controller:
        assert not skills.place(controller, outside).success
        assert skills.place(controller, outside, force=True).success


def test_what_can_be_reached_is_asked_for_once_in_a_process() -> None:
    asked = []

    class Controller:
        def step(self, **request: Any) -> Any:
            asked.append(request)
            event = type("Event", (), {})()
            event.metadata = {"actionReturn": [{"x": 1.0, "y": 0.9, "z": 2.0}]}
            return event

    first = skills.reachable(Controller(), ("nowhere", 0.1))
    assert skills.reachable(Controller(), ("nowhere", 0.1)) is first
    assert len(asked) == 1
    assert skills.reachable(Controller(), ("nowhere", 0.2)) is not first
    assert next(first.nearest_to(0.0, 0.0)) == [[1.0, 0.9, 2.0]]


def test_all_positions_come_in_batches_the_nearest_first() -> None:
    places = [{"x": x / 4, "y": 0.9, "z": z / 4} for x in range(9) for z in range(11)]
    batches = list(skills.Reachable(places[::-1]).nearest_to(1.0, 1.0))
    flat = [place for batch in batches for place in batch]
    away = [round(hypot(x - 1.0, z - 1.0), 6) for x, _, z in flat]
    assert away == sorted(away)
    assert sorted(flat) == [[each[axis] for axis in "xyz"] for each in places]
    assert len(batches) > 2
    assert {len(batch) for batch in batches[:-1]} == {len(batches[0])}


@pytest.mark.parametrize(
    ("verb", "object_type", "request_"),
    [
        ("pickup", "Apple", {"action": "PickupObject", "objectType": "Apple"}),
        ("put in", "Sink", {"action": "PutObject", "objectType": "SinkBasin", "forceAction": True}),
        ("put in", "Bowl", {"action": "PutObject", "objectType": "Bowl", "forceAction": True}),
        (
            "toggle",
            "StoveBurner",
            {"action": "ToggleObjectOn", "objectType": "StoveKnob", "forceAction": True},
        ),
        (
            "toggle",
            "Faucet",
            {"action": "ToggleObjectOn", "objectType": "Faucet", "forceAction": False},
        ),
    ],
)
def test_verbs_are_done_to_the_part_that_takes_them(
    verb: str, object_type: str, request_: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    with make_controller(scene="FloorPlan1", headless=True) as controller:
        event = controller.last_event
        objects, *_ = objects_of(event)
        sent = []
        controller.headless = False  # so that each call is a request
        monkeypatch.setattr(controller, "step", lambda **request: (sent.append(request), event)[1])
        row = objects.of_type(object_type)[0]
        skills.interact(controller, verb, objects, row)
    object_id = sent[0].pop("objectId")
    assert type_of_id(object_id) == request_.pop("objectType")
    assert sent == [request_]
    if object_type == "StoveBurner":
        assert row in objects.controlled[objects.row[object_id]]


def test_where_there_is_no_way_everything_stays_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    env = EmbodiedEnv(obs_mode="rgb+state", width=96, height=64)
    before, info = env.reset(seed=0)
    monkeypatch.setattr(skills, "_interactable_poses", lambda *arguments: [])
    monkeypatch.setattr(skills, "_can_handle", lambda *arguments: False)
    after, _, _, _, then = env.step(f"navigate to {env.details['navigable'][0]}")
    assert "no way was found" in then["feedback"]
    assert not then["action_success"]
    assert then["action_mask"].tolist() == info["action_mask"].tolist()
    assert (after["rgb"] == before["rgb"]).all()
    assert not np.shares_memory(after["rgb"], before["rgb"])
    env.close()
