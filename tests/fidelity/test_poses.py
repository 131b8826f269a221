"""Interactable poses agree with the poses from which AI2-THOR opened objects."""

from __future__ import annotations

import numpy as np

from benchmarks.checks.comparisons.recorded import openable_poses


def share(found: dict[str, tuple[int, int]]) -> float:
    agreed, entries = np.sum([*found.values()], axis=0)
    return float(agreed / entries)


def test_recorded_poses_are_interactable() -> None:
    found = openable_poses()
    assert sum(entries for _, entries in found.values()) > 1400
    assert share(found) >= 0.99  # 0.999 when this was written
    assert {kind: n for kind, n in found.items() if n[0] < 0.8 * n[1]} == {}


def test_the_comparison_notices_an_agent_that_looks_away() -> None:
    assert share(openable_poses(turn=180.0)) < 0.1
