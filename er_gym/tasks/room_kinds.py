"""The four kinds of room among the iTHOR scenes."""

from __future__ import annotations

import re

ROOM_KINDS = ("kitchen", "living room", "bedroom", "bathroom")
"""The kinds, in the order of AI2-THOR's scene numbers."""

_KIND_OF_HUNDRED = {0: "kitchen", 2: "living room", 3: "bedroom", 4: "bathroom"}


def room_kind(scene: str) -> str:
    """The kind of room of a scene: ``FloorPlan212`` is a living room.

    Raises:
        ValueError: there is no iTHOR scene of that name.
    """
    match = re.fullmatch(r"FloorPlan([234](?=\d\d))?(\d{1,2})(_physics)?", scene)
    if match is None or not 1 <= int(match[2]) <= 30:
        raise ValueError(f"{scene!r} is not an iTHOR scene; give a name such as FloorPlan1")
    return _KIND_OF_HUNDRED[int(match[1] or 0)]
