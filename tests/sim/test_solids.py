"""The solid parts of objects, the directions that they face, and sliding drawers."""

from __future__ import annotations

import numpy as np
import pytest
from support import in_one_test

from er_gym.sim.scene import SCENE_NAMES, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.line_of_sight_builder import lines_of_sight
from er_gym.sim.space.solids import Solid, solid_of
from er_gym.sim.space.solids.box_transforms import trimmed, turned
from er_gym.sim.space.solids.counter_tops import _largest_rectangle, rectangles
from er_gym.sim.space.solids.facing import facings
from er_gym.sim.space.solids.families import parts
from er_gym.sim.space.solids.sample_points import sample_points
from er_gym.sim.world import World
from er_gym.thor import OBJECT_TYPES

# -- parts -----------------------------------------------------------------------------------------

TYPES = sorted({kind for name in SCENE_NAMES for kind in load_scene(name).types})


@in_one_test("kind", TYPES)
@pytest.mark.parametrize("size", [(1.2, 0.8, 0.6), (0.3, 2.0, 0.3), (0.1, 0.02, 0.05)])
def test_parts_are_boxes_inside_the_thing(kind, size):
    for surface in (None, 0.4 * size[1]):
        made_of, hiding = parts(kind, False, size, surface)
        assert len(made_of) >= 1
        for boxes in (made_of, hiding):
            assert (boxes[:, 0] <= boxes[:, 1] + 1e-9).all()
            assert (boxes[:, 0] >= -1e-9).all()
            assert (boxes[:, 1] <= np.array(size) + 1e-9).all()


def test_a_table_is_a_top_on_legs():
    made_of, hiding = parts("DiningTable", False, (2.0, 0.8, 1.0), None)
    assert len(made_of) == 5
    assert len(hiding) == 1
    top, *legs = made_of
    assert top[1].tolist() == [2.0, 0.8, 1.0]
    assert top[0, 1] > 0.7
    assert all(leg[0, 1] == 0.0 and leg[1, 1] == top[0, 1] for leg in legs)


def test_glass_and_lattices_hide_nothing():
    for kind in ("Window", "ShowerDoor", "CounterTop", "ShelvingUnit", "Floor"):
        assert len(parts(kind, False, (1.0, 1.0, 1.0), None)[1]) == 0


def test_few_boxes_hide_things():
    """Each costs time in every line of sight: there are fewer than objects."""
    worlds = [World.load(load_scene(name), Settings()) for name in SCENE_NAMES[::10]]
    assert sum(len(lines_of_sight(w).box_low) for w in worlds) < sum(len(w) for w in worlds)


# -- in the world ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SCENE_NAMES[::15])
def test_solids_are_where_their_objects_are(name):
    world = World.load(load_scene(name), Settings())
    for i in range(len(world)):
        solid = solid_of(world, i)
        slack = 0.02 if round(solid.yaw) % 90 == 0 else 0.15  # askew, it is a box of equal area
        assert (solid.boxes[:, 0] >= world.low[i] - slack).all(), world.object_ids[i]
        assert (solid.boxes[:, 1] <= world.high[i] + slack).all(), world.object_ids[i]


def test_a_solid_moves_with_its_object():
    world = World.load(load_scene("FloorPlan201"), Settings())
    sofa = next(world.of_type("Sofa"))
    before = solid_of(world, sofa).boxes
    world.move_by(sofa, np.array([0.5, 0.0, -0.25]))
    assert np.allclose(solid_of(world, sofa).boxes - before, [0.5, 0.0, -0.25])
    fresh = World.load(load_scene("FloorPlan201"), Settings())
    assert np.array_equal(solid_of(fresh, sofa).boxes, before)


def test_quarter_turns_are_exact_and_others_keep_the_area():
    box = np.array([[[-1.0, 0.0, -0.25], [1.0, 1.0, 0.25]], [[0.5, 0.0, 1.0], [1.0, 1.0, 2.0]]])
    quarter = turned(box, 90.0)
    assert np.allclose(quarter[0], [[-0.25, 0, -1], [0.25, 1, 1]])
    assert np.allclose(quarter[1], [[1.0, 0, -1.0], [2.0, 1, -0.5]])  # front to +x, right to -z
    askew = turned(box, 33.0)
    for before, after in zip(box, askew, strict=True):
        assert np.prod(after[1] - after[0]) == pytest.approx(np.prod(before[1] - before[0]))
    assert np.allclose(trimmed(box)[0], [[-0.94, 0, -0.235], [0.94, 1, 0.235]])


# -- counters --------------------------------------------------------------------------------------


def test_the_largest_rectangle():
    cells = np.array(
        [
            [1, 1, 0, 0],
            [1, 1, 1, 1],
            [0, 1, 1, 1],
        ],
        dtype=bool,
    )
    assert _largest_rectangle(cells) == (1, 3, 1, 4)
    assert _largest_rectangle(np.zeros((2, 3), dtype=bool)) == (0, 0, 0, 0)


