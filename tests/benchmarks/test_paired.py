"""Differences between runs of the same tasks."""

from __future__ import annotations

import pytest

from benchmarks.scoring.metrics import Score, normal
from benchmarks.scoring.paired import paired_change


def scores(*successes: bool) -> list[Score]:
    return [
        Score(
            task_id=f"task{number}", task_type="single_search", group="Search", success=success,
            search_efficiency=0.0, completeness=0.0, ordered_completeness=0.0, repeat_rate=0.0,
            revisit_rate=0.0, steps_saved=0.0, key_action_precision=0.0, missing=(),
        )
        for number, success in enumerate(successes)
    ]  # fmt: skip


def test_a_smaller_loss_is_a_positive_change() -> None:
    loses_all = scores(True, True, False), scores(False, False, False)
    loses_one = scores(True, True, False), scores(True, False, False)
    assert paired_change(loses_all, loses_one) == normal([1.0, 0.0, 0.0])
    assert paired_change(loses_one, loses_all) == normal([-1.0, 0.0, 0.0])


def test_only_tasks_of_all_four_runs_count() -> None:
    whole, part = scores(True, True), scores(False)
    assert paired_change((whole, whole), (whole, part)) == normal([-1.0])
    with pytest.raises(ValueError, match="no task in common"):
        paired_change((whole, whole), (whole, []))
