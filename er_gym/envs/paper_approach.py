"""Where the paper's agent stands to reach an object, and how it then looks at it.

The agent picks one of AI2-THOR's interactable poses within 1.5 m. For a small object it picks the
nearest. For other objects it picks a pose in front of the object, judged by the direction that the
object faces. Where there is none, it picks a pose behind the object. The agent then crouches or
stands, tilts its head and turns towards the object.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import radians, sqrt, tan
from typing import Any

import numpy as np

from er_gym.envs.feedback_words import PAPER_WAY
from er_gym.envs.perception import perceive
from er_gym.envs.skills import Outcome, Reachable
from er_gym.tasks.task import AgentPose
from er_gym.thor.objects import is_present

_FARTHEST, _NEAR = 1.5, 1.0
"""The greatest distance between the agent and an object; and between an agent that stands in front
of (or behind) an object and that object, if it is larger than :data:`_LITTLE`; metres."""
_SMALL = (0.1, 1.0)
"""The largest volume (m³) and face (m²) of a small object. The agent stands as near to it as it
can."""
_LITTLE, _MIDDLING = (0.2, 0.5), (1.0, 1.0)
"""The largest volume and face of a little and of a middling object. In front of a little object the
agent takes the nearest place, in front of a middling one the middle one of the places by distance,
in front of any other the farthest."""
_TOLERANCES = (0.1, 0.2, 0.3, 0.4, 0.5)
_GAP = 0.1
_HEADINGS = (0, 45, 90, 135, 180, 225, 270, 315, 360)
_UP, _DOWN = 30, -60
"""The limits of the head's tilt, degrees upwards."""
_BELOW = 0.44
"""The agent crouches if the object's top is this far below the agent's centre, metres."""
_HORIZON = 60.0

_CORNERS = ((2, 225.0), (3, 315.0), (6, 135.0), (7, 45.0))
"""The lower ones of AI2-THOR's eight corners, in the order of the search, each with the direction
in which the agent looks from there, degrees."""

Pose = Mapping[str, Any]
"""An entry of GetInteractablePoses's ``actionReturn``."""


@dataclass(frozen=True)
class ObjectSnapshot:
    """What the paper's agent knows of an object: its state now, or when the episode began.

    Attributes:
        object_id, object_type: AI2-THOR's ``objectId`` and ``objectType``.
        x, z, rotation: the position of its origin, metres, and the direction that it faces,
            degrees.
        centre: x, y and z of the middle of its axis-aligned box, metres.
        top: y of the box's top, metres.
        receptacle, openable, is_toggled: as AI2-THOR has them.
        contents: ids of the objects that lie in it.
    """

    object_id: str
    object_type: str
    x: float
    z: float
    rotation: float
    centre: tuple[float, float, float]
    top: float
    receptacle: bool
    openable: bool
    is_toggled: bool
    contents: tuple[str, ...]


def snapshot_of(entry: Mapping[str, Any]) -> ObjectSnapshot:
    """Read an entry of the metadata's ``objects``."""
    box = entry["axisAlignedBoundingBox"]
    return ObjectSnapshot(
        object_id=entry["objectId"],
        object_type=entry["objectType"],
        x=entry["position"]["x"],
        z=entry["position"]["z"],
        rotation=entry["rotation"]["y"],
        centre=tuple(box["center"][axis] for axis in "xyz"),
        top=box["cornerPoints"][0][1],
        receptacle=bool(entry["receptacle"]),
        openable=bool(entry["openable"]),
        is_toggled=bool(entry["isToggled"]),
        contents=tuple(entry["receptacleObjectIds"] or ()),
    )


def current_snapshot(controller: Any, object_id: str) -> ObjectSnapshot | None:
    """An object in its present state, None if no object has that id."""
    entry = _entry(controller, object_id)
    return None if entry is None else snapshot_of(entry)


def _entry(controller: Any, object_id: str) -> Mapping[str, Any] | None:
    objects = controller.last_event.metadata["objects"]
    entry = next((entry for entry in objects if entry["objectId"] == object_id), None)
    return entry if entry is not None and is_present(entry) else None


def step_undrawn(controller: Any, action: str, **arguments: Any) -> bool:
    """Make a call without drawing; return whether AI2-THOR reports no error."""
    event = controller.step(action=action, renderImage=False, **arguments)
    return not event.metadata["errorMessage"]


def teleport(controller: Any, pose: AgentPose) -> bool:
    """Teleport; the agent keeps standing or crouching as before, whatever the pose says."""
    return step_undrawn(
        controller,
        "Teleport",
        position={"x": pose.x, "y": pose.y, "z": pose.z},
        rotation={"x": 0.0, "y": pose.rotation, "z": 0.0},
        horizon=pose.horizon,
    )


