"""ProcTHOR's house JSON, read and checked.

A house is a dictionary of lists: ``rooms`` (``floorPolygon``, ``roomType``), ``walls``
(``polygon``), ``doors`` and ``windows`` (``wall0``, ``wall1`` and a ``holePolygon`` along
``wall0``, or a ``boundingBox`` in old files), ``objects`` (``assetId``, ``position``, ``rotation``,
``children``), and ``metadata`` with a pose for the agent. The position of an object is the middle
of its box. Keys that say how Unity draws things are not read.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from er_gym.sim.shell import Point, Room

_CATEGORIES = {
    "kitchen": "kitchens",
    "livingroom": "living_rooms",
    "bedroom": "bedrooms",
    "bathroom": "bathrooms",
}
_SAME = 1e-3
"""Coordinates that differ by less are equal, metres."""
_LARGEST = 1000.0
"""The largest coordinate, metres, or angle, degrees."""
_MOST = 2000
"""The most walls, doors, windows or objects."""


class HouseError(ValueError):
    """A house cannot be built; the message says what is wrong with it."""


@dataclass(frozen=True)
class HouseWall:
    """A wall: its two lower corners, in the order of its polygon, and its heights.

    An empty wall only says where rooms meet: one sees and walks through it.
    """

    id: str
    start: Point
    end: Point
    low: float
    high: float
    empty: bool = False

    @property
    def axis(self) -> int:
        """0 if it is at one x, 1 if it is at one z."""
        return 0 if self.start[0] == self.end[0] else 1


@dataclass(frozen=True)
class HouseHole:
    """A door or a window.

    Attributes:
        kind: "Doorway", "Doorframe" or "Window".
        walls: the ids of the walls that it is in, the one that it is measured along first.
        left, right: its ends, from the first corner of that wall.
        low, high: its heights above the wall's lower edge.
        open: whether one can go, or look, through it.
    """

    id: str
    kind: str
    asset: str
    walls: tuple[str, ...]
    left: float
    right: float
    low: float
    high: float
    open: bool


@dataclass(frozen=True)
class HouseObject:
    """An object: the middle of its box and its Euler angles, and the id of what it lies in."""

    id: str
    asset: str
    position: tuple[float, float, float]
    rotation: tuple[float, float, float]
    openness: float = 0.0
    on: bool = False
    dirty: bool = False
    parent: str = ""


@dataclass(frozen=True)
class House:
    """A house. ``agent`` is x, z and heading of the pose that it gives, None if it gives none."""

    rooms: tuple[Room, ...]
    walls: tuple[HouseWall, ...]
    holes: tuple[HouseHole, ...]
    objects: tuple[HouseObject, ...]
    agent: tuple[float, float, float] | None


def read_house(data: Mapping[str, Any]) -> House:
    """Read a house.

    Raises:
        HouseError: it has no room, a value is missing or of the wrong kind, a wall is slanted, two
            objects have one id, or a door is in no wall.
    """
    if not isinstance(data, Mapping):
        raise HouseError(f"a house is a dictionary with rooms and walls, not {data!r:.60}")
    rooms = tuple(_room(each, k) for k, each in enumerate(_list(data, "rooms")))
    if not rooms:
        raise HouseError("the house has no rooms")
    walls = tuple(_wall(each, k) for k, each in enumerate(_list(data, "walls")))
    holes = (
        *(_hole(each, "doors", k) for k, each in enumerate(_list(data, "doors"))),
        *(_hole(each, "windows", k) for k, each in enumerate(_list(data, "windows"))),
    )
    objects = tuple(
        found for k, each in enumerate(_list(data, "objects")) for found in _objects(each, k, "")
    )
    ids = [*(each.id for each in objects), *(w.id for w in walls), *(h.id for h in holes)]
    twice = next((one for k, one in enumerate(ids) if one in ids[:k]), None)
    if twice is not None:
        raise HouseError(f"two parts of the house have the id {twice!r}")
    return House(rooms, walls, holes, objects, _agent(data))


def _list(data: Mapping[str, Any], key: str) -> Sequence[Mapping[str, Any]]:
    found = data.get(key) or []
    if not isinstance(found, list) or not all(isinstance(each, Mapping) for each in found):
        raise HouseError(f"{key} is a list of dictionaries, not {found!r:.60}")
    if len(found) > _MOST:
        raise HouseError(f"a house has {_MOST} {key} at most, not {len(found)}")
    return found


def _room(data: Mapping[str, Any], k: int) -> Room:
    where = f"rooms[{k}]"
    polygon = [_point(each, where) for each in data.get("floorPolygon") or ()]
    if len(polygon) < 4:
        raise HouseError(f"{where}: floorPolygon has four corners or more, not {len(polygon)}")
    corners = list(polygon)
    for i in range(len(corners)):  # corners that are meant to be in line are
        (x0, z0), (x1, z1) = corners[i - 1], corners[i]
        if abs(x0 - x1) >= _SAME and abs(z0 - z1) >= _SAME:
            raise HouseError(f"{where}: the edges of floorPolygon run along x or z; one is slanted")
        corners[i] = (x0 if abs(x0 - x1) < _SAME else x1, z0 if abs(z0 - z1) < _SAME else z1)
    corners[-1] = _in_line(corners[-1], corners[0])
    kind = str(data.get("roomType", "LivingRoom")).lower().replace(" ", "")
    return Room(
        str(data.get("id", f"room|{k}")), _CATEGORIES.get(kind, "living_rooms"), tuple(corners)
    )


def _in_line(one: Point, other: Point) -> Point:
    return (
        other[0] if abs(one[0] - other[0]) < _SAME else one[0],
        other[1] if abs(one[1] - other[1]) < _SAME else one[1],
    )


def _wall(data: Mapping[str, Any], k: int) -> HouseWall:
    where = f"walls[{k}]"
    corners = data.get("polygon") or ()
    heights = [_number(each, "y", where) for each in corners]
    if len(heights) < 4:
        raise HouseError(f"{where}: polygon has four corners, not {len(heights)}")
    low = [
        _point(c, where) for c, y in zip(corners, heights, strict=True) if y < min(heights) + _SAME
    ]
    if len(low) != 2:
        raise HouseError(f"{where}: two corners of polygon are at its lower edge, not {len(low)}")
    start, end = low[0], _in_line(low[1], low[0])
    if start[0] != end[0] and start[1] != end[1]:
        raise HouseError(f"{where}: walls run along x or z here; this one is slanted")
    ident, empty = str(data.get("id", f"wall|{k}")), bool(data.get("empty"))
    return HouseWall(ident, start, end, min(heights), max(heights), empty)


def _hole(data: Mapping[str, Any], key: str, k: int) -> HouseHole:
    where = f"{key}[{k}]"
    box = data.get("boundingBox") or {}
    corners = data.get("holePolygon") or [box.get("min"), box.get("max")]
    xs = [_number(each, "x", where) for each in corners]
    ys = [_number(each, "y", where) for each in corners]
    asset = str(data.get("assetId", ""))
    kind = "Window" if key == "windows" else "Doorframe" if "Doorframe" in asset else "Doorway"
    walls = tuple(str(data[each]) for each in ("wall0", "wall1") if data.get(each))
    if not walls:
        raise HouseError(f"{where}: it names no wall0")
    shut = kind == "Doorway" and not _number({"o": data.get("openness", 0.0)}, "o", where)
    ident = str(data.get("id", f"{kind.lower()}|{k}"))
    return HouseHole(ident, kind, asset, walls, min(xs), max(xs), min(ys), max(ys), not shut)


def _objects(data: Mapping[str, Any], k: int, parent: str) -> Iterator[HouseObject]:
    where = f"objects[{k}]" if not parent else f"children of {parent}"
    ident, asset = data.get("id"), data.get("assetId")
    if not isinstance(ident, str) or not isinstance(asset, str):
        raise HouseError(f"{where}: an object has an id and an assetId")
    turn, at = data.get("rotation") or {}, data.get("position")
    yield HouseObject(
        ident,
        asset,
        _triple(at, where),
        _triple({axis: turn.get(axis, 0.0) for axis in "xyz"}, where),
        min(max(_number({"o": data.get("openness") or 0.0}, "o", where), 0.0), 1.0),
        bool(data.get("isOn")),
        bool(data.get("isDirty")),
        parent,
    )
    for child in _list(data, "children"):
        yield from _objects(child, k, ident)


def _agent(data: Mapping[str, Any]) -> tuple[float, float, float] | None:
    agent = (data.get("metadata") or {}).get("agent")
    if not isinstance(agent, Mapping) or not isinstance(agent.get("position"), Mapping):
        return None
    turn = agent.get("rotation", 0.0)
    yaw = turn.get("y", 0.0) if isinstance(turn, Mapping) else turn
    x, z = _point(agent["position"], "metadata.agent.position")
    return x, z, _number({"y": yaw}, "y", "metadata.agent.rotation")


def _point(data: Any, where: str) -> Point:
    return _number(data, "x", where), _number(data, "z", where)


def _triple(data: Any, where: str) -> tuple[float, float, float]:
    return _number(data, "x", where), _number(data, "y", where), _number(data, "z", where)


def _number(data: Any, key: str, where: str) -> float:
    value = data.get(key) if isinstance(data, Mapping) else None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise HouseError(f"{where}: {key} is a number, not {value!r:.60}")
    if not abs(value) <= _LARGEST:
        raise HouseError(f"{where}: {key} is {_LARGEST:g} at most, not {value!r:.60}")
    return float(value)
