"""A house in ProcTHOR's JSON, written by hand: a kitchen, a bedroom and a bathroom.

The rooms stand in a row along x, 4 m deep. Doors lead from the kitchen to the bedroom (open) and to
the bathroom (a frame without a leaf); the front door, in the kitchen's south wall, is shut.
"""

from __future__ import annotations

from typing import Any


def point(x: float, z: float, y: float = 0.0) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def walls(room: int, west: float, east: float, deep: float, high: float = 2.6) -> list[Any]:
    corners = [(west, 0.0), (west, deep), (east, deep), (east, 0.0)]
    return [
        {
            "id": f"wall|{room}|{k}",
            "roomId": f"room|{room}",
            "polygon": [point(*a), point(*b), point(*a, high), point(*b, high)],
        }
        for k, (a, b) in enumerate(zip(corners, (*corners[1:], corners[0]), strict=True))
    ]


def room(number: int, kind: str, west: float, east: float, deep: float) -> dict[str, Any]:
    corners = [(west, 0.0), (west, deep), (east, deep), (east, 0.0)]
    return {
        "id": f"room|{number}",
        "roomType": kind,
        "floorPolygon": [point(*corner) for corner in corners],
    }


def hole(ident: str, asset: str, wall: str, left: float, right: float, low: float, high: float,
         **more: Any) -> dict[str, Any]:  # fmt: skip
    corners = [point(left, 0.0, low), point(right, 0.0, high)]
    return {"id": ident, "assetId": asset, "wall0": wall, "holePolygon": corners, **more}


def thing(ident: str, asset: str, at: dict[str, float], yaw: float = 0.0, *children: Any,
          **more: Any) -> dict[str, Any]:  # fmt: skip
    turn = {"x": 0.0, "y": yaw, "z": 0.0}
    return {"id": ident, "assetId": asset, "position": at, "rotation": turn,
            "children": list(children), **more}  # fmt: skip


def three_rooms() -> dict[str, Any]:
    """The house, newly made at each call."""
    pose = {"position": point(1.0, 1.0, 0.95), "rotation": {"x": 0, "y": 90, "z": 0}}
    return {
        "metadata": {"schema": "1.0.0", "agent": pose},
        "rooms": [
            room(1, "Kitchen", 0.0, 4.0, 4.0),
            room(2, "Bedroom", 4.0, 8.0, 4.0),
            room(3, "Bathroom", -3.0, 0.0, 4.0),
        ],
        "walls": [*walls(1, 0.0, 4.0, 4.0), *walls(2, 4.0, 8.0, 4.0), *walls(3, -3.0, 0.0, 4.0)],
        "doors": [
            # Along wall|1|2, which goes south from (4, 4): the middle is at z = 2.48.
            hole("door|1|2", "Doorway_10", "wall|1|2", 1.0, 2.04, 0.0, 2.1, openness=1),
            # Along wall|1|0, which goes north from (0, 0): the middle is at z = 1.52.
            hole("door|1|3", "Doorframe_10", "wall|1|0", 1.0, 2.04, 0.0, 2.1),
            # Along wall|1|3, which goes west from (4, 0): the middle is at x = 2.
            hole("door|1|1", "Doorway_1", "wall|1|3", 1.46, 2.54, 0.0, 2.13, openness=0),
        ],
        "windows": [hole("window|2|0", "Window_Fixed_60x36", "wall|2|2", 1.2, 2.7, 0.85, 1.76)],
        "objects": [
            thing(
                "CounterTop|1|0",
                "Countertop_I_4x2",
                point(1.8, 3.67, 0.47),
                180.0,
                thing("Apple|surface|1|0", "Apple_27", point(1.5, 3.6, 1.0)),
                thing("Mug|surface|1|1", "Mug_1", point(1.9, 3.6, 0.99), isDirty=True),
            ),
            thing("Fridge|1|1", "Fridge_5", point(0.6, 3.6, 0.846), 180.0),
            thing("Bed|2|0", "Bed_1", point(6.5, 2.95, 0.455)),
            thing("Dresser|2|1", "Dresser_301_1", point(7.8, 1.0, 0.615), 270.0),
            thing("Toilet|3|0", "Toilet_1", point(-1.5, 3.5, 0.52), 180.0),
        ],
    }


DOORS = ((4.0, 2.48), (0.0, 1.52))
"""x and z of the middles of the doors that one can walk through, both in walls at one x."""
SHUT = (2.0, 0.0)
"""The middle of the door that is shut."""