def test_counters_leave_the_floor_free():
    """No recorded position is inside what is left of a counter; most of most counters is left."""
    shares = []
    for name in SCENE_NAMES:
        scene = load_scene(name)
        for i, kind in enumerate(scene.types):
            if kind != "CounterTop":
                continue
            tops = rectangles(name, i)
            area = np.prod(tops[:, 1] - tops[:, 0], axis=1).sum()
            shares.append(area / np.prod(scene.aabb_size[i][[0, 2]]))
            if shares[-1] < 0.999:
                inside = (scene.reachable[:, None] > tops[:, 0]) & (
                    scene.reachable[:, None] < tops[:, 1]
                )
                assert not inside.all(axis=2).any(), (name, scene.object_ids[i])
    assert np.median(shares) > 0.9
    assert min(shares) < 0.6  # some bend


# -- facing ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["Fridge", "Microwave", "Cabinet"])
def test_what_opens_faces_where_it_was_opened_from(kind):
    """The recorded poses look at these from in front.

    A cabinet between two floors takes its pose as a hint, so for one in ten this is no news.
    """
    right = entries = 0
    for name in SCENE_NAMES:
        scene, fronts = load_scene(name), facings(name)
        for i, pose in scene.openable_poses.items():
            if scene.types[i] == kind:
                entries += 1
                right += round((fronts[i] - pose.rotation - 180.0) / 90.0) % 4 == 0
    assert entries > 25
    assert right >= 0.95 * entries


# -- drawers ---------------------------------------------------------------------------------------


def middle(world, i):
    return (world.low[i] + world.high[i]) / 2


def test_an_open_drawer_is_out_with_what_lies_in_it(enter):
    room = enter("FloorPlan1")
    drawer = next(
        o["objectId"]
        for o in room.event.metadata["objects"]
        if o["objectType"] == "Drawer" and o["receptacleObjectIds"]
    )
    inside = room[drawer]["receptacleObjectIds"]

    def where(thing):
        return np.array([*room[thing]["axisAlignedBoundingBox"]["center"].values()])

    shut = {thing: where(thing) for thing in (drawer, *inside)}
    room.do("OpenObject", drawer, openness=0.5, forceAction=True)
    half = where(drawer) - shut[drawer]
    room.do("OpenObject", drawer, openness=1.0, forceAction=True)
    full = where(drawer) - shut[drawer]
    size = np.array([*room[drawer]["axisAlignedBoundingBox"]["size"].values()])
    axis = int(abs(full).argmax())
    assert abs(full[axis]) == pytest.approx(size[axis], abs=1e-3)
    assert np.allclose(full, 2 * half)
    assert np.count_nonzero(abs(full) > 1e-6) == 1
    for thing in inside:
        assert np.allclose(where(thing) - shut[thing], full)
    assert room[drawer]["receptacleObjectIds"] == inside
    room.do("CloseObject", drawer, forceAction=True)
    for thing, place in shut.items():
        assert np.allclose(where(thing), place)


def _has_a_filled_drawer(name: str) -> bool:
    """Things that can be carried; FloorPlan19 also records its fridge in a drawer."""
    scene = load_scene(name)
    return any(
        scene.types[k] == "Drawer" and "pickupable" in OBJECT_TYPES[kind].properties
        for kind, parents in zip(scene.types, scene.parents, strict=True)
        for k in parents
    )


@pytest.mark.parametrize("scene", [name for name in SCENE_NAMES if _has_a_filled_drawer(name)])
def test_what_lies_in_an_open_drawer_can_be_handled(enter, scene):
    room = enter(scene)
    drawers = [
        o
        for o in room.event.metadata["objects"]
        if o["objectType"] == "Drawer" and o["receptacleObjectIds"]
    ]
    assert drawers
    for drawer in drawers:
        room.do("OpenObject", drawer["objectId"], forceAction=True)
        for thing in drawer["receptacleObjectIds"]:
            assert room.do("GetInteractablePoses", thing, maxPoses=1), thing
        room.do("CloseObject", drawer["objectId"], forceAction=True)


def test_a_thing_at_a_known_place_has_its_known_solid_in_any_world() -> None:
    def apple_at(x: float, yaw: float = 0.0) -> tuple[Solid, np.ndarray]:
        world = World.load(load_scene("FloorPlan1"), Settings())
        apple = next(world.of_type("Apple"))
        world.set_pose(apple, np.array([x, 1.0, 0.5]), np.array([0.0, yaw, 0.0]))
        return solid_of(world, apple), sample_points(world, apple)

    first, turned_by = apple_at(0.5), apple_at(0.5, 45.0)
    assert all(one is other for one, other in zip(first, apple_at(0.5), strict=True))
    assert first[0].boxes.tolist() != apple_at(0.6)[0].boxes.tolist()
    assert first[1].tolist() != turned_by[1].tolist()
