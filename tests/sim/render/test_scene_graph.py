"""The renderer draws the right objects, at their positions and in their states."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from functools import cache
from hashlib import sha256

import numpy as np
import pytest
from houses_by_hand import three_rooms
from support import in_one_test

from er_gym.sim.actions import perform
from er_gym.sim.agent import Agent
from er_gym.sim.house.build import house_scene
from er_gym.sim.render.appearance import Appearance, compute_appearance
from er_gym.sim.render.camera import Camera
from er_gym.sim.render.panda import FAR
from er_gym.sim.render.scene_graph import scene_graph_of
from er_gym.sim.render.shapes import SHAPES, UNSEEN, build, without_shape
from er_gym.sim.scene import SCENE_NAMES, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.world import World
from er_gym.thor import OBJECT_TYPES


def world_of(scene: str) -> World:
    return World.load(load_scene(scene), Settings(visibility_distance=20.0))


def camera_of(world: World, width: int = 200, height: int = 150, fov: float = 90.0) -> Camera:
    agent = world.agent
    return Camera(agent.camera, agent.rotation, agent.horizon, fov, width, height)


def do(world: World, action: str, **arguments: object) -> None:
    perform(world, {"action": action, **arguments})


def stand(world: World, x: float, z: float, rotation: float, horizon: float = 0.0) -> None:
    y = world.agent.position[1]
    world.place_agent(Agent(np.array([x, y, z]), rotation, horizon))


def one(world: World, kind: str) -> int:
    return next(world.of_type(kind))


# -- the table -------------------------------------------------------------------------------------


def test_every_type_has_a_shape() -> None:
    assert without_shape(list(OBJECT_TYPES)) == []
    assert without_shape(["Fridge", "NoSuchThing"]) == ["NoSuchThing"]


MADE = {"Sliced": "SliceObject", "Cracked": "BreakObject"}
"""How the names of types end that no scene begins with, and the action that makes them."""


def _world_with(kind: str, scene_name: str) -> World | None:
    """The scene with a thing of the type in it, made if need be; None where it cannot be."""
    types = load_scene(scene_name).types
    if kind in types:
        return world_of(scene_name)
    for end, action in MADE.items():
        whole = kind.removesuffix(end)
        if whole != kind and whole in types:
            world = world_of(scene_name)
            thing = world.object_ids[one(world, whole)]
            do(world, action, objectId=thing, forceAction=True)
            return world
    return None


@cache
def _looks(kind: str) -> list[Appearance]:
    """One to four things of a type, of different assets, in their plain state."""
    found: dict[str, Appearance] = {}
    for name in (*SCENE_NAMES[::3], *SCENE_NAMES[1::3], *SCENE_NAMES[2::3]):
        scene = load_scene(name)
        if kind in scene.types and scene.asset_ids[scene.types.index(kind)] in found:
            continue  # seen already, and a world takes time to load
        if (world := _world_with(kind, name)) is not None:
            thing = one(world, kind)
            found[world.asset_ids[thing]] = compute_appearance(world, thing)
        if len(found) == (1 if kind.endswith(tuple(MADE)) else 4):
            break
    if kind in ("Doorway", "Doorframe"):
        world = World.load(house_scene(three_rooms()), Settings())
        found[""] = compute_appearance(world, one(world, kind))
    assert found, f"no scene has a {kind}, and none can be made: its shape would not be checked"
    off = {"openness": 0.0, "on": False, "filled": "", "dirty": False, "broken": False}
    return [replace(look, **off) for look in found.values()]  # type: ignore[arg-type]


@in_one_test("kind", sorted(OBJECT_TYPES.keys() - UNSEEN))
def test_shapes_are_well_formed_in_every_state(kind: str) -> None:
    for plain in _looks(kind):
        for look in (
            plain,
            replace(plain, openness=1.0, on=True, filled="coffee"),
            replace(plain, openness=0.3, dirty=True, cooked=True, broken=True, used_up=True),
        ):
            patches = build(look)
            assert patches, look
            for patch in patches.values():
                assert np.isfinite(patch.vertices).all()
                assert np.isfinite(patch.uv).all()
                assert (patch.colours >= 0).all()
                assert np.allclose(np.linalg.norm(patch.normals, axis=1), 1.0, atol=1e-3)
                assert patch.triangles.min() >= 0
                assert patch.triangles.max() < len(patch.vertices)
            assert sum(len(patch.triangles) for patch in patches.values()) < 2500


@in_one_test("kind", sorted(SHAPES))
def test_shapes_fill_the_size_that_they_are_given(kind: str) -> None:
    for look in _looks(kind):
        points = np.concatenate([patch.vertices for patch in build(look).values()])
        size = np.array(look.size)
        inside = (np.abs(points[:, [0, 2]]) <= size[[0, 2]] / 2 + 0.12).all()
        assert inside, (look, points.min(axis=0), points.max(axis=0))
        spread = np.ptp(points, axis=0)
        assert (spread >= 0.4 * size).sum() >= 2, (look, spread)


STATES = {
    "Fridge": {"openness": 1.0},
    "Cabinet": {"openness": 1.0},
    "Microwave": {"openness": 1.0},
    "Safe": {"openness": 1.0},
    "Box": {"openness": 1.0},
    "Book": {"openness": 1.0},
    "Laptop": {"on": True},
    "Toilet": {"openness": 1.0},
    "Blinds": {"openness": 1.0},
    "ShowerCurtain": {"openness": 1.0},
    "DeskLamp": {"on": True},
    "FloorLamp": {"on": True},
    "Television": {"on": True},
    "StoveBurner": {"on": True},
    "Faucet": {"on": True},
    "Toaster": {"on": True},
    "CoffeeMachine": {"on": True},
    "Candle": {"on": True},
    "Mug": {"filled": "coffee"},
    "Pot": {"filled": "water"},
    "Plate": {"dirty": True},
    "Potato": {"cooked": True},
    "Bowl": {"broken": True},
    "Vase": {"broken": True},
    "ToiletPaper": {"used_up": True},
}


@pytest.mark.parametrize("kind", STATES)
def test_states_can_be_seen(kind: str) -> None:
    for look in _looks(kind):
        before, after = build(look), build(replace(look, **STATES[kind]))
        same = before.keys() == after.keys() and all(
            np.array_equal(before[m].vertices, after[m].vertices)
            and np.array_equal(before[m].colours, after[m].colours)
            for m in before
        )
        assert not same, look


# -- the picture -----------------------------------------------------------------------------------


def test_depth_is_measured_along_the_line_of_view() -> None:
    world = world_of("FloorPlan1")
    for horizon in (90.0, 60.0):
        stand(world, 1.5, 0.5, 0.0, horizon)
        frames = scene_graph_of("FloorPlan1").draw(world, camera_of(world), depth=True)
        assert frames.depth is not None
        lift = world.agent.camera[1] - world.high[one(world, "Floor"), 1]
        assert frames.ids[75, 100] == one(world, "Floor") + 1
        expected = lift / np.sin(np.radians(horizon))
        assert frames.depth[75, 100] == pytest.approx(expected, abs=0.02)
    assert (frames.depth <= FAR).all()


def test_instances_are_where_the_boxes_are() -> None:
    world = world_of("FloorPlan1")
    right = total = 0
    for x, z in world.scene.reachable[::9]:
        for rotation in (0.0, 90.0, 180.0, 270.0):
            stand(world, x, z, rotation, 20.0)
            camera = camera_of(world)
            ids = scene_graph_of("FloorPlan1").draw(world, camera).ids
            assert ids.max() <= len(world)
            for number in np.unique(ids[ids > 0]):
                i = int(number) - 1
                if world.types[i] in ("Floor", "CounterTop"):
                    continue
                corners = np.array(np.meshgrid(*np.stack([world.low[i], world.high[i]]).T))
                pixels = camera.project(corners.reshape(3, -1).T)
                if (pixels[:, 2] < 0.2).any():
                    continue
                rows, columns = np.nonzero(ids == number)
                (left, top), (right_, low) = pixels[:, :2].min(axis=0), pixels[:, :2].max(axis=0)
                inside = (columns > left - 8) & (columns < right_ + 8)
                inside &= (rows > top - 8) & (rows < low + 8)
                right, total = right + int(inside.sum()), total + len(rows)
    assert total > 100_000
    assert right / total > 0.98


def test_what_is_shut_away_is_not_drawn_until_it_is_opened() -> None:
    world = world_of("FloorPlan1")
    fridge, egg = one(world, "Fridge"), one(world, "Egg")
    assert fridge in world.parents[egg]
    stand(world, -1.0, 1.0, 270.0, 20.0)
    seen = set()
    for _ in range(2):
        shut = scene_graph_of("FloorPlan1").draw(world, camera_of(world)).ids
        assert egg + 1 not in shut
        assert fridge + 1 in shut
        do(world, "OpenObject", objectId=world.object_ids[fridge], forceAction=True)
        seen |= set(
            np.unique(scene_graph_of("FloorPlan1").draw(world, camera_of(world)).ids).tolist()
        )
        do(world, "CloseObject", objectId=world.object_ids[fridge], forceAction=True)
    inside = {i + 1 for i in world.inside(fridge)}
    assert inside & seen


def test_what_is_held_is_in_the_lower_half_of_the_picture() -> None:
    world = world_of("FloorPlan1")
    apple = one(world, "Apple")
    do(world, "PickupObject", objectId=world.object_ids[apple], forceAction=True)
    for rotation, horizon in ((0.0, 0.0), (135.0, 30.0), (270.0, -30.0)):
        stand(world, 1.0, 1.0, rotation, horizon)
        rows, columns = np.nonzero(
            scene_graph_of("FloorPlan1").draw(world, camera_of(world)).ids == apple + 1
        )
        assert len(rows) > 50
        assert rows.mean() > 75
        assert abs(columns.mean() - 100) < 15


def test_worlds_of_the_same_scene_do_not_show_each_other() -> None:
    one_world, other = world_of("FloorPlan212"), world_of("FloorPlan212")
    lamp = one_world.object_ids[one(one_world, "FloorLamp")]
    plain = scene_graph_of("FloorPlan212").draw(one_world, camera_of(one_world)).rgb
    stand(other, 0.0, 0.0, 0.0)
    television = other.object_ids[one(other, "Television")]
    do(other, "ToggleObjectOn", objectId=television, forceAction=True)
    do(other, "ToggleObjectOff", objectId=lamp, forceAction=True)
    for _ in range(2):
        scene_graph_of("FloorPlan212").draw(other, camera_of(other))
        assert (
            scene_graph_of("FloorPlan212").draw(one_world, camera_of(one_world)).rgb == plain
        ).all()


@pytest.mark.parametrize(
    ("width", "height", "fov"), [(64, 64, 30), (1280, 960, 150), (333, 97, 90)]
)
def test_any_size_and_field_of_view(width: int, height: int, fov: float) -> None:
    world = world_of("FloorPlan403")
    frames = scene_graph_of("FloorPlan403").draw(
        world, camera_of(world, width, height, fov), depth=True
    )
    assert frames.rgb.shape == (height, width, 3)
    assert frames.ids.shape == frames.depth.shape == (height, width)  # type: ignore[union-attr]
    assert frames.rgb.std() > 5


_PRINT = """
from hashlib import sha256
from tests.sim.render.test_scene_graph import picture_bytes
print(sha256(picture_bytes()).hexdigest())
"""


def picture_bytes() -> bytes:
    found = b""
    for scene in ("FloorPlan5", "FloorPlan217", "FloorPlan311", "FloorPlan413"):
        world = world_of(scene)
        floor = world.scene.reachable
        middle = floor[np.linalg.norm(floor - floor.mean(axis=0), axis=1).argmin()]
        stand(world, *middle, 0.0)
        frames = scene_graph_of(scene).draw(world, camera_of(world), depth=True)
        found += frames.rgb.tobytes() + frames.ids.tobytes() + frames.depth.tobytes()  # type: ignore[union-attr]
    return found


def test_the_same_bytes_in_any_process() -> None:
    here = sha256(picture_bytes()).hexdigest()
    assert sha256(picture_bytes()).hexdigest() == here
    for hash_seed in ("1", "2"):
        other = subprocess.run(
            [sys.executable, "-c", _PRINT],
            check=True, capture_output=True, text=True,
            env={"PYTHONHASHSEED": hash_seed, "PYTHONPATH": ":".join(p for p in sys.path if p)},
        )  # fmt: skip
        assert other.stdout.strip() == here
