"""What a shape may know of the thing that it draws."""

from __future__ import annotations

from dataclasses import dataclass
from hashlib import blake2b

import numpy as np

from er_gym.sim.render.mesh import Colour
from er_gym.sim.space.solids.built_in import Box


@dataclass(frozen=True)
class Palette:
    """The colours of a scene, the same for all that is in it."""

    wood: Colour
    cabinet: Colour
    counter: Colour
    fabric: Colour
    accent: Colour
    metal: Colour
    wall: Colour
    floor: Colour


@dataclass(frozen=True)
class Look:
    """How one thing looks: hashable, so that what was made for it is kept.

    Attributes:
        kind: AI2-THOR's object type. asset: its asset id, "" where there is none.
        scene: the scene's name. room: "kitchens", "living_rooms", "bedrooms" or "bathrooms".
        size: width (x), height (y) and depth (z) of its upright box, metres.
        height: of its underside above the floor, metres: what hangs on a wall is high up.
        openness: 0 shut to 1 open. on: switched on.
        filled: what it is filled with ("water", "coffee", "wine"), "" if nothing.
        dirty, cooked, sliced, broken, used_up: its states.
        parts: boxes that the engine takes it to be made of, in the mesh's frame: low and high
            corners, metres. For counters the rectangles of the top.
        surface: how high over its underside things stand on it, metres; None where not known.
        boards: how high over its underside there are shelves, metres.
        built_in: type and box, in the mesh's frame, of what is let into it or built in under it.
        palette: the scene's colours.
        face: which way the face of a knob points, in the mesh's frame; None where not known.
    """

    kind: str
    asset: str
    scene: str
    room: str
    size: tuple[float, float, float]
    height: float
    palette: Palette
    openness: float = 0.0
    on: bool = False
    filled: str = ""
    dirty: bool = False
    cooked: bool = False
    sliced: bool = False
    broken: bool = False
    used_up: bool = False
    parts: tuple[Box, ...] = ()
    surface: float | None = None
    boards: tuple[float, ...] = ()
    built_in: tuple[tuple[str, Box], ...] = ()
    face: tuple[float, float, float] | None = None

    def random(self) -> np.random.Generator:
        """Chance that is the same for a thing in every run, whatever state it is in."""
        key = f"{self.kind}|{self.asset or self.scene}"
        return np.random.default_rng(
            int.from_bytes(blake2b(key.encode(), digest_size=8).digest(), "big")
        )

    def pick(self, *colours: Colour) -> Colour:
        """One of several colours, always the same for this thing."""
        return colours[int(self.random().integers(len(colours)))]


def shaded(colour: Colour, factor: float) -> Colour:
    """A colour made darker (below 1) or lighter."""
    r, g, b = (min(1.0, channel * factor) for channel in colour)
    return r, g, b


def mixed(one: Colour, other: Colour, share: float) -> Colour:
    """A colour between two: ``share`` of the other."""
    r, g, b = (a + (c - a) * share for a, c in zip(one, other, strict=True))
    return r, g, b
