"""No reader of what a model or a stranger wrote takes more than its budget for a long text."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator

import pytest

pytest.importorskip("openai", reason="needs the extra vlm")

from benchmarks.checks.long_texts import BOUNDED, growing, readers, slow
from benchmarks.harness.tally import Try

COSTLY = {"names in an instruction": 500, "an instruction": 200}
"""Readers that are linear, and so slow that a test gives them shorter texts."""


def told(tries: Iterable[Try]) -> Iterator[str]:
    return (f"{name}: {problem}" for name, problems in tries for problem in problems)


@pytest.mark.parametrize("name", readers())
def test_a_long_text_is_read_within_the_budget(name: str) -> None:
    read = readers()[name]
    read("Put the Apple into the Fridge.")  # what is loaded once is loaded now
    length = COSTLY.get(name, 20_000)
    assert list(told(slow(read, length, 2.0, framed=False))) == []
    if name not in BOUNDED:
        assert list(told(growing(read, min(600, length // 3), framed=False))) == []


def _each_with_each(text: str) -> int:
    count = 0
    for place in range(len(text)):
        for _ in range(place):
            count += 1
    return count


def test_a_reader_whose_lines_grow_faster_is_noticed() -> None:
    assert next(told(growing(_each_with_each, 300, framed=False))).startswith("openers: ")


def test_a_pattern_that_is_quadratic_is_noticed() -> None:
    pattern = re.compile(r"<(Planning)>(.*?)</\1>", re.DOTALL)
    problems = told(slow(pattern.findall, 60_000, 0.3, framed=False))
    assert next(problems).startswith("openers: more than")


def test_an_error_is_noticed() -> None:
    assert next(told(slow(int, 10, framed=False))).startswith("openers: ValueError")
