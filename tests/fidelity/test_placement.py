"""Objects are put down where there is room, in AI2-THOR's order."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.checks.comparisons.recorded import Placements, clashes, random_placements
from er_gym.sim.actions.pick_place import put_down
from er_gym.sim.scene import load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.placement import _tight_spots, free_spots
from er_gym.sim.world import World


@pytest.fixture(scope="module")
def placements() -> Placements:
    return random_placements(each=10)


def test_nothing_is_put_into_something_else(placements) -> None:
    assert placements.placed > 800
    assert placements.clashes == []


def test_spots_in_the_picture_come_first_and_the_nearest_of_them(placements) -> None:
    assert placements.out_of_order == []


def test_most_receptacles_have_room(placements) -> None:
    assert placements.placed > 0.8 * placements.tried  # 0.87 when this was written


def test_the_comparison_notices_a_clash() -> None:
    world = World.load(load_scene("FloorPlan1"), Settings())
    apple, bread = (next(world.of_type(kind)) for kind in ("Apple", "Bread"))
    assert clashes(world, apple, world.parents[apple][0]) == []
    offset = (world.low[bread] + world.high[bread] - world.low[apple] - world.high[apple]) / 2
    world.move_by(apple, np.asarray(offset))
    assert bread in clashes(world, apple, world.parents[apple][0])


@pytest.mark.parametrize(
    ("scene", "thing", "receptacle"),
    [
        ("FloorPlan12", "Plate|+01.38|+01.06|+00.01", "CounterTop|-00.97|+00.97|+00.92"),
        ("FloorPlan27", "Pan|+01.93|+00.07|+00.64", "DiningTable|-00.15|00.00|+01.07"),
    ],
)
def test_what_fits_only_beside_an_edge_is_put_there(scene, thing, receptacle) -> None:
    world = World.load(load_scene(scene), Settings())
    i, r = world.object_ids.index(thing), world.object_ids.index(receptacle)
    near = world.agent.position[[0, 2]]
    assert list(free_spots(world, i, r, near, squeeze=False)) == []
    spots = list(free_spots(world, i, r, near))
    assert spots
    for yaw, foot in spots[:: max(1, len(spots) // 10)]:
        put_down(world, i, yaw, foot, [r])
        assert clashes(world, i, r) == []
        assert (world.low[i] >= world.low[r] - 0.01)[[0, 2]].all()
        assert (world.high[i] <= world.high[r] + 0.01)[[0, 2]].all()


def test_a_gap_is_found_wherever_there_is_one() -> None:
    random, found = np.random.default_rng(0), 0
    world = World.load(load_scene("FloorPlan1"), Settings())
    place, half, none = (
        np.array([[[0.0, 0.0], [1.0, 0.6]]]),
        np.array([0.13, 0.11]),
        np.array([], int),
    )
    grid = np.stack(np.meshgrid(np.arange(0.135, 0.866, 0.005), np.arange(0.115, 0.486, 0.005)), -1)
    for _ in range(60):
        low = random.uniform(0.0, [1.0, 0.6], (13, 2))
        high = low + random.uniform(0.02, 0.3, (13, 2))
        boxes = np.zeros((13, 2, 3))
        boxes[:, 0, [0, 2]], boxes[:, 1, [0, 2]], boxes[:, 1, 1] = low, high, 0.2
        spots = _tight_spots(world, [(0.0, half)], place, boxes, none)[:, 1:]

        def clear(points: np.ndarray, low=low, high=high) -> np.ndarray:
            apart = (points[..., None, :] + half + 0.005 <= low) | (
                points[..., None, :] - half - 0.005 >= high
            )
            return apart.any(axis=-1).all(axis=-1)

        assert clear(spots).all()
        assert len(spots) > 0 or not clear(grid).any()
        found += len(spots) > 0
    assert 10 < found < 60
