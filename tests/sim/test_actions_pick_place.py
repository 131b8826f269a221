"""PickupObject and PutObject in FloorPlan1's kitchen: containment before and after."""

from __future__ import annotations

import pytest

APPLE = "Apple|-00.47|+01.15|+00.48"
BOWL = "Bowl|+00.27|+01.10|-00.75"
BREAD = "Bread|-00.52|+01.17|-00.03"
BURNER = "StoveBurner|-00.04|+00.92|-02.37"
CARD = "CreditCard|-00.46|+01.10|+00.87"
EGG = "Egg|-02.04|+00.81|+01.24"
FLOOR = "Floor|+00.00|+00.00|+00.00"
FRIDGE = "Fridge|-02.10|+00.00|+01.07"
ISLAND = "CounterTop|-00.08|+01.15|00.00"
MICROWAVE = "Microwave|-00.24|+01.69|-02.53"
MUG = "Mug|-01.76|+00.90|-00.62"
PAN = "Pan|+00.72|+00.90|-02.42"
PLATE = "Plate|+00.96|+01.65|-02.61"
PLATES_CABINET = "Cabinet|+00.72|+02.02|-02.46"
POT = "Pot|-01.22|+00.90|-02.36"
SINK = "Sink|-01.90|+00.97|-01.50|SinkBasin"
SPONGE = "DishSponge|-01.94|+00.75|-01.71"
SPOON = "Spoon|+00.98|+00.77|-02.29"
SPOONS_DRAWER = "Drawer|+00.95|+00.83|-02.20"
TOMATO = "Tomato|-00.39|+01.14|-00.81"


def box(entry):
    """The lower and upper corner of an object's axis-aligned box."""
    centre = entry["axisAlignedBoundingBox"]["center"]
    size = entry["axisAlignedBoundingBox"]["size"]
    return (
        [centre[axis] - size[axis] / 2 for axis in "xyz"],
        [centre[axis] + size[axis] / 2 for axis in "xyz"],
    )


# -- taking ------------------------------------------------------------------------------------


def test_picking_up_takes_a_thing_off_its_receptacle(kitchen):
    kitchen.go_to(APPLE)
    assert APPLE in kitchen[ISLAND]["receptacleObjectIds"]
    kitchen.do("PickupObject", APPLE)
    assert kitchen.event.metadata["inventoryObjects"] == [
        {"objectId": APPLE, "objectType": "Apple"}
    ]
    assert kitchen[APPLE]["isPickedUp"]
    assert kitchen[APPLE]["parentReceptacles"] is None
    assert APPLE not in kitchen[ISLAND]["receptacleObjectIds"]
    assert kitchen[APPLE]["distance"] < 0.8
    hand = kitchen.event.metadata["heldObjectPose"]
    assert hand["position"] == pytest.approx(kitchen[APPLE]["position"], abs=0.02)
    assert hand["localRotation"]["x"] == pytest.approx(-kitchen.agent["cameraHorizon"] % 360)


def test_the_hand_holds_one_thing(kitchen):
    kitchen.take(APPLE)
    kitchen.go_to(MUG)
    assert APPLE in kitchen.refused("PickupObject", MUG)
    assert APPLE in kitchen.refused("PickupObject", APPLE)
    assert kitchen.inventory == [APPLE]


def test_force_takes_what_is_out_of_view(kitchen):
    assert not kitchen[CARD]["visible"]
    kitchen.do("PickupObject", CARD, forceAction=True)
    assert kitchen.inventory == [CARD]


def test_what_is_in_hand_stays_visible_wherever_one_looks(kitchen):
    kitchen.take(APPLE)
    for _ in range(4):
        kitchen.do("RotateRight")
        assert kitchen[APPLE]["visible"]


# -- putting -----------------------------------------------------------------------------------


def test_putting_on_a_surface(kitchen):
    kitchen.take(EGG)
    kitchen.go_to(ISLAND)
    kitchen.do("PutObject", ISLAND)
    assert kitchen.inventory == []
    assert not kitchen[EGG]["isPickedUp"]
    assert kitchen[EGG]["parentReceptacles"] == [ISLAND]
    assert EGG in kitchen[ISLAND]["receptacleObjectIds"]
    assert kitchen[EGG]["visible"]
    low, high = box(kitchen[EGG])
    under, over = box(kitchen[ISLAND])
    assert under[1] - 0.05 < low[1] < over[1] + 0.05  # it stands on it
    for axis in (0, 2):  # and does not overhang
        assert under[axis] < low[axis]
        assert high[axis] < over[axis]


def test_what_is_put_down_overlaps_nothing_there(kitchen):
    kitchen.do("TeleportFull", x=0.5, z=1.5, rotation=180)
    kitchen.take(PAN)
    kitchen.do("PutObject", ISLAND, forceAction=True)
    low, high = box(kitchen[PAN])
    for other in kitchen[ISLAND]["receptacleObjectIds"]:
        if other != PAN:
            lowest, highest = box(kitchen[other])
            apart = [low[k] >= highest[k] - 1e-3 or high[k] <= lowest[k] + 1e-3 for k in range(3)]
            assert any(apart), other


