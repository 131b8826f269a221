"""Reachable positions agree with the recorded ones and with AI2-THOR's own."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.checks.comparisons.reachable import (
    BEFORE,
    LARGER,
    POSITIONS,
    Reachable,
    ReachableAgreement,
    agreements,
    by_kind,
    held_out,
    pieces,
    reachable,
    sample,
)
from er_gym.sim.scene import SCENE_NUMBERS
from er_gym.sim.space.walkable_floor import Rules


@pytest.fixture(scope="module")
def compared() -> Reachable:
    return reachable()


def test_at_the_recorded_step_all_recorded_positions_are_reachable(compared) -> None:
    assert compared.recorded == 120


def test_a_finer_grid_keeps_clear_of_furniture_and_inside_the_room(compared) -> None:
    assert compared.in_furniture == 0
    assert compared.outside == 0


def test_there_are_about_as_many_positions_as_in_unity(compared) -> None:
    assert compared.fine / BEFORE == pytest.approx(LARGER, rel=0.1)


def test_a_finer_grid_is_connected_where_the_record_is(compared) -> None:
    assert compared.connected == 120


@pytest.fixture(scope="module")
def given(shared_data: Path):
    return sample(shared_data / POSITIONS)


def test_positions_of_unity_are_reachable_in_every_kind_of_room(given) -> None:
    for kind, agreed in by_kind(agreements(given, Rules())).items():
        assert agreed.recall >= 0.94, kind
        assert agreed.size == pytest.approx(1.0, abs=0.13), kind


def test_they_are_in_scenes_that_chose_no_rule(given) -> None:
    agreed = by_kind(held_out(given))
    for kind in SCENE_NUMBERS:
        assert agreed[kind].recall >= 0.92, kind
    assert agreed["all"].recall >= 0.95
    assert agreed["all"].size == pytest.approx(1.0, abs=0.1)


def test_a_set_that_is_everywhere_agrees_badly() -> None:
    everywhere = ReachableAgreement(given=50, found=50, ours=4000, theirs=1000.0)
    fair = ReachableAgreement(given=50, found=46, ours=1000, theirs=1000.0)
    assert everywhere.f1 < 0.5 < fair.f1


def test_pieces_are_counted_by_steps_along_the_axes() -> None:
    corner = np.array([[0.0, 0.0], [0.25, 0.0], [0.5, 0.25], [1.0, 1.0]])
    assert pieces(corner, 0.25) == 3
