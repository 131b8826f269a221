"""Random materials, colours and lights, put over the pieces of a room and of its objects.

A piece keeps its shape and its shading. What glows and what is transparent keeps its colours.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.look import FINISHES, Look
from er_gym.sim.render.materials import MATERIALS
from er_gym.sim.render.pieces import Piece

_LIKE = (
    ("wood", "marble", "metal", "wicker"),
    ("planks", "tiles", "carpet", "stone"),
    ("fabric", "stripes"),
    ("plaster", "wall_tiles"),
)
"""Textures that may stand for one another."""
_ALIKE = {name: group for group in _LIKE for name in group}
_SIDES = (("up", 0.7), ("down", -0.7))
"""The sides of a room's shell that have finishes of their own beside its walls: the direction, and
the least part of their normals that points there."""
_UNIT = 127.0
_LIGHTEST = 248.0
"""See :data:`er_gym.sim.render.soft_light._WHITE`."""


def finished(pieces: tuple[Piece, ...], look: Look, kind: str, shell: bool) -> tuple[Piece, ...]:
    """Pieces in a look that is not the room's own.

    Args:
        kind: whose pieces they are; those of a type have the same finish.
        shell: whether they are the room's own, whose ceiling and walls differ.
    """
    return tuple(_finished(piece, look, kind, shell) for piece in pieces)


def in_light(piece: Piece, light: tuple[float, float, float]) -> Piece:
    """A piece in the light of a look."""
    if _keeps_its_colours(piece):
        return piece
    vertices = piece.vertices.copy()
    colours = vertices["colour"][:, :3] * np.array(light)
    colours *= np.minimum(_LIGHTEST / np.maximum(colours.max(axis=1, keepdims=True), 1.0), 1.0)
    vertices["colour"][:, :3] = colours + 0.5
    return replace(piece, vertices=vertices)


def _keeps_its_colours(piece: Piece) -> bool:
    surface = MATERIALS[piece.material]
    return surface.glows or surface.glass


def _finished(piece: Piece, look: Look, kind: str, shell: bool) -> Piece:
    if _keeps_its_colours(piece):
        return piece
    material, vertices = piece.material, piece.vertices.copy()
    for seed, splits in ((look.materials, look.splits), (look.colors, ("any",))):
        if seed is None:
            continue
        if seed is look.materials and material in _ALIKE:
            group = _ALIKE[material]
            material = group[_number(f"{seed} {kind} {material} texture") % len(group)]
        up = piece.normals[:, 1] / _UNIT
        rest = np.ones(len(up), dtype=bool)
        for side, least in _SIDES if shell else ():
            there = rest & (up * np.sign(least) > abs(least))
            _tint(vertices, there, seed, splits, f"{kind} {piece.material} {side}")
            rest &= ~there
        _tint(vertices, rest, seed, splits, f"{kind} {piece.material}")
    return replace(piece, material=material, vertices=vertices)


def _tint(
    vertices: NDArray[np.void],
    there: NDArray[np.bool_],
    seed: int,
    splits: tuple[str, ...],
    what: str,
) -> None:
    """Give some vertices a finish, and keep how light each is compared with the others."""
    if not there.any():
        return
    number = _number(f"{seed} {what}")
    colour = _finishes(splits[number % len(splits)])[number // len(splits) % FINISHES]
    own = vertices["colour"][there, :3].astype(np.float64)
    level = own.mean(axis=1)
    shading = 0.25 + 0.75 * level / max(float(np.percentile(level, 95)), 1.0)
    vertices["colour"][there, :3] = np.clip(shading[:, None] * colour, 0.0, _LIGHTEST) + 0.5


@lru_cache(maxsize=16)
def _finishes(split: str) -> NDArray[np.float64]:
    """(FINISHES, 3) the colours of a set, from 0 to 255."""
    random = np.random.default_rng(_number(split))
    hue, deep, light = random.random((3, FINISHES, 1))
    wheel = np.clip(np.abs((hue * 6.0 + np.array([0.0, 4.0, 2.0])) % 6.0 - 3.0) - 1.0, 0.0, 1.0)
    return np.asarray(255.0 * (0.3 + 0.65 * light) * (1.0 - (0.1 + 0.7 * deep) * (1.0 - wheel)))


def _number(text: str) -> int:
    return int.from_bytes(blake2b(text.encode(), digest_size=8).digest(), "big")
