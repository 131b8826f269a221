"""Rooms arranged for a task."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from er_gym.tasks.arrangement import Arrangement, ObjectPose, random_arrangement, set_up_scene
from er_gym.thor import make_controller

SCENE = "FloorPlan1"
Objects = list[dict[str, Any]]


@pytest.fixture(scope="module")
def controller() -> Iterator[Any]:
    controller = make_controller(headless=True)
    yield controller
    controller.stop()


@pytest.fixture(scope="module", params=[("FloorPlan1", 1), ("FloorPlan303", 2)], ids=str)
def layout(request: pytest.FixtureRequest, controller: Any) -> tuple[str, Arrangement]:
    scene, seed = request.param
    return scene, random_arrangement(controller, scene, seed)


def arranged(controller: Any, scene: str, arrangement: Arrangement) -> Objects:
    objects: Objects = set_up_scene(controller, scene, arrangement).metadata["objects"]
    return objects


def recorded(controller: Any, scene: str) -> Objects:
    return arranged(controller, scene, Arrangement())


def test_a_plain_start_is_the_scene_as_recorded(controller: Any) -> None:
    objects: Objects = controller.reset(SCENE).metadata["objects"]
    assert recorded(controller, SCENE) == objects


def test_things_are_where_the_layout_says(controller: Any, layout: tuple[str, Arrangement]) -> None:
    scene, arrangement = layout
    objects = arranged(controller, scene, arrangement)
    assert len(arrangement.poses) > 10
    for entry in objects:
        pose = arrangement.poses.get(entry["name"])
        if pose is not None:
            found = [entry["position"][axis] for axis in "xyz"]
            assert found == pytest.approx([pose.x, pose.y, pose.z], abs=1e-4), entry["name"]
            assert entry["pickupable"]


def test_what_the_layout_leaves_out_stays_where_it_is(
    controller: Any, layout: tuple[str, Arrangement]
) -> None:
    scene, arrangement = layout
    before = {entry["name"]: entry for entry in recorded(controller, scene)}
    after = {entry["name"]: entry for entry in arranged(controller, scene, arrangement)}
    assert set(after) == set(before)
    stayed = [name for name in after if name not in arrangement.poses]
    assert len(stayed) > 20
    for name in stayed:
        assert after[name]["objectId"] == before[name]["objectId"]
        assert after[name]["position"] == before[name]["position"]


def test_things_that_were_moved_have_ids_of_their_new_places(
    controller: Any, layout: tuple[str, Arrangement]
) -> None:
    scene, arrangement = layout
    before = {entry["name"]: entry["objectId"] for entry in recorded(controller, scene)}
    after = {entry["name"]: entry["objectId"] for entry in arranged(controller, scene, arrangement)}
    changed = {name for name in after if after[name] != before[name]}
    assert changed <= set(arrangement.poses)
    assert len(changed) > 10
    assert len(set(after.values())) == len(after)


def test_another_controller_gives_the_same_ids_and_containment(
    controller: Any, layout: tuple[str, Arrangement]
) -> None:
    scene, arrangement = layout

    def told(objects: Objects) -> list[Any]:
        return [(e["name"], e["objectId"], e["parentReceptacles"]) for e in objects]

    here = told(arranged(controller, scene, arrangement))
    with make_controller(headless=True) as other:
        assert (
            random_arrangement(other, scene, int(arrangement.layout.rpartition("-")[2]))
            == arrangement
        )
        assert told(arranged(other, scene, arrangement)) == here


def test_closed_receptacles_get_things_too(controller: Any) -> None:
    def hidden(objects: Objects) -> set[str]:
        shut = {e["objectId"] for e in objects if e["openable"] and not e["isOpen"]}
        return {e["name"] for e in objects if shut & {*(e["parentReceptacles"] or ())}}

    before = hidden(recorded(controller, SCENE))
    fresh = [
        hidden(arranged(controller, SCENE, random_arrangement(controller, SCENE, seed))) - before
        for seed in range(3)
    ]
    assert any(fresh)


def test_what_lies_in_what_can_be_told_from_the_poses_alone(controller: Any) -> None:
    """The engine's first ways to arrange this room are such that poses do not tell."""

    def places(objects: Objects) -> dict[str, Any]:
        return {e["name"]: [e["position"][axis] for axis in "xyz"] for e in objects}

    def holders(objects: Objects) -> dict[str, Any]:
        return {e["name"]: {*(e["parentReceptacles"] or ())} for e in objects}

    arrangement = random_arrangement(controller, "FloorPlan3", 1)
    after = arranged(controller, "FloorPlan3", arrangement)
    spawned = []
    for number in range(20, 40):
        controller.reset("FloorPlan3")
        event = controller.step(
            action="InitialRandomSpawn",
            randomSeed=number,
            forceVisible=False,
            numPlacementAttempts=20,
            placeStationary=True,
        )
        spawned.append(event.metadata["objects"])
        there = places(spawned[-1])
        if all(there[name] == pytest.approx(at, abs=1e-3) for name, at in places(after).items()):
            break
    assert holders(after) == holders(spawned[-1])
    assert 1 < len(spawned) < 20


def test_one_seed_gives_one_arrangement_and_another_seed_another(controller: Any) -> None:
    one, two = (random_arrangement(controller, SCENE, seed) for seed in (1, 2))
    assert one == random_arrangement(controller, SCENE, 1)
    assert one.poses != two.poses
    assert (one.layout, two.layout) == ("FloorPlan1-1", "FloorPlan1-2")
    assert one.dirty == ()


def test_dirty_things_are_dirty_and_no_others(controller: Any) -> None:
    washable = [e["objectId"] for e in recorded(controller, SCENE) if e["dirtyable"]]
    assert len(washable) > 2
    arrangement = Arrangement(dirty=tuple(washable[:2]))
    dirty = [e["objectId"] for e in arranged(controller, SCENE, arrangement) if e["isDirty"]]
    assert dirty == washable[:2]
    assert not [e for e in recorded(controller, SCENE) if e["isDirty"]]


def test_things_that_were_moved_can_be_dirty_by_their_new_ids(controller: Any) -> None:
    layout = random_arrangement(controller, SCENE, 1)
    before = {e["objectId"] for e in recorded(controller, SCENE)}
    moved = next(
        e["objectId"]
        for e in arranged(controller, SCENE, layout)
        if e["dirtyable"] and e["objectId"] not in before
    )
    arrangement = Arrangement(layout.layout, layout.poses, dirty=(moved,))
    assert [e["objectId"] for e in arranged(controller, SCENE, arrangement) if e["isDirty"]] == [
        moved
    ]


WRONG = {
    "a thing to be moved": (
        Arrangement("mine", {"Unicorn_1": ObjectPose(0.0, 1.0, 0.0)}),
        "FloorPlan1 cannot be arranged as 'mine': .*Unicorn_1",
    ),
    "a thing to be dirtied": (
        Arrangement(dirty=("Unicorn|+00.00|+00.00|+00.00",)),
        r"FloorPlan1 cannot be arranged as 'its task asks': .*Unicorn\|",
    ),
}


@pytest.mark.parametrize(("arrangement", "message"), WRONG.values(), ids=WRONG)
def test_a_start_that_names_what_is_not_there_is_refused(
    arrangement: Arrangement, message: str, controller: Any
) -> None:
    with pytest.raises(ValueError, match=message) as caught:
        set_up_scene(controller, SCENE, arrangement)
    assert "\n" not in str(caught.value)
