"""The camera that sees a whole room from above, without perspective."""

from __future__ import annotations

from er_gym.sim.settings import ThirdPartyCamera
from er_gym.sim.space.room_bounds import room_corners

_FIELD_OF_VIEW = 90.0


def map_camera(scene_name: str) -> ThirdPartyCamera:
    """In the middle of a room's ceiling, looking down; its picture is north up (+z).

    The longer side of the room fits into the picture if that is square.
    """
    (west, _, south), (east, ceiling, north) = room_corners(scene_name)
    size = max(east - west, north - south) / 2
    middle = ((west + east) / 2, ceiling, (south + north) / 2)
    return ThirdPartyCamera(middle, (90.0, 0.0, 0.0), _FIELD_OF_VIEW, size)
