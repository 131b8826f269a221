"""Soft shadows where things touch what they stand on: dark veils just above it.

A veil tints what is behind it and neither hides anything nor belongs to an instance. It reaches a
little beyond the thing's outline, farther on the side that is turned away from the windows, and
ends at the edge of what the thing stands on.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.floor_plan import floor_plan
from er_gym.sim.render.pieces import VERTEX, Piece
from er_gym.sim.render.soft_light import Daylight
from er_gym.sim.render.textures import VEIL_EDGE
from er_gym.sim.scene import load_scene
from er_gym.sim.space.solids import solid_of
from er_gym.sim.space.solids.built_in import Rectangle
from er_gym.sim.space.solids.carcass import carcass
from er_gym.sim.world import World

Floats = NDArray[np.float64]
VEIL = "veil"
"""The material of shadows."""
_NONE = frozenset(
    {
        "Blinds", "Cabinet", "Curtains", "Drawer", "Faucet", "Floor", "HandTowel",
        "HandTowelHolder", "LightSwitch", "Mirror", "Painting", "Poster", "Shelf", "ShowerCurtain",
        "ShowerDoor", "ShowerGlass", "ShowerHead", "Sink", "SinkBasin", "StoveBurner", "StoveKnob",
        "ToiletPaperHanger", "Towel", "TowelHolder", "Window", "BathtubBasin", "CounterTop",
        "Doorway", "Doorframe", "Wall",
    }
)  # fmt: skip
"""Types that hang on something or are built into it."""
_ROUND = frozenset({"DogBed", "FloorLamp", "GarbageCan", "HousePlant", "Stool", "DeskLamp"})
"""Types that are round, besides what can be picked up."""
_KEPT = 1024
_LIFT, _APART, _LAYERS = 0.003, 0.0004, 16
"""Of a veil above what it lies on, and how far apart veils are that may overlap, metres; and at how
many heights they are. One that is not below another would be hidden by it."""
_DARK, _DARKER, _TALL = 0.20, 0.26, 0.1
"""How dark the shadow of a flat thing is at its outline, and how much darker that of a thing which
is at least so tall, metres."""
_LEAST, _SHARE, _TALLEST = 0.012, 0.2, 0.8
"""The width of the shadow of a flat thing, metres; how much wider it is with each metre of height,
up to a height."""
_FADES = 0.45
"""The distance under a thing at which its shadow is gone, metres."""
_LEANS = 0.5
"""How far the outer edge is shifted away from the windows, as a share of the shadow's width."""
_ON_IT, _EDGE = 0.03, 0.01
_SEVERAL, _MOST = 0.6, 6
"""If no part of a thing covers such a share of its outline, its parts have shadows of their own, at
most so many."""
_CORNER = 0.3
"""How far inside the corners of its outline a round thing is, as a share of its half width."""
_UV = np.array([0.0, VEIL_EDGE, 1.0 - VEIL_EDGE, 1.0])
"""Where the lines of a veil's grid are in its texture."""


@dataclass(frozen=True)
class _Ground:
    """What a thing stands on: its height, and the rectangle that it covers, None for the floor."""

    height: float
    edges: Rectangle | None


@dataclass(frozen=True)
class _Print:
    """The outline of a thing: its middle (x, z), half sides, heading in radians, roundness, the
    height of what casts the shadow, and its distance from the ground."""

    middle: tuple[float, float]
    half: tuple[float, float]
    turn: float
    round: float
    tall: float
    above: float


def shade_of(world: World, i: int, order: int, day: Daylight) -> Piece | None:
    """The shadow of object i on what it stands on, in the room's frame; None if it has none.

    Args:
        order: in which it is drawn.
    """
    if world.types[i] in _NONE or i in world.carried:
        return None
    solid = solid_of(world, i)
    low = solid.boxes[:, 0].min(axis=0)
    ground = _ground(world, i, float(low[1]), solid.middle[[0, 2]])
    if ground is None:
        return None
    prints = tuple(_prints(world, i, float(low[1]) - ground.height))
    return _veil(prints, ground, _shift(day, solid.middle), order)


def shades_of_room(scene_name: str, day: Daylight) -> Piece | None:
    """The shadows of the carcasses of counters."""
    scene, plan, prints = load_scene(scene_name), floor_plan(scene_name), []
    for i, kind in enumerate(scene.types):
        if kind == "CounterTop":
            found = carcass(scene_name, i)
            tall = found.under - found.floor
            for x0, z0, x1, z1 in found.footprint:
                half = ((x1 - x0) / 2, (z1 - z0) / 2)
                prints.append(_Print(((x0 + x1) / 2, (z0 + z1) / 2), half, 0.0, 0.05, tall, 0.0))
    return _veil(tuple(prints), _Ground(plan.ground, None), (0.0, 0.0), 0)


def _ground(world: World, i: int, low: float, middle: Floats) -> _Ground | None:
    floor = floor_plan(world.scene.name).ground
    parents = [p for p in world.parents[i] if world.exists[p]]
    if not parents or world.types[parents[0]] == "Floor":
        return _Ground(floor, None) if low - floor < _FADES else None
    on = parents[0]
    if world.has(on, "pickupable"):
        return None
    boxes = solid_of(world, on).boxes
    inside = ((boxes[:, 0][:, [0, 2]] <= middle) & (middle <= boxes[:, 1][:, [0, 2]])).all(axis=1)
    tops = boxes[inside & (np.abs(boxes[:, 1, 1] - low) < _ON_IT)]
    if len(tops):
        (x0, _, z0), (x1, _, z1) = tops[
            np.prod(np.ptp(tops[:, :, [0, 2]], axis=1), axis=1).argmax()
        ]
    else:
        (x0, _, z0), (x1, _, z1) = world.low[on] + _EDGE, world.high[on] - _EDGE
    if not (x0 < middle[0] < x1 and z0 < middle[1] < z1):
        return None
    return _Ground(low, (float(x0), float(z0), float(x1), float(z1)))


