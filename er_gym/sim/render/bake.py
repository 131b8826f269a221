"""What a room looks like as recorded, kept on disk: shapes take long to make and are soon read.

A bake holds the room's own triangles and those of each object at its recorded place and in its
recorded state, whether it is hidden or not. It is made when the room is first drawn. Its name
depends on the source of all that makes it. Objects whose shapes another package adds are not in it,
since their source is not known.
"""

from __future__ import annotations

import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from hashlib import blake2b
from typing import Any

import msgpack  # type: ignore[import-untyped]
import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.appearance import Appearance, compute_appearance
from er_gym.sim.render.carcasses import carcasses
from er_gym.sim.render.fixtures import fixtures
from er_gym.sim.render.lighting import lit_colours
from er_gym.sim.render.pieces import Piece, packed, piece_of, pieces_of, unpacked
from er_gym.sim.render.place import Place, place_of
from er_gym.sim.render.room_shell import room_shell
from er_gym.sim.render.shades import shade_of, shades_of_room
from er_gym.sim.render.shapes import UNSEEN, build, is_added
from er_gym.sim.render.soft_light import Daylight, daylight
from er_gym.sim.scene import load_scene, scene_file
from er_gym.sim.settings import Settings
from er_gym.sim.source_key import source_key
from er_gym.sim.space.solids.solid import Solid, solid_of
from er_gym.sim.world import World
from er_gym.writing import kept

Pieces = tuple[Piece, ...]
_BAKES = 24
"""Rooms whose bakes are kept in memory; others are read again."""
_HEADING = 1.0
"""Headings are rounded to a multiple of this for lighting, degrees."""
_FASTEST = 1


@dataclass(frozen=True, eq=False)
class Bake:
    """A room as recorded.

    Attributes:
        around: the parts of the room that are no objects, by name, in the order of drawing.
        floor: the object of type Floor.
        recorded: for the rows of objects their look and their place.
        looks: the pieces of each look.
        day: the room's daylight.
        shades: for the rows of objects their shadows, and for -1 those of the room itself.
    """

    around: Mapping[str, Pieces]
    floor: Pieces
    recorded: Mapping[int, tuple[str, Place]]
    looks: Mapping[str, Pieces]
    day: Daylight
    shades: Mapping[int, Piece]


@lru_cache(maxsize=_BAKES)
def bake_of(scene_name: str) -> Bake:
    """The bake of a scene, out of the user's cache if it is there; houses are not kept there."""
    scene = load_scene(scene_name)
    if scene.shell is not None:
        return _without_added(_made(scene_name), scene.types)
    data = blake2b(scene_file(scene_name).read_bytes(), digest_size=8).hexdigest()
    name = f"{scene_name}-{data}.bake"
    bake = _read(kept("render", source_key(), name, lambda: _written(_made(scene_name))))
    return _without_added(bake, scene.types)


def look_of(seen: Appearance, heading: float) -> str:
    """A short name of what an object looks like at a heading."""
    return blake2b(f"{heading} {seen!r}".encode(), digest_size=8).hexdigest()


def heading_of(solid: Solid) -> float:
    """The heading of an object that its light is computed for, degrees."""
    return round(solid.yaw / _HEADING) * _HEADING % 360.0


def pieces_of_look(seen: Appearance, heading: float) -> Pieces:
    """The pieces of an object, made anew."""
    return tuple(
        piece_of(name, patch, lit_colours(name, patch, heading, seen.size[1], seen.height))
        for name, patch in build(seen).items()
    )


def _made(scene_name: str) -> Bake:
    world, shell = World.load(load_scene(scene_name), Settings()), room_shell(scene_name)
    recorded: dict[int, tuple[str, Place]] = {}
    looks: dict[str, Pieces] = {}
    for i, kind in enumerate(world.types):
        if kind not in UNSEEN and not is_added(kind):
            solid, seen = solid_of(world, i), compute_appearance(world, i)
            heading = heading_of(solid)
            look = look_of(seen, heading)
            recorded[i] = look, place_of(solid)
            if look not in looks:
                looks[look] = pieces_of_look(seen, heading)
    around = {
        "room": pieces_of(shell.rest),
        "fixtures": pieces_of(fixtures(scene_name)),
        "carcasses": pieces_of(carcasses(scene_name)),
    }
    floor = pieces_of(shell.floor)
    day = daylight(scene_name, (*around["room"], *floor))
    shades = {-1: shades_of_room(scene_name, day)}
    shades.update((i, shade_of(world, i, i, day)) for i in range(len(world)))
    return Bake(around, floor, recorded, looks, day, {i: s for i, s in shades.items() if s})


def _without_added(bake: Bake, types: Sequence[str]) -> Bake:
    """A bake without the objects that another package has given its own shapes since."""
    recorded = {i: row for i, row in bake.recorded.items() if not is_added(types[i])}
    looks = {look: bake.looks[look] for look, _ in recorded.values()}
    return replace(bake, recorded=recorded, looks=looks)


def _written(bake: Bake) -> bytes:
    whole = {
        "around": {name: packed(pieces) for name, pieces in bake.around.items()},
        "floor": packed(bake.floor),
        "recorded": [
            [i, look, [place.x, place.y, place.z, place.yaw]]
            for i, (look, place) in bake.recorded.items()
        ],
        "looks": {look: packed(pieces) for look, pieces in bake.looks.items()},
        "day": [each.tolist() for each in (bake.day.at, bake.day.into, bake.day.areas)],
        "even": bake.day.even,
        "shades": [[i, packed([shade])] for i, shade in bake.shades.items()],
    }
    return zlib.compress(msgpack.packb(whole), _FASTEST)


def _read(data: bytes) -> Bake:
    whole: dict[str, Any] = msgpack.unpackb(zlib.decompress(data))
    at, into, areas = whole["day"]
    return Bake(
        {name: unpacked(pieces) for name, pieces in whole["around"].items()},
        unpacked(whole["floor"]),
        {i: (look, Place(*place)) for i, look, place in whole["recorded"]},
        {look: unpacked(pieces) for look, pieces in whole["looks"].items()},
        Daylight(_single(at), _single(into), _single(areas), whole["even"]),
        {i: unpacked(shade)[0] for i, shade in whole["shades"]},
    )


def _single(values: list[Any]) -> NDArray[np.float32]:
    return np.array(values, dtype=np.float32)