def start_in_corner(bounds: Mapping[str, Any], floor: Reachable) -> AgentPose:
    """The start pose: the reachable position nearest to a corner of the scene's bounds.

    It equals :func:`er_gym.envs.skills.start_pose` unless two corners are equally near.

    Args:
        bounds: ``sceneBounds`` of an event's metadata.
    """
    least, pose = float("inf"), None
    for corner, rotation in _CORNERS:
        x, _, z = bounds["cornerPoints"][corner]
        away = np.sqrt((floor.positions[:, 0] - x) ** 2 + (floor.positions[:, 2] - z) ** 2)
        nearest = int(away.argmin())
        if away[nearest] < least:
            x, y, z = floor.positions[nearest].tolist()
            least, pose = away[nearest], AgentPose(x, y, z, rotation)
    assert pose is not None
    return pose


def approach(controller: Any, target: ObjectSnapshot, stated: AgentPose | None) -> Outcome:
    """Go to an object and look at it.

    Args:
        stated: the pose that a pose file states for the object, None if it states none; the agent
            goes there and neither crouches nor turns.
    """
    refused: list[Pose] = []
    pose = stated or _choose(controller, target, refused)
    if pose is None:
        return Outcome(None, False, PAPER_WAY(thing=target.object_type))
    while not teleport(controller, pose):
        refused.append({"x": pose.x, "y": pose.y, "z": pose.z})
        pose = _choose(controller, target, refused)
        if pose is None:
            return Outcome(None, False, PAPER_WAY(thing=target.object_type))
    if stated is None:
        _adjust_height(controller, target)
        _look_at(controller, target)
    if not controller.headless:
        controller.step(action="Pass")  # to draw the one picture needed
    return Outcome(perceive(controller.last_event), True)


# -- where to stand --------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Sides:
    """The sides on which the agent looks for a place, for one direction that an object faces.

    Attributes:
        axis: only places with a small offset along this axis count; ``""`` for all places.
        sides: the signs of a place's offsets along x and z (0 for any), and the rotation that faces
            the object from there; in order of preference.
        skips: whether the second side counts only if the first has no place at all. Otherwise it
            also counts if the first has no place that is near enough.
    """

    axis: str
    sides: tuple[tuple[int, int, float], ...]
    skips: bool = False


_FACING = {
    45: _Sides("", ((1, 1, 225.0), (-1, -1, 45.0))),
    90: _Sides("z", ((1, 0, 270.0), (-1, 0, 90.0)), skips=True),
    135: _Sides("", ((1, -1, 315.0), (-1, 1, 135.0), (1, 1, 225.0), (-1, -1, 45.0))),
    180: _Sides("x", ((0, -1, 0.0),)),
    225: _Sides("", ((-1, -1, 45.0), (1, 1, 225.0))),
    270: _Sides("z", ((-1, 0, 90.0), (1, 0, 270.0))),
    315: _Sides("", ((-1, 1, 135.0), (1, -1, 315.0))),
}
"""The sides by the direction that the object faces, degrees. 0 has its own rule,
:func:`_for_facing_north`."""


def _choose(controller: Any, target: ObjectSnapshot, refused: Sequence[Pose]) -> AgentPose | None:
    """The pose from which the agent reaches an object; None if there is none.

    Args:
        refused: positions to which AI2-THOR refused to teleport the agent.
    """
    event = controller.step(
        action="GetInteractablePoses", objectId=target.object_id, renderImage=False
    )
    poses = [
        pose
        for pose in event.metadata["actionReturn"] or ()
        if _away(pose, target) <= _FARTHEST
        and not any(all(pose[axis] == place[axis] for axis in "xyz") for place in refused)
    ]
    if not poses:
        return None
    entry = _entry(controller, target.object_id)
    assert entry is not None
    size = [entry["axisAlignedBoundingBox"]["size"][axis] for axis in "xyz"]
    volume = round(size[0] * size[1] * size[2], 4)
    face = round(max(size[0] * size[1], size[0] * size[2], size[1] * size[2]), 4)
    found, rotation = None, 0.0
    if not (volume <= _SMALL[0] and face <= _SMALL[1]):
        facing = _heading(target.rotation)
        choose = _for_facing_north if facing == 0 else _by_sides
        found, rotation = choose(target, poses, _FACING.get(facing), (volume, face))
    if found is None:
        found = min(poses, key=lambda pose: _away(pose, target))
        rotation = found["rotation"]
    return AgentPose(found["x"], found["y"], found["z"], rotation, _HORIZON)


def _heading(degrees: float) -> int:
    """The nearest of eight directions; the first of two that are equally near."""
    return min(_HEADINGS, key=lambda heading: abs(heading - round(degrees))) % 360


