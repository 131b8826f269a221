"""What is put down is put where there is room, in AI2-THOR's order."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.perf.comparisons.placement import Placements, clashes, random_placements
from er_gym.sim.scene import load_scene
from er_gym.sim.world import Settings, World


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
