"""The conditions under which a goal holds."""

from __future__ import annotations

from typing import Any

import pytest

from er_gym.tasks.goal import Condition, unmet_conditions


def entry(object_type: str, number: int = 1, *parents: str, **fields: Any) -> dict[str, Any]:
    """An object's metadata, as far as goals look into it."""
    return {
        "objectId": f"{object_type}|{number}",
        "objectType": object_type,
        "parentReceptacles": list(parents) or None,
        "isPickedUp": False,
        "isToggled": False,
        "isCooked": False,
        "fillLiquid": None,
        **fields,
    }


FRIDGE, TABLE = entry("Fridge"), entry("DiningTable")
EGG = entry("Egg", 1, "Fridge|1")
SECOND = entry("Egg", 2, "Shelf|9", "DiningTable|1", isCooked=True)
MUG = entry("Mug", 1, isPickedUp=True, fillLiquid="coffee")
LAMP = entry("DeskLamp", 1, "DiningTable|1", isToggled=True)
OBJECTS = [FRIDGE, TABLE, EGG, SECOND, MUG, LAMP]

HOLDS = {
    "there is one": Condition("Egg"),
    "held": Condition("Mug", held=True),
    "inside": Condition("Egg", inside="Fridge"),
    "inside, another of the type": Condition("Egg", inside="DiningTable"),
    "inside, the one that is meant": Condition("Egg", "Egg|1", inside="Fridge"),
    "a state": Condition("DeskLamp", state=(("isToggled", True),)),
    "a state that is not": Condition("Fridge", state=(("isToggled", False),)),
    "a state in words": Condition("Mug", state=(("fillLiquid", "coffee"),)),
    "several states": Condition("DeskLamp", state=(("isToggled", True), ("isCooked", False))),
    "place and state": Condition("Egg", inside="DiningTable", state=(("isCooked", True),)),
    "in reach": Condition("Egg", in_reach=True),
}
FAILS = {
    "there is none": Condition("Potato"),
    "no such object": Condition("Egg", "Egg|3"),
    "an object of another type": Condition("Egg", "Mug|1"),
    "not held": Condition("Egg", held=True),
    "inside something else": Condition("Mug", inside="Fridge"),
    "inside by the other only": Condition("Egg", "Egg|2", inside="Fridge"),
    "inside something that is not there": Condition("Egg", inside="Shelf"),
    "a state": Condition("DeskLamp", state=(("isToggled", False),)),
    "a state in words": Condition("Mug", state=(("fillLiquid", "water"),)),
    "one of several states": Condition("DeskLamp", state=(("isToggled", True), ("isCooked", True))),
    "place and state of different ones": Condition(
        "Egg", inside="Fridge", state=(("isCooked", True),)
    ),
    "out of reach": Condition("Mug", in_reach=True),
    "in reach but not there": Condition("Potato", in_reach=True),
}
IN_REACH = ("Egg", "Potato")


@pytest.mark.parametrize("condition", HOLDS.values(), ids=HOLDS)
def test_a_goal_that_holds(condition: Condition) -> None:
    assert unmet_conditions([condition], OBJECTS, IN_REACH) == ()


@pytest.mark.parametrize("condition", FAILS.values(), ids=FAILS)
def test_a_goal_that_does_not_hold(condition: Condition) -> None:
    assert unmet_conditions([condition], OBJECTS, IN_REACH) == (condition,)


def test_all_that_does_not_hold_is_named_in_order() -> None:
    held, inside, absent = HOLDS["held"], FAILS["inside something else"], FAILS["there is none"]
    assert unmet_conditions([absent, held, inside], OBJECTS) == (absent, inside)
    assert unmet_conditions([], OBJECTS) == ()


def test_nothing_is_in_reach_unless_one_says_so() -> None:
    assert unmet_conditions([HOLDS["in reach"]], OBJECTS) == (HOLDS["in reach"],)


WORDS = {
    "Mug is held": Condition("Mug", held=True),
    "Egg is in reach": Condition("Egg", in_reach=True),
    "Egg|2 is in Plate, isCooked": Condition(
        "Egg", "Egg|2", inside="Plate", state=(("isCooked", True),)
    ),
    "Mug not isDirty, fillLiquid coffee": Condition(
        "Mug", state=(("isDirty", False), ("fillLiquid", "coffee"))
    ),
}


@pytest.mark.parametrize(("words", "condition"), WORDS.items(), ids=WORDS)
def test_a_condition_in_words(words: str, condition: Condition) -> None:
    assert str(condition) == words