def _away(pose: Pose, target: ObjectSnapshot) -> float:
    return sqrt((pose["x"] - target.x) ** 2 + (pose["z"] - target.z) ** 2)


_Found = tuple[Pose | None, float]
_Size = tuple[float, float]


def _by_sides(
    target: ObjectSnapshot, poses: Sequence[Pose], ways: _Sides | None, size: _Size
) -> _Found:
    assert ways is not None
    for x, z, rotation in ways.sides:
        there = _on_side(target, _in_line(target, poses, ways.axis), x, z)
        found = _straight_ahead(target, there, size)
        if found is not None or (ways.skips and there):
            return found, rotation
    return None, 0.0


def _for_facing_north(
    target: ObjectSnapshot, poses: Sequence[Pose], _: object, size: _Size
) -> _Found:
    """The nearer one of the best places on both sides, and the rotation there.

    The agent looks north if there is any place behind the object, even if it stands in front.
    """
    line = _in_line(target, poses, "z")
    front, back = _on_side(target, line, 0, 1), _on_side(target, line, 0, -1)
    best = [_straight_ahead(target, there, size) for there in (back, front)]
    there_is = [pose for pose in best if pose is not None]
    # min returns the first of two places that are equally near: the one behind the object.
    found = min(there_is, key=lambda pose: _away(pose, target)) if there_is else None
    return found, 0.0 if back else 180.0


def _in_line(target: ObjectSnapshot, poses: Sequence[Pose], axis: str) -> Sequence[Pose]:
    """The poses with a small offset along an axis, by the first tolerance that any pose meets."""
    if not axis:
        return poses
    origin = {"x": target.x, "z": target.z}[axis]
    for tolerance in _TOLERANCES:
        found = [pose for pose in poses if abs(pose[axis] - origin) <= tolerance]
        if found:
            return found
    return []


def _on_side(target: ObjectSnapshot, poses: Sequence[Pose], x: int, z: int) -> list[Pose]:
    return [
        pose
        for pose in poses
        if (not x or (pose["x"] - target.x) * x > 0) and (not z or (pose["z"] - target.z) * z > 0)
    ]


def _straight_ahead(target: ObjectSnapshot, poses: Sequence[Pose], size: _Size) -> Pose | None:
    """Choose among the poses close to the line in which an object faces, by the object's size.

    The paper's equation of the line swaps x and z. This one swaps them, too.
    """
    slope = -tan(radians(target.rotation))
    offset = -target.x - slope * target.z
    least, close = float("inf"), []
    for pose in poses:
        aside = abs(pose["z"] + slope * pose["x"] + offset) / sqrt(1 + slope**2)
        if aside <= least + _GAP:
            least = min(least, aside)
            close.append(pose)
    if not close:
        return None
    if size[0] <= _LITTLE[0] and size[1] <= _LITTLE[1]:
        return min(close, key=lambda pose: _away(pose, target))
    near = [pose for pose in close if _away(pose, target) <= _NEAR]
    if not near:
        return None
    if size[0] <= _MIDDLING[0] and size[1] <= _MIDDLING[1]:
        return sorted(near, key=lambda pose: _away(pose, target))[len(near) // 2]
    return max(near, key=lambda pose: _away(pose, target))


# -- how to look -----------------------------------------------------------------------------------


def _adjust_height(controller: Any, target: ObjectSnapshot) -> None:
    """Crouch for a low object, otherwise stand; stand up again if the object is out of sight."""
    low = controller.last_event.metadata["agent"]["position"]["y"] > target.top + _BELOW
    step_undrawn(controller, "Crouch" if low else "Stand")
    entry = _entry(controller, target.object_id)
    if entry is None or not entry["visible"]:
        step_undrawn(controller, "Stand")


def _look_at(controller: Any, target: ObjectSnapshot) -> None:
    """Tilt the head to the object's middle, and turn to the nearest of eight directions to it."""
    metadata = controller.last_event.metadata
    camera = metadata["cameraPosition"]
    offset = np.array([target.centre[k] - camera[axis] for k, axis in enumerate("xyz")])
    length = np.linalg.norm(offset)
    direction = offset / length if length else offset
    yaw = float(np.degrees(np.arctan2(direction[0], direction[2])))
    pitch = int(np.degrees(np.arcsin(direction[1])))
    wanted = min(_UP, pitch) if pitch > 0 else max(_DOWN, pitch)
    up = wanted + round(metadata["agent"]["cameraHorizon"])
    if up:
        step_undrawn(controller, "LookUp" if up > 0 else "LookDown", degrees=abs(up))
    heading = _heading(360 + yaw if int(yaw) < 0 else yaw)
    turn = controller.last_event.metadata["agent"]["rotation"]["y"] - heading
    step_undrawn(controller, "RotateLeft", degrees=turn)
