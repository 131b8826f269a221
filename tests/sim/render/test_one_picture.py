"""A picture depends on the state of the world, not on its history."""

from __future__ import annotations

from itertools import combinations, permutations

import numpy as np

from er_gym.sim.render.camera import Camera
from er_gym.sim.render.materials import MATERIALS
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.panda import core, geometry, rasteriser
from er_gym.sim.render.pieces import pieces_of
from er_gym.sim.render.scene_graph import SceneGraph, scene_graph_of
from er_gym.sim.scene import SCENE_NAMES
from er_gym.sim.world import World
from tests.sim.render.test_scene_graph import camera_of, do, one, stand, world_of


def _panel(number: int, material: str = "plain") -> object:
    mesh = Mesh()
    mesh.panel((0.0, 0.0, 1.0), (4.0, 4.0), (1.0, 1.0, 1.0), material, facing="z")
    return geometry(pieces_of(mesh.patches()), number, f"panel {number}")


def test_of_surfaces_at_the_same_depth_the_first_in_order_is_seen() -> None:
    camera = Camera((0.0, 0.0, 0.0), 0.0, 0.0, 60.0, 16, 16)
    for numbers in permutations(range(1, 5)):  # as they are made, and so as their addresses are
        root = core().NodePath("panels")
        for number in numbers:
            root.attachNewNode(_panel(number), number)
        assert (rasteriser().draw(root, camera).ids == 1).all()


def test_of_materials_at_the_same_depth_the_first_in_their_table_is_seen() -> None:
    camera = Camera((0.0, 0.0, 0.0), 0.0, 0.0, 60.0, 8, 8)
    materials = [name for name, material in MATERIALS.items() if not material.glass][::2]
    for first, second in combinations(reversed(materials), 2):
        root = core().NodePath("panels")
        root.attachNewNode(_panel(1, first), 0)
        root.attachNewNode(_panel(2, second), 1)
        assert (rasteriser().draw(root, camera).ids == 2).all(), (first, second)


def _pictures(world: World) -> list[np.ndarray]:
    """From all around, with ids as names: rows depend on what was made first."""
    found, drawn = [], scene_graph_of(world.scene.name)
    names = np.array(["", *world.names])
    for yaw in range(0, 360, 90):
        stand(world, *world.scene.reachable[0], float(yaw), 20.0)
        frames = drawn.draw(world, camera_of(world), depth=True)
        assert frames.depth is not None
        found += [frames.rgb, frames.depth, names[frames.ids]]
    return found


def _same(one_way: list[np.ndarray], other: list[np.ndarray]) -> bool:
    return all(np.array_equal(a, b) for a, b in zip(one_way, other, strict=True))


def test_it_does_not_matter_what_was_sliced_first() -> None:
    ways = []
    for kinds in (("Bread", "Tomato"), ("Tomato", "Bread")):
        world = world_of("FloorPlan1")
        spot = world.position[one(world, "Bread")]
        # Into the same place, so that slices share surfaces.
        world.set_pose(one(world, "Tomato"), spot, world.rotation[one(world, "Tomato")])
        for kind in kinds:
            do(world, "SliceObject", objectId=world.object_ids[one(world, kind)], forceAction=True)
        ways.append(_pictures(world))
    assert _same(*ways)


def test_what_is_opened_and_carried_about_comes_back_to_the_last_bit() -> None:
    drawers = 0
    for name in SCENE_NAMES[::10]:
        world = world_of(name)
        before = world.position.copy(), world.low.copy(), world.high.copy()
        for i in world.of_type("Drawer"):
            inside = world.object_ids[i]
            for openness in (0.3, 1.0, 0.7):
                do(world, "OpenObject", objectId=inside, openness=openness, forceAction=True)
            assert not np.array_equal(world.low[i], before[1][i])
            do(world, "CloseObject", objectId=inside, forceAction=True)
            drawers += 1
        rows = np.abs(world.scene.position).min(axis=1) > 1e-4  # finer than the engine's steps
        for now, then in zip((world.position, world.low, world.high), before, strict=True):
            assert np.array_equal(now[rows], then[rows])
    assert drawers > 20


def test_what_is_held_is_where_the_pose_says_however_it_came_there() -> None:
    random = np.random.default_rng(0)
    for kind in ("Apple", "Bread", "Mug", "Knife", "Book"):
        world = world_of("FloorPlan1")
        do(world, "PickupObject", objectId=world.object_ids[one(world, kind)], forceAction=True)
        ways = []
        for _ in range(2):
            stand(world, 1.0, 1.0, 45.0, 10.0)
            held = world.held
            ways.append(np.array([world.position[held], world.low[held], world.high[held]]))
            for _ in range(100):
                x, z = random.choice(world.scene.reachable)
                stand(world, x, z, float(random.uniform(0, 360)), float(random.uniform(-30, 60)))
        assert np.array_equal(*ways), kind


def test_what_lies_in_a_shut_box_is_not_drawn_when_the_hand_moves() -> None:
    scene = next(name for name in SCENE_NAMES if "Box" in world_of(name).types)
    world = world_of(scene)
    box = one(world, "Box")
    small = next(i for i in range(len(world)) if world.has(i, "pickupable") and i != box)
    world.relocate(small, (box,))
    if world.state(box, "isOpen"):
        do(world, "CloseObject", objectId=world.object_ids[box], forceAction=True)
    do(world, "PickupObject", objectId=world.object_ids[box], forceAction=True)
    assert small in world.in_hand
    assert world.hidden[small]
    camera = camera_of(world)
    scene_graph_of(scene).draw(world, camera)
    world.carry()
    scene_graph_of(scene).draw(world, camera)
    assert small not in scene_graph_of(scene)._placed
    assert box in scene_graph_of(scene)._placed


def test_a_graph_that_has_shown_other_worlds_shows_this_one_as_a_new_graph_does() -> None:
    """Only what has changed in a world, or had in the one before, is looked at."""
    name, worlds = "FloorPlan1", [world_of("FloorPlan1") for _ in range(3)]
    plain, opened, moved = worlds
    do(opened, "OpenObject", objectId=opened.object_ids[one(opened, "Fridge")], forceAction=True)
    do(opened, "SliceObject", objectId=opened.object_ids[one(opened, "Bread")], forceAction=True)
    apple = moved.object_ids[one(moved, "Apple")]
    do(moved, "PickupObject", objectId=apple, forceAction=True)
    for each in worlds:
        stand(each, -1.0, 1.0, 270.0, 20.0)
    kept = SceneGraph(name)
    for each in (plain, opened, moved, plain, moved, opened, plain):
        shown, fresh = (graph.draw(each, camera_of(each)) for graph in (kept, SceneGraph(name)))
        assert np.array_equal(shown.rgb, fresh.rgb)
        assert np.array_equal(shown.ids, fresh.ids)
