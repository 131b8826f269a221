"""Shapes that overlap each other: a sink and its basin, blinds and their window."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from er_gym.sim.render.appearance import Appearance
from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.palette import palette
from er_gym.sim.render.shapes import SHAPES
from er_gym.sim.render.shapes.hangings import across


def _look(kind: str, size: tuple[float, float, float], asset: str = "") -> Appearance:
    scene = "FloorPlan401"
    return Appearance(kind, asset, scene, "bathrooms", size, 0.0, palette(scene))


def _points(look: Appearance) -> np.ndarray:
    return np.concatenate([p.vertices for p in SHAPES[look.kind](look).patches().values()])


def _height_at(mesh: Mesh, x: float, z: float) -> float:
    """Of the highest triangle over a place, minus infinity where there is none."""
    best = -np.inf
    for patch in mesh.patches().values():
        a, b, c = (patch.vertices[patch.triangles[:, k]].astype(np.float64) for k in range(3))
        sides = np.stack([b - a, c - a], axis=2)[:, [0, 2]]
        flat = np.abs(np.linalg.det(sides)) > 1e-9
        share = np.linalg.solve(sides[flat], (np.array([x, z]) - a[flat][:, [0, 2]])[..., None])
        u, v = share[:, 0, 0], share[:, 1, 0]
        over = (u >= 0) & (v >= 0) & (u + v <= 1)
        y = a[flat][:, 1] + u * (b - a)[flat][:, 1] + v * (c - a)[flat][:, 1]
        best = max(best, *y[over].tolist(), -np.inf)
    return best


@pytest.mark.parametrize(
    ("kind", "size", "basin", "lift"),
    [
        ("Sink", (0.66, 0.15, 0.44), (0.32, 0.13, 0.33), 0.0),
        ("Sink", (0.60, 0.13, 0.40), (0.57, 0.13, 0.37), 0.0),
        ("Sink", (0.85, 0.25, 0.55), (0.69, 0.14, 0.40), 0.09),
        ("Sink", (0.72, 1.05, 0.73), (0.32, 0.17, 0.32), 0.82),
        ("Bathtub", (1.37, 0.59, 2.45), (0.68, 0.42, 1.82), 0.01),
    ],
)
def test_one_sees_into_a_basin(
    kind: str,
    size: tuple[float, float, float],
    basin: tuple[float, float, float],
    lift: float,
) -> None:
    # Beside the drain, which is in the middle.
    x, z = 0.3 * basin[0] / 2, 0.3 * basin[2] / 2
    hull = _height_at(SHAPES[kind](_look(kind, size)), x, z)
    floor = lift + _height_at(SHAPES[f"{kind}Basin"](_look(f"{kind}Basin", basin)), x, z)
    assert hull < floor


def test_a_filled_basin_holds_water_below_its_lip() -> None:
    look = _look("SinkBasin", (0.4, 0.14, 0.35))
    dry = _height_at(SHAPES["SinkBasin"](look), 0.1, 0.05)
    wet = _height_at(SHAPES["SinkBasin"](replace(look, filled="water")), 0.1, 0.05)
    assert dry < wet < 0.14


def test_blinds_recorded_short_come_down_when_open() -> None:
    look = _look("Blinds", (1.0, 0.2, 0.03), "Blinds_1")
    assert _points(look)[:, 1].min() >= -1e-6
    assert _points(replace(look, openness=1.0))[:, 1].min() == pytest.approx(-1.0, abs=0.01)


def test_blinds_recorded_long_are_gathered_when_shut() -> None:
    look = _look("Blinds", (1.0, 1.2, 0.03), "Blinds_1")
    assert _points(look)[:, 1].min() == pytest.approx(1.0, abs=0.01)
    assert _points(replace(look, openness=1.0))[:, 1].min() == pytest.approx(0.0, abs=0.01)


@pytest.mark.parametrize("kind", ["Window", "Mirror", "Painting", "Poster", "ShowerDoor", "Blinds"])
def test_what_is_flat_stands_along_its_longer_side(kind: str) -> None:
    look = _look(kind, (0.06, 1.2, 0.9))
    assert across(look) == (0.9, 1.2, 0.06, True)
    reach = np.ptp(_points(look), axis=0)
    assert reach[2] == pytest.approx(0.9, abs=0.01)
    assert reach[0] < 0.2


def test_a_skin_faces_outwards_when_it_goes_up() -> None:
    angle = np.arange(8) / 8 * 2 * np.pi
    rings = [np.stack([np.cos(angle), np.full(8, y), np.sin(angle)], axis=1) for y in (0.0, 1.0)]
    mesh = Mesh()
    mesh.skin(rings, (1.0, 1.0, 1.0))
    patch = mesh.patches()["plain"]
    assert ((patch.vertices * patch.normals)[:, [0, 2]].sum(axis=1) > 0.9).all()
