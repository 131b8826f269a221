"""Cached lines of sight equal newly computed ones."""

from __future__ import annotations

import numpy as np
import pytest

from er_gym.sim.controller import EmbeddedController
from er_gym.sim.scene import load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space import line_of_sight
from er_gym.sim.space.changes import Changes
from er_gym.sim.space.compiled_sight import kernel
from er_gym.sim.space.frustum import in_frustum
from er_gym.sim.space.line_of_sight_builder import compute_lines_of_sight, lines_of_sight
from er_gym.sim.space.rays import blocked_by
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World


def random_changes(controller, random, count):
    """Open, close, pick up, put, slice: whatever succeeds of random tries."""
    world = controller.server.engine.world
    for _ in range(count):
        i = int(random.integers(len(world)))
        objects = world.object_ids[i]
        verb = random.choice(
            ["OpenObject", "CloseObject", "PickupObject", "PutObject", "SliceObject", "MoveAhead"]
        )
        arguments = {} if verb == "MoveAhead" else {"objectId": objects, "forceAction": True}
        controller.step(action=str(verb), **arguments)


def blocking(known, viewpoint):
    """How many boxes hide each sample point."""
    return np.bincount(viewpoint.blocked_point, minlength=len(known.point_owner))


def rearrange(controller, seed):
    """Put what is loose elsewhere, by SetObjectPoses, as if the room had just been loaded."""
    controller.step(action="InitialRandomSpawn", randomSeed=seed)
    objects = controller.last_event.metadata["objects"]
    poses = [
        {"objectName": o["name"], "position": o["position"], "rotation": o["rotation"]}
        for o in objects
        if o["pickupable"] or o["moveable"]
    ]
    for _ in range(2):  # the second time it is remembered
        controller.reset()
        assert controller.step(action="SetObjectPoses", objectPoses=poses)


@pytest.fixture(params=["numpy", "compiled"])
def way(request, monkeypatch) -> str:
    """Lines of sight are computed with and without the compiled kernel."""
    if request.param == "numpy":
        monkeypatch.setattr(line_of_sight, "kernel", lambda: None)
    elif kernel() is None:
        pytest.skip("this machine has no C compiler")
    return request.param


@pytest.mark.parametrize("rearranged", [False, True])
@pytest.mark.parametrize("scene", ["FloorPlan1", "FloorPlan16", "FloorPlan203", "FloorPlan403"])
def test_the_difference_from_the_record_gives_what_all_boxes_give(
    scene: str, rearranged: bool, monkeypatch
) -> None:
    random = np.random.default_rng(len(scene))
    monkeypatch.setattr(line_of_sight, "kernel", lambda: None)
    with EmbeddedController(scene=scene, headless=True, visibilityDistance=20) as controller:
        if rearranged:
            rearrange(controller, seed=1)
        world = controller.server.engine.world
        assert (world.base is not None) == rearranged
        changed = moved = 0
        for _ in range(25):
            random_changes(controller, random, 6)
            known, anew = lines_of_sight(world), compute_lines_of_sight(world)
            changed += known.base is not None
            moved += known.moved_points is not None
            camera = world.agent.camera
            there = ~anew.concealed[anew.point_owner]
            whole = {i: [] for i in range(len(world))}
            for i, point in zip(anew.point_owner, anew.points, strict=True):
                whole[int(i)].append(point)
            mine, theirs = known.viewpoint(camera), anew.viewpoint(camera)
            for i in np.unique(anew.point_owner[there]).tolist():
                span = slice(known.first_point[i], known.first_point[i] + known.point_count[i])
                assert (known.points[span] == np.array(whole[i])).all()
                expected = blocking(anew, theirs)[
                    anew.first_point[i] : anew.first_point[i] + anew.point_count[i]
                ]
                assert (blocking(known, mine)[span] == expected).all()
                clear = known.unobstructed(camera[None], known.points[span], i)
                assert (clear[0] == (expected == 0)).all()
            assert set(known.point_owner[mine.clear_points]) == set(
                anew.point_owner[theirs.clear_points]
            )
            assert (visible(world) == visible(world)).all()
        assert changed
        assert moved


