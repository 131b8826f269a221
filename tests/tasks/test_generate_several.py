"""Several objects of a type, and rooms as the rules see them."""

from __future__ import annotations

import pytest
from rooms_by_hand import (
    APPLE,
    BOWL,
    BOX,
    COUNTER,
    DESK,
    DRAWER,
    FLOOR,
    FURNITURE,
    MICROWAVE,
    OFFICE,
    SEQUENCE,
    TABLE,
    TOILET,
    Objects,
    about,
    book,
    everywhere,
    nowhere,
    room_of,
    tasks_of,
    thing,
)

from er_gym.tasks import verbs
from er_gym.tasks.arrangement import Arrangement, ObjectPose
from er_gym.tasks.generate import generate_tasks
from er_gym.tasks.generate.generator import AMBIGUOUS
from er_gym.tasks.generate.scene_graph import read_scene_graph
from er_gym.tasks.goal import Condition
from er_gym.tasks.judge import Criteria, Progress

# -- several objects of a type -------------------------------------------------------------------


def test_two_in_equal_circumstances_make_one_task_that_either_fulfils() -> None:
    first, second = book(1, "Desk"), book(2, "Shelf")
    for name in ("single_search", "single_pickup"):
        (task,) = tasks_of(name, [*OFFICE, first, second])
        assert task.related_objects == (first["objectId"],)
        assert task.id == f"FloorPlan1-{name}-Book"
        assert not task.named
    progress = Progress.start(Criteria.of(task))
    pickup = (verbs.PICKUP, "Book")
    assert progress.after(*pickup, first["objectId"])[1] == 1
    assert progress.after(*pickup, second["objectId"])[1] == 1


def test_two_in_closed_drawers_are_one_task_too() -> None:
    second = thing("Drawer", receptacle=True, openable=True, number=2)
    room = room_of([DRAWER, second, book(1, "Drawer"), book(2, second)])
    for name in ("single_search_from_closerep", "single_pickup_from_closerep"):
        (task,) = room.tasks([name])
        assert task.related_objects == (book(1)["objectId"],)
        assert not task.named
    assert not room.dropped


def test_the_first_in_the_scene_stands_for_all_that_will_do() -> None:
    objects = [*OFFICE, book(2, "Shelf"), TABLE, book(1, "Desk")]
    by_name = {about(task): task for task in tasks_of("pickup_and_put", objects)}
    assert by_name["Book-DiningTable"].related_objects == (objects[3]["objectId"],)
    assert not by_name["Book-DiningTable"].named
    assert len([name for name in by_name if name.startswith("Book-DiningTable")]) == 1


def test_a_second_one_that_is_got_at_in_the_same_way_stands_for_none() -> None:
    on_floor = book(2, "Floor")
    (task,) = tasks_of("single_pickup", [FLOOR, *OFFICE, on_floor, book(1, "Desk")])
    assert task.related_objects == (book(1)["objectId"],)
    assert not task.named


def test_one_that_is_shut_away_and_one_that_is_not_are_told_apart_by_their_places() -> None:
    exposed, enclosed = book(1, "Desk"), book(2, "Drawer")
    objects = [*OFFICE, exposed, enclosed]
    for name, meant, other, words, end in (
        ("single_pickup", exposed, enclosed, "on the Desk", "from_Desk"),
        ("single_pickup_from_closerep", enclosed, exposed, "in the Drawer", "from_Drawer"),
    ):
        (task,) = tasks_of(name, objects)
        assert about(task) == f"Book-{end}"
        assert task.name == f"Pick up the Book that is {words} in the kitchen."
        assert f"book that is {words}".casefold() in task.instruction.casefold()
        assert task.goal == (Condition("Book", meant["objectId"], held=True),)
        assert task.named == {meant["objectId"]}
        progress = Progress.start(Criteria.of(task))
        pickup = (verbs.PICKUP, "Book")
        assert progress.after(*pickup, other["objectId"]) == (progress, 0.0)
        after, reward = progress.after(*pickup, meant["objectId"])
        assert reward == 1
        assert [key.verb for key in after.done] == [verbs.PICKUP]


