"""The agent's pose after a scene is loaded, and after Initialize."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from er_gym.sim.data.build_start_poses import build, start_pose_of
from er_gym.sim.scene import SCENE_NAMES, load_scene
from er_gym.sim.space.walkable_floor import floor_of
from er_gym.sim.start_pose import START_POSES, start_pose

MISLABELLED = {"FloorPlan410": "FloorPlan411", "FloorPlan411": "FloorPlan412"}
"""Where a pose was published for, and the room that it belongs to; see docs/fidelity.md."""


@pytest.fixture(scope="module")
def published(shared_data: Path):
    return json.loads((shared_data / "unity_start_poses.json").read_text())["poses"]


def test_every_published_start_is_ours(enter, published):
    assert len(published) == 119
    for scene in published.keys() - MISLABELLED.keys():
        pose, agent = published[scene], enter(scene, gridSize=0.25).agent
        here = [agent["position"][axis] for axis in "xyz"]
        assert here == pytest.approx([pose[axis] for axis in "xyz"], abs=1e-4), scene
        assert agent["rotation"] == pytest.approx({"x": 0, "y": pose["rotation"], "z": 0}), scene
        assert agent["cameraHorizon"] == pytest.approx(pose["horizon"]), scene
        assert agent["isStanding"] is True


@pytest.mark.parametrize("number", MISLABELLED)
def test_two_published_starts_are_those_of_other_rooms(published, number):
    pose = published[number]
    here, room = np.array([pose["x"], pose["z"]]), MISLABELLED[number]
    assert not floor_of(number).contains(here)  # it is outside the walls
    assert floor_of(room).contains(here)
    start = start_pose(room)
    assert (start.x, start.z, start.rotation) == (pose["x"], pose["z"], pose["rotation"])


def test_what_was_seen_from_a_mislabelled_start_is_in_the_other_room(shared_data: Path):
    captures = json.loads((shared_data / "unity_captures_dev.json").read_text())
    seen = set(captures["FloorPlan410"]["visible"])
    assert seen <= set(load_scene("FloorPlan411").object_ids)
    assert len(seen & set(load_scene("FloorPlan410").object_ids)) <= 1  # the Floor


def test_the_packaged_table_is_what_the_script_makes_of_them(published):
    made = {name: list(row) for name, row in build(published).items()}
    assert made == json.loads(START_POSES.read_text())


def test_a_start_that_looks_down_is_no_row_of_the_table():
    pose = {"x": 0.0, "y": 0.9, "z": 0.0, "rotation": 0.0, "horizon": 30.0}
    with pytest.raises(ValueError, match="horizon"):
        start_pose_of("FloorPlan1", pose)


def test_one_can_stand_where_episodes_start():
    for scene in SCENE_NAMES:
        start = start_pose(scene)
        assert floor_of(scene).contains(np.array([start.x, start.z])), scene


@pytest.mark.parametrize("scene", ["FloorPlan30", "FloorPlan410"])
def test_a_start_of_our_own_is_a_recorded_position(scene):
    start = start_pose(scene)
    assert [start.x, start.z] in load_scene(scene).reachable.tolist()


def test_from_the_start_one_can_move(enter):
    for scene in SCENE_NAMES[::10]:
        room = enter(scene)
        moves = ("MoveAhead", "MoveRight", "MoveBack", "MoveLeft")
        assert any(room.step(move).metadata["lastActionSuccess"] for move in moves), scene


@pytest.mark.parametrize("grid", [0.1, 0.15, 0.2, 0.25, 0.5])
def test_initialize_snaps_the_pose_to_its_grid(enter, grid):
    for scene in SCENE_NAMES[::9]:
        room = enter(scene, gridSize=grid)
        here = np.array([room.agent["position"][axis] for axis in "xz"])
        assert np.allclose(here / grid, np.round(here / grid), atol=1e-4), scene
        start = start_pose(scene)
        assert np.abs(here - [start.x, start.z]).max() < grid
        assert here.tolist() in [
            [place["x"], place["z"]] for place in room.do("GetReachablePositions")
        ], scene


def test_without_a_grid_the_pose_stays(enter):
    room = enter("FloorPlan3", gridSize=0.1, snapToGrid=False)
    assert [room.agent["position"][axis] for axis in "xz"] == [0.0, -1.75]


def test_initialize_takes_the_lower_corner_that_can_be_walked_to(enter):
    """AI2-THOR tries the corners of the grid square in the order of x, then z."""
    room = enter("FloorPlan1")
    room.do("Teleport", x=0.56, z=1.56)
    room.do("Initialize", gridSize=0.25)
    assert [room.agent["position"][axis] for axis in "xz"] == [0.5, 1.5]
    room.do("Teleport", x=-0.91, z=0.24)  # the island begins at -0.62
    room.do("Initialize", gridSize=0.5)
    assert [room.agent["position"][axis] for axis in "xz"] == [-1.0, 0.0]


def test_initialize_puts_nobody_into_furniture(enter):
    """Whoever was forced onto the island gets to the free place of the grid nearest to it."""
    room = enter("FloorPlan1")
    room.do("Teleport", x=0.1, z=0.1, forceAction=True)
    room.do("Initialize", gridSize=0.25)
    here = [room.agent["position"][axis] for axis in "xz"]
    assert floor_of("FloorPlan1").contains(np.array(here))
    assert np.hypot(*np.array(here) - 0.1) < 1.5
