"""The metadata of AI2-THOR 5 for a world. All dictionaries are made here, at the edge."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from functools import lru_cache
from typing import Any

import numpy as np

from er_gym.sim.agent import HAND_OFFSET
from er_gym.sim.carrying import hand_point, hand_rotation, in_camera_frame
from er_gym.sim.lazy_metadata import LazyMetadata
from er_gym.sim.object_metadata import box, objects, vector
from er_gym.sim.rotation import unity_angles
from er_gym.sim.space.map_camera import map_camera
from er_gym.sim.space.room_bounds import room_bounds
from er_gym.sim.world import World


def scene_bounds(world: World) -> dict[str, Any]:
    """The box around the room with its walls and ceiling, metres."""
    return box(*room_bounds(world.scene.name))


def scene_label(world: World) -> str:
    """AI2-THOR's name of the scene: all houses have one."""
    return PROCEDURAL if world.scene.shell is not None else f"{world.scene.name}_physics"


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
    """The pose of the hand, whether it holds anything or not."""
    agent, hand = world.agent, world.hand
    turned = hand_rotation(agent, hand)
    return {
        "localPosition": vector(HAND_OFFSET if hand is None else HAND_OFFSET + hand.shift),
        "position": vector(hand_point(agent, hand)),
        "localRotation": vector(in_camera_frame(agent, turned)),
        "rotation": vector(unity_angles(turned)),
    }


PROCEDURAL = "Procedural"
"""AI2-THOR's name of the scene in which houses are created."""


@lru_cache(maxsize=65536)
def instance_color(object_id: str) -> tuple[int, int, int]:
    """The RGB colour of an object id or an object type in segmentations, the same in every run."""
    number = zlib.crc32(object_id.encode()) & 0xFFFFFF
    return number >> 16, number >> 8 & 255, number & 255


def _colors(world: World) -> list[dict[str, Any]] | None:
    """The colours of the segmentation images by name, None while none is drawn.

    As in AI2-THOR, objects and types are both listed, whichever is drawn. The official client finds
    the masks of a class among the colours of those objects whose ids begin with its name. So an
    object whose id begins with another name, such as a SinkBasin (``Sink|…|SinkBasin``), is also
    listed under its type. If a colour has several names, the client uses the last one.
    """
    if not world.settings.draws_colors:
        return None
    there = np.flatnonzero(world.exists).tolist()
    ids, types = world.object_ids, world.types
    colors = [
        (types[i], instance_color(ids[i])) for i in there if ids[i].split("|", 1)[0] != types[i]
    ]
    names = [*(ids[i] for i in there), *sorted({types[i] for i in there})]
    colors += [(name, instance_color(name)) for name in names]
    return [{"name": name, "color": list(color)} for name, color in colors]


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


def _orthographic_size(world: World) -> float:
    """Of the agent's camera, metres; 0 in perspective."""
    size = map_camera(world.scene.name).orthographic_size if world.map_view else None
    return 0.0 if size is None else size


def inventory(world: World) -> list[dict[str, str]]:
    """The object in the agent's hand."""
    if world.held < 0:
        return []
    return [{"objectId": world.object_ids[world.held], "objectType": world.types[world.held]}]


_LATER: dict[str, Callable[[World], Any]] = {
    "objects": objects,
    "agent": _agent,
    "heldObjectPose": _held_pose,
    "cameraPosition": lambda world: vector(world.agent.camera),
    "thirdPartyCameras": _third_party_cameras,
    "inventoryObjects": inventory,
    "sceneBounds": scene_bounds,
}
"""Values that are computed when they are read."""


def metadata(
    world: World,
    action: str,
    error: str = "",
    error_code: str | None = None,
    action_return: Any = None,
    kind: type[LazyMetadata] = LazyMetadata,
) -> LazyMetadata:
    """All metadata of an AI2-THOR event about the world after an action.

    Most values are computed when they are read. Call ``settle`` before the world changes.
    """
    settings = world.settings
    report = {
        "isSceneAtRest": True,
        "arm": None,
        "fov": settings.field_of_view,
        "cameraOrthSize": _orthographic_size(world),
        "collided": False,
        "collidedObjects": [],
        "sceneName": scene_label(world),
        "lastAction": action,
        "errorMessage": error,
        "errorCode": error_code,
        "lastActionSuccess": not error,
        "screenWidth": settings.width,
        "screenHeight": settings.height,
        "agentId": world.acting,
        "colors": _colors(world),  # now, because a step may ask for segmentation for itself alone
        "updateCount": 0,
        "fixedUpdateCount": 0,
        "currentTime": 0.0,
        "visibleRange": None,
        "actionReturn": action_return,
        "depthFormat": "Meters",
        # Old fields for answers, older than actionReturn.
        "actionFloatReturn": 0.0,
        "actionFloatsReturn": [],
        "actionIntReturn": 0,
        "actionStringsReturn": [],
        "actionVector3sReturn": [],
        "distances": [],
        "flatSurfacesOnGrid": [],
        "isOpenableGrid": [],
        "normals": [],
        "objectIdsInBox": [],
        "segmentedObjectIds": [],
    }
    return kind(report, _LATER, world)
