"""A scene from a house: the same tables as those of a recorded room, and a shell."""

from __future__ import annotations

import json
from collections import OrderedDict
from collections.abc import Mapping, Sequence
from dataclasses import replace
from hashlib import blake2b
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.house.assets import known_types
from er_gym.sim.house.floor import free_floor, largest_part, part_with
from er_gym.sim.house.rows import Row, floor_row, hole_rows, object_rows, wall_row
from er_gym.sim.house.schema import House, HouseError, HouseWall, read_house
from er_gym.sim.house.walls import PlacedHole, placed_holes, wall_boxes
from er_gym.sim.remembering import get_or_compute
from er_gym.sim.scene import HOUSES, Scene
from er_gym.sim.settings import Settings
from er_gym.sim.shell import Opening, Shell
from er_gym.sim.space.reachable_positions import Grid
from er_gym.sim.space.receptacles import receptacles_of
from er_gym.sim.space.recorded_floor import RECORDED_STEP
from er_gym.sim.space.walkable_floor import CELL, Floor
from er_gym.sim.world import World

_KEPT = 16
_scenes: OrderedDict[str, Scene] = OrderedDict()
_STRUCTURE = frozenset({"Wall", "Doorway", "Doorframe"})
_LARGEST = 4_000_000
"""The most cells of a floor."""
EMPTY: Mapping[str, Any] = {
    "rooms": [
        {
            "id": "room|0",
            "roomType": "LivingRoom",
            "floorPolygon": [
                {"x": x, "y": 0.0, "z": z} for x, z in ((-5, -5), (-5, 5), (5, 5), (5, -5))
            ],
        }
    ]
}
"""What AI2-THOR's scene "Procedural" is before a house is created: here a bare floor."""


def house_scene(data: Mapping[str, Any]) -> Scene:
    """The scene of a house in ProcTHOR's JSON. The same house is the same scene.

    Raises:
        HouseError: the house cannot be built; the message says why.
    """
    try:
        text = json.dumps(data, sort_keys=True, allow_nan=False)
    except (TypeError, ValueError) as error:
        raise HouseError(f"a house is plain JSON: {error}") from None
    name = "House_" + blake2b(text.encode(), digest_size=8).hexdigest()
    return get_or_compute(_scenes, name, _KEPT, lambda: HOUSES.get(name) or _build(name, data))


def _build(name: str, data: Mapping[str, Any]) -> Scene:
    house = read_house(data)
    holes = placed_holes(house)
    ground, ceiling = _heights(house)
    known, others = _known_first(list(object_rows(house.objects)))
    doors = list(hole_rows(holes))
    windows = [row for row in doors if row.type == "Window"]
    boxes = _walls(house, holes)
    rows = [
        floor_row(house, ground),
        *known,
        *windows,
        *others,
        *(row for row in doors if row.type != "Window"),
        *(wall_row(ident, found) for ident, found in boxes.items()),
    ]
    index = {row.id: i for i, row in enumerate(rows)}
    shell = Shell(
        rooms=house.rooms,
        openings=(
            *(_opening(hole) for hole in holes if hole.hole.open),
            *(_gap(wall) for wall in house.walls if wall.empty),
        ),
        walls={index[ident]: found for ident, found in boxes.items()},
        ground=ground,
        ceiling=ceiling,
        start=(0.0, 0.0, 0.0),
        origin=np.zeros(2),
        free=np.zeros((1, 1), dtype=bool),
    )
    (x0, z0), (x1, z1) = shell.bounds
    if (x1 - x0) * (z1 - z0) > _LARGEST * CELL * CELL:
        raise HouseError(f"the house is {x1 - x0:.0f} by {z1 - z0:.0f} m, which is too large")
    draft = _scene(f"{name}_draft", rows, shell)
    HOUSES[draft.name] = draft
    return _furnished(name, draft, house, rows, index)


def _heights(house: House) -> tuple[float, float]:
    if not house.walls:
        return 0.0, 3.0
    return min(w.low for w in house.walls), max(w.high for w in house.walls)


def _known_first(rows: Sequence[Row]) -> tuple[list[Row], list[Row]]:
    """Objects of the types that recorded rooms have, and others."""
    known = known_types()
    return [r for r in rows if r.type in known], [r for r in rows if r.type not in known]


def _walls(house: House, holes: Sequence[PlacedHole]) -> dict[str, NDArray[np.float64]]:
    """The boxes of each wall. Of two walls at one place, those of both rooms, one is kept."""
    found: dict[str, NDArray[np.float64]] = {}
    seen: set[bytes] = set()
    for wall in (each for each in house.walls if not each.empty):
        boxes = wall_boxes(wall, holes)
        key = boxes.round(2).tobytes()
        if len(boxes) and key not in seen:
            seen.add(key)
            found[wall.id] = boxes
    return found


