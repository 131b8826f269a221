"""Triangles in the form in which they are drawn and kept on disk: small numbers, nothing twice."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.materials import MATERIALS
from er_gym.sim.render.patch import Patch

VERTEX = np.dtype([("at", "<f4", 3), ("colour", "u1", 4), ("uv", "<f4", 2)])
"""A vertex as Panda3D reads it: its place in Panda's frame (our x, z and y), its colour, and its
place in the texture."""
_NORMAL = np.dtype([("normal", "i1", 4)])
_WHOLE = np.dtype([*VERTEX.descr, *_NORMAL.descr])
_UNIT = 127
"""The length of a normal."""


@dataclass(frozen=True, eq=False)
class Piece:
    """Triangles of one material, in the light of the room. No two vertices are the same.

    Attributes:
        material: a name of :data:`er_gym.sim.render.materials.MATERIALS`.
        vertices: (V,) of :data:`VERTEX`; the colours' alpha is 0.
        normals: (V, 4) int8: x, y and z in our frame, 127 long, and 0.
        triangles: (F, 3) uint16, or uint32 if there are more vertices than that can count.
    """

    material: str
    vertices: NDArray[np.void]
    normals: NDArray[np.int8]
    triangles: NDArray[np.uint16] | NDArray[np.uint32]


def piece_of(material: str, patch: Patch, colours: NDArray[np.float32]) -> Piece:
    """The triangles of a patch, in colours (V, 3) from 0 to 1."""
    rows = np.zeros(len(patch.vertices), dtype=_WHOLE)
    rows["at"] = patch.vertices[:, [0, 2, 1]]
    rows["colour"][:, :3] = np.clip(colours, 0.0, 1.0) * 255 + 0.5
    rows["normal"][:, :3] = np.rint(patch.normals * _UNIT)
    if MATERIALS[material].texture is not None:
        rows["uv"] = patch.uv
    _, first, place = np.unique(
        rows.view(np.dtype((np.void, _WHOLE.itemsize))), return_index=True, return_inverse=True
    )
    kept = rows[first]
    vertices = np.empty(len(kept), dtype=VERTEX)
    for name in VERTEX.names or ():
        vertices[name] = kept[name]
    return Piece(
        material,
        vertices,
        np.ascontiguousarray(kept["normal"]),
        place.reshape(-1)[patch.triangles].astype(_index_type(len(kept))),
    )


def pieces_of(patches: Mapping[str, Patch]) -> tuple[Piece, ...]:
    """The triangles of patches by material, in their own colours."""
    return tuple(piece_of(name, patch, patch.colours) for name, patch in patches.items())


def _index_type(vertices: int) -> type[Any]:
    return np.uint16 if vertices < 65536 else np.uint32


# -- as bytes --------------------------------------------------------------------------------------


def packed(pieces: Iterable[Piece]) -> list[list[Any]]:
    """Pieces as lists of names, numbers and bytes; :func:`unpacked` makes them again."""
    return [
        [
            each.material,
            each.vertices.tobytes(),
            each.normals.tobytes(),
            each.triangles.tobytes(),
        ]
        for each in pieces
    ]


def unpacked(lists: Iterable[list[Any]]) -> tuple[Piece, ...]:
    """The pieces that were packed; their arrays are read-only."""
    found = []
    for material, rows, normals, triangles in lists:
        vertices = np.frombuffer(rows, VERTEX)
        faces: Any = np.frombuffer(triangles, _index_type(len(vertices))).reshape(-1, 3)
        found.append(
            Piece(material, vertices, np.frombuffer(normals, np.int8).reshape(-1, 4), faces)
        )
    return tuple(found)
