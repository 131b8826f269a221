"""Arrangements: how a scene is set up for a task, as recorded or with moved objects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from er_gym.houses.names import scene_of

_DECIMALS = 4
"""Decimals of stored poses: a tenth of a millimetre, a ten-thousandth of a degree."""
_SOMEWHERE_ELSE = 20
"""How many places AI2-THOR tries for an object before the object stays where it is."""
_ATTEMPTS = 20
"""How many arrangements are tried to find one that its poses determine completely."""


@dataclass(frozen=True)
class ObjectPose:
    """The pose of an object: metres and degrees, AI2-THOR's world frame."""

    x: float
    y: float
    z: float
    pitch: float = 0.0
    yaw: float = 0.0
    roll: float = 0.0


@dataclass(frozen=True)
class Arrangement:
    """How a scene differs from the recorded scene when an episode begins.

    Attributes:
        layout: the name of the arrangement, ``""`` for the recorded one.
        poses: an object's ``name`` in the metadata to its pose, for the objects that were moved.
            Moved objects have other ids than in the recorded scene, because AI2-THOR derives ids
            from positions.
        dirty: ids of the objects that are made dirty.
    """

    layout: str = ""
    poses: Mapping[str, ObjectPose] = field(default_factory=dict)
    dirty: tuple[str, ...] = ()


def set_up_scene(controller: Any, scene: str, arrangement: Arrangement) -> Any:
    """Load a scene and arrange it; returns the last event.

    Args:
        controller: an AI2-THOR controller.
        scene: such as ``FloorPlan1``, or the name of a house.
        arrangement: what to change.

    Raises:
        ValueError: an object of the arrangement is not in the scene.
    """
    event = controller.reset(scene_of(scene))
    if arrangement.poses:
        poses = _all_poses(_recorded_poses(controller, scene, event), arrangement)
        del event  # the embedded engine need not compute an event that nobody keeps
        event = controller.step(action="SetObjectPoses", objectPoses=poses, placeStationary=True)
        _check(event, scene, arrangement)
    for object_id in arrangement.dirty:
        event = controller.step(action="DirtyObject", objectId=object_id, forceAction=True)
        _check(event, scene, arrangement)
    return event


def _check(event: Any, scene: str, arrangement: Arrangement) -> None:
    if not event.metadata["lastActionSuccess"]:
        raise ValueError(
            f"{scene} cannot be arranged as {arrangement.layout or 'its task asks'!r}: "
            f"{event.metadata['errorMessage']}"
        )


_recorded: dict[tuple[type, str], Mapping[str, ObjectPose]] = {}
"""The recorded poses by the class of the controller (one class per engine) and by scene."""


def _recorded_poses(controller: Any, scene: str, event: Any) -> Mapping[str, ObjectPose]:
    """Object name to pose for everything movable in a scene that was just loaded."""
    key = (type(controller), scene)
    if key not in _recorded:
        _recorded[key] = {
            entry["name"]: _pose(entry)
            for entry in event.metadata["objects"]
            if entry["pickupable"] or entry["moveable"]
        }
    return _recorded[key]


def _all_poses(
    recorded: Mapping[str, ObjectPose], arrangement: Arrangement
) -> list[dict[str, Any]]:
    """The poses of all movable objects: SetObjectPoses removes those that are not listed."""
    return [
        {
            "objectName": name,
            "position": {"x": pose.x, "y": pose.y, "z": pose.z},
            "rotation": {"x": pose.pitch, "y": pose.yaw, "z": pose.roll},
        }
        for name, pose in {**recorded, **arrangement.poses}.items()
    ]


def _pose(entry: Mapping[str, Any]) -> ObjectPose:
    position, rotation = entry["position"], entry["rotation"]
    return ObjectPose(*(position[axis] for axis in "xyz"), *(rotation[axis] for axis in "xyz"))


def random_arrangement(controller: Any, scene: str, seed: int) -> Arrangement:
    """A random arrangement in which the pickupable objects have other places.

    AI2-THOR's ``InitialRandomSpawn`` chooses the places, also in closed receptacles. The
    arrangement stores the poses, so that it is the same on every engine. Several arrangements are
    tried. The result is the first whose poses alone determine which object lies in which
    receptacle, or the one whose poses determine most.

    Args:
        controller: an AI2-THOR controller; the scene is loaded into it.
        scene: such as ``FloorPlan1``.
        seed: the same seed gives the same arrangement.
    """
    objects = controller.reset(scene_of(scene)).metadata["objects"]
    recorded = {entry["name"]: _pose(entry) for entry in objects}
    best, fewest = Arrangement(), float("inf")
    for attempt in range(_ATTEMPTS):
        if attempt:
            controller.reset(scene_of(scene))
        spawned = controller.step(
            action="InitialRandomSpawn",
            randomSeed=seed * _ATTEMPTS + attempt,
            forceVisible=False,
            numPlacementAttempts=_SOMEWHERE_ELSE,
            placeStationary=True,
        ).metadata["objects"]
        poses = {
            entry["name"]: _rounded(pose)
            for entry in spawned
            if (pose := _pose(entry)) != recorded.get(entry["name"], pose)
        }
        arrangement = Arrangement(f"{scene}-{seed}", poses)
        wanted = _holders(spawned)
        arranged = _holders(set_up_scene(controller, scene, arrangement).metadata["objects"])
        doubtful = sum(holders != wanted[name] for name, holders in arranged.items())
        if doubtful < fewest:
            best, fewest = arrangement, doubtful
        if not doubtful:
            break
    return best


def _holders(objects: list[dict[str, Any]]) -> dict[str, frozenset[str]]:
    """Object name to the ids of its parent receptacles."""
    return {entry["name"]: frozenset(entry["parentReceptacles"] or ()) for entry in objects}


def _rounded(pose: ObjectPose) -> ObjectPose:
    # Adding 0.0 turns -0.0 into 0.0.
    values = (pose.x, pose.y, pose.z, pose.pitch, pose.yaw, pose.roll)
    return ObjectPose(*(round(value, _DECIMALS) + 0.0 for value in values))
