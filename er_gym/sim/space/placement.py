"""Free spots for an object in or on a receptacle."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.agent import Agent
from er_gym.sim.rotation import unity_rotation
from er_gym.sim.scene import PROPERTIES
from er_gym.sim.space.frustum import in_frustum
from er_gym.sim.space.recorded_surfaces import recorded_surfaces
from er_gym.sim.space.solids import solid_of
from er_gym.sim.space.solids.families import family
from er_gym.sim.world import World, upright_rotation

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class _Manner:
    """How a type of receptacle holds objects, if not side by side.

    Attributes:
        vessel: it holds one object, which may stick out over its rim.
        heaps: once it is full, objects lie on top of each other.
    """

    vessel: bool = False
    heaps: bool = False


_MANNERS_BY_TYPES = {
    "Box GarbageCan LaundryHamper Sink SinkBasin Bathtub BathtubBasin": _Manner(heaps=True),
    "Pot Pan Bowl Plate": _Manner(vessel=True, heaps=True),
    "Cup Mug Toaster CoffeeMachine StoveBurner ToiletPaperHanger HandTowelHolder "
    "TowelHolder": _Manner(vessel=True),
}
_MANNERS = {name: manner for names, manner in _MANNERS_BY_TYPES.items() for name in names.split()}
_SIDE_BY_SIDE = _Manner()
_STEP = 0.05
"""Spacing of the grid of spots, metres."""
_FINE_STEP = 0.02
"""The spacing in vessels and in tight spaces, metres."""
_SKIN = 0.005
"""Gap between objects, metres."""
_GIVE = 0.02
"""How much too large an object may be, metres: recorded boxes are generous."""
_RISES = 0.03
"""A fixed object is an obstacle on a surface if it rises above it by more than this, metres."""
_OVERHANG = 1.0
"""Objects farther from a receptacle than this are not obstacles, metres."""
_PICKUPABLE = PROPERTIES.index("pickupable")
_HOLES = frozenset({"Sink", "SinkBasin", "StoveBurner"})
"""Types that are built into a counter and leave no place for other objects."""
_INTO = 0.15
"""How far below a surface the top of these types may lie, metres."""


def surface_height(world: World, receptacle: int) -> float:
    """Height at which objects stand in or on a receptacle, metres.

    The height comes from recorded objects on that receptacle if there are any, else from its type.
    """
    low, high = world.low[receptacle, 1], world.high[receptacle, 1]
    recorded = recorded_surfaces(world.scene.name).get(receptacle)
    if recorded is not None:
        return float(low + recorded)
    share = _stand(world, receptacle)
    lift = min(0.02, 0.2 * (high - low)) if share is None else share * (high - low)
    return float(low + lift)


def _stand(world: World, receptacle: int) -> float | None:
    return family(world.types[receptacle], world.has(receptacle, "pickupable")).stand


def is_vessel(world: World, receptacle: int) -> bool:
    """Whether a receptacle holds one object, as a cup or a stove burner does."""
    return _manner(world, receptacle).vessel


def _manner(world: World, receptacle: int) -> _Manner:
    return _MANNERS.get(world.types[receptacle], _SIDE_BY_SIDE)


def _places(world: World, receptacle: int) -> Floats:
    """(R, 2, 2) corners x, z of the rectangles in or on a receptacle where objects can stand."""
    if world.types[receptacle] == "CounterTop":
        return solid_of(world, receptacle).boxes[:, :, [0, 2]]
    if _stand(world, receptacle) is None:
        return np.array([[world.low[receptacle], world.high[receptacle]]])[:, :, [0, 2]]
    return solid_of(world, receptacle).boxes[:1, :, [0, 2]]


def free_spots(
    world: World,
    i: int,
    receptacle: int,
    near: Floats,
    seen_by: Agent | None = None,
    squeeze: bool = True,
) -> Iterator[tuple[float, Floats]]:
    """Spots for object i in or on a receptacle, nearest to a (2,) x, z point first.

    Args:
        seen_by: spots in this agent's picture come before all others.
        squeeze: if no spot of the grid is free, look into the gaps between objects as well
            (:func:`_tight_spots`).

    Yields:
        The heading in degrees at which the object fits, and the (3,) centre of its box's underside.
    """
    if is_vessel(world, receptacle):
        yield from _in_vessel(world, i, receptacle)
        return
    height = surface_height(world, receptacle)
    obstacles, loose = _obstacles(world, receptacle, i, height)
    beside = _at_height(obstacles, height, _height(world, i))
    loose = loose[beside[: len(loose)]]
    free: list[Floats] = [np.empty((0, 3))]  # heading, x, z
    heaps: list[tuple[float, float, Floats]] = []
    heaping, places = _manner(world, receptacle).heaps, _places(world, receptacle)
    for yaw, half in _headings(world, i):
        spots = _spots(places, half)
        if heaping and len(spots):
            spots = spots[np.argsort(_distance(spots, near), kind="stable")]
            tops = _tops(spots, half, height, world.high[receptacle, 1], obstacles)
            k = int(tops.argmin())
            heaps.append((float(tops[k]), yaw, spots[k]))
        clear = spots[_free(spots, half, obstacles[beside])]
        free.append(np.column_stack([np.full(len(clear), yaw), clear]))
    found = np.concatenate(free)
    if squeeze and not len(found):
        found = _tight_spots(world, _headings(world, i), places, obstacles[beside], loose)
    order: list[NDArray[Any]] = [_distance(found[:, 1:], near)]
    if seen_by is not None:
        order.append(~_in_picture(world, seen_by, found[:, 1:], height))
    for k in np.lexsort(order):
        yield float(found[k, 0]), np.array([found[k, 1], height, found[k, 2]])
    for top, yaw, (x, z) in sorted(heaps, key=lambda heap: heap[0]):
        if top < world.high[receptacle, 1]:
            yield yaw, np.array([x, top + _SKIN, z])


def spawn_points(world: World, receptacle: int, seen_by: Agent | None) -> Floats:
    """(S, 3) points on the surface of a receptacle, free or not, metres.

    Args:
        seen_by: leave out points that are not in this agent's picture.
    """
    height = surface_height(world, receptacle)
    spots = np.unique(_spots(_places(world, receptacle), np.zeros(2)).round(6), axis=0)
    if seen_by is not None:
        spots = spots[_in_picture(world, seen_by, spots, height)]
    return np.column_stack([spots[:, 0], np.full(len(spots), height), spots[:, 1]])


def _distance(spots: Floats, near: Floats) -> Floats:
    """(S,) distances from (S, 2) spots to a (2,) point."""
    return np.asarray(np.hypot(spots[:, 0] - near[0], spots[:, 1] - near[1]))


def _in_picture(world: World, agent: Agent, spots: Floats, height: float) -> NDArray[np.bool_]:
    """(S,) whether each spot, (S, 2) x and z at one height, is in the agent's picture."""
    settings = world.settings
    points = np.column_stack([spots[:, 0], np.full(len(spots), height), spots[:, 1]])
    aspect = settings.width / settings.height
    return in_frustum(
        points - agent.camera, agent.rotation, agent.horizon, settings.field_of_view, aspect
    )


