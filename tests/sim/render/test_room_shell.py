from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from support import in_one_test

from er_gym.sim.agent import AGENT_HEIGHT, Agent
from er_gym.sim.render.camera import Camera
from er_gym.sim.render.doorway import WIDTH, doorway
from er_gym.sim.render.floor_plan import floor_plan
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.panda import core, geometry, rasteriser
from er_gym.sim.render.patch import Patch
from er_gym.sim.render.pieces import pieces_of
from er_gym.sim.render.room_shell import room_shell
from er_gym.sim.scene import SCENE_NAMES, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.solids import solid_of
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World

FLOOR = 250


def drawn(root: Any, patches: dict[str, Patch], number: int, name: str) -> Any:
    return root.attachNewNode(geometry(pieces_of(patches), number, name))


def boxes(world: World, i: int) -> dict[str, Patch]:
    """An object as the boxes that the engine takes it for."""
    mesh = Mesh()
    for low, high in solid_of(world, i).boxes:
        x, y, z = ((low + high) / 2).tolist()
        w, h, d = np.maximum(high - low, 0.004).tolist()
        mesh.box((x, y, z), (w, h, d), (1, 1, 1))
    return mesh.patches()


@in_one_test("name", SCENE_NAMES)
def test_one_can_stand_where_one_can_stand(name: str) -> None:
    plan, places = floor_plan(name), load_scene(name).reachable
    assert all(plan.contains(place) for place in places)
    for wall in plan.walls:
        along = places[:, 1 - wall.axis]
        before = (wall.low < along) & (along < wall.high)
        away = wall.sign * (places[before, wall.axis] - wall.at)
        assert (away[away > 0] > 0.2).all()


@in_one_test("name", SCENE_NAMES)
def test_walls_are_around_the_room_and_face_it(name: str) -> None:
    plan = floor_plan(name)
    for wall in plan.walls:
        along = (wall.low + wall.high) / 2
        for off, inside in ((0.01, True), (-0.01, False)):
            at = wall.at + wall.sign * off
            point = (at, along) if wall.axis == 0 else (along, at)
            assert plan.contains(np.array(point)) == inside
    around = sum(wall.high - wall.low for wall in plan.walls)
    assert around >= 2 * (np.ptp(plan.xs) + np.ptp(plan.zs)) - 1e-6


@in_one_test("name", SCENE_NAMES)
def test_things_within_reach_are_in_the_room(name: str) -> None:
    scene, plan = load_scene(name), floor_plan(name)
    low, high = scene.aabb_center - scene.aabb_size / 2, scene.aabb_center + scene.aabb_size / 2
    for i, kind in enumerate(scene.types):
        near = np.clip(scene.reachable, low[i, ::2], high[i, ::2])
        if kind in ("Floor", "Window") or np.linalg.norm(near - scene.reachable, axis=1).min() > 1:
            continue
        assert plan.contains(scene.aabb_center[i, ::2]), scene.object_ids[i]
        assert high[i, 1] < plan.ceiling


