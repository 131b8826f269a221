"""Objects made by hand, as the generator reads them."""

from __future__ import annotations

from typing import Any

from er_gym.tasks.generate.scene_graph import SceneObject


def thing(object_type: str, *parents: str, number: int = 0, **fields: Any) -> SceneObject:
    """A thing in or on the first things of some types."""
    plain: dict[str, Any] = {
        **dict.fromkeys(("receptacle", "pickupable", "openable", "closed", "toggleable"), False),
        **dict.fromkeys(("on", "dirtyable", "fillable", "cookable", "sliceable"), False),
        "controlled": (),
        "volume": 1.0,
        "x": 0.0,
        "z": 0.0,
    }
    return SceneObject(
        f"{object_type}|+00.00|+00.00|+0{number}.00",
        object_type,
        tuple(f"{parent}|+00.00|+00.00|+00.00" for parent in parents),
        **{**plain, **fields},
    )
