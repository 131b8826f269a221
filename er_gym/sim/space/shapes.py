"""What of an object's bounding box hides what is behind it.

The record gives boxes; things are not boxes. This table says, by type, which part of the box is
solid enough to block a line of sight. It is deliberately coarse: what it gets wrong is measured in
docs/fidelity.md, not guessed.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Solid:
    """The opaque part of a box, as fractions of its height, and how much to shrink its sides.

    Attributes:
        bottom, top: 0 is the box's floor, 1 its ceiling.
        width: fraction of the horizontal extent that is kept, centred.
    """

    bottom: float = 0.0
    top: float = 1.0
    width: float = 0.94


_WHOLE = Solid()
_NOTHING = None

_BY_TYPES: dict[str, Solid | None] = {
    # Flat on a wall or the floor, glass, frames and the volumes above shelves: nothing behind them
    # is hidden by them. A counter's box is thin, and covers free floor where the counter bends.
    "CounterTop Floor Window Curtains Blinds Painting Poster Mirror LightSwitch ShowerGlass "
    "ShowerDoor ShowerHead Shelf ShelvingUnit StoveBurner StoveKnob Faucet TowelHolder "
    "HandTowelHolder ToiletPaperHanger SinkBasin BathtubBasin Sink RoomDecor FloorLamp "
    "DeskLamp": _NOTHING,
    # A top on legs.
    "DiningTable CoffeeTable Desk SideTable Stool Footstool": Solid(bottom=0.88),
    "Chair": Solid(bottom=0.4, top=0.55, width=0.85),
    # A seat with a back or rim that the box's height is taken from.
    "Sofa ArmChair Bed DogBed": Solid(top=0.5),
    "Bathtub Toilet": Solid(top=0.5),
    # Hollow, and open at the top.
    "Box GarbageCan LaundryHamper": Solid(top=0.9, width=0.9),
    # Plants are mostly air above the pot.
    "HousePlant": Solid(top=0.5, width=0.6),
}
_SOLIDS = {name: solid for names, solid in _BY_TYPES.items() for name in names.split()}
_SMALL = Solid(top=0.95, width=0.7)
"""Things one can carry are rounded: the corners of their boxes are air."""


def solid_part(object_type: str, pickupable: bool) -> Solid | None:
    """The part of the box that hides what is behind it, None when nothing of it does."""
    return _SOLIDS.get(object_type, _SMALL if pickupable else _WHOLE)


def solid_boxes(
    low: NDArray[np.float64], high: NDArray[np.float64], solids: list[Solid]
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Cut (K, 3) boxes down to their solid parts.

    Returns:
        The (K, 3) lower and upper corners, metres.
    """
    bottom, top, width = np.array([(s.bottom, s.top, s.width) for s in solids]).reshape(-1, 3).T
    size, centre = high - low, (low + high) / 2
    half = size / 2 * np.stack([width, np.ones_like(width), width], axis=1)
    solid_low, solid_high = centre - half, centre + half
    solid_low[:, 1] = low[:, 1] + size[:, 1] * bottom
    solid_high[:, 1] = low[:, 1] + size[:, 1] * top
    return solid_low.astype(np.float32), solid_high.astype(np.float32)


_SAMPLE_SPACING = 0.5
"""Big boxes get a sample point about every so many metres, small ones three along each side."""
_MOST_SAMPLES = 11
_INSET = 0.08
"""How far inside the box's faces the outer samples lie, as a fraction of its size."""


def surface_fractions(size: NDArray[np.float64]) -> NDArray[np.float64]:
    """(P, 3) points on the surface of a box of (3,) metres, as fractions of its size."""
    counts = np.clip(np.ceil(size / _SAMPLE_SPACING) + 1, 3, _MOST_SAMPLES).astype(int)
    return _surface_grid(*counts.tolist())


@lru_cache(maxsize=1024)
def _surface_grid(*counts: int) -> NDArray[np.float64]:
    axes = [np.linspace(_INSET, 1.0 - _INSET, count) for count in counts]
    grid = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    on_surface = np.zeros(counts, dtype=bool)
    for axis in range(3):
        for face in (0, -1):
            on_surface[(slice(None),) * axis + (face,)] = True
    return grid[on_surface]