def _prints(world: World, i: int, above: float) -> Iterator[_Print]:
    solid = solid_of(world, i)
    roundness = 1.0 if world.has(i, "pickupable") or world.types[i] in _ROUND else 0.3
    parts, turn = solid.upright, float(np.radians(solid.yaw))
    low, high = parts[:, 0].min(axis=0), parts[:, 1].max(axis=0)
    down = parts[parts[:, 0, 1] < low[1] + 0.05]
    area, whole = np.prod(np.ptp(down[:, :, [0, 2]], axis=1), axis=1), _area(low, high)
    several = area.max() < _SEVERAL * whole and len(down) <= _MOST
    cos, sin = float(np.cos(turn)), float(np.sin(turn))
    for a, b in [(low, high), *(down if several else ())]:
        x, _, z = ((a + b) / 2).tolist()
        at = solid.middle[[0, 2]] + (cos * x + sin * z, cos * z - sin * x)
        yield _Print(
            (float(at[0]), float(at[1])),
            (float(b[0] - a[0]) / 2, float(b[2] - a[2]) / 2),
            turn,
            roundness,
            float(high[1] - low[1]) * (0.5 if several else 1.0),
            above,
        )  # fmt: skip


def _area(low: Floats, high: Floats) -> float:
    return float((high[0] - low[0]) * (high[2] - low[2]))


def _shift(day: Daylight, middle: Floats) -> tuple[float, float]:
    """The direction (x, z) away from the windows, up to 1 long."""
    away = (middle - day.at)[:, [0, 2]].astype(np.float64)
    squared = (away**2).sum(axis=1) + 1.0
    x, z = (away / np.sqrt(squared)[:, None] * (day.areas / squared)[:, None]).sum(axis=0) / (
        day.areas / squared
    ).sum()
    return float(x), float(z)


@lru_cache(maxsize=_KEPT)
def _veil(
    prints: tuple[_Print, ...], ground: _Ground, shift: tuple[float, float], order: int
) -> Piece | None:
    rows = []
    for k, each in enumerate(prints):
        dark = (_DARK + _DARKER * min(1.0, each.tall / _TALL)) * (1.0 - each.above / _FADES)
        dark = min(dark, 1.0)  # what was pushed deep into the floor is below its shadow
        if dark > 0.0:
            rows.append(_rows(each, dark, ground, shift))
            layer = 1 + (order + k) % _LAYERS
            rows[-1]["at"][:, 2] = ground.height + _LIFT + _APART * layer
    if not rows:
        return None
    starts = len(_UV) ** 2 * np.arange(len(rows))[:, None, None]
    faces = (_FACES + starts).reshape(-1, 3).astype(np.uint16)
    vertices = np.concatenate(rows)
    return Piece(VEIL, vertices, np.zeros((len(vertices), 4), np.int8), faces)


def _rows(
    each: _Print, dark: float, ground: _Ground, shift: tuple[float, float]
) -> NDArray[np.void]:
    """The 16 vertices of a veil: a grid of four lines by four, in which the inner ones are at the
    thing's outline."""
    cos, sin = np.cos(each.turn), np.sin(each.turn)
    turn = np.array([[cos, -sin], [sin, cos]])  # of rows, clockwise seen from above
    half = np.array(each.half)
    corner = _CORNER * each.round * half.min()
    width = _LEAST + _SHARE * min(each.tall, _TALLEST) + corner
    lean = _LEANS * (width - corner) * (turn @ shift)
    inner, outer = half - corner, half - corner + width
    lines = np.stack([lean - outer, -inner, inner, lean + outer])  # (4, 2)
    grid = np.stack(np.meshgrid(lines[:, 0], lines[:, 1], indexing="ij"), axis=2).reshape(-1, 2)
    if ground.edges is not None:
        grid = _within(grid @ turn, each.middle, ground.edges) @ turn.T
    at = grid @ turn + each.middle
    rows = np.zeros(len(grid), dtype=VERTEX)
    rows["at"][:, 0], rows["at"][:, 1] = at[:, 0], at[:, 1]
    rows["colour"][:, 3] = dark * 255 + 0.5
    for axis in range(2):
        rows["uv"][:, axis] = np.interp(grid[:, axis], lines[:, axis], _UV)
    return rows


def _within(away: Floats, middle: tuple[float, float], edges: Rectangle) -> Floats:
    """Points, as offsets from a middle, drawn towards it until they are in a rectangle."""
    room = np.where(away > 0.0, np.subtract(edges[2:], middle), np.subtract(edges[:2], middle))
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(away != 0.0, room / away, np.inf).min(axis=1)
    return np.asarray(away * np.clip(share, 0.0, 1.0)[:, None])


def _faces() -> NDArray[np.int64]:
    """(18, 3) the triangles of a grid, facing up."""
    corner = np.add.outer(np.arange(3) * 4, np.arange(3)).reshape(-1)
    a, b, c, d = corner, corner + 1, corner + 5, corner + 4
    return np.concatenate([np.stack([a, c, b], axis=1), np.stack([a, d, c], axis=1)])


_FACES = _faces()
