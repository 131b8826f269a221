"""How a scene is made ready for a task: as recorded, or rearranged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

_DECIMALS = 4
"""Of kept poses: a tenth of a millimetre, a ten-thousandth of a degree."""
_SOMEWHERE_ELSE = 20
"""How many receptacles a thing tries before it stays where it is."""
_ATTEMPTS = 20
"""How many arrangements are looked at for one of which the poses tell all."""


@dataclass(frozen=True)
class ObjectPose:
    """Where an object is: metres and degrees, AI2-THOR's world frame."""

    x: float
    y: float
    z: float
    pitch: float = 0.0
    yaw: float = 0.0
    roll: float = 0.0


@dataclass(frozen=True)
class Arrangement:
    """How a scene differs from the recorded one when an episode begins.

    Attributes:
        layout: a name for the arrangement, ``""`` for the recorded one.
        poses: an object's ``name`` in the metadata to where it is, for those that have been moved.
            Objects that have been moved have other ids than in the recorded scene: AI2-THOR names
            things after their places.
        dirty: ids of objects that are made dirty.
    """

    layout: str = ""
    poses: Mapping[str, ObjectPose] = field(default_factory=dict)
    dirty: tuple[str, ...] = ()


def set_up_scene(controller: Any, scene: str, arrangement: Arrangement) -> Any:
    """Load a scene and arrange it; returns the last event.

    Raises:
        ValueError: an object of the start is not in the scene.
    """
    event = controller.reset(scene)
    if arrangement.poses:
        poses = _all_poses(_recorded_poses(controller, scene, event), arrangement)
        del event  # what nobody keeps, the embedded engine need not work out
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
"""By the kind of controller, which is to say by engine, and scene."""


def _recorded_poses(controller: Any, scene: str, event: Any) -> Mapping[str, ObjectPose]:
    """Where everything loose is in a scene that has just been loaded, by name."""
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
    """What SetObjectPoses needs: the pose of everything loose, for it takes away the rest."""
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
    """A scene with everything that can be carried put somewhere else, by a seed.

    AI2-THOR's ``InitialRandomSpawn`` chooses the places, closed receptacles among them; the poses
    are kept, so that the start is the same on every engine and for good. Of several arrangements it
    is the first of which the poses alone tell what lies in what, or that of which they tell most.
    """
    objects = controller.reset(scene).metadata["objects"]
    recorded = {entry["name"]: _pose(entry) for entry in objects}
    best, fewest = Arrangement(), float("inf")
    for attempt in range(_ATTEMPTS):
        if attempt:
            controller.reset(scene)
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
    """Object name to the receptacles that it lies in."""
    return {entry["name"]: frozenset(entry["parentReceptacles"] or ()) for entry in objects}


def _rounded(pose: ObjectPose) -> ObjectPose:
    # Adding 0.0 turns a minus zero into a plain one.
    values = (pose.x, pose.y, pose.z, pose.pitch, pose.yaw, pose.roll)
    return ObjectPose(*(round(value, _DECIMALS) + 0.0 for value in values))
