"""The colours of scenes, and functions that change colours."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from hashlib import blake2b

import numpy as np

from er_gym.sim.render.patch import Colour
from er_gym.sim.scene import scene_category

_WOODS: tuple[Colour, ...] = (
    (0.62, 0.42, 0.25), (0.50, 0.33, 0.19), (0.72, 0.54, 0.35), (0.40, 0.26, 0.16),
    (0.82, 0.68, 0.50), (0.34, 0.20, 0.13),
)  # fmt: skip
_CABINETS: tuple[Colour, ...] = (
    (0.78, 0.60, 0.40), (0.90, 0.89, 0.86), (0.55, 0.36, 0.22), (0.55, 0.62, 0.60),
    (0.45, 0.50, 0.58), (0.70, 0.66, 0.58),
)  # fmt: skip
_COUNTERS: tuple[Colour, ...] = (
    (0.58, 0.55, 0.52), (0.30, 0.30, 0.32), (0.80, 0.78, 0.74), (0.50, 0.42, 0.36),
)  # fmt: skip
_FABRICS: tuple[Colour, ...] = (
    (0.36, 0.45, 0.56), (0.60, 0.55, 0.48), (0.45, 0.50, 0.40), (0.62, 0.36, 0.30),
    (0.35, 0.36, 0.42), (0.75, 0.68, 0.55), (0.50, 0.40, 0.52),
)  # fmt: skip
_ACCENTS: tuple[Colour, ...] = (
    (0.75, 0.25, 0.20), (0.20, 0.45, 0.60), (0.85, 0.65, 0.20), (0.30, 0.55, 0.35),
    (0.55, 0.30, 0.50), (0.90, 0.50, 0.25),
)  # fmt: skip
_METALS: tuple[Colour, ...] = ((0.72, 0.74, 0.77), (0.60, 0.60, 0.62), (0.74, 0.66, 0.50))
_WALLS: dict[str, tuple[Colour, ...]] = {
    "kitchens": ((0.93, 0.90, 0.82), (0.88, 0.90, 0.86), (0.92, 0.86, 0.76)),
    "living_rooms": ((0.88, 0.87, 0.80), (0.84, 0.80, 0.74), (0.80, 0.84, 0.86)),
    "bedrooms": ((0.80, 0.86, 0.90), (0.90, 0.86, 0.84), (0.86, 0.88, 0.80)),
    "bathrooms": ((0.86, 0.92, 0.92), (0.92, 0.90, 0.86), (0.84, 0.88, 0.92)),
}
_FLOORS: dict[str, tuple[tuple[str, Colour], ...]] = {
    "kitchens": (
        ("tiles", (0.84, 0.77, 0.66)),
        ("tiles", (0.74, 0.72, 0.70)),
        ("planks", (0.72, 0.52, 0.34)),
        ("tiles", (0.80, 0.62, 0.50)),
    ),
    "living_rooms": (
        ("planks", (0.72, 0.52, 0.34)),
        ("planks", (0.56, 0.39, 0.26)),
        ("planks", (0.82, 0.66, 0.47)),
        ("carpet", (0.72, 0.66, 0.58)),
    ),
    "bedrooms": (
        ("planks", (0.78, 0.61, 0.42)),
        ("carpet", (0.74, 0.69, 0.62)),
        ("planks", (0.60, 0.44, 0.30)),
        ("carpet", (0.60, 0.66, 0.70)),
    ),
    "bathrooms": (
        ("tiles", (0.84, 0.87, 0.89)),
        ("tiles", (0.72, 0.77, 0.80)),
        ("tiles", (0.88, 0.82, 0.74)),
    ),
}
_FLOOR_TURNS = {"tiles": 1.5, "planks": 1.5, "carpet": 1.0}
"""Metres of one repeat of the texture."""


@dataclass(frozen=True)
class Palette:
    """The colours of a scene, which all its objects share."""

    wood: Colour
    cabinet: Colour
    counter: Colour
    fabric: Colour
    accent: Colour
    metal: Colour
    wall: Colour
    floor: Colour


def shaded(colour: Colour, factor: float) -> Colour:
    """A colour made darker (factor below 1) or lighter."""
    r, g, b = (min(1.0, channel * factor) for channel in colour)
    return r, g, b


def mixed(one: Colour, other: Colour, share: float) -> Colour:
    """A mixture of two colours; ``share`` is that of the other one."""
    r, g, b = (a + (c - a) * share for a, c in zip(one, other, strict=True))
    return r, g, b


def flooring(scene: str, kind: str | None = None) -> tuple[str, float]:
    """The floor of a scene, or of a room of a kind: its material, and the metres of one repeat of
    its texture."""
    material, _ = _floor(scene, kind or scene_category(scene))
    return material, _FLOOR_TURNS[material]


def _floor(scene: str, kind: str) -> tuple[str, Colour]:
    floors = _FLOORS[kind]
    return floors[blake2b(f"{scene} floor".encode(), digest_size=8).digest()[0] % len(floors)]


@lru_cache(maxsize=128)
def palette(scene: str, kind: str | None = None) -> Palette:
    """The colours of a scene, or of a room of a kind, which need be no scene."""
    seed = int.from_bytes(blake2b(scene.encode(), digest_size=8).digest(), "big")
    random, kind = np.random.default_rng(seed), kind or scene_category(scene)

    def one(colours: tuple[Colour, ...]) -> Colour:
        return colours[int(random.integers(len(colours)))]

    return Palette(
        wood=one(_WOODS),
        cabinet=one(_CABINETS),
        counter=one(_COUNTERS),
        fabric=one(_FABRICS),
        accent=one(_ACCENTS),
        metal=one(_METALS),
        wall=one(_WALLS[kind]),
        floor=_floor(scene, kind)[1],
    )
