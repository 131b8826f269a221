"""Where the nodes of a room stand."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.render.patch import rotation
from er_gym.sim.render.pieces import Piece
from er_gym.sim.space.solids import Solid


@dataclass(frozen=True)
class Place:
    """Where a node stands: x, y and z in metres, and its heading in degrees."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    yaw: float = 0.0


def place_of(solid: Solid) -> Place:
    """Where the node of an object stands."""
    x, y, z = solid.middle.tolist()
    return Place(x, y + float(solid.upright[:, 0, 1].min()), z, solid.yaw)


def in_room(piece: Piece, place: Place) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """(V, 3) the points and the unit normals of a piece at a place, in the room's frame."""
    points = piece.vertices["at"][:, [0, 2, 1]]
    normals = piece.normals[:, :3] * np.float32(1 / 127)
    if place.yaw:
        turn = rotation("y", place.yaw).T.astype(np.float32)
        points, normals = points @ turn, normals @ turn
    return points + np.array([place.x, place.y, place.z], np.float32), normals
