"""English for object types: articles, pronouns, verbs, prepositions."""

from __future__ import annotations

# fmt: off
HOLLOW = frozenset({
    "BathtubBasin", "Bowl", "Box", "Cabinet", "CoffeeMachine", "Cup", "Drawer", "Fridge",
    "GarbageCan", "LaundryHamper", "Microwave", "Mug", "Pan", "Pot", "Safe", "SinkBasin", "Toaster",
})
"""Receptacle types that things are "in"; they are "on" the others.

Bathtub, Sink and Toilet are not among them: in the 120 scenes, what one can pick up from these lies
on the rim or the closed lid. What lies further down is in a BathtubBasin or a SinkBasin.
"""

PLURAL = frozenset({"Blinds", "Boots", "Curtains"})
"""Types that are spoken of as "them"."""

UNCOUNTED = frozenset({
    "AluminumFoil", "AppleSliced", "Bread", "BreadSliced", "Lettuce", "LettuceSliced",
    "PotatoSliced", "RoomDecor", "TableTopDecor", "ToiletPaper", "TomatoSliced",
})
"""Types that, like the plural ones, take "some" where others take "a" or "an"."""
# fmt: on


def with_article(object_type: str) -> str:
    """The type with its indefinite article: "an Apple", "some Bread"."""
    if object_type in UNCOUNTED | PLURAL:
        return f"some {object_type}"
    return f"{'an' if object_type[0] in 'AEIOU' else 'a'} {object_type}"


def pronoun(object_type: str) -> str:
    """The pronoun for a thing of a type: "it" or "them"."""
    return "them" if object_type in PLURAL else "it"


def verb_to_be(object_type: str) -> str:
    """The verb for a thing of a type: "is" or "are"."""
    return "are" if object_type in PLURAL else "is"


def in_or_on_the(receptacle_type: str) -> str:
    """Where a thing is that lies in a receptacle: "in the Fridge", "on the Shelf"."""
    return f"{'in' if receptacle_type in HOLLOW else 'on'} the {receptacle_type}"
