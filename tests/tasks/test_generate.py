"""Tasks generated for rooms made by hand, each of which shows a rule."""

from __future__ import annotations

from collections import Counter

import pytest
from rooms_by_hand import (
    APPLE,
    BOWL,
    BOX,
    CHAIR,
    COUNTER,
    DESK,
    DRAWER,
    EGG,
    FLOOR,
    FRIDGE,
    FURNITURE,
    MICROWAVE,
    MUG,
    OFFICE,
    SEQUENCE,
    TABLE,
    TOILET,
    TRANSFERS,
    Objects,
    about,
    book,
    everywhere,
    nowhere,
    room_of,
    steps,
    subjects,
    tasks_of,
    thing,
)

from er_gym.tasks import TASK_TYPES
from er_gym.tasks.generate import GENERATED_TYPES, generate_tasks
from er_gym.tasks.generate.composite import sequence
from er_gym.tasks.generate.generator import DONE_ALREADY, SAME_PLACES
from er_gym.tasks.generate.transport import transfer, transfers
from er_gym.tasks.goal import Condition

# -- who qualifies -------------------------------------------------------------------------------


def test_makes_every_type() -> None:
    assert TASK_TYPES == GENERATED_TYPES


def test_exposed_things() -> None:
    (search,) = tasks_of("single_search", [*FURNITURE, APPLE])
    assert steps(search) == ["navigate to DiningTable", "end"]
    assert search.target_objects == (TABLE["objectId"],)
    assert search.related_objects == (APPLE["objectId"],)
    assert search.navigable_objects == ()
    assert search.goal == (Condition("Apple", in_reach=True),)
    (pickup,) = tasks_of("single_pickup", [*FURNITURE, APPLE])
    assert steps(pickup) == ["navigate to DiningTable", "pickup Apple", "end"]
    assert {action.reward for action in pickup.key_actions} == {1}
    assert pickup.goal == (Condition("Apple", held=True),)


def test_enclosed_things() -> None:
    (search,) = tasks_of("single_search_from_closerep", [*FURNITURE, EGG])
    assert steps(search) == ["navigate to Fridge", "open Fridge", "end"]
    (pickup,) = tasks_of("single_pickup_from_closerep", [*FURNITURE, EGG])
    assert steps(pickup) == [
        "navigate to Fridge", "open Fridge", "pickup Egg", "close Fridge", "end",
    ]  # fmt: skip
    assert not tasks_of("single_pickup", [*FURNITURE, EGG])
    assert not tasks_of("single_search", [*FURNITURE, EGG])


def test_what_lies_in_something_open_is_neither_exposed_nor_enclosed() -> None:
    open_fridge = {**FRIDGE, "isOpen": True}
    objects = [FLOOR, TABLE, open_fridge, EGG]
    assert not tasks_of("single_pickup", objects)
    assert not tasks_of("single_pickup_from_closerep", objects)


NO_SUBJECT = {
    "in a toilet": [thing("Cloth", "Toilet", pickupable=True), TOILET],
    "on the floor": [thing("Cloth", "Floor", pickupable=True)],
    "on a chair": [thing("Cloth", "Chair", pickupable=True)],
    "on a stool": [
        thing("Cloth", "Stool", pickupable=True),
        thing("Stool", "Floor", receptacle=True),
    ],
    "in a microwave on top": [thing("Cloth", "Microwave", pickupable=True), MICROWAVE],
    "in a bowl": [thing("Cloth", "Bowl", pickupable=True), BOWL],
    "in an open box": [thing("Cloth", "Box", pickupable=True), BOX],
    "in an open box on the table": [thing("Cloth", "Box", "DiningTable", pickupable=True), BOX],
    "in something shut that holds nothing": [
        thing("Cloth", "Laptop", pickupable=True),
        thing("Laptop", "Floor", openable=True),
    ],
    "in something that is not there": [thing("Cloth", "Attic", pickupable=True)],
    "nowhere": [thing("Cloth", pickupable=True)],
    "fixed": [thing("Cloth", "CounterTop")],
}


