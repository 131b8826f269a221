"""Where there is room for an object in or on a receptacle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.scene import PROPERTIES, load_scene
from er_gym.sim.space.rotation import unity_rotation
from er_gym.sim.world import World, settled


@dataclass(frozen=True)
class _Room:
    """How a type of receptacle takes things.

    Attributes:
        surface: where things stand, as a fraction of the box's height; None for near its floor.
        vessel: it is made for one thing, which may stick out over its rim.
        heaps: when it is full, things lie on top of each other.
    """

    surface: float | None = None
    vessel: bool = False
    heaps: bool = False


_ROOMS_BY_TYPES = {
    "Shelf Drawer Cabinet Fridge Microwave Safe Cart": _Room(),
    "Box GarbageCan LaundryHamper Sink SinkBasin Bathtub BathtubBasin": _Room(heaps=True),
    "Pot Pan Bowl Plate": _Room(vessel=True, heaps=True),
    "Cup Mug Toaster CoffeeMachine": _Room(vessel=True),
    "StoveBurner ToiletPaperHanger HandTowelHolder TowelHolder": _Room(surface=1.0, vessel=True),
    # Backs and rims rise above these.
    "Sofa ArmChair Chair": _Room(surface=0.5),
    "Bed": _Room(surface=0.55),
    "Toilet": _Room(surface=0.95),
}
_ROOMS = {name: room for names, room in _ROOMS_BY_TYPES.items() for name in names.split()}
_ON_TOP = _Room(surface=1.0)
_STEP = 0.05
"""Spacing of the spots that are tried, metres."""
_SKIN = 0.005
"""Gap that is left between things, metres."""
_GIVE = 0.02
"""How much a thing may be too large, metres: recorded boxes are generous."""
_AGENT_RADIUS = 0.2


@lru_cache(maxsize=128)
def _recorded_surfaces(scene_name: str) -> dict[int, float]:
    """Receptacle row to how far above its box's floor the record shows things to stand, metres."""
    scene = load_scene(scene_name)
    bottoms = scene.aabb_center[:, 1] - scene.aabb_size[:, 1] / 2
    lies_in: dict[int, list[float]] = {}
    carried = scene.properties[:, PROPERTIES.index("pickupable")]
    for i in np.flatnonzero(carried):
        for receptacle in scene.parents[i]:
            lies_in.setdefault(receptacle, []).append(bottoms[i] - bottoms[receptacle])
    return {receptacle: float(np.median(heights)) for receptacle, heights in lies_in.items()}


def surface_height(world: World, receptacle: int) -> float:
    """Height at which things stand in or on a receptacle, metres.

    Taken from what the record shows standing there, where it shows anything, else from the type.
    """
    low, high = world.low[receptacle, 1], world.high[receptacle, 1]
    recorded = _recorded_surfaces(world.scene.name).get(receptacle)
    if recorded is not None:
        return float(low + recorded)
    share = _room(world, receptacle).surface
    lift = min(0.02, 0.2 * (high - low)) if share is None else share * (high - low)
    return float(low + lift)


def _room(world: World, receptacle: int) -> _Room:
    return _ROOMS.get(world.types[receptacle], _ON_TOP)


def _headings(world: World, i: int) -> list[tuple[float, NDArray[np.float64]]]:
    """Headings in degrees that align object i's box with the axes, and its (2,) half-size then."""
    tilt = settled(world.rotation[i], 0.0)
    edges = world.obb[i, 1:] @ unity_rotation(tilt).T
    if np.isnan(edges).any():
        return [(world.rotation[i, 1], (world.high[i] - world.low[i])[[0, 2]] / 2)]
    longest = edges[np.argmax(np.linalg.norm(edges[:, [0, 2]], axis=1))]
    angle = float(np.degrees(np.arctan2(longest[0], longest[2])))
    found = []
    for yaw in (-angle, 90.0 - angle):
        turned = edges @ unity_rotation(np.array([0.0, yaw, 0.0])).T
        found.append((yaw % 360.0, np.abs(turned[:, [0, 2]]).sum(axis=0) / 2))
    return found


def _spots(world: World, receptacle: int, half: NDArray[np.float64]) -> NDArray[np.float64]:
    """(S, 2) x, z centres on the receptacle where a thing of half-size (2,) does not overhang."""
    low = world.low[receptacle, [0, 2]] + half + _SKIN
    high = world.high[receptacle, [0, 2]] - half - _SKIN
    middle = (low + high) / 2
    axes = []
    for axis in (0, 1):
        reach = max(0.0, high[axis] - middle[axis])
        count = int(reach / _STEP)
        axes.append(middle[axis] + _STEP * np.arange(-count, count + 1))
    return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2)


