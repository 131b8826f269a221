"""Plans of tasks: their actions, and the final states of objects."""

from __future__ import annotations

import pytest
from things_by_hand import thing

from er_gym.tasks.generate.plan_builder import ImpossiblePlan, PlanBuilder
from er_gym.tasks.generate.scene_graph import SceneGraph
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
def builder() -> PlanBuilder:
    return PlanBuilder(ROOM)


@pytest.fixture
def staying() -> PlanBuilder:
    return PlanBuilder(ROOM, merge_visits=True)


def steps(builder: PlanBuilder) -> list[str]:
    return [f"{action.verb} {action.object_type}" for action in builder.actions]


def test_what_is_fetched_is_held_and_the_place_left_as_it_was(builder: PlanBuilder) -> None:
    builder.fetch(EGG)
    assert steps(builder) == ["navigate to Fridge", "open Fridge", "pickup Egg", "close Fridge"]
    assert builder.goal() == (Condition("Egg", held=True),)
    assert builder.held == EGG


def test_what_is_put_somewhere_is_there_and_the_last_place_stays_open(builder: PlanBuilder) -> None:
    builder.fetch(CUP)
    builder.put(FRIDGE)
    assert steps(builder) == [
        "navigate to DiningTable", "pickup Cup", "navigate to Fridge", "open Fridge",
        "put in Fridge",
    ]  # fmt: skip
    assert builder.goal() == (Condition("Cup", inside="Fridge"),)
    assert builder.held is None


def test_who_goes_on_closes_what_was_opened_first(builder: PlanBuilder) -> None:
    builder.fetch(CUP)
    builder.put(FRIDGE)
    builder.visit(COUNTER)
    assert steps(builder)[-2:] == ["close Fridge", "navigate to CounterTop"]
    builder.visit(TABLE)
    assert steps(builder)[-1] == "navigate to DiningTable"
    assert steps(builder).count("close Fridge") == 1


def test_what_was_open_is_not_closed() -> None:
    open_fridge = thing("Fridge", receptacle=True, openable=True)
    builder = PlanBuilder(SceneGraph({open_fridge.id: open_fridge, EGG.id: EGG}, ROOM.accepts))
    builder.fetch(EGG)
    builder.visit(COUNTER)
    assert steps(builder) == ["navigate to Fridge", "pickup Egg", "navigate to CounterTop"]


def test_what_is_closed_by_going_on_is_opened_again(builder: PlanBuilder) -> None:
    builder.fetch(CUP)
    builder.put(FRIDGE)
    builder.visit(COUNTER)
    builder.fetch(CUP)
    assert steps(builder)[-4:] == [
        "navigate to Fridge", "open Fridge", "pickup Cup", "close Fridge",
    ]  # fmt: skip
    assert builder.goal() == (Condition("Cup", held=True),)


def test_a_script_that_stays_goes_nowhere_in_vain(
    builder: PlanBuilder, staying: PlanBuilder
) -> None:
    for one in (builder, staying):
        one.fetch(CUP)
        one.put(FRIDGE)
        one.fetch(EGG)
    assert steps(staying) == [
        "navigate to DiningTable", "pickup Cup", "navigate to Fridge", "open Fridge",
        "put in Fridge", "pickup Egg", "close Fridge",
    ]  # fmt: skip
    assert steps(builder) == [
        *steps(staying)[:5], "navigate to Fridge", *steps(staying)[5:],
    ]  # fmt: skip
    goal = (Condition("Cup", inside="Fridge"), Condition("Egg", held=True))
    assert builder.goal() == staying.goal() == goal


def test_what_is_carried_is_gone_to_where_it_stands_by_now(builder: PlanBuilder) -> None:
    builder.fetch(CUP)
    builder.put(BOWL)
    assert steps(builder)[-2:] == ["navigate to CounterTop", "put in Bowl"]
    assert builder.place_of(CUP) == COUNTER
    builder.fetch(BOWL)
    builder.put(FRIDGE)
    assert builder.place_of(CUP) == builder.place_of(BOWL) == FRIDGE
    builder.fetch(KNIFE)
    builder.put(BOWL)
    assert steps(builder)[-4:] == [
        "pickup Knife", "navigate to Fridge", "open Fridge", "put in Bowl",
    ]  # fmt: skip
    assert builder.goal() == (
        Condition("Cup", inside="Bowl"),
        Condition("Bowl", inside="Fridge"),
        Condition("Knife", inside="Bowl"),
    )


def test_a_box_that_is_shut_is_opened_where_it_stands() -> None:
    box = thing("Box", "Fridge", receptacle=True, pickupable=True, openable=True, closed=True)
    builder = PlanBuilder(SceneGraph({item.id: item for item in (*EVERYTHING, box)}, ROOM.accepts))
    builder.fetch(CUP)
    builder.put(box)
    assert steps(builder)[2:] == ["navigate to Fridge", "open Fridge", "open Box", "put in Box"]
    builder.visit(COUNTER)
    assert steps(builder)[-3:] == ["close Fridge", "close Box", "navigate to CounterTop"]


