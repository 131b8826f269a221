"""Consequences of actions: water, flames and cold change the objects there."""

from __future__ import annotations

import pytest

APPLE = "Apple|-00.47|+01.15|+00.48"
BOWL = "Bowl|+00.27|+01.10|-00.75"
BREAD = "Bread|-00.52|+01.17|-00.03"
BURNER = "StoveBurner|-00.04|+00.92|-02.37"
COFFEE_MACHINE = "CoffeeMachine|-01.98|+00.90|-00.19"
EGG = "Egg|-02.04|+00.81|+01.24"
FAUCET = "Faucet|-02.15|+00.91|-01.50"
FRIDGE = "Fridge|-02.10|+00.00|+01.07"
KNOB = "StoveKnob|-00.02|+00.88|-02.19"
MICROWAVE = "Microwave|-00.24|+01.69|-02.53"
MUG = "Mug|-01.76|+00.90|-00.62"
OTHER_KNOB = "StoveKnob|-00.48|+00.88|-02.19"
PAN = "Pan|+00.72|+00.90|-02.42"
PLATE = "Plate|+00.96|+01.65|-02.61"
POT = "Pot|-01.22|+00.90|-02.36"
POTATO = "Potato|-01.66|+00.93|-02.15"
SINK = "Sink|-01.90|+00.97|-01.50|SinkBasin"
TOASTER = "Toaster|-01.84|+00.90|+00.13"


def move(room, thing, receptacle):
    room.take(thing)
    room.put(receptacle)


def switch(room, thing, on=True):
    room.do("ToggleObjectOn" if on else "ToggleObjectOff", thing, forceAction=True)


def put_where_it_runs(kitchen, thing, place, control, running_first, change):
    """Move a thing and switch on its place, in either order; only both make the change."""
    changed, state, value = change
    if running_first:
        switch(kitchen, control)
        move(kitchen, thing, place)
    else:
        move(kitchen, thing, place)
        assert kitchen[changed][state] != value
        switch(kitchen, control)
    assert kitchen[changed][state] == value


@pytest.mark.parametrize("running_first", [False, True])
def test_a_running_faucet_cleans_and_fills_what_lies_in_the_basin(kitchen, running_first):
    kitchen.do("DirtyObject", MUG, forceAction=True)
    put_where_it_runs(kitchen, MUG, SINK, FAUCET, running_first, (MUG, "isDirty", False))
    assert kitchen[MUG]["isFilledWithLiquid"]
    assert kitchen[MUG]["fillLiquid"] == "water"


def test_a_plate_is_cleaned_and_not_filled(kitchen):
    kitchen.do("DirtyObject", PLATE, forceAction=True)
    move(kitchen, PLATE, SINK)
    switch(kitchen, FAUCET)
    assert not kitchen[PLATE]["isDirty"]
    assert not kitchen[PLATE]["isFilledWithLiquid"]


def test_a_faucet_that_is_off_or_elsewhere_does_nothing(kitchen):
    for thing in (MUG, BOWL):
        kitchen.do("DirtyObject", thing, forceAction=True)
    switch(kitchen, FAUCET)
    assert kitchen[BOWL]["isDirty"]  # on the island
    switch(kitchen, FAUCET, on=False)
    move(kitchen, MUG, SINK)
    assert kitchen[MUG]["isDirty"]
    assert not kitchen[MUG]["isFilledWithLiquid"]


def test_each_bathroom_faucet_feeds_its_own_basin(enter):
    """In FloorPlan401 a cloth in the bathtub gets wet from the tub's faucet, not the sink's."""
    bathroom = enter("FloorPlan401")
    cloth = bathroom.one("Cloth")
    tub = next(i for i in bathroom.of_type("BathtubBasin"))
    at = bathroom[tub]["axisAlignedBoundingBox"]["center"]
    faucets = sorted(
        bathroom.of_type("Faucet"),
        key=lambda f: (
            abs(bathroom[f]["position"]["x"] - at["x"])
            + abs(bathroom[f]["position"]["z"] - at["z"])
        ),
    )
    bathroom.do("DirtyObject", cloth, forceAction=True)
    move(bathroom, cloth, tub)
    switch(bathroom, faucets[-1])
    assert bathroom[cloth]["isDirty"]
    switch(bathroom, faucets[0])
    assert not bathroom[cloth]["isDirty"]


