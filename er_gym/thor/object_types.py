"""Every object type of the iTHOR scenes, with its properties."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.resources import files
from types import MappingProxyType

from er_gym.sim.initial_state import USED_UP


@dataclass(frozen=True)
class ObjectType:
    """An object type.

    Attributes:
        name: AI2-THOR's ``objectType``.
        properties: AI2-THOR's property names ("pickupable", "openable", …) that at least one
            instance in the 120 scenes has.
    """

    name: str
    properties: frozenset[str]


def _load() -> dict[str, ObjectType]:
    text = files("er_gym.sim.data").joinpath("object_types.json").read_text()
    recorded = {name: frozenset(has) for name, has in json.loads(text).items()}
    used_up = {name: frozenset({"canBeUsedUp"}) for name in USED_UP}  # not recorded
    return {
        name: ObjectType(name, has | used_up.get(name, frozenset()))
        for name, has in recorded.items()
    }


OBJECT_TYPES: Mapping[str, ObjectType] = MappingProxyType(_load())
"""Object types by name, in alphabetical order, with the parts that slicing makes."""
