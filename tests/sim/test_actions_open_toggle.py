"""Opening, closing and switching, in FloorPlan1's kitchen."""

from __future__ import annotations

import pytest
from floor_plan_1 import EGG, FRIDGE

BURNER = "StoveBurner|-00.04|+00.92|-02.37"
KNOB = "StoveKnob|-00.02|+00.88|-02.19"
MICROWAVE = "Microwave|-00.24|+01.69|-02.53"

OPENABLE = [
    FRIDGE,
    MICROWAVE,
    "Cabinet|-01.55|+00.50|-01.97",
    "Drawer|+00.95|+00.83|-02.20",
    "Kettle|+01.04|+00.90|-02.60",
    "Book|+00.15|+01.10|+00.62",
]
TOGGLEABLE = [
    KNOB,
    MICROWAVE,
    "CoffeeMachine|-01.98|+00.90|-00.19",
    "Faucet|-02.15|+00.91|-01.50",
    "Toaster|-01.84|+00.90|+00.13",
]


@pytest.mark.parametrize("thing", OPENABLE)
def test_open_and_close(kitchen, thing):
    kitchen.go_to(thing)
    assert "closed already" in kitchen.refused("CloseObject", thing)
    kitchen.do("OpenObject", thing)
    assert (kitchen[thing]["isOpen"], kitchen[thing]["openness"]) == (True, 1.0)
    assert "open already" in kitchen.refused("OpenObject", thing)
    kitchen.do("CloseObject", thing)
    assert (kitchen[thing]["isOpen"], kitchen[thing]["openness"]) == (False, 0.0)


def test_open_part_of_the_way(kitchen):
    kitchen.do("OpenObject", FRIDGE, openness=0.3, forceAction=True)
    assert (kitchen[FRIDGE]["isOpen"], kitchen[FRIDGE]["openness"]) == (True, 0.3)
    kitchen.do("OpenObject", FRIDGE, openness=0.8, forceAction=True)
    assert kitchen[FRIDGE]["openness"] == 0.8


@pytest.mark.parametrize("share", [{"openness": -0.5}, {"openness": 1.1}, {"moveMagnitude": 1.1}])
def test_openness_is_a_share(kitchen, share):
    assert "[0:1]" in kitchen.refused("OpenObject", FRIDGE, **share, forceAction=True)


@pytest.mark.parametrize(("magnitude", "openness"), [(0, 1.0), (0.65, 0.65)])
def test_openness_under_its_old_name(kitchen, magnitude, openness):
    kitchen.do("OpenObject", FRIDGE, moveMagnitude=magnitude, forceAction=True)
    assert kitchen[FRIDGE]["openness"] == openness


def test_contents_show_only_while_it_is_open(kitchen):
    kitchen.go_to(FRIDGE)
    assert kitchen[EGG]["parentReceptacles"] == [FRIDGE]
    assert not kitchen[EGG]["visible"]
    assert kitchen.do("GetInteractablePoses", EGG) == []
    kitchen.do("OpenObject", FRIDGE)
    kitchen.go_to(EGG)
    assert kitchen[EGG]["visible"]
    assert kitchen[EGG]["isInteractable"]
    kitchen.do("CloseObject", FRIDGE, forceAction=True)
    assert not kitchen[EGG]["visible"]
    assert not kitchen[EGG]["isInteractable"]


@pytest.mark.parametrize("thing", TOGGLEABLE)
def test_on_and_off(kitchen, thing):
    kitchen.go_to(thing)
    assert "off already" in kitchen.refused("ToggleObjectOff", thing)
    kitchen.do("ToggleObjectOn", thing)
    assert kitchen[thing]["isToggled"]
    assert "on already" in kitchen.refused("ToggleObjectOn", thing)
    kitchen.do("ToggleObjectOff", thing)
    assert not kitchen[thing]["isToggled"]


def test_the_light_is_on_at_first(kitchen):
    switch = kitchen.one("LightSwitch")
    kitchen.do("ToggleObjectOff", switch, forceAction=True)
    assert not kitchen[switch]["isToggled"]


@pytest.mark.parametrize("action", ["ToggleObjectOn", "ToggleObjectOff"])
@pytest.mark.parametrize("force", [False, True])
def test_a_burner_is_turned_by_its_knob_alone(kitchen, action, force):
    kitchen.go_to(BURNER)
    assert kitchen[KNOB]["controlledObjects"] == [BURNER]
    assert KNOB in kitchen.refused(action, BURNER, forceAction=force)


def test_a_microwave_runs_only_when_shut(kitchen):
    kitchen.do("OpenObject", MICROWAVE, forceAction=True)
    assert "closed" in kitchen.refused("ToggleObjectOn", MICROWAVE, forceAction=True)
    kitchen.do("CloseObject", MICROWAVE, forceAction=True)
    kitchen.do("ToggleObjectOn", MICROWAVE, forceAction=True)


def test_a_microwave_opens_only_when_off(kitchen):
    kitchen.do("ToggleObjectOn", MICROWAVE, forceAction=True)
    assert "off" in kitchen.refused("OpenObject", MICROWAVE, forceAction=True)
    kitchen.do("ToggleObjectOff", MICROWAVE, forceAction=True)
    kitchen.do("OpenObject", MICROWAVE, forceAction=True)
