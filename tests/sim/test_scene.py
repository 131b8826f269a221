"""The packaged scenes are complete, consistent and quick to load."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest
from support import in_one_test

from er_gym.sim import scene as scene_module
from er_gym.sim.rotation import unity_rotation
from er_gym.sim.scene import (
    PROPERTIES,
    SCENE_NAMES,
    STATES,
    UnknownSceneError,
    load_scene,
    read_scene,
    write_scene,
)

ARRAYS = {
    "position": (3,),
    "rotation": (3,),
    "aabb_center": (3,),
    "aabb_size": (3,),
    "obb": (4, 3),
    "properties": (len(PROPERTIES),),
    "states": (len(STATES),),
    "openness": (),
    "mass": (),
}
COLUMNS = [
    "names",
    "types",
    "asset_ids",
    "temperature",
    "salient_materials",
    "parents",
    "controlled",
]


def test_names_follow_ai2thor() -> None:
    assert len(SCENE_NAMES) == len(set(SCENE_NAMES)) == 120
    assert SCENE_NAMES[0] == "FloorPlan1"
    assert SCENE_NAMES[29:31] == ("FloorPlan30", "FloorPlan201")
    assert SCENE_NAMES[-1] == "FloorPlan430"


def test_physics_name_gives_the_same_scene() -> None:
    assert load_scene("FloorPlan201_physics") is load_scene("FloorPlan201")


@pytest.mark.parametrize("name", ["FloorPlan31", "floorplan1", "", "FloorPlan_Train1_1"])
def test_unknown_scene_says_what_exists(name: str) -> None:
    with pytest.raises(UnknownSceneError, match="FloorPlan401-430") as caught:
        load_scene(name)
    assert repr(name) in str(caught.value)
    assert "\n" not in str(caught.value)


@in_one_test("name", SCENE_NAMES)
def test_every_column_has_an_entry_per_object(name: str) -> None:
    scene = load_scene(name)
    for column in COLUMNS:
        assert len(getattr(scene, column)) == len(scene)
    for array, shape in ARRAYS.items():
        assert getattr(scene, array).shape == (len(scene), *shape)


@in_one_test("name", SCENE_NAMES)
def test_arrays_are_read_only(name: str) -> None:
    scene = load_scene(name)
    for array in [*ARRAYS, "reachable"]:
        with pytest.raises(ValueError, match="read-only"):
            getattr(scene, array)[...] = 0


@in_one_test("name", SCENE_NAMES)
def test_ids_are_unique_and_name_their_type(name: str) -> None:
    scene = load_scene(name)
    assert len(set(scene.object_ids)) == len(set(scene.names)) == len(scene)
    for object_id, object_type in zip(scene.object_ids, scene.types, strict=True):
        assert object_type in (object_id.split("|")[0], object_id.split("|")[-1])


@in_one_test("name", SCENE_NAMES)
def test_values_are_those_of_ai2thor(name: str) -> None:
    scene = load_scene(name)
    for array in set(ARRAYS) - {"obb"}:
        assert np.isfinite(getattr(scene, array)).all()
    assert (scene.aabb_size >= 0).all()
    assert set(scene.temperature) <= {"RoomTemp", "Cold", "Hot"}
    portable = scene.properties[:, [PROPERTIES.index("pickupable"), PROPERTIES.index("moveable")]]
    assert np.array_equal(np.isfinite(scene.obb).all(axis=(1, 2)), portable.any(axis=1))


@in_one_test("name", SCENE_NAMES)
def test_parents_are_receptacles(name: str) -> None:
    scene = load_scene(name)
    receptacle = scene.properties[:, PROPERTIES.index("receptacle")]
    for child, parents in enumerate(scene.parents):
        assert child not in parents
        assert receptacle[list(parents)].all()


@in_one_test("name", SCENE_NAMES)
def test_only_what_can_be_toggled_controls(name: str) -> None:
    scene = load_scene(name)
    toggleable = scene.properties[:, PROPERTIES.index("toggleable")]
    assert toggleable.tolist() == [controlled is not None for controlled in scene.controlled]


@in_one_test("name", SCENE_NAMES)
def test_agent_can_stand_on_a_grid(name: str) -> None:
    scene = load_scene(name)
    assert len(scene.reachable) > 0
    assert np.array_equal(scene.reachable * 4, np.round(scene.reachable * 4))
    assert np.array_equal(np.lexsort(scene.reachable.T), np.arange(len(scene.reachable)))


@in_one_test("name", SCENE_NAMES)
def test_opening_poses_stand_on_reachable_places(name: str) -> None:
    scene = load_scene(name)
    places = set(map(tuple, scene.reachable.tolist()))
    for index, pose in scene.openable_poses.items():
        assert 0 <= index < len(scene)
        assert (pose.x, pose.z) in places
        assert pose.rotation in (0, 90, 180, 270)
        assert pose.horizon in (-30, 0, 30)


def test_known_objects_of_floorplan1() -> None:
    scene = load_scene("FloorPlan1")
    assert len(scene) == 77
    burner = scene.object_ids.index("StoveBurner|-00.04|+00.92|-02.37")
    assert burner == 0
    assert np.array_equal(
        scene.position[burner], [-0.03610000014305115, 0.9150999784469604, -2.3722000122070312]
    )
    assert scene.properties[burner].tolist() == [
        name in ("receptacle", "isHeatSource") for name in PROPERTIES
    ]
    knobs = [i for i, name in enumerate(scene.types) if name == "StoveKnob"]
    switched = {j for i in knobs for j in scene.controlled[i] or ()}
    assert {scene.types[j] for j in switched} == {"StoveBurner"}


def test_something_is_cold_open_and_in_something() -> None:
    scenes = [load_scene(name) for name in SCENE_NAMES]
    assert sum(len(scene) for scene in scenes) == 5670
    assert sum(scene.temperature.count("Cold") for scene in scenes) == 49
    assert sum(int(scene.states[:, STATES.index("isOpen")].sum()) for scene in scenes) == 106
    assert sum(len(parents) for scene in scenes for parents in scene.parents) == 3481


def test_writing_gives_the_same_bytes_again(tmp_path: Path) -> None:
    scene = load_scene("FloorPlan1")
    write_scene(tmp_path / "once.npz", scene)
    write_scene(tmp_path / "twice.npz", read_scene(tmp_path / "once.npz"))
    assert (tmp_path / "once.npz").read_bytes() == (tmp_path / "twice.npz").read_bytes()


def test_loading_is_quick_and_the_data_small() -> None:
    files = list(scene_module._SCENES.glob("*.npz"))
    assert len(files) == 120
    assert sum(file.stat().st_size for file in files) < 3e6
    read_scene(files[0])
    times = []
    for file in files:
        start = time.process_time()
        read_scene(file)
        times.append(time.process_time() - start)
    assert np.median(times) < 0.01


class TestUnityRotation:
    def test_yaw_is_clockwise_from_above(self) -> None:
        assert np.allclose(unity_rotation([0, 90, 0]) @ [0, 0, 1], [1, 0, 0])
        yaw = np.radians(30)
        assert np.allclose(
            unity_rotation([0, 30, 0]) @ [2, 5, 7],
            [
                2 * np.cos(yaw) + 7 * np.sin(yaw),
                5,
                -2 * np.sin(yaw) + 7 * np.cos(yaw),
            ],
        )

    def test_pitch_looks_down_and_roll_turns_x_up(self) -> None:
        assert np.allclose(unity_rotation([90, 0, 0]) @ [0, 0, 1], [0, -1, 0])
        assert np.allclose(unity_rotation([0, 0, 90]) @ [1, 0, 0], [0, 1, 0])

    def test_order_is_roll_then_pitch_then_yaw(self) -> None:
        x, y, z = ([20, 0, 0], [0, 50, 0], [0, 0, 70])
        expected = unity_rotation(y) @ unity_rotation(x) @ unity_rotation(z)
        assert np.allclose(unity_rotation([20, 50, 70]), expected)

    def test_many_at_once(self) -> None:
        angles = np.arange(24.0).reshape(4, 2, 3)
        many = unity_rotation(angles)
        assert many.shape == (4, 2, 3, 3)
        assert np.array_equal(many[2, 1], unity_rotation(angles[2, 1]))
        assert np.allclose(many @ many.swapaxes(-1, -2), np.eye(3))
