"""Recipes: the paper's numbers, shares of a limit, and bad files."""

from __future__ import annotations

from collections import Counter
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
import yaml
from support import in_one_test

from agents.expert.recipe import Recipe, load_recipe, quotas
from er_gym.tasks.types import BY_NAME

PAPER = load_recipe()
TYPES = set(BY_NAME)
PAPERS_TYPES = {  # arXiv 2503.21696, all three sets
    "single_search": 2529,
    "single_search_from_closerep": 297,
    "single_pickup": 2324,
    "single_pickup_from_closerep": 190,
    "single_toggle": 1067,
    "pickup_and_put": 943,
    "pickup_and_put_in_closerep": 803,
    "pickup_from_closerep_and_put": 154,
    "pickup_from_closerep_and_put_in_closerep": 127,
    "ordered_pickup_two_object_and_put": 956,
}


def test_the_default_has_the_papers_numbers() -> None:
    sizes = {name: sum(part.types.values()) for name, part in PAPER.parts.items()}
    assert sizes == {
        "imitation": 1128,
        "exploration": 6246,
        "anomalies": 519,
        "corrections": 1497,
    }
    assert PAPER.size == 9390
    types: Counter[str] = Counter()
    for part in PAPER.parts.values():
        types.update(part.types)
    assert types == PAPERS_TYPES


def test_without_a_limit_the_quotas_are_the_recipes_numbers() -> None:
    wanted = quotas(PAPER, None, TYPES)
    assert wanted == {
        (name, kind): number
        for name, part in PAPER.parts.items()
        for kind, number in part.types.items()
    }


def test_quotas_sum_to_the_limit_and_never_shrink() -> None:
    """A collection with a larger limit holds all that one with a smaller limit holds."""
    for types in (TYPES, TYPES - {"single_search", "pickup_and_put"}):
        before: dict[tuple[str, str], int] = {}
        for limit in range(1, 700):
            now = quotas(PAPER, limit, types)
            assert sum(now.values()) == limit
            assert all(now[key] >= number for key, number in before.items()), limit
            before = now


def test_quotas_are_the_shares_times_one_factor_rounded() -> None:
    """Then a number is off by half of one, and by its share of half of one for each of them."""
    half = Fraction(1, 2)
    for limit in (1, 100, 939, 5000, 9390, 100_000):
        numbers = quotas(PAPER, limit, TYPES)
        shares = {(name, kind): PAPER.parts[name].types[kind] for name, kind in numbers}
        least = max((number - half) / shares[key] for key, number in numbers.items())
        most = min((number + half) / shares[key] for key, number in numbers.items())
        assert least <= most, limit
        for key, number in numbers.items():
            share = Fraction(shares[key], PAPER.size)
            assert abs(number - share * limit) <= half + share * len(numbers) / 2, (limit, key)


def test_the_shares_of_missing_types_go_to_the_others_of_the_part() -> None:
    wanted = quotas(PAPER, None, {"single_toggle", "pickup_and_put"})
    assert set(wanted) == {
        (part, kind) for part in PAPER.parts for kind in ("single_toggle", "pickup_and_put")
    }
    assert wanted["imitation", "single_toggle"] == round(1128 * 150 / 230)
    assert sum(wanted.values()) == 9390
    assert quotas(PAPER, 10, {"single_twist"}) == {}


def written(parts: Any) -> str:
    return yaml.safe_dump({"parts": parts})


def with_part(**changes: Any) -> str:
    part = {"actor": "expert", "types": {"single_search": 1}, "kinds": {"a": 1}}
    return written({"x": {name: it for name, it in {**part, **changes}.items() if it != "-"}})


BAD = {
    "empty": ("", "table of settings"),
    "a list": ("[1]", "table of settings"),
    "no parts": ("parts: {}", "parts"),
    "actor": (with_part(actor="robot"), "actor"),
    "no actor": (with_part(actor="-"), "actor"),
    "type": (with_part(types={"single_dance": 1}), "unknown task type 'single_dance'"),
    "no types": (with_part(types={}), "asks for nothing"),
    "nothing of a type": (with_part(types={"single_search": 0}), "asks for nothing"),
    "negative": (with_part(types={"single_search": -1}), "single_search"),
    "half": (with_part(types={"single_search": 1.5}), "single_search"),
    "too many": (with_part(types={"single_search": 10**9}), "single_search"),
    "digits": (with_part(types={"single_search": 10**30}), "64 bits are allowed"),
    "kind": (with_part(kinds={"z": 1}), "give shares of a, b, c, anomaly"),
    "no kinds": (with_part(kinds={"a": 0}), "give shares of a, b, c, anomaly"),
    "share": (with_part(kinds={"a": float("inf")}), "kinds.a"),
    "nan": (with_part(kinds={"a": float("nan")}), "kinds.a"),
    "fault": (with_part(faults={"sneeze": 0.1}), "sneeze"),
    "rate": (with_part(faults={"open": 2}), "open"),
    "no explorers": (with_part(actor="explorer"), "an explorer needs explorers"),
    "explorer": (
        with_part(actor="explorer", explorers={"x": {"temperature": -1}}),
        "explorers.x.temperature",
    ),
    "share of an explorer": (
        with_part(actor="explorer", explorers={"x": {"share": float("inf")}}),
        "explorers.x.share",
    ),
    "most actions": (with_part(most_actions=0), "most_actions"),
    "expected": (with_part(expected=0), "expected"),
    "unknown field": (with_part(speed=3), "speed"),
    "name of a part": (written({"../x": {}}), "parts"),
    "no YAML": ("parts: [", "YAML"),
    "bomb": (
        "a: &a [1,1,1,1,1,1,1,1,1]\n"
        + "".join(
            f"{new}: &{new} [{','.join([f'*{old}'] * 9)}]\n"
            for old, new in zip("abcdefgh", "bcdefghi", strict=True)
        ),
        "too many values",
    ),
}


@in_one_test("case", BAD.items())
def test_a_bad_recipe_is_told_in_one_line(
    case: tuple[str, tuple[str, str]], tmp_path: Path
) -> None:
    name, (text, message) = case
    file = tmp_path / f"{name}.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=r"\.yaml: ") as told:
        load_recipe(str(file))
    assert "\n" not in str(told.value)
    assert len(str(told.value)) < 1000
    assert message in str(told.value)
    assert str(file) in str(told.value)


def test_an_unknown_recipe_is_told_with_the_known_ones(tmp_path: Path) -> None:
    for name in ("nobodys", str(tmp_path), "/dev/null", "/dev/zero"):
        with pytest.raises(ValueError, match=r"there is no recipe .*one of: balanced, paper"):
            load_recipe(name)


def test_a_part_states_its_kinds() -> None:
    kinds = {name: part.all_kinds for name, part in PAPER.parts.items()}
    assert kinds == {
        "imitation": ("a", "b", "c"),
        "exploration": ("explored",),
        "anomalies": ("anomaly",),
        "corrections": ("corrected",),
    }
    assert isinstance(PAPER, Recipe)