@pytest.mark.parametrize("vessel", [PAN, POT])
@pytest.mark.parametrize("lit_first", [False, True])
def test_a_lit_burner_cooks_what_is_in_the_vessel_on_it(kitchen, vessel, lit_first):
    move(kitchen, POTATO, vessel)
    put_where_it_runs(kitchen, vessel, BURNER, KNOB, lit_first, (POTATO, "isCooked", True))
    assert kitchen[POTATO]["temperature"] == "Hot"


def test_what_is_put_into_a_pan_on_a_lit_burner_is_cooked(kitchen):
    move(kitchen, PAN, BURNER)
    switch(kitchen, KNOB)
    move(kitchen, POTATO, PAN)
    assert kitchen[POTATO]["isCooked"]


def test_another_burner_cooks_nothing_here(kitchen):
    move(kitchen, PAN, BURNER)
    move(kitchen, POTATO, PAN)
    switch(kitchen, OTHER_KNOB)
    assert not kitchen[POTATO]["isCooked"]


def test_an_egg_that_is_cracked_in_a_hot_pan_is_cooked(kitchen):
    move(kitchen, PAN, BURNER)
    move(kitchen, EGG, PAN)
    switch(kitchen, KNOB)
    assert not kitchen[EGG]["isCooked"]
    kitchen.do("BreakObject", EGG, forceAction=True)
    assert kitchen[f"{EGG}|EggCracked_0"]["isCooked"]


def test_a_toaster_toasts_a_slice(kitchen):
    kitchen.do("SliceObject", BREAD, forceAction=True)
    part = f"{BREAD}|BreadSliced_2"
    kitchen.take(part)
    kitchen.go_to(TOASTER)
    kitchen.do("PutObject", TOASTER)
    assert not kitchen[part]["isCooked"]
    kitchen.do("ToggleObjectOn", TOASTER)
    assert kitchen[part]["isCooked"]
    assert kitchen[part]["temperature"] == "Hot"


def test_a_microwave_heats(kitchen):
    kitchen.do("OpenObject", MICROWAVE, forceAction=True)
    move(kitchen, POTATO, MICROWAVE)
    kitchen.do("CloseObject", MICROWAVE, forceAction=True)
    assert kitchen[POTATO]["temperature"] == "RoomTemp"
    switch(kitchen, MICROWAVE)
    assert kitchen[POTATO]["temperature"] == "Hot"
    assert kitchen[POTATO]["isCooked"]


def test_a_fridge_cools(kitchen):
    assert kitchen[APPLE]["temperature"] == "RoomTemp"
    kitchen.do("OpenObject", FRIDGE, forceAction=True)
    move(kitchen, APPLE, FRIDGE)
    assert kitchen[APPLE]["temperature"] == "Cold"


@pytest.mark.parametrize("running_first", [False, True])
def test_a_coffee_machine_fills_a_mug(kitchen, running_first):
    filled = (MUG, "isFilledWithLiquid", True)
    put_where_it_runs(kitchen, MUG, COFFEE_MACHINE, COFFEE_MACHINE, running_first, filled)
    assert kitchen[MUG]["fillLiquid"] == "coffee"


def test_coffee_does_not_turn_into_water(kitchen):
    kitchen.do("FillObjectWithLiquid", MUG, fillLiquid="coffee", forceAction=True)
    move(kitchen, MUG, SINK)
    switch(kitchen, FAUCET)
    assert kitchen[MUG]["fillLiquid"] == "coffee"
