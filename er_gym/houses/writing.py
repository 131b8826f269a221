"""A planned and furnished house as ProcTHOR's JSON."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from er_gym.houses.furniture import Placed
from er_gym.houses.openings import Gap
from er_gym.houses.plan import PlannedRoom

_HIGH = 2.6
"""Height of the walls, metres."""
_FLOORS = {
    "Kitchen": "RedBrick", "LivingRoom": "DarkWoodFloors", "Bedroom": "WoodFloorsCross",
    "Bathroom": "PureWhite",
}  # fmt: skip


def house_json(
    name: str,
    rooms: Sequence[PlannedRoom],
    gaps: Sequence[Gap],
    things: Sequence[Placed],
    start: tuple[float, float],
) -> dict[str, Any]:
    """The house; ids are those of AI2-THOR's rooms: a type and three coordinates."""
    agent = {
        "position": _point(*start, 0.95),
        "rotation": {"x": 0.0, "y": 0.0, "z": 0.0},
        "horizon": 0.0,
        "standing": True,
    }
    numbers = {room.number: room for room in rooms}
    return {
        "format": "er-gym/house-1",
        "metadata": {"schema": "1.0.0", "name": name, "agent": agent},
        "proceduralParameters": {
            "ceilingMaterial": {"name": "PureWhite"},
            "floorColliderThickness": 1.0,
            "receptacleHeight": 0.7,
            "skyboxId": "Sky1",
            "lights": [],
            "reflections": [],
        },
        "rooms": [
            {
                "id": room.id,
                "roomType": room.kind,
                "floorMaterial": {"name": _FLOORS[room.kind]},
                "floorPolygon": [_point(x, z) for x, z in _corners(room)],
                "ceilings": [],
                "children": [],
            }
            for room in rooms
        ],
        "walls": [wall for room in rooms for wall in _walls(room)],
        "doors": [_gap(g, k, numbers) for k, g in enumerate(gaps) if g.kind != "Window"],
        "windows": [_gap(g, k, numbers) for k, g in enumerate(gaps) if g.kind == "Window"],
        "objects": [_thing(each, things) for each in things if each.on < 0],
    }


def _point(x: float, z: float, y: float = 0.0) -> dict[str, float]:
    return {"x": x, "y": y, "z": z}


def _corners(room: PlannedRoom) -> list[tuple[float, float]]:
    """Clockwise seen from above, from the south-west; so a wall leads along each side."""
    return [
        (room.west, room.south),
        (room.west, room.north),
        (room.east, room.north),
        (room.east, room.south),
    ]


_WALL_OF = {"west": 0, "north": 1, "east": 2, "south": 3}


def _walls(room: PlannedRoom) -> list[dict[str, Any]]:
    corners = _corners(room)
    return [
        {
            "id": f"wall|{room.number}|{k}",
            "roomId": room.id,
            "material": {"name": "PureWhite"},
            "polygon": [_point(*a), _point(*b), _point(*a, _HIGH), _point(*b, _HIGH)],
        }
        for k, (a, b) in enumerate(zip(corners, (*corners[1:], corners[0]), strict=True))
    ]


def _gap(gap: Gap, k: int, rooms: dict[int, PlannedRoom]) -> dict[str, Any]:
    room, number = rooms[gap.room], _WALL_OF[gap.side]
    start = _corners(room)[number]
    at = start[1] if gap.side in ("west", "east") else start[0]
    left, right = sorted((abs(gap.low - at), abs(gap.high - at)))
    found: dict[str, Any] = {
        "id": f"{'window' if gap.kind == 'Window' else 'door'}|{gap.room}|{gap.other}|{k}",
        "assetId": gap.asset,
        "room0": room.id,
        "room1": f"room|{gap.other}" if gap.other else room.id,
        "wall0": f"wall|{gap.room}|{number}",
        "holePolygon": [
            _point(round(left, 3), 0.0, gap.bottom), _point(round(right, 3), 0.0, gap.top)
        ],
        "assetPosition": _point(
            round((left + right) / 2, 4), 0.0, round((gap.bottom + gap.top) / 2, 4)
        ),
    }  # fmt: skip
    if gap.kind == "Doorway":
        found |= {"openable": gap.open, "openness": float(gap.open)}
    return found


def _thing(thing: Placed, things: Sequence[Placed]) -> dict[str, Any]:
    number = next(k for k, each in enumerate(things) if each is thing)
    children = [_thing(each, things) for each in things if each.on == number]
    kind = thing.asset.type
    found: dict[str, Any] = {
        "id": f"{kind}|{thing.x:+06.2f}|{thing.y:+06.2f}|{thing.z:+06.2f}",
        "assetId": thing.asset.id,
        "position": _point(thing.x, thing.z, round(thing.y, 4)),
        "rotation": {"x": 0.0, "y": thing.yaw, "z": 0.0},
        "kinematic": not thing.asset.has & {"pickupable", "moveable"},
    }
    return {**found, "children": children} if children else found
