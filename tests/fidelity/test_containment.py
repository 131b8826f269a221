"""The receptacles of objects, computed from boxes, agree with the recorded ones."""

from __future__ import annotations

from benchmarks.checks.comparisons.recorded import containment


def test_receptacles_agree_with_the_record() -> None:
    found = containment()
    assert found.objects > 1800
    assert found.innermost >= 0.95 * found.objects  # 0.974 when this was written
    assert found.all_of_them >= 0.90 * found.objects  # 0.923


def test_the_comparison_notices_things_in_the_air() -> None:
    found = containment(lift=0.5)
    assert found.innermost < 0.3 * found.objects