def test_one_target_is_related_where_it_is_not_gone_to_itself(builder: PlanBuilder) -> None:
    builder.fetch(CUP)
    builder.put(BOWL)
    assert builder.handled == [CUP, BOWL]
    builder.fetch(POTATO)
    builder.put(TABLE)
    assert builder.handled == [CUP, BOWL, POTATO]
    assert builder.goal() == (
        Condition("Cup", inside="Bowl"),
        Condition("Potato", inside="DiningTable"),
    )


def test_what_is_taken_out_again_is_remembered(builder: PlanBuilder) -> None:
    assert builder.lies_in(CUP, TABLE)
    builder.fetch(CUP)
    builder.put(FRIDGE)
    assert builder.lies_in(CUP, FRIDGE)
    assert not builder.lies_in(CUP, TABLE)
    assert builder.taken_from(CUP) is None
    builder.fetch(CUP)
    assert builder.taken_from(CUP) == FRIDGE
    builder.fetch(CUP)
    assert steps(builder)[-1] == "close Fridge"
    assert steps(builder).count("pickup Cup") == 2
    assert builder.handled == [CUP]


def test_switches_end_as_they_were_switched_last(builder: PlanBuilder) -> None:
    builder.go_and_toggle(LAMP)
    assert steps(builder) == ["navigate to DiningTable", "toggle DeskLamp"]
    assert builder.handled == [LAMP]
    assert builder.is_on(LAMP)
    assert builder.goal() == (Condition("DeskLamp", state=(("isToggled", True),)),)
    builder.toggle(LAMP)
    assert not builder.is_on(LAMP)
    assert builder.goal() == (Condition("DeskLamp", state=(("isToggled", False),)),)


def test_a_burner_is_switched_but_has_no_state_of_its_own(builder: PlanBuilder) -> None:
    builder.go_and_toggle(BURNER)
    assert steps(builder) == ["navigate to StoveBurner", "toggle StoveBurner"]
    assert builder.is_on(BURNER)
    assert builder.goal() == ()


def test_slicing_goes_on_with_a_slice(builder: PlanBuilder) -> None:
    builder.fetch(KNIFE)
    builder.go_to(COUNTER, POTATO)
    part = builder.slice(POTATO)
    assert (part.id, part.type) == (f"{POTATO.id}|PotatoSliced_0", "PotatoSliced")
    assert part.cookable
    assert not part.sliceable
    builder.put(COUNTER)
    builder.fetch(part)
    builder.put(BOWL)
    builder.set_state(part, isCooked=True)
    assert steps(builder)[2:] == [
        "navigate to CounterTop", "slice Potato", "navigate to CounterTop", "put in CounterTop",
        "navigate to CounterTop", "pickup PotatoSliced", "navigate to CounterTop", "put in Bowl",
    ]  # fmt: skip
    assert builder.goal() == (
        Condition("Knife", inside="CounterTop"),
        Condition("PotatoSliced", inside="Bowl", state=(("isCooked", True),)),
    )


def test_slices_lie_where_the_whole_was_put(staying: PlanBuilder) -> None:
    staying.fetch(LETTUCE)
    staying.put(COUNTER)
    staying.fetch(KNIFE)
    staying.go_to(COUNTER, LETTUCE)
    part = staying.slice(LETTUCE)
    assert not part.cookable
    assert staying.place_of(part) == COUNTER
    assert staying.lies_in(part, COUNTER)
    assert steps(staying)[-2:] == ["navigate to CounterTop", "slice Lettuce"]


def test_states_that_are_noted_join_with_where_things_are(builder: PlanBuilder) -> None:
    builder.set_state(CUP, isDirty=False)
    builder.fetch(CUP)
    builder.set_state(CUP, isFilledWithLiquid=True)
    builder.put(COUNTER)
    assert builder.goal() == (
        Condition(
            "Cup", inside="CounterTop", state=(("isDirty", False), ("isFilledWithLiquid", True))
        ),
    )


def test_what_was_only_looked_at_is_no_part_of_the_goal(builder: PlanBuilder) -> None:
    assert builder.visit(EGG) == FRIDGE
    assert steps(builder) == ["navigate to Fridge", "open Fridge"]
    assert builder.goal() == ()
    assert builder.handled == []


def test_the_end_involves_all_that_was_acted_on(builder: PlanBuilder) -> None:
    builder.fetch(CUP)
    builder.put(BOWL)
    *actions, end = builder.key_actions()
    assert actions == builder.actions
    assert (end.verb, end.object_id) == ("end", "")
    assert end.related_objects == tuple(item.id for item in (TABLE, CUP, COUNTER, BOWL))
    assert actions[2].related_objects == (COUNTER.id, BOWL.id)


def test_a_full_hand_takes_nothing(builder: PlanBuilder) -> None:
    builder.fetch(CUP)
    with pytest.raises(ImpossiblePlan, match="the hand holds Cup already"):
        builder.fetch(EGG)


def test_an_empty_hand_puts_nothing(builder: PlanBuilder) -> None:
    with pytest.raises(ImpossiblePlan, match="the hand is empty"):
        builder.put(COUNTER)
