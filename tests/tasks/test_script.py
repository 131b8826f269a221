"""Tasks acted out on paper: what is done, and how things are in the end."""

from __future__ import annotations

import pytest
from things_by_hand import thing

from er_gym.tasks.generate.scene_graph import SceneGraph
from er_gym.tasks.generate.script import Impossible, Script
from er_gym.tasks.goal import Condition

COUNTER = thing("CounterTop", receptacle=True)
TABLE = thing("DiningTable", receptacle=True)
FRIDGE = thing("Fridge", receptacle=True, openable=True, closed=True)
BURNER = thing("StoveBurner", receptacle=True)
LAMP = thing("DeskLamp", "DiningTable", toggleable=True)
BOWL = thing("Bowl", "CounterTop", receptacle=True, pickupable=True)
CUP = thing("Cup", "DiningTable", pickupable=True)
EGG = thing("Egg", "Fridge", pickupable=True)
POTATO = thing("Potato", "CounterTop", pickupable=True, sliceable=True, cookable=True)
LETTUCE = thing("Lettuce", "Fridge", pickupable=True, sliceable=True)
KNIFE = thing("Knife", "DiningTable", pickupable=True)
KNOB = thing("StoveKnob", toggleable=True, controlled=(BURNER.id,))
EVERYTHING = (COUNTER, TABLE, FRIDGE, BURNER, KNOB, LAMP, BOWL, CUP, EGG, POTATO, LETTUCE, KNIFE)
ROOM = SceneGraph({item.id: item for item in EVERYTHING}, lambda what, where: True)


@pytest.fixture
def script() -> Script:
    return Script(ROOM)


@pytest.fixture
def staying() -> Script:
    return Script(ROOM, stays=True)


def steps(script: Script) -> list[str]:
    return [f"{action.verb} {action.object_type}" for action in script.actions]


def test_what_is_fetched_is_held_and_the_place_left_as_it_was(script: Script) -> None:
    script.fetch(EGG)
    assert steps(script) == ["navigate to Fridge", "open Fridge", "pickup Egg", "close Fridge"]
    assert script.goal() == (Condition("Egg", held=True),)
    assert script.held == EGG


def test_what_is_put_somewhere_is_there_and_the_last_place_stays_open(script: Script) -> None:
    script.fetch(CUP)
    script.put(FRIDGE)
    assert steps(script) == [
        "navigate to DiningTable", "pickup Cup", "navigate to Fridge", "open Fridge",
        "put in Fridge",
    ]  # fmt: skip
    assert script.goal() == (Condition("Cup", inside="Fridge"),)
    assert script.held is None


def test_who_goes_on_closes_what_was_opened_first(script: Script) -> None:
    script.fetch(CUP)
    script.put(FRIDGE)
    script.visit(COUNTER)
    assert steps(script)[-2:] == ["close Fridge", "navigate to CounterTop"]
    script.visit(TABLE)
    assert steps(script)[-1] == "navigate to DiningTable"
    assert steps(script).count("close Fridge") == 1


def test_what_was_open_is_not_closed() -> None:
    open_fridge = thing("Fridge", receptacle=True, openable=True)
    script = Script(SceneGraph({open_fridge.id: open_fridge, EGG.id: EGG}, ROOM.accepts))
    script.fetch(EGG)
    script.visit(COUNTER)
    assert steps(script) == ["navigate to Fridge", "pickup Egg", "navigate to CounterTop"]


def test_what_is_closed_by_going_on_is_opened_again(script: Script) -> None:
    script.fetch(CUP)
    script.put(FRIDGE)
    script.visit(COUNTER)
    script.fetch(CUP)
    assert steps(script)[-4:] == [
        "navigate to Fridge", "open Fridge", "pickup Cup", "close Fridge",
    ]  # fmt: skip
    assert script.goal() == (Condition("Cup", held=True),)


def test_a_script_that_stays_goes_nowhere_in_vain(script: Script, staying: Script) -> None:
    for one in (script, staying):
        one.fetch(CUP)
        one.put(FRIDGE)
        one.fetch(EGG)
    assert steps(staying) == [
        "navigate to DiningTable", "pickup Cup", "navigate to Fridge", "open Fridge",
        "put in Fridge", "pickup Egg", "close Fridge",
    ]  # fmt: skip
    assert steps(script) == [
        *steps(staying)[:5], "navigate to Fridge", *steps(staying)[5:],
    ]  # fmt: skip
    goal = (Condition("Cup", inside="Fridge"), Condition("Egg", held=True))
    assert script.goal() == staying.goal() == goal


def test_what_is_carried_is_gone_to_where_it_stands_by_now(script: Script) -> None:
    script.fetch(CUP)
    script.put(BOWL)
    assert steps(script)[-2:] == ["navigate to CounterTop", "put in Bowl"]
    assert script.place_of(CUP) == COUNTER
    script.fetch(BOWL)
    script.put(FRIDGE)
    assert script.place_of(CUP) == script.place_of(BOWL) == FRIDGE
    script.fetch(KNIFE)
    script.put(BOWL)
    assert steps(script)[-4:] == [
        "pickup Knife", "navigate to Fridge", "open Fridge", "put in Bowl",
    ]  # fmt: skip
    assert script.goal() == (
        Condition("Cup", inside="Bowl"),
        Condition("Bowl", inside="Fridge"),
        Condition("Knife", inside="Bowl"),
    )