def test_searches_never_say_where_a_thing_is() -> None:
    room = room_of([*OFFICE, book(1, "Desk"), book(2, "Drawer")])
    assert not list(room.tasks(["single_search", "single_search_from_closerep"]))
    assert room.dropped == {AMBIGUOUS: 2}


def test_one_that_is_already_where_it_should_go_will_not_do() -> None:
    objects = [*OFFICE, book(1, "Desk"), book(2, "Shelf")]
    by_name = {about(task): task for task in tasks_of("pickup_and_put", objects)}
    assert set(by_name) == {"Book-Shelf-from_Desk", "Book-Desk-from_Shelf"}
    task = by_name["Book-Shelf-from_Desk"]
    assert task.name == "Put the Book that is on the Desk on the Shelf."
    assert task.goal == (Condition("Book", objects[3]["objectId"], inside="Shelf"),)
    (into_drawer,) = tasks_of("pickup_and_put_in_closerep", objects)
    assert about(into_drawer) == "Book-Drawer"
    assert not into_drawer.named


def test_where_the_place_does_not_tell_them_apart_there_is_no_task() -> None:
    room = room_of([*OFFICE, book(1, "Desk"), book(2, "Desk"), book(3, "Shelf")])
    tasks = list(room.tasks(["pickup_and_put"]))
    assert [about(task) for task in tasks] == ["Book-Desk-from_Shelf"]
    assert room.dropped == {AMBIGUOUS: 2}


def test_two_switches_in_the_same_state_are_one_task_and_in_different_states_two() -> None:
    lamps = [
        thing("DeskLamp", place, toggleable=True, number=n)
        for n, place in ((1, "Desk"), (2, "Shelf"))
    ]
    room = room_of([*OFFICE, *lamps])
    (either,) = room.tasks(["single_toggle"])
    assert not room.dropped
    assert either.name == "Turn on the DeskLamp in the kitchen."
    assert not either.named
    lamps[1]["isToggled"] = True
    on, off = tasks_of("single_toggle", [*OFFICE, *lamps])
    assert on.name == "Turn on the DeskLamp that is on the Desk in the kitchen."
    assert off.name == "Turn off the DeskLamp that is on the Shelf in the kitchen."
    assert off.goal == (Condition("DeskLamp", lamps[1]["objectId"], state=(("isToggled", False),)),)


def test_either_thing_of_a_sequence_may_be_the_one_that_is_singled_out() -> None:
    objects = [*OFFICE, TABLE, book(1, "Desk"), book(2, "Shelf"), APPLE]
    moves = {("Book", "Shelf"), ("Apple", "Drawer")}
    first, second = tasks_of(SEQUENCE, objects, lambda what, where: (what, where) in moves)
    assert about(first) == "Book-Shelf-Apple-Drawer-from_Desk"
    assert about(second) == "Apple-Drawer-Book-Shelf-from_Desk"
    for task in (first, second):
        assert task.named == {objects[4]["objectId"]}
        assert "Book that is on the Desk" in task.name
        assert "Apple that" not in task.name


def test_what_one_thing_of_a_sequence_asks_for_singles_out_no_other() -> None:
    cups = [
        thing("Cup", place, pickupable=True, number=n) for n, place in ((1, "Desk"), (2, "Shelf"))
    ]
    objects = [*OFFICE, *cups, book(1, "Desk"), book(2, "Shelf")]
    moves = {("Cup", "Drawer"), ("Book", "Shelf")}
    tasks = tasks_of(SEQUENCE, objects, lambda what, where: (what, where) in moves)
    assert {about(task) for task in tasks} == {
        "Cup-Drawer-Book-Shelf-from_Desk", "Book-Shelf-Cup-Drawer-from_Desk",
    }  # fmt: skip
    assert {task.named for task in tasks} == {frozenset({objects[5]["objectId"]})}


# -- rooms ---------------------------------------------------------------------------------------