def _in_vessel(world: World, i: int, receptacle: int) -> Iterator[tuple[float, Floats]]:
    """Spots in a vessel, or on top of its contents, from the middle outwards."""
    inside = world.contents[receptacle]
    if inside and not _manner(world, receptacle).heaps:
        return
    base = max([surface_height(world, receptacle), *(float(world.high[c, 1]) for c in inside)])
    obstacles, _ = _obstacles(world, receptacle, i, base)
    obstacles = obstacles[_at_height(obstacles, base, _height(world, i))]
    places = np.array([[world.low[receptacle], world.high[receptacle]]])[:, :, [0, 2]]
    offcentre = _spots(places, np.zeros(2), _FINE_STEP)
    offcentre = offcentre[np.argsort(np.linalg.norm(offcentre - places.mean(axis=1), axis=1))]
    for spot in offcentre:
        for yaw, half in _headings(world, i):
            if _free(spot[None], half, obstacles)[0]:
                yield yaw, np.array([spot[0], base, spot[1]])


# -- the object ------------------------------------------------------------------------------------


def _headings(world: World, i: int) -> list[tuple[float, Floats]]:
    """Headings in degrees that align object i's box with the axes, each with the box's (2,)
    half-size."""
    tilt = upright_rotation(world.rotation[i], 0.0)
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


