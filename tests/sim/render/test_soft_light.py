"""Soft light: from windows and lamps, with shadows under what stands on something."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
import pytest

from er_gym.sim.engine import Engine
from er_gym.sim.errors import ActionFailed
from er_gym.sim.render.bake import bake_of
from er_gym.sim.render.camera import Camera
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.panda import Frames, core, geometry, rasteriser
from er_gym.sim.render.pieces import Piece, pieces_of
from er_gym.sim.render.place import Place
from er_gym.sim.render.scene_graph import SceneGraph, scene_graph_of
from er_gym.sim.render.shades import shade_of
from er_gym.sim.render.soft_light import REACH, Daylight, Lamp, lamps_on, lit
from er_gym.sim.world import World
from er_gym.thor import make_controller
from tests.sim.render.test_scene_graph import camera_of, do, one, stand, world_of

DARK = Daylight(*(np.zeros((0, 3), np.float32),) * 2, np.zeros(0, np.float32))
CHANGES = ("OpenObject", "PickupObject", "ToggleObjectOff", "SliceObject")


def changed(scene: str, actions: int) -> World:
    """A room in which some things have been opened, taken, switched off and cut."""
    world, random = world_of(scene), np.random.default_rng(actions)
    for k in random.permutation(len(world))[: 5 * actions]:
        with suppress(ActionFailed):
            do(world, str(random.choice(CHANGES)), objectId=world.object_ids[k], forceAction=True)
    x, z = random.choice(world.scene.reachable)
    stand(world, x, z, float(random.uniform(0, 360)), 20.0)
    return world


def equal(one_way: Frames, other: Frames) -> bool:
    return np.array_equal(one_way.rgb, other.rgb) and np.array_equal(one_way.ids, other.ids)


@pytest.mark.parametrize("scene", ["FloorPlan3", "FloorPlan212", "FloorPlan320", "FloorPlan405"])
def test_light_changes_nothing_but_colours(scene: str) -> None:
    for actions in range(3):
        world = changed(scene, actions)
        camera = camera_of(world)
        flat, soft = (scene_graph_of(scene, light).draw(world, camera, depth=True)
                      for light in ("flat", "soft"))  # fmt: skip
        assert flat.depth is not None
        assert np.array_equal(flat.depth, soft.depth)
        assert np.array_equal(flat.ids, soft.ids)
        assert (flat.rgb != soft.rgb).mean() > 0.3
        assert abs(float(flat.rgb.mean()) - soft.rgb.mean()) < 30
        assert equal(soft, scene_graph_of(scene, "soft").draw(world, camera))


def test_a_picture_in_soft_light_depends_on_the_state_alone() -> None:
    scene = "FloorPlan301"
    kept, worlds = SceneGraph(scene), [changed(scene, actions) for actions in range(4)]
    lamp = one(worlds[0], "DeskLamp")
    do(worlds[0], "ToggleObjectOff", objectId=worlds[0].object_ids[lamp], forceAction=True)
    box = one(worlds[1], "Dresser")  # what stands on it stays where it is
    worlds[1].set_pose(box, worlds[1].position[box] + (0.3, 0, 0), worlds[1].rotation[box])
    for k in (0, 1, 2, 3, 1, 0, 3):
        camera = camera_of(worlds[k])
        assert equal(kept.draw(worlds[k], camera), SceneGraph(scene).draw(worlds[k], camera)), k


def test_what_was_moved_and_moved_back_is_lit_as_it_was() -> None:
    plain, moved = world_of("FloorPlan1"), world_of("FloorPlan1")
    for kind in ("Toaster", "GarbageCan", "Apple"):
        for offset in (0.25, -0.25):
            moved.move_by(one(moved, kind), np.array([offset, 0.0, offset]))
    graph = SceneGraph("FloorPlan1")
    for x, z in plain.scene.reachable[::25]:
        for yaw in (0.0, 90.0, 180.0, 270.0):
            stand(plain, x, z, yaw, 30.0)
            camera = camera_of(plain)
            assert equal(graph.draw(plain, camera), graph.draw(moved, camera))


# -- lamps and windows -----------------------------------------------------------------------------


def _plate(at: tuple[float, float, float], facing: str) -> Piece:
    mesh = Mesh()
    mesh.panel(at, (0.2, 0.2), (0.5, 0.5, 0.5), facing=facing)  # type: ignore[arg-type]
    (piece,) = pieces_of(mesh.patches())
    return piece


def _mean(piece: Piece, day: Daylight, *lamps: Lamp) -> np.ndarray:
    return np.asarray(lit(piece, Place(), day, lamps).vertices["colour"][:, :3].mean(axis=0))


def test_a_lamp_lights_what_is_near_and_turned_to_it_in_a_warm_colour() -> None:
    lamp = Lamp((0.0, 1.0, 0.0), 0.8, 0.6)
    near, averted, far = _plate((0, 0.5, 0), "Y"), _plate((0, 0.5, 0), "y"), _plate((4, 0, 0), "Y")
    plain = _mean(near, DARK)
    red, green, blue = _mean(near, DARK, lamp) - plain
    assert red > green > blue > 3
    assert np.array_equal(_mean(averted, DARK, lamp), _mean(averted, DARK))
    assert np.array_equal(_mean(far, DARK, lamp), _mean(far, DARK))
    assert REACH * lamp.range < 4.0


def test_what_is_turned_to_a_window_is_lighter_and_undersides_are_darker() -> None:
    window = [np.array([row], np.float32) for row in ((-3.0, 1.5, 0.0), (1.0, 0.0, 0.0))]
    day = Daylight(window[0], window[1], np.array([2.0], np.float32))
    to, away, below, near = (
        float(_mean(_plate(at, facing), day).mean())
        for at, facing in (((0, 1, 0), "x"), ((0, 1, 0), "X"), ((0, 1, 0), "y"), ((-2, 1, 0), "x"))
    )
    assert near > to + 5
    assert to > away + 15
    assert float(_mean(_plate((0, 1, 0), "Y"), day).mean()) > below + 2


def test_the_lamps_that_are_on_light_the_room() -> None:
    world = world_of("FloorPlan301")
    lamp = one(world, "DeskLamp")
    assert len(lamps_on(world)) == 1
    stand(world, 0.5, -0.7, 270.0)
    graph, camera = scene_graph_of("FloorPlan301"), camera_of(world)
    on = graph.draw(world, camera)
    do(world, "ToggleObjectOff", objectId=world.object_ids[lamp], forceAction=True)
    assert lamps_on(world) == ()
    off = graph.draw(world, camera)
    others = (on.ids != lamp + 1) & (on.rgb.astype(int).sum(axis=2) != off.rgb.sum(axis=2))
    assert others.mean() > 0.02
    more = on.rgb[others].astype(int) - off.rgb[others]
    assert (more[:, 0] >= -1).mean() > 0.99
    assert more[:, 0].mean() > more[:, 2].mean() + 1  # warm


# -- shadows ---------------------------------------------------------------------------------------


def test_next_to_no_pixel_of_a_shadow_is_darkened_twice() -> None:
    """Whatever triangles it is made of, and however the edge of the picture cuts them."""
    world = world_of("FloorPlan301")
    shade = bake_of("FloorPlan301").shades[one(world, "Bed")]
    mesh, root, veils = Mesh(), core().NodePath("floor"), core().NodePath("veils")
    mesh.box((0, -0.05, 0), (12, 0.1, 12), (1, 1, 1))
    root.attachNewNode(geometry(pieces_of(mesh.patches()), 1, "floor"))
    veils.attachNewNode(geometry([shade], 0, "veil"))
    least = 255 - shade.vertices["colour"][:, 3].max() - 2
    twice = once = 0
    for x, z, yaw in ((-0.6, 0.8, 30.0), (0.4, 0.2, 250.0), (-1.5, 2.0, 100.0)):
        for horizon in (40.0, 85.0):
            camera = Camera((x, 1.0, z), yaw, horizon, 80.0, 160, 120)
            frames = rasteriser().draw(root, camera, veils=veils)
            seen = frames.rgb[frames.ids == 1]
            twice, once = twice + (seen < least).sum(), once + (seen < least + 30).sum()
    assert once > 30_000
    assert twice < 1e-3 * once  # its depths are rounded


def test_a_shadow_ends_where_what_it_lies_on_ends() -> None:
    for scene in ("FloorPlan1", "FloorPlan301"):
        world, laid = world_of(scene), 0
        day = bake_of(scene).day
        for i in range(len(world)):
            on = world.parents[i]
            shade = shade_of(world, i, i, day)
            if shade is None or not on or world.types[on[0]] == "Floor":
                continue
            points = shade.vertices["at"][:, :2]
            low, high = world.low[on[0]][[0, 2]], world.high[on[0]][[0, 2]]
            assert (low - 1e-3 <= points).all(), world.names[i]
            assert (points <= high + 1e-3).all(), world.names[i]
            assert abs(shade.vertices["at"][0, 2] - world.low[i, 1]) < 0.02
            laid += 1
        assert laid > 5


def test_the_shadow_goes_with_the_thing() -> None:
    world = world_of("FloorPlan1")
    day, apple = bake_of("FloorPlan1").day, one(world, "Apple")
    before = shade_of(world, apple, apple, day)
    world.move_by(apple, np.array([0.05, 0.0, 0.0]))
    after = shade_of(world, apple, apple, day)
    assert before is not None
    assert after is not None
    moved = after.vertices["at"] - before.vertices["at"]
    assert moved[:, 0].mean() == pytest.approx(0.05, abs=0.02)
    do(world, "PickupObject", objectId=world.object_ids[apple], forceAction=True)
    assert shade_of(world, apple, apple, day) is None


# -- asking for it ---------------------------------------------------------------------------------


def _frame(**arguments: Any) -> np.ndarray:
    controller = make_controller(scene="FloorPlan301", width=120, height=90, **arguments)
    frame = controller.last_event.frame
    controller.stop()
    return np.asarray(frame)


def test_what_was_pushed_below_the_floor_can_be_drawn() -> None:
    """Its shadow would be darker than black."""
    world = world_of("FloorPlan215")
    statue = next(world.of_type("Statue"))
    world.relocate(statue, ())
    world.set_pose(statue, world.position[statue] - [0.0, 5.0, 0.0], world.rotation[statue])
    shade = shade_of(world, statue, 0, bake_of("FloorPlan215").day)
    assert shade is not None
    assert shade.vertices["colour"][:, 3].max() == 255


def test_the_light_is_chosen_for_each_controller_and_outlives_a_reset() -> None:
    world = world_of("FloorPlan301")
    for light in ("soft", "flat"):
        drawn = scene_graph_of("FloorPlan301", light).draw(world, camera_of(world, 120, 90)).rgb
        assert np.array_equal(_frame(light=light), drawn)
    assert np.array_equal(_frame(), _frame(light="soft"))
    with pytest.raises(ValueError, match="unknown light 'dim'; choose one of: soft, flat"):
        _frame(light="dim")
    engine = Engine(light="flat")
    engine.step({"action": "Reset", "sceneName": "FloorPlan2"})
    engine.step({"action": "Initialize", "gridSize": 0.1})
    assert engine.world.settings.light == "flat"
