"""Objects made by hand, as an agent in the origin that looks north perceives them."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from er_gym.envs.perception import Perception, perceive

Entry = dict[str, Any]


def make_entry(
    object_id: str,
    centre: tuple[float, float, float] = (0.5, 0.0, 0.0),
    size: tuple[float, float, float] = (0.1, 0.1, 0.1),
    **fields: Any,
) -> Entry:
    """An object's metadata: visible, and of the type that its id begins with."""
    flags = ("isPickedUp", "pickupable", "receptacle", "openable", "toggleable", "sliceable")
    return {
        "objectId": object_id,
        "objectType": object_id.split("|")[0],
        "visible": True,
        "isInteractable": True,
        **dict.fromkeys((*flags, "isOpen", "isToggled"), False),
        **dict.fromkeys(("parentReceptacles", "receptacleObjectIds", "controlledObjects")),
        "axisAlignedBoundingBox": {
            "size": dict(zip("xyz", size, strict=True)),
            "center": dict(zip("xyz", centre, strict=True)),
        },
        **fields,
    }


def perception_of(*entries: Entry) -> Perception:
    """What an agent in the origin perceives of some objects."""
    metadata = {
        "objects": list(entries),
        "agent": {
            "position": {"x": 0.0, "y": 0.9, "z": 0.0},
            "rotation": {"x": 0.0, "y": 0.0, "z": 0.0},
            "cameraHorizon": 0.0,
            "isStanding": True,
        },
        "inventoryObjects": [{"objectId": e["objectId"]} for e in entries if e["isPickedUp"]],
    }
    return perceive(undrawn(metadata))


def undrawn(metadata: Any) -> Any:
    """An event without images."""
    images = ("frame", "depth_frame", "semantic_segmentation_frame", "instance_detections2D")
    return SimpleNamespace(metadata=metadata, **dict.fromkeys(images))
