"""The part of a suite's configuration that says what to generate."""

from __future__ import annotations

from typing import Any

import pytest
from pydantic import ValidationError

from er_gym.tasks.difficulty import Difficulty
from er_gym.tasks.splits import EVALUATION_SCENES, TRAINING_SCENES
from er_gym.tasks.suite_spec import SuiteSpec
from er_gym.thor import SCENE_NAMES


def test_all_rooms_all_types_and_any_difficulty_are_the_default() -> None:
    spec = SuiteSpec(total=3)
    assert spec.rooms == SCENE_NAMES
    assert spec.types == ()
    assert (spec.layouts, spec.unseen_objects) == (0, True)
    assert spec.allows_any_difficulty
    assert spec.admits(Difficulty(0, 0, 0.0, 2))
    assert spec.admits(Difficulty(9, 99, 999.0, 99))


@pytest.mark.parametrize(
    ("scenes", "rooms"),
    [
        ("training", TRAINING_SCENES),
        ("evaluation", EVALUATION_SCENES),
        ("FloorPlan7", ("FloorPlan7",)),
        (["FloorPlan7", "FloorPlan201"], ("FloorPlan7", "FloorPlan201")),
        (["FloorPlan7", "FloorPlan7"], ("FloorPlan7",)),
    ],
    ids=["training", "evaluation", "one room", "rooms", "one room twice"],
)
def test_rooms_by_the_name_of_a_set_or_by_their_own(scenes: Any, rooms: tuple[str, ...]) -> None:
    assert tuple(SuiteSpec(total=1, scenes=scenes).rooms) == rooms


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "no total": ({}, "Field required"),
    "nothing": ({"total": 0}, "greater than 0"),
    "a set that is none": (
        {"total": 1, "scenes": "test"},
        "unknown scene 'test'; give names such as FloorPlan1 or House3-17, or one of: all, "
        "training, strict, evaluation",
    ),
    "a room that is none": ({"total": 1, "scenes": ["FloorPlan1", "Hall"]}, "unknown scene 'Hall'"),
    "a set among rooms": ({"total": 1, "scenes": ["training"]}, "unknown scene 'training'"),
    "a type that is none": (
        {"total": 1, "types": ["single_search", "dance"]},
        "unknown task type 'dance'; choose one of: single_search, ",
    ),
    "layouts": ({"total": 1, "layouts": -1}, "greater than or equal to 0"),
    "none of a layout": ({"total": 1, "per_layout": 0}, "greater than 0"),
    "no rooms": ({"total": 1, "scenes": []}, "unknown scene ''"),
    "a span the wrong way round": ({"total": 1, "distance": [3, 2]}, "not a range: from 3 to 2"),
    "a span from nowhere": (
        {"total": 1, "distractors": [float("nan"), 2]},
        "not a range: from nan",
    ),
    "a span to nowhere": (
        {"total": 1, "hidden_depth": [0, float("inf")]},
        "not a range: from 0 to",
    ),
    "half a span": ({"total": 1, "distance": [3]}, "Field required"),
    "misspelled": ({"total": 1, "hidden": [0, 1]}, "Extra inputs are not permitted"),
}


@pytest.mark.parametrize(("data", "message"), WRONG.values(), ids=WRONG)
def test_what_cannot_be_made_is_refused(data: dict[str, Any], message: str) -> None:
    with pytest.raises(ValidationError) as caught:
        SuiteSpec.model_validate(data)
    (problem,) = caught.value.errors()
    assert message in problem["msg"]


SPANS = {
    "from": ((2, None), [1], [2, 3, 50]),
    "to": ((0, 2), [3, 50], [0, 2]),
    "from and to": ((2, 3), [1, 4], [2, 3]),
    "exactly": ((2, 2), [1, 3], [2]),
    "none": ((0, 0), [1], [0]),
}


@pytest.mark.parametrize("figure", ["hidden_depth", "distractors", "distance"])
@pytest.mark.parametrize(("span", "refused", "admitted"), SPANS.values(), ids=SPANS)
def test_a_span_admits_what_lies_in_it(
    figure: str, span: tuple[float, float | None], refused: list[int], admitted: list[int]
) -> None:
    spec = SuiteSpec.model_validate({"total": 1, figure: span})
    assert not spec.allows_any_difficulty

    def of(value: int) -> Difficulty:
        plain: dict[str, Any] = {"hidden_depth": 1, "distractors": 1, "distance": 1.0, "length": 9}
        return Difficulty(**{**plain, figure: value})

    assert not [value for value in refused if spec.admits(of(value))]
    assert [value for value in admitted if spec.admits(of(value))] == admitted


def test_all_spans_have_to_admit_a_task() -> None:
    spec = SuiteSpec(total=1, hidden_depth=(1, None), distance=(0, 5))
    assert spec.admits(Difficulty(1, 0, 5.0, 9))
    assert not spec.admits(Difficulty(0, 0, 5.0, 9))
    assert not spec.admits(Difficulty(1, 0, 5.1, 9))
