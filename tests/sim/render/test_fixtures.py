"""Stoves are under their burners and behind their knobs, and hide no other object."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from er_gym.sim.render.camera import Camera
from er_gym.sim.render.fixtures import fixtures
from er_gym.sim.render.panda import geometry
from er_gym.sim.render.pieces import pieces_of
from er_gym.sim.render.scene_graph import SceneGraph
from er_gym.sim.scene import SCENE_NAMES, SCENE_NUMBERS, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.world import World

KITCHENS = [f"FloorPlan{number}" for number in SCENE_NUMBERS["kitchens"]]
EYE = 1.575


def world_of(name: str) -> World:
    return World.load(load_scene(name), Settings())


def ground(world: World) -> float:
    return float(world.high[next(world.of_type("Floor")), 1])


def triangles(name: str) -> NDArray[np.float32]:
    """(F, 3, 3) corners."""
    return np.concatenate([p.vertices[p.triangles] for p in fixtures(name).values()])


def attach(graph: Any, name: str) -> None:
    graph._root.attachNewNode(geometry(pieces_of(fixtures(name)), 0, "fixtures"))


def views(world: World) -> list[Camera]:
    """From the nearest places where one can stand, towards the burners and towards the knobs."""
    found = []
    for kind in ("StoveBurner", "StoveKnob"):
        rows = list(world.of_type(kind))
        middle = (world.low[rows].min(axis=0) + world.high[rows].max(axis=0)) / 2
        away = middle[[0, 2]] - world.scene.reachable
        for k in np.argsort(np.hypot(*away.T))[:10].tolist():
            x, z = world.scene.reachable[k]
            yaw = float(np.degrees(np.arctan2(*away[k])))
            found.append(Camera((x, ground(world) + EYE, z), yaw, 30.0, 90.0, 300, 300))
    return found


def below(name: str, x: float, z: float, high: float) -> float:
    """How high a fixture's level triangles are under a point; minus infinity if there are none."""
    corners = triangles(name).astype(np.float64)
    corners = corners[np.ptp(corners[:, :, 1], axis=1) < 1e-4]
    a, b, c = (corners[:, k][:, [0, 2]] for k in range(3))
    sides = [
        (q[:, 0] - p[:, 0]) * (z - p[:, 1]) - (q[:, 1] - p[:, 1]) * (x - p[:, 0])
        for p, q in ((a, b), (b, c), (c, a))
    ]
    around = np.all(np.array(sides) >= -1e-9, axis=0) | np.all(np.array(sides) <= 1e-9, axis=0)
    heights = corners[around, 0, 1]
    return float(heights[heights < high].max(initial=-np.inf))


def test_only_kitchens_have_stoves() -> None:
    assert [name for name in SCENE_NAMES if fixtures(name)] == KITCHENS


@pytest.mark.parametrize("name", KITCHENS)
def test_a_cooktop_is_right_under_the_burners(name: str) -> None:
    world = world_of(name)
    for i in world.of_type("StoveBurner"):
        # There is one in the middle of the burner, or around it if the burner lies in a hole.
        low, high = world.low[i], world.high[i]
        points = [(low + high) / 2, low + 0.04 * (high - low)]
        gap = low[1] - max(below(name, float(x), float(z), high[1] + 0.002) for x, _, z in points)
        assert -0.006 < gap < 0.015


@pytest.mark.parametrize("name", KITCHENS)
def test_a_stove_is_well_formed(name: str) -> None:
    for patch in fixtures(name).values():
        assert np.isfinite(patch.vertices).all()
        assert ((patch.colours >= 0) & (patch.colours <= 1)).all()
        np.testing.assert_allclose(np.linalg.norm(patch.normals, axis=1), 1.0, atol=1e-3)
    assert len(triangles(name)) < 700


@pytest.mark.parametrize("name", KITCHENS)
def test_nobody_walks_into_a_stove(name: str) -> None:
    world, points = world_of(name), triangles(name).reshape(-1, 3)
    over = points[:, 1] - ground(world)
    assert over.min() > -0.001
    points = points[over < 1.5]
    away = points[:, None, [0, 2]] - world.scene.reachable[None]
    assert np.hypot(away[..., 0], away[..., 1]).min() > 0.15


@pytest.mark.parametrize("name", KITCHENS)
def test_a_stove_hides_neither_burners_nor_knobs(name: str) -> None:
    world, graph = world_of(name), SceneGraph(name)
    numbers = np.array(list(world.of_type("StoveBurner", "StoveKnob"))) + 1
    cameras = views(world)

    def pixels() -> NDArray[np.int64]:
        seen = [np.bincount(graph.draw(world, c).ids.ravel(), minlength=255) for c in cameras]
        most: NDArray[np.int64] = np.max(seen, axis=0)[numbers]
        return most

    before = pixels()
    attach(graph, name)
    assert (pixels() >= np.maximum(0.9 * before, 8)).all()
