"""English for object types: articles, pronouns, prepositions."""

from __future__ import annotations

# fmt: off
HOLLOW = frozenset({
    "BathtubBasin", "Bowl", "Box", "Cabinet", "CoffeeMachine", "Cup", "Drawer", "Fridge",
    "GarbageCan", "LaundryHamper", "Microwave", "Mug", "Pan", "Pot", "Safe", "SinkBasin", "Toaster",
})
# fmt: on
"""Receptacle types that things are "in"; they are "on" the others."""

PLURAL = frozenset({"Boots"})
"""Types that are spoken of as "them"."""

UNCOUNTED = frozenset({"AluminumFoil", "Bread", "Lettuce", "TableTopDecor", "ToiletPaper"})
"""Types that, like the plural ones, take "some" where others take "a" or "an"."""


def a(object_type: str) -> str:
    """The type with its indefinite article: "an Apple", "some Bread"."""
    if object_type in UNCOUNTED | PLURAL:
        return f"some {object_type}"
    return f"{'an' if object_type[0] in 'AEIOU' else 'a'} {object_type}"


def it(object_type: str) -> str:
    """The pronoun for a thing of a type: "it" or "them"."""
    return "them" if object_type in PLURAL else "it"


def in_the(receptacle_type: str) -> str:
    """Where a thing is that lies in a receptacle: "in the Fridge", "on the Shelf"."""
    return f"{'in' if receptacle_type in HOLLOW else 'on'} the {receptacle_type}"
