"""Captures rooms with an AI2-THOR controller: metadata, positions, and views with their pictures.

The same function captures Unity and the embedded engine, so a comparison compares like with like.
"""

from __future__ import annotations

import json
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from er_gym.data.pictures import open_picture
from er_gym.writing import make_folder, write_output, write_picture

FORMAT, SCENE_FORMAT = "er-gym/unity-captures/1", "er-gym/unity-capture/1"
MANIFEST = "captures.json"
_HORIZONS = (0.0, 30.0)


@dataclass(frozen=True)
class CaptureSettings:
    """How rooms are captured.

    Attributes:
        width, height: of pictures, pixels.
        poses: how many views of each room, from positions that are drawn from ``seed``.
        seed: of the draw.
    """

    width: int = 640
    height: int = 480
    poses: int = 4
    seed: int = 0


@dataclass(frozen=True)
class RoomCapture:
    """What a controller said of a room.

    Attributes:
        scene: its name.
        metadata: the whole metadata after ``reset``, as the client has it.
        reachable: (P, 3) positions in metres.
        views: for each pose ``pose`` (the arguments of TeleportFull), ``visible`` (object ids) and
            ``error`` (``""`` where the agent could stand there).
        pictures: of the views, (height, width, 3).
    """

    scene: str
    metadata: Mapping[str, Any]
    reachable: NDArray[np.float64]
    views: Sequence[Mapping[str, Any]]
    pictures: Sequence[NDArray[np.uint8]]


def drawn_poses(
    scene: str, reachable: NDArray[np.float64], settings: CaptureSettings
) -> list[dict[str, Any]]:
    """Poses among the reachable positions, the same for the same positions and seed."""
    draw = np.random.default_rng([settings.seed, zlib.crc32(scene.encode())])
    places = reachable[draw.permutation(len(reachable))[: settings.poses]]
    return [
        {
            "position": dict(zip("xyz", map(float, place), strict=True)),
            "rotation": {"x": 0.0, "y": float(90 * draw.integers(4)), "z": 0.0},
            "horizon": float(draw.choice(_HORIZONS)),
            "standing": True,
        }
        for place in places
    ]


def capture(
    controller: Any,
    scene: str,
    settings: CaptureSettings,
    poses: Sequence[Mapping[str, Any]] | None = None,
) -> RoomCapture:
    """Capture a room.

    Args:
        controller: an AI2-THOR controller, of either engine.
        scene: the room.
        settings: how; the pictures have the controller's size.
        poses: where to look from, as ``TeleportFull`` takes them; drawn if None.

    Raises:
        ValueError: the controller does not know the room.
    """
    controller.reset(scene)
    metadata = json.loads(json.dumps(controller.last_event.metadata, default=float))
    found = controller.step("GetReachablePositions").metadata["actionReturn"]
    reachable = np.array([[each[axis] for axis in "xyz"] for each in found]).reshape(-1, 3)
    views, pictures = [], []
    for pose in drawn_poses(scene, reachable, settings) if poses is None else poses:
        event = controller.step("TeleportFull", **pose, forceAction=True)
        seen = sorted(each["objectId"] for each in event.metadata["objects"] if each["visible"])
        error = "" if event.metadata["lastActionSuccess"] else event.metadata["errorMessage"]
        views.append({"pose": dict(pose), "visible": seen, "error": error})
        pictures.append(np.array(event.frame))
    return RoomCapture(scene, metadata, reachable, views, pictures)


# -- files -----------------------------------------------------------------------------------------


def room_file(folder: Path, scene: str) -> Path:
    """Where a room's capture lies; it is written last, so a room with it is whole."""
    return folder / "rooms" / f"{scene}.json"


def picture_file(folder: Path, scene: str, view: int) -> Path:
    """Where the picture of a view lies."""
    return folder / "pictures" / f"{scene}-{view}.png"


def save(folder: Path, room: RoomCapture) -> None:
    """Write a room's capture.

    Raises:
        CannotWrite, ForeignFile: see :func:`er_gym.writing.write_output`.
    """
    for name in ("rooms", "pictures"):
        make_folder(folder / name)
    for number, picture in enumerate(room.pictures):
        write_picture(picture_file(folder, room.scene, number), Image.fromarray(picture))
    told = {
        "format": SCENE_FORMAT,
        "scene": room.scene,
        "metadata": room.metadata,
        "reachable": room.reachable.tolist(),
        "views": room.views,
    }
    write_output(room_file(folder, room.scene), json.dumps(told))


def load(folder: Path, scene: str) -> RoomCapture:
    """Read a room's capture.

    Raises:
        ValueError: the file is none, or a picture is missing or has another size.
    """
    file = room_file(folder, scene)
    try:
        told = json.loads(file.read_text("utf-8"))
        if told["format"] != SCENE_FORMAT:
            raise ValueError(f"its format is {told['format']!r}, and {SCENE_FORMAT} is read")
        reachable = np.array(told["reachable"], np.float64).reshape(-1, 3)
        pictures = [
            np.asarray(open_picture(picture_file(folder, scene, number)))
            for number in range(len(told["views"]))
        ]
        return RoomCapture(scene, told["metadata"], reachable, told["views"], pictures)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValueError(f"{file} is no capture of a room: {error}") from None