def test_a_box_that_is_shut_is_opened_where_it_stands() -> None:
    box = thing("Box", "Fridge", receptacle=True, pickupable=True, openable=True, closed=True)
    script = Script(SceneGraph({item.id: item for item in (*EVERYTHING, box)}, ROOM.accepts))
    script.fetch(CUP)
    script.put(box)
    assert steps(script)[2:] == ["navigate to Fridge", "open Fridge", "open Box", "put in Box"]
    script.visit(COUNTER)
    assert steps(script)[-3:] == ["close Fridge", "close Box", "navigate to CounterTop"]


def test_one_target_is_related_where_it_is_not_gone_to_itself(script: Script) -> None:
    script.fetch(CUP)
    script.put(BOWL)
    assert script.handled == [CUP, BOWL]
    script.fetch(POTATO)
    script.put(TABLE)
    assert script.handled == [CUP, BOWL, POTATO]
    assert script.goal() == (
        Condition("Cup", inside="Bowl"),
        Condition("Potato", inside="DiningTable"),
    )


def test_what_is_taken_out_again_is_remembered(script: Script) -> None:
    assert script.lies_in(CUP, TABLE)
    script.fetch(CUP)
    script.put(FRIDGE)
    assert script.lies_in(CUP, FRIDGE)
    assert not script.lies_in(CUP, TABLE)
    assert script.comes_from(CUP) is None
    script.fetch(CUP)
    assert script.comes_from(CUP) == FRIDGE
    script.fetch(CUP)
    assert steps(script)[-1] == "close Fridge"
    assert steps(script).count("pickup Cup") == 2
    assert script.handled == [CUP]


def test_switches_end_as_they_were_switched_last(script: Script) -> None:
    script.switch(LAMP)
    assert steps(script) == ["navigate to DiningTable", "toggle DeskLamp"]
    assert script.handled == [LAMP]
    assert script.is_on(LAMP)
    assert script.goal() == (Condition("DeskLamp", state=(("isToggled", True),)),)
    script.toggle(LAMP)
    assert not script.is_on(LAMP)
    assert script.goal() == (Condition("DeskLamp", state=(("isToggled", False),)),)


def test_a_burner_is_switched_but_has_no_state_of_its_own(script: Script) -> None:
    script.switch(BURNER)
    assert steps(script) == ["navigate to StoveBurner", "toggle StoveBurner"]
    assert script.is_on(BURNER)
    assert script.goal() == ()


def test_slicing_goes_on_with_a_slice(script: Script) -> None:
    script.fetch(KNIFE)
    script.go(COUNTER, POTATO)
    part = script.slice(POTATO)
    assert (part.id, part.type) == (f"{POTATO.id}|PotatoSliced_0", "PotatoSliced")
    assert part.cookable
    assert not part.sliceable
    script.put(COUNTER)
    script.fetch(part)
    script.put(BOWL)
    script.becomes(part, isCooked=True)
    assert steps(script)[2:] == [
        "navigate to CounterTop", "slice Potato", "navigate to CounterTop", "put in CounterTop",
        "navigate to CounterTop", "pickup PotatoSliced", "navigate to CounterTop", "put in Bowl",
    ]  # fmt: skip
    assert script.goal() == (
        Condition("Knife", inside="CounterTop"),
        Condition("PotatoSliced", inside="Bowl", state=(("isCooked", True),)),
    )


def test_slices_lie_where_the_whole_was_put(staying: Script) -> None:
    staying.fetch(LETTUCE)
    staying.put(COUNTER)
    staying.fetch(KNIFE)
    staying.go(COUNTER, LETTUCE)
    part = staying.slice(LETTUCE)
    assert not part.cookable
    assert staying.place_of(part) == COUNTER
    assert staying.lies_in(part, COUNTER)
    assert steps(staying)[-2:] == ["navigate to CounterTop", "slice Lettuce"]


def test_states_that_are_noted_join_with_where_things_are(script: Script) -> None:
    script.becomes(CUP, isDirty=False)
    script.fetch(CUP)
    script.becomes(CUP, isFilledWithLiquid=True)
    script.put(COUNTER)
    assert script.goal() == (
        Condition(
            "Cup", inside="CounterTop", state=(("isDirty", False), ("isFilledWithLiquid", True))
        ),
    )


def test_what_was_only_looked_at_is_no_part_of_the_goal(script: Script) -> None:
    assert script.visit(EGG) == FRIDGE
    assert steps(script) == ["navigate to Fridge", "open Fridge"]
    assert script.goal() == ()
    assert script.handled == []


def test_the_end_involves_all_that_was_acted_on(script: Script) -> None:
    script.fetch(CUP)
    script.put(BOWL)
    *actions, end = script.key_actions()
    assert actions == script.actions
    assert (end.verb, end.object_id) == ("end", "")
    assert end.related_objects == tuple(item.id for item in (TABLE, CUP, COUNTER, BOWL))
    assert actions[2].related_objects == (COUNTER.id, BOWL.id)


def test_a_full_hand_takes_nothing(script: Script) -> None:
    script.fetch(CUP)
    with pytest.raises(Impossible, match="the hand holds Cup already"):
        script.fetch(EGG)


def test_an_empty_hand_puts_nothing(script: Script) -> None:
    with pytest.raises(Impossible, match="the hand is empty"):
        script.put(COUNTER)