@pytest.mark.parametrize("scene", ["FloorPlan1", "FloorPlan216", "FloorPlan303", "FloorPlan420"])
def test_the_kernel_that_leaves_out_what_cannot_be_leaves_out_nothing_else(scene: str) -> None:
    world = World.load(load_scene(scene), Settings())
    known = compute_lines_of_sight(world)
    for x, z in world.scene.reachable[::15]:
        eye = np.array([x, world.agent.camera[1], z])
        blocked = blocked_by(
            eye[None].astype(np.float32), known.points, known.box_low, known.box_high
        )
        expected = (blocked & ~known.exempt_boxes[known.point_owner]).sum(axis=1)
        assert expected.any()
        assert (blocking(known, known.viewpoint(eye)) == expected).all()


def test_what_looks_as_recorded_again_is_known_as_such() -> None:
    with EmbeddedController(scene="FloorPlan1", headless=True) as controller:
        world = controller.server.engine.world
        before = lines_of_sight(world)
        fridge = next(world.of_type("Fridge"))
        for _ in range(2):
            controller.step("OpenObject", objectId=world.object_ids[fridge], forceAction=True)
            opened = lines_of_sight(world)
            assert opened is not before
            controller.step("CloseObject", objectId=world.object_ids[fridge], forceAction=True)
            assert lines_of_sight(world) is before
        controller.step("OpenObject", objectId=world.object_ids[fridge], forceAction=True)
        assert lines_of_sight(world) is opened


def test_what_is_cut_up_behind_a_closed_door_is_hidden_and_then_seen(way: str) -> None:
    with EmbeddedController(scene="FloorPlan1", headless=True, visibilityDistance=20) as controller:
        world = controller.server.engine.world
        tomato, fridge = (world.object_ids[next(world.of_type(t))] for t in ("Tomato", "Fridge"))
        pose = {"x": -1.0, "z": 1.0, "rotation": 270, "horizon": 30, "standing": True}
        controller.step("TeleportFull", **pose)
        for action, thing in (
            ("PickupObject", tomato),
            ("OpenObject", fridge),
            ("PutObject", fridge),
            ("CloseObject", fridge),
            ("SliceObject", tomato),
        ):
            assert controller.step(action, objectId=thing, forceAction=True)
        slices = list(world.of_type("TomatoSliced"))
        assert slices
        assert not visible(world)[slices].any()
        controller.step("OpenObject", objectId=fridge, forceAction=True)
        assert (visible(world) == _seen_by_all(world)).all()
        assert visible(world)[slices].any()


def _seen_by_all(world):
    """What is seen, computed without any other arrangement."""
    anew = compute_lines_of_sight(world)
    seen = np.zeros(len(world), dtype=bool)
    camera = world.agent.camera
    clear = anew.viewpoint(camera).clear_points
    lens = (world.agent.rotation, world.agent.horizon, 90.0, 1.0)
    seen[anew.point_owner[clear[in_frustum(anew.points[clear] - camera, *lens)]]] = True
    return seen


def test_changes_that_are_known_from_a_place_give_what_all_boxes_give(monkeypatch) -> None:
    """Each change is remembered by itself, the second time that it is seen from a place."""
    known, worked_out = Changes.hidden_from, []

    def noted(self, eye):
        found = known(self, eye)
        worked_out.append(found is not None)
        return found

    monkeypatch.setattr(Changes, "hidden_from", noted)
    monkeypatch.setattr(line_of_sight, "kernel", lambda: None)
    with EmbeddedController(scene="FloorPlan1", headless=True, visibilityDistance=20) as controller:
        world = controller.server.engine.world

        def do(action, kind):
            thing = world.object_ids[next(world.of_type(kind))]
            assert controller.step(action, objectId=thing, forceAction=True)

        poses = [
            {"x": -1.0, "z": 1.0, "rotation": rotation, "horizon": 30, "standing": True}
            for rotation in (270, 0)
        ]
        for combination in (
            [("OpenObject", "Fridge")],
            [("OpenObject", "Fridge"), ("OpenObject", "Microwave")],
            [("PickupObject", "Apple"), ("OpenObject", "Fridge"), ("PutObject", "Fridge")],
            [("OpenObject", "Drawer"), ("OpenObject", "Fridge")],
            [("OpenObject", "Fridge"), ("PickupObject", "Tomato"), ("PutObject", "Fridge")],
        ) * 2:
            controller.reset("FloorPlan1")
            world = controller.server.engine.world
            for action, kind in combination:
                controller.step("TeleportFull", **poses[0], forceAction=True)
                do(action, kind)
            for pose in poses:
                controller.step("TeleportFull", **pose, forceAction=True)
                assert (visible(world) == _seen_by_all(world)).all(), combination
    assert sum(worked_out) > 2
    assert not all(worked_out)


