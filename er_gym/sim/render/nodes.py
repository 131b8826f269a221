"""Nodes of triangles, made once for each look, light and number; a copy shares the triangles.

``lit_at`` is the place whose light a node is drawn in, None for flat light; ``lamps`` are those
that are on there; ``look`` is that of the room.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

from er_gym.sim.look import OWN, Look
from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.bake import Pieces, bake_of, look_of, pieces_of_look
from er_gym.sim.render.finish import finished, in_light
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
    look: Look,
    shell: bool = False,
) -> Any:
    """A node of pieces in the light at a place, in flat light if that is None."""
    if look != OWN:
        pieces = finished(pieces, look, name, shell)
    if lit_at is not None:
        day = bake_of(scene_name).day
        pieces = tuple(lit(piece, lit_at, day, lamps) for piece in pieces)
    if look.light != OWN.light:
        pieces = tuple(in_light(piece, look.light) for piece in pieces)
    return geometry(pieces, number, name)


@lru_cache(maxsize=_NODES)
def made_node(
    seen: Appearance,
    heading: float,
    lit_at: Place | None,
    lamps: tuple[Lamp, ...],
    number: int,
    look: Look = OWN,
) -> Any:
    """An object that looks like this, lit for a heading."""
    return _drawn(seen.scene, _pieces(seen, heading), lit_at, lamps, number, seen.kind, look)


@lru_cache(maxsize=_NODES)
def recorded_node(
    scene_name: str,
    name: str,
    lit_at: Place | None,
    lamps: tuple[Lamp, ...],
    number: int,
    kind: str,
    look: Look = OWN,
) -> Any:
    """An object that looks as one by a name in a scene's bake."""
    pieces = bake_of(scene_name).looks[name]
    return _drawn(scene_name, pieces, lit_at, lamps, number, kind, look)


@lru_cache(maxsize=_PIECES)
def room_node(
    scene_name: str,
    part: str,
    lit_at: Place | None,
    lamps: tuple[Lamp, ...],
    number: int,
    look: Look = OWN,
) -> Any:
    """A part of a room itself: one of its bake's, or :data:`FLOOR`."""
    bake = bake_of(scene_name)
    pieces = bake.floor if part == FLOOR else bake.around[part]
    return _drawn(scene_name, pieces, lit_at, lamps, number, part, look, shell=True)


@lru_cache(maxsize=_NODES)
def veil_node(shade: Piece) -> Any:
    """A shadow."""
    return geometry([shade], 0, "veil")