def test_it_is_put_where_it_is_near_the_agent(kitchen):
    for z, side in ((1.5, 1), (-1.25, -1)):
        kitchen.take(CARD)
        kitchen.do("TeleportFull", x=0.0, z=z, rotation=90 + 90 * side)
        kitchen.do("PutObject", ISLAND, forceAction=True)
        assert kitchen[CARD]["position"]["z"] * side > 0.5


def test_an_empty_hand_puts_nothing(kitchen):
    kitchen.go_to(ISLAND)
    assert "empty" in kitchen.refused("PutObject", ISLAND)


def test_a_receptacle_takes_only_what_belongs_there(kitchen):
    kitchen.take(APPLE)
    kitchen.go_to(BURNER)
    assert kitchen.refused("PutObject", BURNER) == "A StoveBurner does not take a Apple."
    kitchen.do("PutObject", BURNER, forceAction=True)
    assert kitchen[APPLE]["parentReceptacles"] == [BURNER]


def test_only_receptacles_take_things(kitchen):
    kitchen.take(APPLE)
    assert "not a receptacle" in kitchen.refused("PutObject", BREAD, forceAction=True)


@pytest.mark.parametrize("force", [False, True])
def test_a_closed_receptacle_takes_nothing(kitchen, force):
    kitchen.take(APPLE)
    kitchen.go_to(FRIDGE)
    assert "closed" in kitchen.refused("PutObject", FRIDGE, forceAction=force)


def test_nothing_is_put_on_what_is_shut_away(kitchen):
    """The plate stands in a closed cabinet; no force reaches into that."""
    kitchen.take(APPLE)
    assert PLATES_CABINET in kitchen.refused("PutObject", PLATE, forceAction=True)


def test_what_goes_into_the_fridge_is_hidden_once_it_is_shut(kitchen):
    kitchen.take(APPLE)
    kitchen.go_to(FRIDGE)
    kitchen.do("OpenObject", FRIDGE)
    kitchen.do("PutObject", FRIDGE)
    assert kitchen[APPLE]["parentReceptacles"] == [FRIDGE]
    assert kitchen[APPLE]["visible"]
    kitchen.do("CloseObject", FRIDGE)
    assert not kitchen[APPLE]["visible"]
    assert not kitchen[APPLE]["isInteractable"]
    low, high = box(kitchen[APPLE])
    under, over = box(kitchen[FRIDGE])
    assert all(under[k] <= low[k] and high[k] <= over[k] for k in range(3))


@pytest.mark.parametrize(
    ("first", "second", "receptacle"),
    [
        (POT, PAN, BURNER),  # one thing on a burner
        (BREAD, APPLE, MUG),  # one thing in a mug
    ],
)
def test_a_full_receptacle_takes_no_more(kitchen, first, second, receptacle):
    kitchen.take(first)
    kitchen.put(receptacle)
    kitchen.take(second)
    assert "no free space" in kitchen.refused("PutObject", receptacle, forceAction=True)
    assert kitchen.inventory == [second]


def test_too_big_a_thing_finds_no_place(enter):
    bedroom = enter("FloorPlan301")
    laptop, drawer = bedroom.one("Laptop"), bedroom.one("Drawer")
    bedroom.take(laptop)
    bedroom.do("OpenObject", drawer, forceAction=True)
    assert "no free space" in bedroom.refused("PutObject", drawer, forceAction=True)


def test_a_microwave_fills_up(kitchen):
    kitchen.do("OpenObject", MICROWAVE, forceAction=True)
    put, refused = [], ""
    for thing in [POT, BREAD, PLATE, BOWL, TOMATO, MUG, APPLE, PAN]:
        kitchen.take(thing)
        event = kitchen.step("PutObject", MICROWAVE, forceAction=True)
        if not event:
            refused = event.metadata["errorMessage"]
            break
        put.append(thing)
    assert put
    assert "no free space" in refused
    assert kitchen.inventory == [thing]
    assert sorted(kitchen[MICROWAVE]["receptacleObjectIds"]) == sorted(put)


def test_nothing_is_put_into_what_is_in_the_own_hand(kitchen):
    kitchen.take(BOWL)
    assert "own hand" in kitchen.refused("PutObject", BOWL, forceAction=True)


def test_nothing_is_put_into_what_lies_in_the_own_hand(kitchen):
    kitchen.take(MUG)
    kitchen.put(BOWL)
    kitchen.take(BOWL)
    assert "own hand" in kitchen.refused("PutObject", MUG, forceAction=True)


# -- contents ----------------------------------------------------------------------------------