@pytest.mark.parametrize("hidden", NO_SUBJECT.values(), ids=NO_SUBJECT)
def test_things_that_no_task_is_about(hidden: Objects) -> None:
    others = [APPLE, EGG, thing("Mug", "CounterTop", pickupable=True)]
    tasks = list(generate_tasks([*FURNITURE, *others, *hidden], "FloorPlan1", everywhere))
    handled = {action.object_type for task in tasks for action in task.key_actions}
    assert subjects(tasks) >= {"Apple", "Egg", "Mug"}
    assert "Cloth" not in subjects(tasks) | handled


def test_toggles() -> None:
    lamp = thing("DeskLamp", "DiningTable", toggleable=True, isToggled=True)
    switch = thing("LightSwitch", "DiningTable", toggleable=True)
    knob = thing("StoveKnob", "CounterTop", toggleable=True)
    phone = thing("CellPhone", "Fridge", toggleable=True, pickupable=True)
    toggle, microwave = tasks_of(
        "single_toggle", [*FURNITURE, lamp, switch, knob, phone, MICROWAVE]
    )
    assert steps(toggle) == ["navigate to DiningTable", "toggle DeskLamp", "end"]
    assert toggle.name == "Turn off the DeskLamp in the kitchen."
    assert toggle.goal == (Condition("DeskLamp", state=(("isToggled", False),)),)
    assert microwave.name == "Turn on the Microwave in the kitchen."
    assert microwave.goal == (Condition("Microwave", state=(("isToggled", True),)),)


# -- where transfers go --------------------------------------------------------------------------


def test_transfers_by_what_is_closed_here_and_there() -> None:
    objects = [*FURNITURE, APPLE, EGG, MICROWAVE]
    found = {
        name: sorted(" ".join(steps(task)[1:-1]) for task in tasks_of(name, objects))
        for name in TRANSFERS
    }
    fetch = "open Fridge pickup Egg close Fridge"
    assert found == {
        "pickup_and_put": ["pickup Apple navigate to CounterTop put in CounterTop"],
        "pickup_and_put_in_closerep": [
            "pickup Apple navigate to Fridge open Fridge put in Fridge",
            "pickup Apple navigate to Microwave open Microwave put in Microwave",
        ],
        "pickup_from_closerep_and_put": [
            f"{fetch} navigate to CounterTop put in CounterTop",
            f"{fetch} navigate to DiningTable put in DiningTable",
        ],
        "pickup_from_closerep_and_put_in_closerep": [
            f"{fetch} navigate to Microwave open Microwave put in Microwave",
        ],
    }
    (into_microwave,) = tasks_of(TRANSFERS[3], objects)
    assert into_microwave.goal == (Condition("Egg", inside="Microwave"),)


def test_transfers_go_only_where_the_type_is_accepted() -> None:
    objects = [*FURNITURE, APPLE, EGG]
    assert [tasks_of(name, objects, nowhere) for name in TRANSFERS] == [[]] * 4
    (only,) = tasks_of(
        TRANSFERS[2], objects, lambda what, where: (what, where) == ("Egg", "CounterTop")
    )
    assert about(only) == "Egg-CounterTop"


def test_an_open_receptacle_is_put_into_without_opening_it() -> None:
    (task,) = tasks_of("pickup_and_put", [FLOOR, TABLE, {**FRIDGE, "isOpen": True}, APPLE])
    assert steps(task)[2:] == ["navigate to Fridge", "put in Fridge", "end"]
    assert not tasks_of(
        "pickup_and_put_in_closerep", [FLOOR, TABLE, {**FRIDGE, "isOpen": True}, APPLE]
    )


def test_what_can_be_carried_is_gone_to_where_it_stands() -> None:
    tasks = tasks_of("pickup_and_put", [*FURNITURE, APPLE, BOWL, BOX])
    into = {about(task): task for task in tasks}
    assert steps(into["Apple-Bowl"])[2:4] == ["navigate to CounterTop", "put in Bowl"]
    assert into["Apple-Bowl"].related_objects == (APPLE["objectId"], BOWL["objectId"])
    assert steps(into["Apple-Box"])[2:4] == ["navigate to Box", "put in Box"]
    assert into["Apple-Box"].related_objects == (APPLE["objectId"],)
    assert "Bowl-Bowl" not in into


