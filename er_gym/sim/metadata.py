"""The world as AI2-THOR 5 metadata: dictionaries are made here, once, at the edge."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from er_gym.sim.lazy import LazyMetadata
from er_gym.sim.object_metadata import box, objects, vector
from er_gym.sim.space.room import room_box
from er_gym.sim.world import HAND_OFFSET, World


def scene_bounds(world: World) -> dict[str, Any]:
    """The box around the room with its walls and ceiling, metres."""
    return box(*room_box(world.scene.name))


def _agent(world: World) -> dict[str, Any]:
    agent = world.agent
    return {
        "name": "agent",
        "position": vector(agent.position),
        "rotation": vector((0.0, agent.rotation, 0.0)),
        "cameraHorizon": float(agent.horizon),
        "isStanding": agent.standing,
        "inHighFrictionArea": False,
    }


def _held_pose(world: World) -> dict[str, Any]:
    if world.held < 0:
        zero = vector((0.0, 0.0, 0.0))
        return {
            "localPosition": vector(HAND_OFFSET),
            "position": zero,
            "localRotation": zero,
            "rotation": zero,
        }
    return {
        "localPosition": vector(HAND_OFFSET),
        "position": vector(world.position[world.held]),
        "localRotation": vector((0.0, 0.0, 0.0)),
        "rotation": vector(world.rotation[world.held]),
    }


@lru_cache(maxsize=65536)
def instance_color(object_id: str) -> tuple[int, int, int]:
    """The RGB colour that stands for an object id or a type; the same in every run."""
    number = zlib.crc32(object_id.encode()) & 0xFFFFFF
    return number >> 16, number >> 8 & 255, number & 255


def _colors(world: World) -> list[dict[str, Any]] | None:
    """Which colour means what in the segmentations that are drawn, None while none is."""
    if not world.settings.render_instances and not world.settings.render_classes:
        return None
    there = np.flatnonzero(world.exists).tolist()
    names: list[str] = []
    if world.settings.render_instances:
        names += [world.object_ids[i] for i in there]
    if world.settings.render_classes:
        names += sorted({world.types[i] for i in there})
    return [{"name": name, "color": list(instance_color(name))} for name in names]


def _third_party_cameras(world: World) -> list[dict[str, Any]]:
    return [
        {
            "thirdPartyCameraId": number,
            "position": vector(camera.position),
            "rotation": vector(camera.rotation),
            "fieldOfView": camera.field_of_view,
        }
        for number, camera in enumerate(world.cameras)
    ]


def _inventory(world: World) -> list[dict[str, str]]:
    if world.held < 0:
        return []
    return [{"objectId": world.object_ids[world.held], "objectType": world.types[world.held]}]


_LATER: dict[str, Callable[[World], Any]] = {
    "objects": objects,
    "agent": _agent,
    "heldObjectPose": _held_pose,
    "cameraPosition": lambda world: vector(world.agent.camera),
    "thirdPartyCameras": _third_party_cameras,
    "inventoryObjects": _inventory,
    "sceneBounds": scene_bounds,
}
"""What of an event is worked out when it is read."""


def metadata(
    world: World,
    action: str,
    error: str = "",
    error_code: str = "",
    action_return: Any = None,
    kind: type[LazyMetadata] = LazyMetadata,
) -> LazyMetadata:
    """Everything that an AI2-THOR event says about the world, after an action.

    Most of it is worked out when it is read; before the world changes, ``settle`` it.
    """
    settings = world.settings
    report = {
        "isSceneAtRest": True,
        "arm": None,
        "fov": settings.field_of_view,
        "cameraOrthSize": 0.0,
        "collided": False,
        "collidedObjects": [],
        "sceneName": f"{world.scene.name}_physics",
        "lastAction": action,
        "errorMessage": error,
        "errorCode": error_code,
        "lastActionSuccess": not error,
        "screenWidth": settings.width,
        "screenHeight": settings.height,
        "agentId": 0,
        "colors": _colors(world),  # now: a step may ask for segmentation for itself alone
        "updateCount": 0,
        "fixedUpdateCount": 0,
        "currentTime": 0.0,
        "visibleRange": None,
        "actionReturn": action_return,
        "depthFormat": "Meters",
    }
    return kind(report, _LATER, world)
