"""Scores of tasks that were played several times."""

from __future__ import annotations

import itertools
import math

import pytest

from benchmarks.scoring.metrics import normal
from benchmarks.scoring.samples import (
    doubling,
    effective_number,
    pass_at,
    variance_between,
)


def test_pass_at_k_is_the_share_of_subsets_with_a_success() -> None:
    for n in range(1, 7):
        for successes in range(n + 1):
            outcomes = [True] * successes + [False] * (n - successes)
            for k in range(1, n + 1):
                subsets = list(itertools.combinations(outcomes, k))
                assert pass_at(k, n, successes) == pytest.approx(
                    sum(map(any, subsets)) / len(subsets)
                )
    with pytest.raises(ValueError, match=r"pass@4 needs from 1 to 3 samples"):
        pass_at(4, 3, 1)
    assert (doubling(1), doubling(4), doubling(6)) == ([1], [1, 2, 4], [1, 2, 4, 6])


def test_the_interval_is_that_of_different_tasks() -> None:
    values = [0.0, 1.0, 0.5, 0.25, 1.0]
    once = variance_between([*"abcde"], values)
    estimate = normal(values)
    assert once is not None
    assert estimate.high is not None
    assert 1.959963984540054 * math.sqrt(once) == pytest.approx(estimate.high - estimate.mean)
    # Samples that are all alike tell no more than one of them.
    assert variance_between([*"abcde"] * 3, values * 3) == pytest.approx(once)
    assert variance_between(["a", "a"], [0.0, 1.0]) is None
    alike = [True, False, True, True, False]
    assert effective_number([*"abcde"] * 3, alike * 3) == pytest.approx(5, rel=0.25)
    assert effective_number(["a", "a", "b", "b"], [True, False, True, False]) == 2
    assert effective_number(["a", "a", "b", "b"], [True] * 4) == 2
    # One task with three episodes of four: they tell less than two tasks do.
    assert effective_number(["a", "a", "a", "b"], [True] * 4) == pytest.approx(16 / 10)