def test_a_bowl_that_is_shut_away_or_lies_in_another_is_no_target() -> None:
    in_fridge = thing("Bowl", "Fridge", receptacle=True, pickupable=True)
    in_bowl = thing("Pan", "Bowl", receptacle=True, pickupable=True)
    tasks = tasks_of("pickup_and_put", [*FURNITURE, APPLE, in_fridge, in_bowl])
    assert {about(task) for task in tasks} == {"Apple-CounterTop"}


def test_of_several_receptacles_the_largest_takes_it() -> None:
    counters = [thing("CounterTop", receptacle=True, number=n, size=n % 3) for n in (1, 2, 3)]
    (task,) = tasks_of("pickup_and_put", [FLOOR, TABLE, *counters, APPLE])
    assert task.target_objects == (TABLE["objectId"], counters[1]["objectId"])


def test_nothing_goes_from_one_to_another_of_a_type() -> None:
    counters = [thing("CounterTop", receptacle=True, number=n, size=n) for n in (1, 2)]
    room = room_of([FLOOR, *counters, thing("Apple", "CounterTop", pickupable=True)])
    assert not list(room.tasks(["pickup_and_put"]))
    assert room.dropped == {SAME_PLACES: 1}


def test_nothing_goes_to_where_it_is_already() -> None:
    there = thing("Apple", "DiningTable", pickupable=True)
    room = room_of([FLOOR, TABLE, there])
    assert not list(room.tasks(TRANSFERS))
    assert not room.dropped


def test_what_fulfils_its_goal_from_the_start_is_no_task() -> None:
    counters = [thing("CounterTop", receptacle=True, number=n, size=n) for n in (1, 2)]
    fork = thing("Fork", "CounterTop", "Drawer", pickupable=True)
    room = room_of([*counters, DRAWER, fork])
    assert not list(room.tasks(TRANSFERS))
    assert room.dropped == {DONE_ALREADY: 1}


def test_nothing_goes_into_a_type_of_which_one_is_open_and_another_shut() -> None:
    cabinets = [
        thing("Cabinet", receptacle=True, openable=True, number=n, size=n) for n in (1, 2, 3)
    ]
    (task,) = tasks_of("pickup_and_put_in_closerep", [FLOOR, TABLE, *cabinets, APPLE])
    assert task.target_objects == (TABLE["objectId"], cabinets[2]["objectId"])
    cabinets[0]["isOpen"] = True
    objects = [FLOOR, TABLE, *cabinets, APPLE]
    assert not [task for name in TRANSFERS for task in tasks_of(name, objects)]


@pytest.mark.parametrize("never", ["Toilet", "Chair", "Stool", "Floor", "Sink", "Bathtub"])
def test_receptacles_that_nothing_is_put_into(never: str) -> None:
    objects = [*OFFICE, book(1, "Desk"), thing(never, receptacle=True, size=9)]
    (task,) = tasks_of("pickup_and_put", objects)
    assert about(task) == "Book-Shelf"


def test_a_sink_is_filled_by_its_basin_but_not_with_what_lies_in_the_sink() -> None:
    sink = thing("Sink", receptacle=True)
    basin = {**thing("SinkBasin", receptacle=True), "objectId": sink["objectId"] + "|SinkBasin"}
    (task,) = tasks_of("pickup_and_put", [FLOOR, TABLE, sink, basin, APPLE])
    assert steps(task)[-2] == "put in SinkBasin"
    assert "in the SinkBasin" in task.name
    soap = thing("SoapBar", "Sink", pickupable=True)
    assert not tasks_of("pickup_and_put", [FLOOR, sink, basin, soap])


def test_what_is_fixed_takes_things_wherever_it_stands() -> None:
    cabinet = thing("Cabinet", receptacle=True, openable=True)
    built_in = thing("Microwave", "Cabinet", receptacle=True, openable=True, isOpen=True)
    tasks = tasks_of("pickup_and_put", [FLOOR, TABLE, cabinet, built_in, APPLE])
    assert [about(task) for task in tasks] == ["Apple-Microwave"]


