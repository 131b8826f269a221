"""The conditions that all actions on objects share."""

from __future__ import annotations

import pytest
from floor_plan_1 import APPLE, EGG, FRIDGE

FLOOR = "Floor|+00.00|+00.00|+00.00"

ACTIONS = [
    "PickupObject",
    "OpenObject",
    "CloseObject",
    "ToggleObjectOn",
    "ToggleObjectOff",
    "SliceObject",
    "CookObject",
    "DirtyObject",
    "CleanObject",
    "FillObjectWithLiquid",
    "EmptyLiquidFromObject",
    "BreakObject",
    "UseUpObject",
]
every_action = pytest.mark.parametrize("action", ACTIONS)
every_action_and_put = pytest.mark.parametrize("action", [*ACTIONS, "PutObject"])


@pytest.fixture
def room(kitchen):
    """At the fridge and facing it, with something in hand, since PutObject needs that."""
    kitchen.go_to(FRIDGE)
    kitchen.take(APPLE)
    return kitchen


@every_action_and_put
@pytest.mark.parametrize("force", [False, True])
def test_there_has_to_be_such_an_object(room, action, force):
    assert "'Sofa|0|0|0'" in room.refused(action, "Sofa|0|0|0", forceAction=force)
    assert room.event.metadata["errorCode"] is None


@every_action
def test_it_must_not_be_shut_away(room, action):
    why = room.refused(action, EGG)
    assert FRIDGE in why
    assert "closed" in why


@every_action_and_put
def test_it_has_to_be_in_view(room, action):
    room.do("RotateRight", degrees=180)
    assert room.refused(action, FRIDGE).startswith(
        "NullReferenceException: Target object not found within the specified visibility."
    )


@every_action_and_put
def test_it_has_to_be_within_reach(room, action):
    fridge = room[FRIDGE]["position"]
    room.do("TeleportFull", x=0.75, z=1.5, rotation=270)  # across the room, facing the fridge
    assert room.agent["position"]["x"] - fridge["x"] > 1.5
    assert "1.5 m" in room.refused(action, FRIDGE)


@every_action
def test_it_has_to_be_a_thing_of_that_kind(room, action):
    """A floor can be neither carried nor opened, sliced, filled ..."""
    assert f"{FLOOR} is not " in room.refused(action, FLOOR, forceAction=True)
