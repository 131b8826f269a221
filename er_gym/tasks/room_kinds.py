"""The four kinds of room among the iTHOR scenes, and houses."""

from __future__ import annotations

import re

from er_gym.houses.names import is_house

ROOM_KINDS = ("kitchen", "living room", "bedroom", "bathroom")
"""The kinds, in the order of AI2-THOR's scene numbers."""

HOUSE = "house"
"""What a scene of several rooms is called."""

_KIND_OF_HUNDRED = {0: "kitchen", 2: "living room", 3: "bedroom", 4: "bathroom"}


def room_kind(scene: str) -> str:
    """The kind of room of a scene: ``FloorPlan212`` is a living room, and a house a house.

    Raises:
        ValueError: there is no iTHOR scene of that name.
    """
    if is_house(scene):
        return HOUSE
    match = re.fullmatch(r"FloorPlan([234](?=\d\d))?(\d{1,2})(_physics)?", scene)
    if match is None or not 1 <= int(match[2]) <= 30:
        raise ValueError(f"{scene!r} is not an iTHOR scene; give a name such as FloorPlan1")
    return _KIND_OF_HUNDRED[int(match[1] or 0)]