def test_a_shut_box_on_a_table_is_gone_to_by_the_table_and_opened() -> None:
    box = thing("Box", "CounterTop", receptacle=True, openable=True, pickupable=True)
    (task,) = tasks_of("pickup_and_put_in_closerep", [TABLE, COUNTER, CHAIR, FLOOR, box, APPLE])
    assert steps(task)[2:] == ["navigate to CounterTop", "open Box", "put in Box", "end"]
    assert task.related_objects == (APPLE["objectId"], box["objectId"])


# -- two transfers -------------------------------------------------------------------------------


def test_sequences_close_what_the_first_transfer_opened() -> None:
    ids = [item["objectId"] for item in (APPLE, FRIDGE, MUG, TABLE)]
    task = room_of([*FURNITURE, APPLE, MUG]).request(SEQUENCE, *ids)
    assert steps(task) == [
        "navigate to DiningTable", "pickup Apple", "navigate to Fridge", "open Fridge",
        "put in Fridge", "close Fridge", "navigate to CounterTop", "pickup Mug",
        "navigate to DiningTable", "put in DiningTable", "end",
    ]  # fmt: skip
    assert task.name == "First, put the Apple in the Fridge; then, put the Mug on the DiningTable."
    assert task.goal == (
        Condition("Apple", inside="Fridge"),
        Condition("Mug", inside="DiningTable"),
    )
    assert task.key_actions[-1].related_objects == tuple(
        item["objectId"] for item in (TABLE, APPLE, FRIDGE, COUNTER, MUG)
    )


def test_sequences_leave_open_what_the_last_transfer_opened() -> None:
    ids = [item["objectId"] for item in (MUG, TABLE, APPLE, FRIDGE)]
    task = room_of([*FURNITURE, APPLE, MUG]).request(SEQUENCE, *ids)
    assert steps(task)[-4:] == ["navigate to Fridge", "open Fridge", "put in Fridge", "end"]


def test_sequences_join_transfers_that_have_nothing_in_common() -> None:
    tasks = tasks_of(SEQUENCE, [*FURNITURE, APPLE, EGG, MUG, DESK])
    assert len(tasks) > 10
    named = [about(task).split("-") for task in tasks]
    assert all(len(set(types)) == 4 for types in named)
    singles = {
        tuple(about(task).split("-"))
        for name in TRANSFERS
        for task in tasks_of(name, [*FURNITURE, APPLE, EGG, MUG, DESK])
    }
    assert {(what, where) for what, where, _, _ in named} == singles
    assert {(what, where) for _, _, what, where in named} <= singles


def test_within_a_sequence_a_type_names_one_receptacle() -> None:
    small = thing("CounterTop", receptacle=True, number=2, size=0.5)
    fork = thing("Fork", small, pickupable=True)
    room = room_of([*FURNITURE, small, APPLE, fork])
    tasks = [about(task) for task in room.tasks([SEQUENCE])]
    assert {"Apple-Fridge-Fork-DiningTable", "Fork-DiningTable-Apple-Fridge"} <= set(tasks)
    assert not [ids for ids in tasks if "CounterTop" in ids]
    assert not room.dropped


def test_each_transfer_begins_two_sequences_at_most() -> None:
    tasks = tasks_of(SEQUENCE, [*FURNITURE, APPLE, EGG, MUG, DESK])
    firsts = Counter(tuple(about(task).split("-")[:2]) for task in tasks)
    assert set(firsts.values()) <= {1, 2}


def test_two_independent_transfers_name_together_what_each_names_alone() -> None:
    graph = room_of([*OFFICE, *FURNITURE, APPLE, BOWL, EGG, MUG, book(1, "Shelf")]).scene_graph
    moves = [*transfers(graph, hidden=False), *transfers(graph, hidden=True)]
    pairs = [
        (one, other)
        for one in moves
        for other in moves
        if len({each.type for each in (*one, *other)}) == 4
    ]
    assert len(pairs) > 50
    for one, other in pairs:
        named = transfer(graph, *one).named | transfer(graph, *other).named
        assert sequence(graph, *one, *other).named == named