@pytest.mark.parametrize("scene", ["FloorPlan1", "FloorPlan216"])
def test_a_picture_needs_only_the_rays_to_what_is_in_it(scene: str) -> None:
    random = np.random.default_rng(7)
    with EmbeddedController(scene=scene, headless=True, visibilityDistance=20) as controller:
        rearrange(controller, seed=2)
        world = controller.server.engine.world
        random_changes(controller, random, 12)
        known, camera = lines_of_sight(world), world.agent.camera
        whole = known.viewpoint(camera).clear_points
        for rotation in (0.0, 90.0, 200.0):
            lens = (rotation, 0.0, 90.0, 16 / 9)
            inside = in_frustum(known.points[whole] - camera, *lens)
            assert known.clear_in_view(camera, lens).tolist() == whole[inside].tolist()
            assert len(known.viewpoint(camera, lens).blocked_point) < len(
                known.viewpoint(camera).blocked_point
            )


@pytest.mark.skipif(kernel() is None, reason="this machine has no C compiler")
@pytest.mark.parametrize("scene", ["FloorPlan7", "FloorPlan201", "FloorPlan311", "FloorPlan415"])
def test_the_compiled_kernel_answers_as_numpy_does(scene: str, monkeypatch) -> None:
    random = np.random.default_rng(len(scene))
    with EmbeddedController(scene=scene, headless=True, visibilityDistance=20) as controller:
        world = controller.server.engine.world
        floor = world.scene.reachable
        looks = seen = open_lines = lines = 0
        for _ in range(12):
            random_changes(controller, random, 6)
            known = lines_of_sight(world)
            cameras = np.insert(random.permutation(floor)[:5], 1, world.agent.camera[1], axis=1)
            before = random.choice(known.points, 5) - [0.05, 0.0, 0.0]  # nearer than the near plane
            cameras = np.concatenate([cameras, before])
            objects = random.choice(len(world), 4, replace=False).tolist()
            for camera in cameras:
                # No tilt, so that points lie on the picture's edge: a room is full of right angles.
                for rotation, horizon, aspect in (
                    (90.0, 0.0, 1.0),
                    (45.0, 30.0, 1.0),
                    (200.0, -30.0, 16 / 9),
                ):
                    lens = (rotation, horizon, 90.0, aspect)
                    compiled = known.look(camera, lens)
                    with monkeypatch.context() as patch:
                        patch.setattr(line_of_sight, "kernel", lambda: None)
                        assert (known.look(camera, lens) == compiled).all()
                    looks, seen = looks + len(compiled), seen + int(compiled.sum())
            for i in objects:
                span = slice(known.first_point[i], known.first_point[i] + known.point_count[i])
                compiled = known.unobstructed(cameras, known.points[span], i)
                with monkeypatch.context() as patch:
                    patch.setattr(line_of_sight, "kernel", lambda: None)
                    assert (known.unobstructed(cameras, known.points[span], i) == compiled).all()
                lines, open_lines = lines + compiled.size, open_lines + int(compiled.sum())
        assert 0.05 < seen / looks < 0.5
        assert 0.05 < open_lines / lines < 0.95
