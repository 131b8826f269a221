"""Nodes of triangles, made once for each look, light and number; a copy shares the triangles.

``lit_at`` is the place whose light a node is drawn in, None for flat light; ``lamps`` are those
that are on there.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.bake import Pieces, bake_of, look_of, pieces_of_look
from er_gym.sim.render.panda import geometry
from er_gym.sim.render.pieces import Piece
from er_gym.sim.render.place import Place
from er_gym.sim.render.soft_light import Lamp, lit

_NODES, _PIECES = 1024, 256
FLOOR = "floor"
"""The name of the part of the room that is the object of type Floor."""


@lru_cache(maxsize=_PIECES)
def _pieces(seen: Appearance, heading: float) -> Pieces:
    baked = bake_of(seen.scene).looks.get(look_of(seen, heading))
    return baked or pieces_of_look(seen, heading)


def _drawn(
    scene_name: str,
    pieces: Pieces,
    lit_at: Place | None,
    lamps: tuple[Lamp, ...],
    number: int,
    name: str,
) -> Any:
    """A node of pieces in the light at a place, in flat light if that is None."""
    if lit_at is None:
        return geometry(pieces, number, name)
    day = bake_of(scene_name).day
    return geometry([lit(piece, lit_at, day, lamps) for piece in pieces], number, name)


@lru_cache(maxsize=_NODES)
def made_node(
    seen: Appearance, heading: float, lit_at: Place | None, lamps: tuple[Lamp, ...], number: int
) -> Any:
    """An object that looks like this, lit for a heading."""
    return _drawn(seen.scene, _pieces(seen, heading), lit_at, lamps, number, seen.kind)


@lru_cache(maxsize=_NODES)
def recorded_node(
    scene_name: str,
    look: str,
    lit_at: Place | None,
    lamps: tuple[Lamp, ...],
    number: int,
    kind: str,
) -> Any:
    """An object with one of the looks of a scene's bake."""
    return _drawn(scene_name, bake_of(scene_name).looks[look], lit_at, lamps, number, kind)


@lru_cache(maxsize=_PIECES)
def room_node(
    scene_name: str, part: str, lit_at: Place | None, lamps: tuple[Lamp, ...], number: int
) -> Any:
    """A part of a room itself: one of its bake's, or :data:`FLOOR`."""
    bake = bake_of(scene_name)
    pieces = bake.floor if part == FLOOR else bake.around[part]
    return _drawn(scene_name, pieces, lit_at, lamps, number, part)


@lru_cache(maxsize=_NODES)
def veil_node(shade: Piece) -> Any:
    """A shadow."""
    return geometry([shade], 0, "veil")