def test_contents_are_carried_along(kitchen):
    kitchen.take(APPLE)
    kitchen.put(BOWL)
    assert kitchen[APPLE]["parentReceptacles"] == [BOWL, ISLAND]
    assert kitchen[BOWL]["receptacleObjectIds"] == [APPLE]
    assert {APPLE, BOWL} <= set(kitchen[ISLAND]["receptacleObjectIds"])

    before = {thing: kitchen[thing]["position"] for thing in (APPLE, BOWL)}
    kitchen.go_to(BOWL)
    kitchen.do("PickupObject", BOWL)
    assert kitchen.inventory == [BOWL]
    assert not kitchen[APPLE]["isPickedUp"]
    assert kitchen[APPLE]["parentReceptacles"] == [BOWL]
    assert kitchen[BOWL]["parentReceptacles"] is None
    assert not {APPLE, BOWL} & set(kitchen[ISLAND]["receptacleObjectIds"])

    kitchen.go_to(SINK)
    kitchen.do("PutObject", SINK)
    assert kitchen[BOWL]["parentReceptacles"] == [SINK]
    assert kitchen[APPLE]["parentReceptacles"] == [BOWL, SINK]
    assert kitchen[BOWL]["receptacleObjectIds"] == [APPLE]
    assert {APPLE, BOWL} <= set(kitchen[SINK]["receptacleObjectIds"])
    for axis in "xz":
        moved = [kitchen[thing]["position"][axis] - before[thing][axis] for thing in before]
        assert moved[0] == pytest.approx(moved[1])
        assert abs(moved[0]) > 0.5


def test_contents_can_be_taken_out_of_what_was_carried(kitchen):
    kitchen.take(APPLE)
    kitchen.put(BOWL)
    kitchen.take(BOWL)
    kitchen.put(SINK)
    kitchen.take(APPLE)
    assert kitchen[BOWL]["receptacleObjectIds"] == []
    assert set(kitchen[SINK]["receptacleObjectIds"]) == {BOWL, SPONGE}


def test_contents_can_be_taken_out_of_the_hand(kitchen):
    """One has no second hand: what lies in the held bowl stays there."""
    kitchen.take(APPLE)
    kitchen.put(BOWL)
    kitchen.take(BOWL)
    assert BOWL in kitchen.refused("PickupObject", APPLE, forceAction=True)


def test_what_is_shut_in_a_held_box_is_not_seen(enter):
    room = enter("FloorPlan201")
    cardboard, thing = room.one("Box"), room.one("KeyChain")
    room.take(thing)
    room.put(cardboard)
    room.do("CloseObject", cardboard, forceAction=True)
    assert not room[thing]["visible"]
    room.take(cardboard)
    assert room[cardboard]["visible"]
    assert not room[thing]["visible"]
    assert not room[thing]["isInteractable"]


# -- dropping ----------------------------------------------------------------------------------


def test_dropping_over_the_floor(kitchen):
    kitchen.do("TeleportFull", x=0.5, z=1.25, rotation=0)
    kitchen.take(APPLE)
    kitchen.do("DropHandObject")
    assert kitchen.inventory == []
    assert kitchen[APPLE]["parentReceptacles"] == [FLOOR]
    assert APPLE in kitchen[FLOOR]["receptacleObjectIds"]
    assert box(kitchen[APPLE])[0][1] == pytest.approx(0.0, abs=0.02)


def test_dropping_over_the_island(kitchen):
    kitchen.do("TeleportFull", x=-1.0, z=0.0, rotation=90)
    kitchen.take(EGG)
    kitchen.do("DropHandObject")
    assert kitchen[EGG]["parentReceptacles"] in ([ISLAND], [FLOOR])
    on = kitchen[EGG]["parentReceptacles"][0]
    assert EGG in kitchen[on]["receptacleObjectIds"]
    assert EGG not in kitchen[FRIDGE]["receptacleObjectIds"]


def test_an_empty_hand_drops_nothing(kitchen):
    assert "empty" in kitchen.refused("DropHandObject")


def test_what_is_dropped_can_be_picked_up_again(kitchen):
    kitchen.do("TeleportFull", x=0.5, z=1.25, rotation=0, horizon=60)
    kitchen.take(BOWL)
    kitchen.do("DropHandObject")
    kitchen.go_to(BOWL)
    kitchen.do("PickupObject", BOWL)


# -- drawers -----------------------------------------------------------------------------------


def test_out_of_an_opened_drawer(kitchen):
    kitchen.go_to(SPOONS_DRAWER)
    assert SPOONS_DRAWER in kitchen.refused("PickupObject", SPOON)
    kitchen.do("OpenObject", SPOONS_DRAWER)
    kitchen.go_to(SPOON)
    kitchen.do("PickupObject", SPOON)
    assert SPOON not in kitchen[SPOONS_DRAWER]["receptacleObjectIds"]
