"""How a room looks beside what is in it: the materials and lights that a program has drawn at
random, and the source of that chance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

SPLITS = ("train", "val", "test", "external")
"""The sets of finishes that ``RandomizeMaterials`` draws from."""
FINISHES = 48
"""The finishes in each set."""


@dataclass(frozen=True)
class Look:
    """What differs from the room's own look.

    Attributes:
        materials: the seed of the materials, None for the room's own.
        splits: the sets that they are drawn from.
        colors: the seed of the colours, None for those of the materials.
        light: red, green and blue that everything is multiplied by, 1 for the room's own light.
    """

    materials: int | None = None
    splits: tuple[str, ...] = ()
    colors: int | None = None
    light: tuple[float, float, float] = (1.0, 1.0, 1.0)


OWN = Look()
"""The room's own look."""


@dataclass(frozen=True)
class Line:
    """A line that a program has drawn into the room.

    Attributes:
        name: by which it can be taken away.
        points: x, y and z of its points, metres, world frame.
        width: metres.
        posts: whether it has a post at each end.
    """

    name: str
    points: tuple[tuple[float, float, float], ...]
    width: float
    posts: bool = False


@dataclass(frozen=True)
class Chance:
    """What ``SetRandomSeed`` seeds: it outlives the room, as in AI2-THOR.

    Attributes:
        seed: what the program gave; 0 before that.
        drawn: how often something was drawn since.
    """

    seed: int = 0
    drawn: int = 0

    def draw(self) -> tuple[np.random.Generator, Chance]:
        """A generator for one action, and what remains."""
        random = np.random.default_rng([self.seed % 2**64, self.drawn])
        return random, replace(self, drawn=self.drawn + 1)


UNSEEDED = Chance()
"""What random actions draw by before ``SetRandomSeed``."""