def _opening(hole: PlacedHole) -> Opening:
    axis = hole.wall.axis
    return Opening(
        hole.hole.kind == "Window",
        axis,
        hole.wall.start[axis],
        (hole.low, hole.high),
        (hole.bottom, hole.top),
    )


def _gap(wall: HouseWall) -> Opening:
    """The opening where a wall is left out."""
    low, high = sorted((wall.start[1 - wall.axis], wall.end[1 - wall.axis]))
    return Opening(False, wall.axis, wall.start[wall.axis], (low, high), (wall.low, wall.high))


def _scene(name: str, rows: Sequence[Row], shell: Shell) -> Scene:
    flags = [row.flags for row in rows]
    return Scene(
        name=name,
        object_ids=tuple(row.id for row in rows),
        names=tuple(row.id for row in rows),
        types=tuple(row.type for row in rows),
        asset_ids=tuple(row.asset for row in rows),
        position=np.array([row.middle for row in rows]),
        rotation=np.array([row.rotation for row in rows]),
        aabb_center=np.array([row.middle for row in rows]),
        aabb_size=np.array([row.extent for row in rows]),
        obb=np.array([row.obb for row in rows]),
        properties=np.array([has for has, _ in flags]),
        states=np.array([states for _, states in flags]),
        openness=np.array([row.openness for row in rows]),
        mass=np.array([row.mass for row in rows]),
        temperature=("RoomTemp",) * len(rows),
        salient_materials=tuple(row.materials for row in rows),
        parents=((),) * len(rows),
        controlled=tuple(() if "toggleable" in row.has else None for row in rows),
        reachable=np.zeros((0, 2)),
        openable_poses={},
        shell=shell,
    )


def _furnished(
    name: str, draft: Scene, house: House, rows: Sequence[Row], index: Mapping[str, int]
) -> Scene:
    """The scene with its floor, the agent's place on it, and what lies in what."""
    shell = draft.shell
    assert shell is not None
    origin, free = free_floor(draft, shell)
    if not free.any():
        raise HouseError("there is no floor in the house on which the agent can stand")
    x, z, yaw = house.agent or (np.nan, np.nan, 0.0)
    cell = np.round((np.array([x, z]) - origin) / CELL)
    there = bool((cell >= 0).all() and (cell < free.shape).all()) and bool(
        free[tuple(cell.astype(int))]
    )
    free = part_with(free, (int(cell[0]), int(cell[1]))) if there else largest_part(free)
    floor = Floor(origin, free, free, free)
    if not there:
        x, z = _in_the_open(floor)
    grid = Grid(floor, np.zeros((0, 2)), RECORDED_STEP, 0.0, (0.0, 0.0))
    nodes = floor.grid(RECORDED_STEP, (0.0, 0.0))
    if not len(nodes):
        raise HouseError("there is no place in the house on the grid of 0.25 m")
    nearest = nodes[np.linalg.norm(nodes - (x, z), axis=1).argmin()]
    scene = replace(
        draft,
        name=name,
        parents=_parents(draft, index, rows),
        reachable=grid.reachable_from(nearest).copy(),
        shell=replace(shell, start=(float(x), float(z), yaw % 360.0), origin=origin, free=free),
    )
    HOUSES[name] = scene
    return scene


def _in_the_open(floor: Floor) -> tuple[float, float]:
    """The node of the grid that is nearest to the middle of the floor."""
    nodes = floor.grid(RECORDED_STEP, (0.0, 0.0))
    if not len(nodes):
        return 0.0, 0.0
    middle = nodes.mean(axis=0)
    x, z = nodes[np.linalg.norm(nodes - middle, axis=1).argmin()].tolist()
    return x, z


def _parents(
    draft: Scene, index: Mapping[str, int], rows: Sequence[Row]
) -> tuple[tuple[int, ...], ...]:
    """The receptacles of every object: by its place, and that which the house names."""
    world = World.load(draft, Settings())
    found: list[tuple[int, ...]] = []
    for i, row in enumerate(rows):
        if row.type in _STRUCTURE or row.type in ("Floor", "Window"):
            found.append(())
            continue
        if not row.has & {"pickupable", "moveable"} and not row.parent:
            found.append(())
            continue
        lies_in = receptacles_of(world, i)
        named = index.get(row.parent) if row.parent else None
        if named is not None and named not in lies_in:
            inner = [r for r in lies_in if rows[r].id.startswith(f"{row.parent}|")]
            lies_in = (*inner, named)
        world.parents[i] = lies_in
        found.append(lies_in)
    return tuple(found)
