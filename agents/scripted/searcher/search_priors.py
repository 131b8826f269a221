"""Priors for the search: how likely a receptacle type holds an object, and the cost of looking."""

from __future__ import annotations

from functools import lru_cache

from er_gym.thor import OBJECT_TYPES, placement_table

_USUAL = {
    "CounterTop": 3, "Cabinet": 8, "Drawer": 8, "Shelf": 4, "SideTable": 2, "StoveBurner": 4,
    "Sofa": 1, "ArmChair": 2, "Chair": 2, "Desk": 1, "TowelHolder": 2, "HandTowelHolder": 2,
    "CoffeeTable": 1, "DiningTable": 1, "Dresser": 1, "Stool": 2, "ShelvingUnit": 1,
}  # fmt: skip
"""The estimated number of receptacles of a type in a room; one for other types."""
_ROOMY = {
    "CounterTop": 1.5, "DiningTable": 1.5, "Desk": 1.5, "Bed": 1.2, "Sofa": 1.2, "SideTable": 1.2,
    "CoffeeTable": 1.2, "Fridge": 1.2, "TVStand": 1.0, "Dresser": 1.0, "Sink": 0.8,
    "SinkBasin": 0.8, "StoveBurner": 0.6, "CoffeeMachine": 0.4, "Toaster": 0.4, "Microwave": 0.8,
    "Safe": 0.9, "Cabinet": 0.75, "Drawer": 0.7,
}  # fmt: skip
"""How much more often than average objects lie in a receptacle of a type."""
_FOREIGN = 0.08
"""The factor for receptacles that AI2-THOR does not allow for the object."""
_LIDS = frozenset({"Toilet"})
"""Openable receptacles whose objects lie on the lid, in view."""
MOBILE = frozenset(
    name for name, kind in OBJECT_TYPES.items() if {"receptacle", "pickupable"} <= kind.properties
)
"""Receptacles that can be picked up: bowls, boxes."""


def has(object_type: str, prop: str) -> bool:
    """Whether objects of a type have an AI2-THOR property in some scene."""
    kind = OBJECT_TYPES.get(object_type)
    return kind is not None and prop in kind.properties


def usual_number(object_type: str) -> int:
    """The estimated number of objects of a type in a room."""
    return _USUAL.get(object_type, 1)


def opens(object_type: str) -> bool:
    """Whether a receptacle type must be opened to see its content."""
    return (
        has(object_type, "openable")
        and has(object_type, "receptacle")
        and (object_type not in MOBILE and object_type not in _LIDS)
    )


@lru_cache(maxsize=4096)
def likelihood(thing: str, receptacle: str) -> float:
    """A score for how likely a receptacle type holds an object type; only its order has a
    meaning."""
    taken_by = placement_table().get(thing, frozenset())
    if receptacle in taken_by:
        return _ROOMY.get(receptacle, 1.0)
    # An object in a bowl is where the bowl is; Sink and SinkBasin are one place.
    return _FOREIGN * _ROOMY.get(receptacle, 1.0)
