"""The world as AI2-THOR 5 metadata: dictionaries are made here, once, at the edge."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import PROPERTIES, STATES
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import HAND_OFFSET, World


def vector(values: Sequence[float] | NDArray[np.float64]) -> dict[str, float]:
    """Three numbers as AI2-THOR writes a point or a rotation."""
    x, y, z = (float(v) for v in values)
    return {"x": x, "y": y, "z": z}


def scene_bounds(world: World) -> dict[str, Any]:
    """The box around everything in the scene as it was recorded, metres."""
    scene = world.scene
    half = scene.aabb_size / 2
    return _box((scene.aabb_center - half).min(axis=0), (scene.aabb_center + half).max(axis=0))


def _box(low: NDArray[np.float64], high: NDArray[np.float64]) -> dict[str, Any]:
    corners = [
        [float(x), float(y), float(z)]
        for x in (high[0], low[0])
        for y in (high[1], low[1])
        for z in (high[2], low[2])
    ]
    return {
        "center": vector((low + high) / 2),
        "size": vector(high - low),
        "cornerPoints": corners,
    }


def _object(world: World, i: int) -> dict[str, Any]:
    """What does not change with where the agent is."""
    oriented = world.obb_corners(i)
    parents = world.parents[i]
    ids = world.object_ids
    controlled = world.controlled[i]
    materials = world.salient_materials[i]
    return {
        "name": world.names[i],
        "position": vector(world.position[i]),
        "rotation": vector(world.rotation[i]),
        "visible": False,
        "isInteractable": False,
        **dict(zip(PROPERTIES, world.properties[i].tolist(), strict=True)),
        **dict(zip(STATES, world.states[i].tolist(), strict=True)),
        "openness": float(world.openness[i]),
        "fillLiquid": world.fill_liquid[i],
        "temperature": world.temperature[i],
        "mass": float(world.mass[i]),
        "salientMaterials": None if materials is None else list(materials),
        "receptacleObjectIds": (
            [ids[c] for c in world.contents[i]] if world.has(i, "receptacle") else None
        ),
        "parentReceptacles": [ids[p] for p in parents] if parents else None,
        "controlledObjects": None if controlled is None else [ids[c] for c in controlled],
        "distance": 0.0,
        "objectType": world.types[i],
        "objectId": ids[i],
        "assetId": world.asset_ids[i],
        "isPickedUp": i == world.held,
        "isMoving": False,
        "axisAlignedBoundingBox": _box(world.low[i], world.high[i]),
        "objectOrientedBoundingBox": (
            None if oriented is None else {"cornerPoints": oriented.tolist()}
        ),
    }


def _objects(world: World) -> list[dict[str, Any]]:
    fixed = world.entries
    rows = np.flatnonzero(world.exists).tolist()
    for i in rows:
        if i not in fixed:
            fixed[i] = _object(world, i)
    seen = visible(world).tolist()
    distance = np.linalg.norm(world.position - world.agent.position, axis=1).tolist()
    return [
        {**fixed[i], "visible": seen[i], "isInteractable": seen[i], "distance": distance[i]}
        for i in rows
    ]


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
    """The RGB colour that stands for an object in instance segmentation; the same in every run."""
    number = zlib.crc32(object_id.encode()) & 0xFFFFFF
    return number >> 16, number >> 8 & 255, number & 255


def metadata(
    world: World,
    action: str,
    error: str = "",
    error_code: str = "",
    action_return: Any = None,
) -> dict[str, Any]:
    """Everything that an AI2-THOR event says about the world, after an action."""
    settings = world.settings
    held = world.held
    return {
        "objects": _objects(world),
        "isSceneAtRest": True,
        "agent": _agent(world),
        "heldObjectPose": _held_pose(world),
        "arm": None,
        "fov": settings.field_of_view,
        "cameraPosition": vector(world.agent.camera),
        "cameraOrthSize": 0.0,
        "thirdPartyCameras": [],
        "collided": False,
        "collidedObjects": [],
        "inventoryObjects": (
            [{"objectId": world.object_ids[held], "objectType": world.types[held]}]
            if held >= 0
            else []
        ),
        "sceneName": f"{world.scene.name}_physics",
        "lastAction": action,
        "errorMessage": error,
        "errorCode": error_code,
        "lastActionSuccess": not error,
        "screenWidth": settings.width,
        "screenHeight": settings.height,
        "agentId": 0,
        "colors": (
            [
                {"name": world.object_ids[i], "color": list(instance_color(world.object_ids[i]))}
                for i in np.flatnonzero(world.exists)
            ]
            if settings.render_instances
            else None
        ),
        "sceneBounds": scene_bounds(world),
        "updateCount": 0,
        "fixedUpdateCount": 0,
        "currentTime": 0.0,
        "visibleRange": None,
        "actionReturn": action_return,
        "depthFormat": "Meters",
    }