def _height(world: World, i: int) -> float:
    """Height of object i's box once it stands upright, metres."""
    edges = world.obb[i, 1:] @ unity_rotation(upright_rotation(world.rotation[i], 0.0)).T
    if np.isnan(edges).any():
        return float(world.high[i, 1] - world.low[i, 1])
    return float(np.abs(edges[:, 1]).sum())


# -- the spots -------------------------------------------------------------------------------------


def _spots(places: Floats, half: Floats, step: float = _STEP) -> Floats:
    """(S, 2) x, z spots in rectangles (R, 2, 2) where a box of half-size (2,) fits."""
    found = [np.empty((0, 2))]
    for low, high in places:
        if (2 * half > high - low + _GIVE).any():
            continue
        middle = (low + high) / 2
        counts = (np.maximum(0.0, (high - low) / 2 - half - _SKIN) / step).astype(int)
        axes = [middle[axis] + step * np.arange(-counts[axis], counts[axis] + 1) for axis in (0, 1)]
        found.append(np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 2))
    return np.concatenate(found)


def _obstacles(
    world: World, receptacle: int, i: int, height: float
) -> tuple[Floats, NDArray[np.intp]]:
    """The obstacles for object i in or on a receptacle.

    Loose objects count wherever they are, since they could be anywhere. Fixed objects count only on
    top of furniture, since the boxes of furniture with room inside overlap their neighbours.

    Returns:
        (Q, 2, 3) boxes, and the (L,) rows of the loose objects, whose boxes come first.
    """
    aside = {receptacle, i, *world.inside(i), *world.ancestors(receptacle)}
    on_top = _stand(world, receptacle) is not None and not is_vessel(world, receptacle)
    aside.update(world.of_type("Floor"))
    low, high = world.low[receptacle] - _OVERHANG, world.high[receptacle] + _OVERHANG
    low[1] = height - _INTO
    close = world.exists & (world.high > low).all(axis=1) & (world.low < high).all(axis=1)
    middle = (world.low[receptacle] + world.high[receptacle]) / 2
    loose = world.properties[:, _PICKUPABLE]
    # A drawer is part of a dresser, so the dresser is not an obstacle in it.
    around = (world.low <= middle).all(axis=1) & (middle <= world.high).all(axis=1)
    close &= loose | ~around
    close[list(aside)] = False
    things = np.flatnonzero(close & loose)
    boxes = [np.stack([world.low[things], world.high[things]], axis=1)]
    for k in np.flatnonzero(close & ~loose).tolist():
        if on_top and world.types[k] in _HOLES:
            hole = np.array([[world.low[k], world.high[k]]])
            hole[0, 1, 1] = max(world.high[k, 1], height + 2 * _SKIN)
            boxes.append(hole)
        elif on_top or world.has(k, "moveable"):
            parts = solid_of(world, k).boxes
            rises = _SKIN if world.has(k, "moveable") else _RISES
            boxes.append(parts[parts[:, 1, 1] > height + rises])
    return np.concatenate(boxes), things


def _free(spots: Floats, half: Floats, obstacles: Floats) -> NDArray[np.bool_]:
    """(S,) whether each spot is free of obstacles at the object's height."""
    low, high = obstacles[:, :, [0, 2]].swapaxes(0, 1)
    return np.asarray(~_overlap(spots, half + _SKIN, low, high).any(axis=1))


def _at_height(obstacles: Floats, height: float, tall: float) -> NDArray[np.bool_]:
    """(Q,) whether each box is at the height of an object that stands at ``height``."""
    return np.asarray((obstacles[:, 0, 1] < height + tall) & (obstacles[:, 1, 1] > height + _SKIN))


