"""English for object types: articles, pronouns, verbs, prepositions."""

from __future__ import annotations

# fmt: off
HOLLOW = frozenset({
    "BathtubBasin", "Bowl", "Box", "Cabinet", "CoffeeMachine", "Cup", "Drawer", "Fridge",
    "GarbageCan", "LaundryHamper", "Microwave", "Mug", "Pan", "Pot", "Safe", "SinkBasin", "Toaster",
})
"""Receptacle types that take the preposition "in"; the others take "on".

Bathtub, Sink and Toilet take "on": in the 120 scenes, their pickupable objects lie on the rim or on
the closed lid. Objects further down lie in a BathtubBasin or a SinkBasin.
"""

PLURAL = frozenset({"Blinds", "Boots", "Curtains"})
"""Types with the pronoun "them"."""

UNCOUNTED = frozenset({
    "AluminumFoil", "AppleSliced", "Bread", "BreadSliced", "Lettuce", "LettuceSliced",
    "PotatoSliced", "RoomDecor", "TableTopDecor", "ToiletPaper", "TomatoSliced",
})
"""Types that take "some" instead of "a" or "an", as the plural ones do."""
# fmt: on


def with_article(object_type: str) -> str:
    """The type with its indefinite article: "an Apple", "some Bread"."""
    if object_type in UNCOUNTED | PLURAL:
        return f"some {object_type}"
    return f"{'an' if object_type[0] in 'AEIOU' else 'a'} {object_type}"


def pronoun(object_type: str) -> str:
    """The pronoun for an object of a type: "it" or "them"."""
    return "them" if object_type in PLURAL else "it"


def verb_to_be(object_type: str) -> str:
    """The form of "to be" for an object of a type: "is" or "are"."""
    return "are" if object_type in PLURAL else "is"


def in_or_on_the(receptacle_type: str) -> str:
    """The place of an object in a receptacle: "in the Fridge", "on the Shelf"."""
    return f"{'in' if receptacle_type in HOLLOW else 'on'} the {receptacle_type}"


def subject_words(object_type: str, place: str = "") -> dict[str, str]:
    """What English templates say of a thing; with ``place`` ("on the Desk") it is told from others.

    Returns:
        The fields ``object``, ``an_object``, ``it`` and ``is``.
    """
    name = f"{object_type} that {verb_to_be(object_type)} {place}" if place else object_type
    return {
        "object": name,
        "an_object": f"the {name}" if place else with_article(object_type),
        "it": pronoun(object_type),
        "is": verb_to_be(object_type),
    }
