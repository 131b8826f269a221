"""Light from where it comes from: windows, or a lamp on the ceiling, and the lamps that are on.

It is computed once for each vertex, by closed forms, as a factor of the colour that
:mod:`er_gym.sim.render.lighting` gives. A surface is lit by what it can be turned to: nothing casts
a shadow here (see :mod:`er_gym.sim.render.shades`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from er_gym.sim.render.floor_plan import floor_plan
from er_gym.sim.render.materials import MATERIALS
from er_gym.sim.render.pieces import Piece
from er_gym.sim.render.place import Place, in_room
from er_gym.sim.scene import load_scene
from er_gym.sim.shell import Shell
from er_gym.sim.space.solids import solid_of
from er_gym.sim.world import World

Floats = NDArray[np.float32]
_AROUND, _UP = 0.74, 0.05
"""Light that comes from everywhere, and how much more of it comes from above."""
_DAY, _HALF = 0.62, 0.35
"""The most that windows add, and the light from them at which half of that is reached."""
_NEAR = 1.2
"""Square metres that are added to squared distances, since windows are no points."""
_WRAP = 0.35
"""How far beyond its edge a surface is still lit, as a cosine."""
_INTO = 0.3
"""Distance from a window to a point in its room, metres."""
_LEAST, _MOST = 0.55, 1.4
_WHITE = 248.0
"""The lightest colour. The software rasteriser computes colours a little beyond a triangle's edge,
and they would go on at 0 after 255."""
_CEILING_AREA = 2.5
"""Of the lamp on the ceiling of rooms without windows, square metres."""
_WARM = (1.0, 0.76, 0.44)
_LAMPS = {"FloorLamp": (1.1, 0.95), "DeskLamp": (0.8, 0.6), "Candle": (0.45, 0.3)}
"""The types of lamps: their strength, and the distance at which a quarter of it is left, metres."""
_BULB = 0.75
"""The height of a lamp's light, as a share of the lamp's."""
REACH = 4.0
"""How many times that distance a lamp's light goes."""


@dataclass(frozen=True, eq=False)
class Daylight:
    """The light of a room while no lamp is on.

    Attributes:
        at, into: (W, 3) the middles of its windows, and the directions in which they shine.
        areas: (W,) square metres.
        even: a factor that makes the mean over the room's own surfaces 1.
    """

    at: Floats
    into: Floats
    areas: Floats
    even: float = 1.0


@dataclass(frozen=True)
class Lamp:
    """A lamp that is on: the place of its light, its strength, and its range in metres."""

    at: tuple[float, float, float]
    strength: float
    range: float


def daylight(scene_name: str, shell: Sequence[Piece]) -> Daylight:
    """The daylight of a scene, whose own surfaces are ``shell``."""
    scene, plan = load_scene(scene_name), floor_plan(scene_name)
    middle = np.insert(scene.reachable.mean(axis=0), 1, (plan.ground + plan.ceiling) / 2)
    at, into, areas = [], [], []
    for i, kind in enumerate(scene.types):
        if kind == "Window":
            centre, size = scene.aabb_center[i], scene.aabb_size[i]
            axis = 0 if size[0] < size[2] else 2
            out = np.zeros(3)
            out[axis] = _inward(scene.shell, centre, axis) or (
                np.sign(middle[axis] - centre[axis]) or 1.0
            )
            at.append(centre)
            into.append(out)
            areas.append(float(size[2 - axis] * size[1]))
    if not at:
        at.append(np.array([middle[0], plan.ceiling - 0.05, middle[2]]))
        into.append(np.array([0.0, -1.0, 0.0]))
        areas.append(_CEILING_AREA)
    light = Daylight(_single(at), _single(into), _single(areas))
    levels = [_level(light, *in_room(piece, Place())) for piece in shell]
    return replace(light, even=1.0 / float(np.concatenate(levels).mean()))


def _inward(shell: Shell | None, centre: NDArray[np.float64], axis: int) -> float:
    """1 or -1, the direction along an axis in which a house's room lies; 0 if that is not known."""
    if shell is None:
        return 0.0
    points = np.repeat(centre[None], 2, axis=0)
    points[:, axis] += (-_INTO, _INTO)
    below, above = np.any([room.contains(*points.T[::2]) for room in shell.rooms], axis=0).tolist()
    return float(above) - float(below)


def lamps_on(world: World) -> tuple[Lamp, ...]:
    """The lamps of a world that are on. One in the hand lights nothing."""
    found, hand = [], world.carried
    for kind, (strength, distance) in _LAMPS.items():
        for i in world.of_type(kind):
            if world.state(i, "isToggled") and not world.hidden[i] and i not in hand:
                solid = solid_of(world, i)
                low, high = solid.boxes[:, 0].min(axis=0), solid.boxes[:, 1].max(axis=0)
                x, y, z = (low + (high - low) * (0.5, _BULB, 0.5)).tolist()
                found.append(Lamp((x, y, z), strength, distance))
    return tuple(found)


def lit(piece: Piece, place: Place, day: Daylight, lamps: Sequence[Lamp]) -> Piece:
    """A piece in this light. What glows and what is transparent stays as it is."""
    surface = MATERIALS[piece.material]
    if surface.glows or surface.glass:
        return piece
    points, normals = in_room(piece, place)
    level = np.clip(day.even * _level(day, points, normals), _LEAST, _MOST)[:, None]
    factor = level + sum(_lamplight(lamp, points, normals) for lamp in lamps)
    vertices = piece.vertices.copy()
    colours = vertices["colour"][:, :3] * factor
    # All channels of what would be too light are lowered alike, so that it keeps its colour.
    colours *= np.minimum(_WHITE / np.maximum(colours.max(axis=1, keepdims=True), 1.0), 1.0)
    vertices["colour"][:, :3] = colours + 0.5
    return replace(piece, vertices=vertices)


def _single(values: ArrayLike) -> Floats:
    return np.asarray(values, dtype=np.float32)


def _level(light: Daylight, points: Floats, normals: Floats) -> Floats:
    """(V,) brightness at points with normals, both (V, 3)."""
    away = light.at - points[:, None]
    squared = np.einsum("vwk,vwk->vw", away, away)
    away /= np.sqrt(squared)[..., None] + np.float32(1e-6)
    facing = np.clip((np.einsum("vwk,vk->vw", away, normals) + _WRAP) / (1 + _WRAP), 0.0, 1.0)
    inward = 0.25 + 0.75 * np.clip(-np.einsum("vwk,wk->vw", away, light.into), 0.0, 1.0)
    shine = (facing * inward * light.areas / (squared + _NEAR)).sum(axis=1)
    return np.asarray(
        _AROUND + _UP * normals[:, 1] + _DAY * shine / (shine + _HALF), dtype=np.float32
    )


def _lamplight(lamp: Lamp, points: Floats, normals: Floats) -> Floats:
    """(V, 3) what a lamp adds to the brightness; nothing beyond its reach."""
    away = np.asarray(lamp.at, np.float32) - points
    squared = np.einsum("vk,vk->v", away, away)
    away /= np.sqrt(squared)[:, None] + np.float32(1e-6)
    facing = np.clip((np.einsum("vk,vk->v", away, normals) + _WRAP) / (1 + _WRAP), 0.0, 1.0)
    far = squared / np.float32(lamp.range) ** 2
    fall = np.clip(1.0 / (1.0 + far) ** 2 - 1.0 / (1.0 + REACH**2) ** 2, 0.0, None)
    return np.outer(lamp.strength * facing * fall, _WARM).astype(np.float32)
