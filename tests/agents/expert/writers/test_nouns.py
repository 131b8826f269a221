"""The names that a text has for types of objects."""

from __future__ import annotations

import random
from collections.abc import Sequence

import pytest

from agents.expert.writers.nouns import ChineseNouns, EnglishNouns, Nouns


@pytest.mark.parametrize(
    ("language", "names", "said", "name"),
    [
        (EnglishNouns, ("armchair", "easy chair"), "I see an easy chair.", "easy chair"),
        (ChineseNouns, ("把 扶手椅", "张 沙发椅"), "我看见一张沙发椅。", "沙发椅"),
    ],
)
def test_a_type_keeps_the_name_of_the_texts_before(
    language: type[Nouns], names: Sequence[str], said: str, name: str
) -> None:
    for seed in range(20):
        nouns = language({"ArmChair": names}, said)
        assert nouns.word("ArmChair", "", random.Random(seed)) == name
