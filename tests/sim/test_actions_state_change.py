"""Slicing, cooking, cleaning, filling, breaking and using up."""

from __future__ import annotations

import pytest

APPLE = "Apple|-00.47|+01.15|+00.48"
BOWL = "Bowl|+00.27|+01.10|-00.75"
BREAD = "Bread|-00.52|+01.17|-00.03"
EGG = "Egg|-02.04|+00.81|+01.24"
FRIDGE = "Fridge|-02.10|+00.00|+01.07"
ISLAND = "CounterTop|-00.08|+01.15|00.00"
MUG = "Mug|-01.76|+00.90|-00.62"
PLATE = "Plate|+00.96|+01.65|-02.61"
POT = "Pot|-01.22|+00.90|-02.36"
POTATO = "Potato|-01.66|+00.93|-02.15"
COUNTER = "CounterTop|-01.87|+00.95|-01.21"

CHANGES = [
    ("CookObject", POTATO, "isCooked", True),
    ("DirtyObject", MUG, "isDirty", True),
    ("FillObjectWithLiquid", MUG, "isFilledWithLiquid", True),
    ("BreakObject", BOWL, "isBroken", True),
]
UNDONE = [
    ("DirtyObject", "CleanObject", MUG, "isDirty"),
    ("FillObjectWithLiquid", "EmptyLiquidFromObject", MUG, "isFilledWithLiquid"),
]


@pytest.mark.parametrize(("action", "thing", "flag", "value"), CHANGES)
def test_a_state_is_changed_once(kitchen, action, thing, flag, value):
    kitchen.go_to(thing)
    assert kitchen[thing][flag] is not value
    kitchen.do(action, thing)
    assert kitchen[thing][flag] is value
    assert "already" in kitchen.refused(action, thing)


@pytest.mark.parametrize(("there", "back", "thing", "flag"), UNDONE)
def test_a_state_is_changed_back(kitchen, there, back, thing, flag):
    kitchen.go_to(thing)
    assert "already" in kitchen.refused(back, thing)
    kitchen.do(there, thing)
    kitchen.do(back, thing)
    assert kitchen[thing][flag] is False


@pytest.mark.parametrize("liquid", ["water", "coffee", "wine"])
def test_filling_says_with_what(kitchen, liquid):
    kitchen.do("FillObjectWithLiquid", POT, fillLiquid=liquid, forceAction=True)
    assert kitchen[POT]["fillLiquid"] == liquid
    kitchen.do("EmptyLiquidFromObject", POT, forceAction=True)
    assert kitchen[POT]["fillLiquid"] is None


def test_an_unknown_liquid_is_refused(kitchen):
    why = kitchen.refused("FillObjectWithLiquid", POT, fillLiquid="petrol", forceAction=True)
    assert "coffee, water, wine" in why
    kitchen.do("FillObjectWithLiquid", POT, fillLiquid="Wine", forceAction=True)
    assert kitchen[POT]["fillLiquid"] == "wine"


def test_cooking_heats(kitchen):
    kitchen.do("CookObject", POTATO, forceAction=True)
    assert kitchen[POTATO]["temperature"] == "Hot"


def test_a_roll_of_paper_is_used_up(kitchen):
    roll = kitchen.one("PaperTowelRoll")
    kitchen.do("UseUpObject", roll, forceAction=True)
    assert not kitchen[roll]["isUsedUp"]  # AI2-THOR 5 does not tell
    assert not kitchen[roll]["canBeUsedUp"]
    assert "already" in kitchen.refused("UseUpObject", roll, forceAction=True)


# -- slicing -------------------------------------------------------------------------------------

SLICED = [
    (APPLE, "AppleSliced", ISLAND, False),
    (BREAD, "BreadSliced", ISLAND, True),
    ("Tomato|-00.39|+01.14|-00.81", "TomatoSliced", ISLAND, False),
    ("Lettuce|-01.81|+00.97|-00.94", "LettuceSliced", COUNTER, False),
    (POTATO, "PotatoSliced", COUNTER, True),
]