@pytest.mark.parametrize("name", ["FloorPlan8", "FloorPlan208", "FloorPlan325", "FloorPlan427"])
def test_walls_hide_nothing_that_is_visible(name: str) -> None:
    scene = load_scene(name)
    world, shell = World.load(scene, Settings()), room_shell(name)
    root = core().NodePath("room")
    room = drawn(root, shell.rest, 0, "shell")
    for i in range(len(world)):
        patches = shell.floor if world.types[i] == "Floor" else boxes(world, i)
        drawn(root, patches, i + 1, world.names[i])
    ground = floor_plan(name).ground
    for x, z in scene.reachable[:: len(scene.reachable) // 12]:
        for yaw in (0.0, 90.0, 180.0, 270.0):
            agent = Agent(np.array([x, ground + AGENT_HEIGHT, z]), yaw)
            camera = Camera(agent.camera, yaw, 0.0, 90.0, 200, 200)
            with_walls = set(rasteriser().draw(root, camera).ids.ravel().tolist())
            room.hide()
            without = set(rasteriser().draw(root, camera).ids.ravel().tolist())
            room.show()
            seen = {int(i) + 1 for i in np.flatnonzero(visible(world, agent))}
            assert (seen & without) - {world.types.index("Floor") + 1} <= with_walls


def test_windows_stand_in_holes() -> None:
    """The pane of a deep window is behind the plane of the wall."""
    scene, plan = load_scene("FloorPlan1"), floor_plan("FloorPlan1")
    i = scene.types.index("Window")
    low, high = scene.aabb_center[i] - scene.aabb_size[i] / 2, scene.aabb_center[i] + 0.0
    mesh, root = Mesh(), core().NodePath("room")
    x, y, z = scene.aabb_center[i].tolist()
    mesh.box((low[0] + 0.02, y, z), (0.01, *scene.aabb_size[i, 1:].tolist()), (0, 0, 1))
    assert low[0] + 0.03 < min(wall.at for wall in plan.walls if wall.axis == 0)
    drawn(root, room_shell("FloorPlan1").rest, 0, "shell")
    drawn(root, mesh.patches(), 9, "pane")
    frames = rasteriser().draw(root, Camera((x + 1.5, high[1], z), 270.0, 0.0, 60.0, 64, 64))
    assert frames.ids[32, 32] == 9


@pytest.mark.parametrize("name", ["FloorPlan1", "FloorPlan223", "FloorPlan420"])
def test_from_above_one_looks_into_the_room(name: str) -> None:
    shell, plan = room_shell(name), floor_plan(name)
    root = core().NodePath("room")
    drawn(root, shell.rest, 0, "shell")
    drawn(root, shell.floor, FLOOR, "floor")
    x, z = load_scene(name).reachable.mean(axis=0)
    camera = Camera((x, plan.ceiling + 3.0, z), 0.0, 90.0, 60.0, 64, 64)
    assert rasteriser().draw(root, camera).ids[32, 32] == FLOOR


@pytest.mark.parametrize("name", ["FloorPlan1", "FloorPlan208", "FloorPlan403"])
def test_it_is_darker_towards_the_edges(name: str) -> None:
    floor, plan = room_shell(name).floor, floor_plan(name)
    (patch,) = floor.values()
    middle = np.linalg.norm(
        patch.vertices[:, ::2] - load_scene(name).reachable.mean(axis=0), axis=1
    )
    corner = np.linalg.norm(patch.vertices[:, ::2] - (plan.xs[0], plan.zs[0]), axis=1)
    light = patch.colours.mean(axis=1)
    assert light[corner.argmin()] < 0.9 * light[middle.argmin()]


@pytest.mark.parametrize("name", SCENE_NAMES[::10])
def test_shells_are_few_triangles_of_proper_numbers_and_always_the_same(name: str) -> None:
    shell = room_shell(name)
    room_shell.cache_clear()
    again = room_shell(name)
    count = 0
    for one, other in ((shell.floor, again.floor), (shell.rest, again.rest)):
        assert one.keys() == other.keys()
        for material, patch in one.items():
            count += len(patch.triangles)
            assert np.array_equal(patch.vertices, other[material].vertices)
            assert np.array_equal(patch.colours, other[material].colours)
            assert np.isfinite(patch.vertices).all()
            assert (patch.colours >= 0).all()
            assert (patch.colours <= 1).all()
            assert (patch.triangles < len(patch.vertices)).all()
    assert count < 2500


def test_most_rooms_have_a_door_at_a_free_stretch_of_wall() -> None:
    doors = {name: doorway(name) for name in SCENE_NAMES}
    assert sum(found is not None for found in doors.values()) > 100
    for name, found in doors.items():
        if found is None:
            continue
        scene, wall = load_scene(name), found.wall
        assert wall.low <= found.along - WIDTH / 2
        assert found.along + WIDTH / 2 <= wall.high
        away = np.linalg.norm(scene.reachable - found.at, axis=1)
        assert away.min() < 1.1
        for i, kind in enumerate(scene.types):
            if kind in ("LightSwitch", "Painting", "Window", "Mirror"):
                gap = np.abs(scene.aabb_center[i, ::2] - found.at) - scene.aabb_size[i, ::2] / 2
                along = gap[1 - wall.axis]
                assert gap[wall.axis] > 0.1 or along > WIDTH / 2, (name, scene.object_ids[i])
