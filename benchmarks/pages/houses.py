"""The houses of docs/gallery.md: ten of them from above, and a view of each."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image
from rich.progress import track

from er_gym.houses.generate import generate_house
from er_gym.houses.names import house_name
from er_gym.sim.controller import EmbeddedController
from er_gym.writing import write_picture

HOUSES = ((1, 0), (2, 1), (2, 4), (3, 0), (3, 7), (4, 0), (4, 5), (5, 0), (6, 0), (6, 3))
"""Rooms and seed of each."""
_MAP, _VIEW = 480, (480, 360)
_COLUMNS, _EDGE = 5, 20
_BACKGROUND = 228
_PLACES, _YAWS = 24, range(0, 360, 45)
_HORIZON = 15


def house_map(controller: EmbeddedController) -> NDArray[np.uint8]:
    """(M, M, 3) a house from above, without its ceiling."""
    picture = controller.step("ToggleMapView").frame.copy()
    controller.step("ToggleMapView")
    picture[picture.sum(axis=2) == 0] = _BACKGROUND
    return np.asarray(picture)


def best_view(controller: EmbeddedController) -> dict[str, object]:
    """The pose from which most objects are visible, of some places and directions."""
    places = controller.step("GetReachablePositions").metadata["actionReturn"]
    poses = [
        {"position": place, "rotation": yaw, "horizon": _HORIZON, "standing": True}
        for place in places[:: max(1, len(places) // _PLACES)]
        for yaw in _YAWS
    ]

    def seen(pose: dict[str, object]) -> int:
        objects = controller.step("TeleportFull", **pose, renderImage=False).metadata["objects"]
        return sum(each["visible"] for each in objects if each["pickupable"] or each["openable"])

    return max(poses, key=seen)


def house_pages(images: Path) -> list[str]:
    """The lines about houses, and their pictures."""
    rows = len(HOUSES) // _COLUMNS
    maps = Image.new("RGB", (_COLUMNS * _MAP, rows * _MAP), (_BACKGROUND,) * 3)
    views = Image.new("RGB", (_COLUMNS * _VIEW[0], rows * _VIEW[1]))
    with EmbeddedController(scene="Procedural", width=_MAP, height=_MAP) as controller:
        for k, (rooms, seed) in enumerate(track(HOUSES, "houses", transient=True)):
            row, column = divmod(k, _COLUMNS)
            house = generate_house(seed, rooms)
            controller.reset(house, width=_MAP, height=_MAP, visibilityDistance=4.0)
            seen = Image.fromarray(house_map(controller)).resize((_MAP - 2 * _EDGE,) * 2)
            maps.paste(seen, (column * _MAP + _EDGE, row * _MAP + _EDGE))
            pose = best_view(controller)
            controller.step("ChangeResolution", x=_VIEW[0], y=_VIEW[1])
            frame = controller.step("TeleportFull", **pose).frame
            views.paste(Image.fromarray(frame), (column * _VIEW[0], row * _VIEW[1]))
    for name, page in (("maps", maps), ("views", views)):
        small = page.resize((page.width // 2, page.height // 2), Image.Resampling.LANCZOS)
        write_picture(images / f"gallery-house-{name}.jpg", small, force=True, quality=85)
    names = ", ".join(house_name(seed, rooms) for rooms, seed in HOUSES)
    return [
        "## Houses: ten of those that `er-gym houses generate` makes",
        "",
        f"{names}, from left to right.",
        "",
        "![Ten houses from above](images/gallery-house-maps.jpg)",
        "",
        "![A view of each house](images/gallery-house-views.jpg)",
        "",
    ]
