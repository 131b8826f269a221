"""The parts of the recognition benchmark without torch: scenes, crops and sums."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from benchmarks.checks.recognisability import (
    SIDE,
    TYPES,
    Classification,
    box_of,
    commonest_types,
    crop,
    crops_of,
    draw_sheet,
    share_inside,
    split,
)
from er_gym.sim.render.camera import Camera
from er_gym.sim.scene import SCENE_NAMES, SCENE_NUMBERS

AHEAD = Camera((0.0, 0.0, 0.0), 0.0, 0.0, 90.0, 100, 100)


def test_a_quarter_of_each_kind_of_room_is_held_out():
    learning, held = split(seed=3)
    assert sorted(learning + held) == sorted(SCENE_NAMES)
    assert len(held) == 30
    for numbers in SCENE_NUMBERS.values():
        assert sum(f"FloorPlan{n}" in held for n in numbers) in (7, 8)
    assert split(seed=3)[1] == held != split(seed=4)[1]


def test_the_commonest_types_are_asked_about():
    types = commonest_types()
    assert len(set(types)) == TYPES
    assert {"Drawer", "Cabinet"} == set(types[:2])
    assert "Floor" not in types


def test_a_scene_gives_the_same_crops_again_and_no_more_than_asked_for():
    first, again = (
        crops_of("FloorPlan410", ("Mirror", "Faucet"), 2, np.random.default_rng(0)) for _ in "ab"
    )
    assert first.images.shape == (4, SIDE, SIDE, 3)
    assert sorted(first.labels.tolist()) == [0, 0, 1, 1]
    assert np.array_equal(first.images, again.images)


@pytest.mark.parametrize("box", [(40, 30, 20, 10), (0, 0, 12, 30), (88, 60, 12, 40)])
def test_a_crop_has_the_thing_in_its_middle(box):
    left, top, width, height = box
    picture = np.zeros((100, 100, 3), np.uint8)
    picture[top : top + height, left : left + width] = 255
    found = crop(picture, box)
    assert found.shape == (SIDE, SIDE, 3)
    assert found[SIDE // 2, SIDE // 2].min() == 255


def test_the_box_around_a_mask():
    mask = np.zeros((9, 7), bool)
    mask[2:5, 3], mask[4, 6] = True, True
    assert box_of(mask) == (3, 2, 4, 3)


def test_what_the_edge_cuts_off_is_known():
    low, high = np.array([-0.5, -0.5, 2.0]), np.array([0.5, 0.5, 2.0])
    aside = np.array([2.0, 0.0, 0.0])
    assert share_inside(AHEAD, low, high) == pytest.approx(1.0)
    assert share_inside(AHEAD, low + aside, high + aside) == pytest.approx(0.5)
    assert share_inside(AHEAD, low - (0, 0, 4), high) == 0.0


def test_the_verdict_counts_and_shows_what_is_wrong(tmp_path):
    said = Classification(
        ("Cup", "Mug", "Pan"), np.array([0, 0, 0, 0, 1, 1]), np.array([0, 1, 1, 2, 1, 1])
    )
    assert said.top1 == pytest.approx(0.5)
    assert said.mean_of_types == pytest.approx((0.25 + 1.0) / 2)
    assert said.worst_first() == [0, 1]
    assert said.taken_for(0) == [("Mug", 0.5), ("Pan", 0.25)]
    draw_sheet(said, np.zeros((6, SIDE, SIDE, 3), np.uint8), tmp_path / "sheet.png")
    with Image.open(tmp_path / "sheet.png") as sheet:
        assert sheet.height < 2 * 150  # one row: of the other type nothing is wrong
