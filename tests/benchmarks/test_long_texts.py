"""No reader of what a model or a stranger wrote takes more than its budget for a long text."""

from __future__ import annotations

import re

import pytest

pytest.importorskip("openai", reason="needs the extra vlm")

from benchmarks.checks.long_texts import BOUNDED, growing, readers, slow

COSTLY = {"names in an instruction": 500, "an instruction": 200}
"""Readers that are linear, and so slow that a test gives them shorter texts."""


@pytest.mark.parametrize("name", readers())
def test_a_long_text_is_read_within_the_budget(name: str) -> None:
    read = readers()[name]
    read("Put the Apple into the Fridge.")  # what is loaded once is loaded now
    length = COSTLY.get(name, 20_000)
    assert list(slow(read, length, 2.0, framed=False)) == []
    if name not in BOUNDED:
        assert list(growing(read, min(600, length // 3), framed=False)) == []


def _each_with_each(text: str) -> int:
    count = 0
    for place in range(len(text)):
        for _ in range(place):
            count += 1
    return count


def test_a_reader_whose_lines_grow_faster_is_noticed() -> None:
    assert next(growing(_each_with_each, 300, framed=False)).startswith("openers: ")


def test_a_pattern_that_is_quadratic_is_noticed() -> None:
    pattern = re.compile(r"<(Planning)>(.*?)</\1>", re.DOTALL)
    assert next(slow(pattern.findall, 60_000, 0.3, framed=False)).startswith("openers: more than")


def test_an_error_is_noticed() -> None:
    assert next(slow(int, 10, framed=False)).startswith("openers: ValueError")