TRAY = thing("Tray", "CounterTop", receptacle=True)
PLACES = {
    "what is closed": (["CounterTop", "Microwave"], "Microwave"),
    "what is closed though it stands on something": (["DiningTable", "Microwave"], "Microwave"),
    "what stands free": (["Tray", "CounterTop"], "CounterTop"),
    "what stands free though it is carried": (["Tray", "Box"], "Box"),
    "what is not carried": (["Box", "DiningTable"], "DiningTable"),
    "what is not carried, of those that do not stand free": (["Bowl", "Tray"], "Tray"),
    "the first": (["Desk", "CounterTop"], "Desk"),
    "the first, the other way round": (["CounterTop", "Desk"], "CounterTop"),
    "what is no chair": (["Chair", "Bowl"], "Bowl"),
    "a chair, if there is nothing else": (["Floor", "Chair"], "Chair"),
    "a toilet, if there is nothing else": (["Toilet"], "Toilet"),
    "itself on the floor": (["Floor"], "Cloth"),
    "itself on nothing": ([], "Cloth"),
    "itself in what is not there": (["Attic"], "Cloth"),
    "itself on what holds nothing": (["Painting"], "Cloth"),
}


@pytest.mark.parametrize(("parents", "place"), PLACES.values(), ids=PLACES)
def test_what_one_goes_to_for_a_thing(parents: list[str], place: str) -> None:
    cloth = thing("Cloth", *parents, pickupable=True)
    painting = thing("Painting")
    objects = [*FURNITURE, MICROWAVE, TRAY, BOX, BOWL, DESK, TOILET, painting, cloth]
    room = read_scene_graph(objects, everywhere)
    assert room.place_of(room.objects[cloth["objectId"]]).type == place


SINK = thing("Sink", receptacle=True)
BASIN = {**thing("SinkBasin", receptacle=True), "objectId": SINK["objectId"] + "|SinkBasin"}
FAUCET = thing("Faucet", "CounterTop", toggleable=True, x=0.9)
NO_WATER = {
    "no faucet": [BASIN],
    "no basin": [FAUCET],
    "two basins": [BASIN, FAUCET, thing("SinkBasin", receptacle=True, x=50.0)],
    "two faucets": [BASIN, FAUCET, thing("Faucet", toggleable=True, number=2, x=50.0)],
    "a faucet too far": [BASIN, thing("Faucet", toggleable=True, x=1.1)],
    "a faucet too far along z": [BASIN, thing("Faucet", toggleable=True, number=3)],
    "the bathtub's": [BASIN, FAUCET, thing("BathtubBasin", receptacle=True, x=1.0)],
    "running": [BASIN, {**FAUCET, "isToggled": True}],
}


@pytest.mark.parametrize("objects", NO_WATER.values(), ids=NO_WATER)
def test_there_is_no_water_without_a_faucet_that_one_can_name(objects: Objects) -> None:
    assert read_scene_graph(objects, everywhere).sink_and_faucet() is None


WATER = {
    "near": [FAUCET],
    "just near enough": [{**FAUCET, **thing("Faucet", toggleable=True, x=1.0)}],
    "nearer than to a bathtub": [FAUCET, thing("BathtubBasin", receptacle=True, x=2.0)],
}


@pytest.mark.parametrize("objects", WATER.values(), ids=WATER)
def test_the_faucet_by_the_sink_gives_water(objects: Objects) -> None:
    water = read_scene_graph([SINK, BASIN, *objects], everywhere).sink_and_faucet()
    assert water is not None
    assert [thing.id for thing in water] == [BASIN["objectId"], FAUCET["objectId"]]


def test_ids_and_starts_of_a_rearranged_room_name_its_layout() -> None:
    start = Arrangement("FloorPlan1-7", {"Apple_1": ObjectPose(1.0, 2.0, 3.0)})
    search, pickup = generate_tasks([*FURNITURE, APPLE], "FloorPlan1", nowhere, start)
    assert search.id == "FloorPlan1-7-single_search-Apple"
    assert pickup.id == "FloorPlan1-7-single_pickup-Apple"
    for task in (search, pickup):
        assert (task.scene, task.arrangement) == ("FloorPlan1", start)


def test_one_of_two_that_are_alike_is_moved_where_the_other_cannot_go() -> None:
    room = room_of([COUNTER, SINK, BASIN, book(1, "Sink"), book(2, "CounterTop")])
    assert {
        task.id.rpartition("pickup_and_put-")[2] for task in room.tasks(["pickup_and_put"])
    } == {
        "Book-SinkBasin",
        "Book-CounterTop-from_Sink",
    }