def _tight_spots(
    world: World,
    headings: list[tuple[float, Floats]],
    places: Floats,
    obstacles: Floats,
    loose: NDArray[np.intp],
) -> Floats:
    """(S, 3) heading, x and z of the free spots that a person would find among the clutter.

    An object that fits between upright boxes also fits where it touches one of them, or an edge, in
    x and one in z. So these spots are tried besides a fine grid. Loose objects take up their
    oriented boxes here, which are smaller than their axis-aligned ones.

    Args:
        headings: see :func:`_headings`.
        places: (R, 2, 2), see :func:`_places`.
        obstacles, loose: see :func:`_obstacles`; only those at the object's height.
    """
    low, high = obstacles[:, :, [0, 2]].swapaxes(0, 1)
    turned = [_footprint(world, k) for k in loose.tolist()]
    found = [np.empty((0, 3))]
    for yaw, half in headings:
        wide = half + _SKIN
        for place in places:
            if (2 * half > place[1] - place[0] + _GIVE).any():
                continue
            first, last = np.minimum(place[0] + wide, place.mean(axis=0)), place[1] - wide
            lines = []
            for axis in (0, 1):
                # The margin is for rounding: an exact touch could count as an overlap.
                touching = np.concatenate(
                    [low[:, axis] - wide[axis] - 1e-9, high[:, axis] + wide[axis] + 1e-9]
                )
                inside = (first[axis] < touching) & (touching < last[axis])
                end = max(last[axis], first[axis])
                grid = np.arange(first[axis], end, _FINE_STEP)
                lines.append(np.concatenate([grid, [end], touching[inside]]))
            spots = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 2)
            taken = _overlap(spots, wide, low, high)
            for k, (middle, edges) in enumerate(turned):
                taken[:, k] &= _overlap_turned(spots, wide, middle, edges)
            clear = spots[~taken.any(axis=1)]
            found.append(np.column_stack([np.full(len(clear), yaw), clear]))
    return np.concatenate(found)


def _footprint(world: World, k: int) -> tuple[Floats, Floats]:
    """Object k's box seen from above: (2,) x and z of its middle, and its (E, 2) edges."""
    middle = ((world.low[k] + world.high[k]) / 2)[[0, 2]]
    edges = world.obb[k, 1:] @ unity_rotation(world.rotation[k]).T
    if np.isnan(edges).any():
        return middle, np.diag((world.high[k] - world.low[k])[[0, 2]])
    return middle, edges[:, [0, 2]]


def _overlap_turned(
    spots: Floats, half: Floats, middle: Floats, edges: Floats
) -> NDArray[np.bool_]:
    """(S,) whether no edge of a footprint separates it from a box of half-size (2,) at each spot.

    The box overlaps the :func:`_footprint` if it also overlaps the axis-aligned box around that.
    """
    met = np.ones(len(spots), dtype=bool)
    for edge in edges:
        length = float(np.hypot(*edge))
        if length > _SKIN:
            across = np.array([-edge[1], edge[0]]) / length
            reach = np.abs(edges @ across).sum() / 2 + np.abs(across) @ half
            met &= np.abs((spots - middle) @ across) < reach
    return met


def _overlap(spots: Floats, half: Floats, low: Floats, high: Floats) -> NDArray[np.bool_]:
    """(S, Q) whether a box of half-size (2,) at each spot overlaps rectangles (Q, 2) to (Q, 2)."""
    x, z = spots[:, 0, None], spots[:, 1, None]
    found = (x > low[:, 0] - half[0]) & (x < high[:, 0] + half[0])
    found &= z > low[:, 1] - half[1]
    found &= z < high[:, 1] + half[1]
    return np.asarray(found)


def _tops(spots: Floats, half: Floats, height: float, rim: float, obstacles: Floats) -> Floats:
    """(S,) height of the heap under a box of half-size (2,) at each spot, below the rim, metres.

    Objects that begin above the rim are not part of the heap.
    """
    heaped = obstacles[(obstacles[:, 0, 1] < rim) & (obstacles[:, 1, 1] > height)]
    low, high = heaped[:, 0][:, [0, 2]], heaped[:, 1][:, [0, 2]]
    under = _overlap(spots, half, low, high)
    return np.asarray(np.where(under, heaped[:, 1, 1], height).max(axis=1, initial=height))
