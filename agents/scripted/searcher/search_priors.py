"""Where things may be: how likely a receptacle type holds one, and what it costs to look."""

from __future__ import annotations

from functools import lru_cache

from er_gym.thor import OBJECT_TYPES, placement_table

_USUAL = {
    "CounterTop": 3, "Cabinet": 8, "Drawer": 8, "Shelf": 4, "SideTable": 2, "StoveBurner": 4,
    "Sofa": 1, "ArmChair": 2, "Chair": 2, "Desk": 1, "TowelHolder": 2, "HandTowelHolder": 2,
    "CoffeeTable": 1, "DiningTable": 1, "Dresser": 1, "Stool": 2, "ShelvingUnit": 1,
}  # fmt: skip
"""How many of a type a room has, at a guess; of others, one."""
_ROOMY = {
    "CounterTop": 1.5, "DiningTable": 1.5, "Desk": 1.5, "Bed": 1.2, "Sofa": 1.2, "SideTable": 1.2,
    "CoffeeTable": 1.2, "Fridge": 1.2, "TVStand": 1.0, "Dresser": 1.0, "Sink": 0.8,
    "SinkBasin": 0.8, "StoveBurner": 0.6, "CoffeeMachine": 0.4, "Toaster": 0.4, "Microwave": 0.8,
    "Safe": 0.9, "Cabinet": 0.75, "Drawer": 0.7,
}  # fmt: skip
"""How much more often than elsewhere things lie in one of a type."""
_FOREIGN = 0.08
"""The same of receptacles that AI2-THOR would not let one put the thing into."""
_LIDS = frozenset({"Toilet"})
"""What opens, but has on its lid what one can see."""
MOBILE = frozenset(
    name for name, kind in OBJECT_TYPES.items() if {"receptacle", "pickupable"} <= kind.properties
)
"""Receptacles that one can carry: bowls, boxes."""


def has(object_type: str, prop: str) -> bool:
    """Whether things of a type have an AI2-THOR property, in some scene."""
    kind = OBJECT_TYPES.get(object_type)
    return kind is not None and prop in kind.properties


def usual_number(object_type: str) -> int:
    """How many things of a type a room has, at a guess."""
    return _USUAL.get(object_type, 1)


def opens(object_type: str) -> bool:
    """Whether one has to open it to see what is in it."""
    return (
        has(object_type, "openable")
        and has(object_type, "receptacle")
        and (object_type not in MOBILE and object_type not in _LIDS)
    )


@lru_cache(maxsize=4096)
def likelihood(thing: str, receptacle: str) -> float:
    """How likely a receptacle of a type is to hold a thing; only to be compared."""
    taken_by = placement_table().get(thing, frozenset())
    if receptacle in taken_by:
        return _ROOMY.get(receptacle, 1.0)
    # A thing that lies in a bowl is where the bowl is; Sink and basin are one place.
    return _FOREIGN * _ROOMY.get(receptacle, 1.0)