@pytest.mark.parametrize(("whole", "kind", "receptacle", "cookable"), SLICED)
def test_slices_take_the_place_of_the_whole(kitchen, whole, kind, receptacle, cookable):
    kitchen.go_to(whole)
    before, box = len(kitchen.event.metadata["objects"]), kitchen[whole]["axisAlignedBoundingBox"]
    kitchen.do("SliceObject", whole)
    slices = [f"{whole}|{kind}_{k}" for k in range(6)]
    assert kitchen.of_type(kind) == slices
    assert len(kitchen.event.metadata["objects"]) == before + 6
    left = kitchen[whole]  # AI2-THOR goes on listing it, where it was
    assert left["isSliced"]
    assert left["axisAlignedBoundingBox"] == box
    assert left["parentReceptacles"] is None
    assert not any(left[name] for name in ("visible", "isInteractable", "isPickedUp"))
    assert whole not in kitchen[receptacle]["receptacleObjectIds"]
    assert set(slices) <= set(kitchen[receptacle]["receptacleObjectIds"])
    for part in map(kitchen.__getitem__, slices):
        assert part["parentReceptacles"] == [receptacle]
        assert part["pickupable"]
        assert part["cookable"] is cookable
        assert not part["sliceable"]
        for axis in "xyz":  # each lies where the whole lay
            away = abs(part["axisAlignedBoundingBox"]["center"][axis] - box["center"][axis])
            assert away <= box["size"][axis] / 2
    assert any(kitchen[part]["visible"] for part in slices)


def test_what_was_sliced_is_no_more(kitchen):
    kitchen.do("SliceObject", APPLE, forceAction=True)
    assert "is sliced" in kitchen.refused("PickupObject", APPLE, forceAction=True)
    assert APPLE in kitchen.refused("SliceObject", APPLE, forceAction=True)
    assert APPLE in kitchen.refused("GetInteractablePoses", APPLE)


def test_a_slice_is_a_thing_like_any_other(kitchen):
    kitchen.do("SliceObject", APPLE, forceAction=True)
    part = f"{APPLE}|AppleSliced_3"
    kitchen.go_to(part)
    kitchen.do("PickupObject", part)
    kitchen.go_to(BOWL)
    kitchen.do("PutObject", BOWL)
    assert kitchen[part]["parentReceptacles"] == [BOWL, ISLAND]
    assert "sliced" in kitchen.refused("SliceObject", part, forceAction=True)


def test_slices_stay_in_what_the_whole_lay_in(kitchen):
    kitchen.take(APPLE)
    kitchen.put(BOWL)
    kitchen.do("SliceObject", APPLE, forceAction=True)
    slices = kitchen.of_type("AppleSliced")
    assert kitchen[BOWL]["receptacleObjectIds"] == slices
    assert kitchen[slices[0]]["parentReceptacles"] == [BOWL, ISLAND]
    kitchen.take(BOWL)
    assert all(kitchen[part]["parentReceptacles"] == [BOWL] for part in slices)


def test_what_is_in_hand_is_not_sliced(kitchen):
    kitchen.take(APPLE)
    assert "hand" in kitchen.refused("SliceObject", APPLE)


@pytest.mark.parametrize("action", ["SliceObject", "BreakObject"])
def test_an_egg_cracks(kitchen, action):
    kitchen.do("OpenObject", FRIDGE, forceAction=True)
    kitchen.do(action, EGG, forceAction=True)
    cracked = f"{EGG}|EggCracked_0"
    assert kitchen.of_type("EggCracked") == [cracked]
    assert kitchen[EGG]["isSliced"] is (action == "SliceObject")
    assert kitchen[EGG]["isBroken"] is (action == "BreakObject")
    assert not kitchen[EGG]["visible"]
    assert "parts" in kitchen.refused("PickupObject", EGG, forceAction=True)
    assert kitchen[cracked]["parentReceptacles"] == [FRIDGE]
    assert kitchen[FRIDGE]["receptacleObjectIds"] == [cracked]
    assert kitchen[cracked]["cookable"]


def test_a_reset_makes_it_whole_again(kitchen):
    kitchen.do("SliceObject", APPLE, forceAction=True)
    kitchen.controller.reset("FloorPlan1")
    kitchen.do("Pass")
    assert APPLE in kitchen
    assert kitchen.of_type("AppleSliced") == []
