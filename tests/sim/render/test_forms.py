"""Pickupable objects fill their boxes in every orientation."""

from __future__ import annotations

import numpy as np
import pytest

from er_gym.sim.render.mesh import Mesh
from er_gym.sim.render.patch import Triple
from er_gym.sim.render.shapes.forms import laid, leant


def _corners(mesh: Mesh) -> tuple[np.ndarray, np.ndarray]:
    points = np.concatenate([patch.vertices for patch in mesh.patches().values()])
    return points.min(axis=0), points.max(axis=0)


def _slab(size: Triple) -> Mesh:
    mesh = Mesh()
    mesh.box((0, size[1] / 2, 0), size, (1, 1, 1))
    mesh.panel((0, size[1], 0), (size[0], size[2]), (1, 1, 1), "card", facing="Y")
    return mesh


@pytest.mark.parametrize(
    ("size", "shown"),
    [((0.2, 0.02, 0.3), "y"), ((0.2, 0.3, 0.02), "z"), ((0.02, 0.3, 0.2), "x")],
    ids=["flat", "facing forwards", "facing sideways"],
)
def test_the_upper_side_of_what_is_laid_faces_along_the_shortest_side(
    size: Triple, shown: str
) -> None:
    mesh = laid(size, _slab)
    low, high = _corners(mesh)
    assert low == pytest.approx((-size[0] / 2, 0, -size[2] / 2), abs=1e-6)
    assert high == pytest.approx((size[0] / 2, size[1], size[2] / 2), abs=1e-6)
    assert mesh.patches()["card"].normals[0]["xyz".index(shown)] == pytest.approx(1.0)


@pytest.mark.parametrize(
    "size",
    [(0.08, 0.96, 0.08), (0.96, 0.08, 0.08), (0.08, 0.08, 0.96), (0.24, 0.96, 0.09),
     (0.08, 0.94, 0.33), (0.78, 0.69, 0.12)],
)  # fmt: skip
def test_what_is_leant_goes_from_end_to_end_of_its_box(size: Triple) -> None:
    def rod(length: float) -> Mesh:
        mesh = Mesh()
        mesh.cylinder((0, length / 2, 0), 0.035, length, (1, 1, 1))
        return mesh

    low, high = _corners(leant(size, 0.07, rod))
    assert (low >= np.array([-size[0] / 2, 0, -size[2] / 2]) - 0.015).all()
    assert (high <= np.array([size[0] / 2, size[1], size[2] / 2]) + 0.015).all()
    assert (high - low)[np.argmax(size)] >= 0.93 * max(size)