def _obstacles(world: World, receptacle: int, moving: list[int]) -> NDArray[np.int64]:
    """What stands in the way there: what lies in it already and, on open surfaces, loose things."""
    inside = set(world.contents[receptacle])
    if _room(world, receptacle).surface is not None:
        inside.update(
            int(i)
            for i in np.flatnonzero(world.exists)
            if world.has(int(i), "pickupable") or world.has(int(i), "moveable")
        )
    inside -= {receptacle, *moving, *world.ancestors(receptacle)}
    return np.array(sorted(inside), dtype=np.int64)


def free_spots(
    world: World, i: int, receptacle: int, near: NDArray[np.float64]
) -> Iterator[tuple[float, NDArray[np.float64]]]:
    """Spots for object i in or on a receptacle, nearest to a (2,) x, z point first.

    Yields:
        The heading in degrees at which it fits, and the (3,) centre of its box's underside.
    """
    room = _room(world, receptacle)
    if room.vessel:
        yield from _in_vessel(world, i, receptacle)
        return
    height = surface_height(world, receptacle)
    obstacles = _obstacles(world, receptacle, [i, *world.inside(i)])
    tall = _height(world, i)
    heap: list[tuple[float, float, NDArray[np.float64]]] = []
    for yaw, half in _headings(world, i):
        size = world.high[receptacle, [0, 2]] - world.low[receptacle, [0, 2]]
        if (2 * half > size + _GIVE).any():
            continue
        spots = _spots(world, receptacle, half)
        spots = spots[np.argsort(np.linalg.norm(spots - near, axis=1), kind="stable")]
        free = _free(world, spots, half, height, tall, obstacles)
        if world.types[receptacle] == "CounterTop":
            free &= _off_the_floor(world, spots)
        for x, z in spots[free]:
            yield yaw, np.array([x, height, z])
        if room.heaps:
            tops = _tops(world, spots, half, height, obstacles)
            k = int(tops.argmin())
            heap.append((float(tops[k]), yaw, spots[k]))
    for top, yaw, (x, z) in sorted(heap, key=lambda found: found[0]):
        if top < world.high[receptacle, 1]:
            yield yaw, np.array([x, top + _SKIN, z])


def _height(world: World, i: int) -> float:
    """How high object i stands once it is set straight, metres."""
    edges = world.obb[i, 1:] @ unity_rotation(settled(world.rotation[i], 0.0)).T
    if np.isnan(edges).any():
        return float(world.high[i, 1] - world.low[i, 1])
    return float(np.abs(edges[:, 1]).sum())


def _in_vessel(
    world: World, i: int, receptacle: int
) -> Iterator[tuple[float, NDArray[np.float64]]]:
    """The one place in a thing that is made for one thing, or on top of what is in it already."""
    inside = world.contents[receptacle]
    if inside and not _room(world, receptacle).heaps:
        return
    base = max([surface_height(world, receptacle), *(float(world.high[c, 1]) for c in inside)])
    middle = (world.low[receptacle] + world.high[receptacle]) / 2
    for yaw, _ in _headings(world, i):
        yield yaw, np.array([middle[0], base, middle[2]])


def _tops(
    world: World,
    spots: NDArray[np.float64],
    half: NDArray[np.float64],
    height: float,
    obstacles: NDArray[np.int64],
) -> NDArray[np.float64]:
    """(S,) height of the top of the heap under a thing of half-size (2,) at each spot, metres."""
    low, high = world.low[obstacles][:, [0, 2]], world.high[obstacles][:, [0, 2]]
    under = ((spots[:, None] + half > low[None]) & (spots[:, None] - half < high[None])).all(axis=2)
    return np.asarray(np.where(under, world.high[obstacles, 1], height).max(axis=1, initial=height))


def _free(
    world: World,
    spots: NDArray[np.float64],
    half: NDArray[np.float64],
    height: float,
    tall: float,
    obstacles: NDArray[np.int64],
) -> NDArray[np.bool_]:
    """(S,) which spots overlap none of the obstacles' boxes."""
    low, high = world.low[obstacles], world.high[obstacles]
    same_height = (low[:, 1] < height + tall) & (high[:, 1] > height + _SKIN)
    low, high = low[same_height][:, [0, 2]], high[same_height][:, [0, 2]]
    clear = half + _SKIN
    centres = spots[:, None]
    overlap = (centres + clear > low[None]) & (centres - clear < high[None])
    return np.asarray(~np.any(np.all(overlap, axis=2), axis=1))


def _off_the_floor(world: World, spots: NDArray[np.float64]) -> NDArray[np.bool_]:
    """(S,) which spots are not above floor that the agent's body sweeps.

    The box of a counter that bends covers free floor too; the recorded positions tell where.
    """
    reachable = world.scene.reachable
    gaps = np.linalg.norm(spots[:, None] - reachable[None], axis=2).min(axis=1)
    return np.asarray(gaps > _AGENT_RADIUS)
