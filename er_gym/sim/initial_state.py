"""The initial state of every world of a scene, computed once for each recently used scene."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.sim.nesting import Nesting
from er_gym.sim.scene import PROPERTIES, Scene

USED_UP = ("PaperTowelRoll", "SoapBottle", "TissueBox", "ToiletPaper")
"""Types that can be used up, from ProcTHOR's asset database."""


def properties(scene: Scene) -> NDArray[np.bool_]:
    """The recorded properties, and ``canBeUsedUp``, which the record lacks."""
    found = scene.properties.copy()
    found[:, PROPERTIES.index("canBeUsedUp")] |= np.isin(scene.types, USED_UP)
    return found


@lru_cache(maxsize=128)
def parents(scene: Scene) -> tuple[tuple[int, ...], ...]:
    """The recorded receptacles of each object, without 20 impossible ones.

    AI2-THOR's trigger boxes overlap, so a few records put a fridge into the cabinet beside it, a
    counter onto a plate, or the floor into a bin. Two rules remove them. An object that cannot be
    picked up is in no receptacle that opens or can be picked up. And the floor is in no receptacle.
    """
    carried = scene.properties[:, PROPERTIES.index("pickupable")]
    no_place = carried | scene.properties[:, PROPERTIES.index("openable")]
    return tuple(
        () if kind == "Floor" else tuple(p for p in lies_in if carried[i] or not no_place[p])
        for i, (kind, lies_in) in enumerate(zip(scene.types, scene.parents, strict=True))
    )


@lru_cache(maxsize=128)
def rows_by_type(scene: Scene) -> Mapping[str, tuple[int, ...]]:
    """The rows of each object type, in scene order."""
    found: dict[str, tuple[int, ...]] = {}
    for i, kind in enumerate(scene.types):
        found[kind] = (*found.get(kind, ()), i)
    return found


@lru_cache(maxsize=128)
def nesting(scene: Scene) -> Nesting:
    """The recorded containment of all objects."""
    return Nesting.of(parents(scene), np.ones(len(scene), dtype=bool))
