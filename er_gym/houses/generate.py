"""A furnished house from a seed."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from er_gym.houses.checks import problems
from er_gym.houses.clutter import clutter
from er_gym.houses.furniture import Placed, furnish
from er_gym.houses.openings import SIDES, doors, windows
from er_gym.houses.plan import plan_rooms
from er_gym.houses.spaces import empty_space
from er_gym.houses.writing import house_json

MOST_ROOMS = 6
_TRIES = 40
_KEPT = 32
_ACROSS = {side: SIDES[(k + 2) % 4] for k, side in enumerate(SIDES)}


@lru_cache(maxsize=_KEPT)
def generate_house(seed: int, rooms: int) -> dict[str, Any]:
    """A house in ProcTHOR's JSON; the same for the same arguments. It must not be changed.

    Its floor hangs together, the agent can walk in every room, and nothing stands inside anything
    else (:mod:`er_gym.houses.checks`).

    Args:
        seed: 0 or more.
        rooms: 1 to :data:`MOST_ROOMS`.

    Raises:
        ValueError: an argument is out of its range.
    """
    if not 1 <= rooms <= MOST_ROOMS or seed < 0:
        raise ValueError(
            f"a house has 1 to {MOST_ROOMS} rooms and a seed of at least 0, not {rooms} rooms and "
            f"seed {seed}"
        )
    found: list[str] = []
    for attempt in range(_TRIES):
        house = _attempt(seed, rooms, np.random.default_rng([seed, rooms, attempt]))
        found = problems(house)
        if not found:
            return house
    raise RuntimeError(f"no house of {rooms} rooms for seed {seed}: {found[0]}")


def _attempt(seed: int, count: int, rng: np.random.Generator) -> dict[str, Any]:
    rooms = plan_rooms(count, rng)
    ways = doors(rooms, rng)
    gaps = (*ways, *windows(rooms, ways, rng))
    spaces = [empty_space(room, gaps, _ACROSS) for room in rooms]
    things: list[Placed] = []
    for space in spaces:
        things += furnish(space, len(things), rng)
    small: list[Placed] = []
    for room in rooms:
        small += clutter(room, things, len(things) + len(small), rng)
    first = rooms[0]
    start = ((first.west + first.east) / 2, (first.south + first.north) / 2)
    return house_json(f"House{count}-{seed}", rooms, gaps, [*things, *small], start)
