"""Every number here was worked out by hand from the definitions."""

from __future__ import annotations

import dataclasses
import math

import pytest

from benchmarks.scoring.metrics import (
    METRICS,
    Score,
    normal,
    score_episode,
    summarise,
    summarise_by,
    wilson,
)
from benchmarks.scoring.scorers import CORRECTED, PAPER, SCORERS

TRANSPORT = (
    "navigate to CounterTop",
    "pickup Egg",
    "navigate to Bowl",
    "put in Bowl",
    "end",
)


@pytest.mark.parametrize("scorer", SCORERS.values(), ids=lambda scorer: scorer.name)
def test_a_perfect_episode(episode, scorer):
    scored = score_episode(episode(TRANSPORT, TRANSPORT), scorer)
    assert scored == Score(
        task_id="task-1",
        task_type="pickup_and_put",
        group="Transport",
        success=True,
        search_efficiency=1.0,  # (5 + 1) / 6
        completeness=1.0,
        ordered_completeness=1.0,
        repeat_rate=0.0,
        revisit_rate=0.0,
        steps_saved=24 / 30,
        key_action_precision=1.0,
        missing=(),
    )


def test_a_detour_costs_efficiency_and_repeats(episode):
    played = (
        "navigate to Fridge",
        "observe",
        "!pickup Egg",
        "navigate to Fridge",
        "!navigate to Fridge",
        "move forward",
        *TRANSPORT,
    )
    scored = score_episode(episode(TRANSPORT, played), PAPER)
    assert scored.success
    assert scored.search_efficiency == pytest.approx(6 / 12)
    assert scored.repeat_rate == pytest.approx(2 / 5)  # a failed navigation repeats too
    assert scored.steps_saved == pytest.approx((30 - 12) / 30)
    assert scored.key_action_precision == pytest.approx(5 / 11)


def test_the_next_cabinet_repeats_a_type_but_is_no_revisit(episode, step):
    def cabinet(place: str) -> object:
        return step("navigate to Cabinet").model_copy(update={"object_id": f"Cabinet|{place}"})

    played = (
        cabinet("left"),
        cabinet("right"),
        cabinet("left"),
        "!navigate to Safe",
        "!navigate to Safe",
        "end",
    )
    for scorer in SCORERS.values():
        scored = score_episode(episode(TRANSPORT, played), scorer)
        assert scored.repeat_rate == pytest.approx(3 / 5)
        assert scored.revisit_rate == pytest.approx(2 / 5)  # the left one and the refused Safe


def test_failed_steps_score_nothing(episode):
    played = ("navigate to CounterTop", "!pickup Egg", "navigate to Bowl", "put in Bowl", "end")
    scored = score_episode(episode(TRANSPORT, played), PAPER)
    assert not scored.success
    assert scored.search_efficiency == 0.0
    assert scored.completeness == pytest.approx(2 / 3)
    assert scored.missing == ("pickup Egg",)
    assert scored.key_action_precision == pytest.approx(4 / 5)


def test_a_key_action_counts_once(episode):
    played = ("pickup Egg", "put in Bowl", "pickup Egg", "put in Bowl")
    counted = PAPER.count(episode(TRANSPORT, played))
    assert counted.points == 2
    assert counted.scored == ("pickup Egg", "put Bowl")


def test_a_key_action_listed_twice_counts_twice(episode):
    keys = ("pickup Egg", "pickup Egg", "end")
    once = score_episode(episode(keys, ("pickup Egg", "end")), PAPER)
    assert once.completeness == pytest.approx(2 / 3)
    assert once.missing == ("pickup Egg",)
    assert score_episode(episode(keys, ("pickup Egg", "pickup Egg", "end")), PAPER).success


def test_put_and_put_in_are_one_verb(episode):
    played = ("navigate to CounterTop", "pickup Egg", "navigate to Bowl", "put Bowl", "end")
    assert score_episode(episode(TRANSPORT, played), PAPER).success


def test_order_is_measured_but_not_needed(episode):
    played = ("put in Bowl", "pickup Egg", "end")
    scored = score_episode(episode(TRANSPORT, played), PAPER)
    assert scored.success
    assert scored.completeness == 1.0
    # put in Bowl, pickup Egg, end against pickup Egg, put in Bowl, end: one of the first two fits.
    assert scored.ordered_completeness == pytest.approx(2 / 3)
    assert scored.search_efficiency == pytest.approx(6 / 4)  # shorter than the task's own way


def test_end_is_needed(episode):
    scored = score_episode(episode(TRANSPORT, TRANSPORT[:-1], end_reason="step limit"), PAPER)
    assert not scored.success
    assert scored.completeness == pytest.approx(2 / 3)
    assert scored.missing == ("end",)


def test_end_counts_in_a_task_that_does_not_ask_for_it_only_to_the_paper(episode):
    asks_for_two = episode(("pickup Egg", "open Fridge"), ("end",))
    assert score_episode(asks_for_two, PAPER).completeness == pytest.approx(1 / 2)
    assert score_episode(asks_for_two, CORRECTED).completeness == 0.0
    assert score_episode(episode(("pickup Egg",), ("pickup Egg", "end")), PAPER).completeness == 2.0


def test_replies_that_name_no_action_are_steps_to_the_paper(episode):
    played = episode(TRANSPORT, ("!error", "!error", *TRANSPORT))
    paper, corrected = score_episode(played, PAPER), score_episode(played, CORRECTED)
    assert paper.search_efficiency == pytest.approx(6 / 8)
    assert corrected.search_efficiency == 1.0
    assert paper.key_action_precision == corrected.key_action_precision == 1.0
    assert paper.steps_saved == corrected.steps_saved == pytest.approx(24 / 30)


def test_an_end_that_the_protocol_appends_scores_but_is_no_prediction(episode, step):
    end = step("end").model_copy(update={"appended": True})
    scored = score_episode(episode(("pickup Egg", "end"), ("pickup Egg", end)), PAPER)
    assert scored.success
    assert scored.key_action_precision == 2.0  # two key actions done, one action predicted
    beyond = episode(("pickup Egg", "end"), (*["observe"] * 30, end))
    assert score_episode(beyond, PAPER).steps_saved == 0.0


def test_the_paper_reads_verbs_as_the_task_file_spells_them(episode):
    played = episode(("pickup Egg", "put in Bowl", "end"), ("pickup Egg", "put in Bowl", "end"))
    keys = played.key_actions
    odd = [keys[0], keys[1].model_copy(update={"spelled": "put in"}), keys[2]]
    assert score_episode(played, PAPER).success
    assert not score_episode(played.model_copy(update={"key_actions": odd}), PAPER).success


def test_nothing_was_played(episode):
    crashed = episode(TRANSPORT, (), error="ValueError: no").model_copy(update={"steps": []})
    scored = score_episode(crashed, CORRECTED)
    numbers = [getattr(scored, name) for name in METRICS]
    assert numbers == [False, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0]


SEARCH = ("navigate to CounterTop", "end")


def search(episode, steps, keys=SEARCH, name="Look for the CreditCard in the room."):
    return episode(
        keys,
        steps,
        task_type="single_search",
        name=name,
        max_steps=22,
        search_targets=["CreditCard"],
    )


def test_a_search_is_answered_by_what_is_within_reach(episode, step):
    end = step("end", interactable=("Mug", "CreditCard"))
    scored = score_episode(search(episode, ("navigate to Shelf", end)), PAPER)
    assert scored.success
    assert scored.completeness == scored.ordered_completeness == 1.0
    assert scored.search_efficiency == pytest.approx(3 / 3)
    assert scored.missing == ()
    assert scored.key_action_precision == pytest.approx(1 / 2)  # end, but not the navigation


def test_a_search_is_answered_by_having_gone_where_the_task_says(episode, step):
    end = step("end", interactable=("Mug",))
    scored = score_episode(search(episode, ("navigate to CounterTop", end)), PAPER)
    assert scored.success
    assert scored.key_action_precision == 1.0


@pytest.mark.parametrize("found", [True, False])
def test_an_old_record_of_a_search_says_by_its_success_whether_it_was_found(episode, step, found):
    end = step("end", interactable=("Mug",))
    old = search(episode, ("navigate to CounterTop", end)).model_copy(
        update={"search_targets": None, "success": found}
    )
    assert score_episode(old, CORRECTED).success is found
    new = old.model_copy(update={"search_targets": ["CreditCard"]})
    assert not score_episode(new, CORRECTED).success  # whatever the environment said


@pytest.mark.parametrize(
    ("between", "paper"),
    [
        (("open Drawer",), False),  # the paper forgets where it went
        (("!navigate to Shelf",), True),
        (("observe",), False),
    ],
    ids=["interaction", "failure", "look"],
)
def test_where_it_went_is_an_answer_to_the_paper_only(episode, step, between, paper):
    for within_reach in (("Mug",), ("CreditCard",)):
        end = step("end", interactable=within_reach)
        played = search(episode, ("navigate to CounterTop", *between, end))
        assert score_episode(played, CORRECTED).success is (within_reach == ("CreditCard",))
    not_there = search(episode, ("navigate to CounterTop", *between, step("end", ("Mug",))))
    assert score_episode(not_there, PAPER).success is paper


def test_the_paper_finds_a_type_in_any_part_of_the_name_whatever_the_case(episode, step):
    """ "open" has a Pen in it, and "spot" a Pot; "Pencil" has one in both spellings."""
    steps = ("navigate to Shelf", step("end", interactable=("Pen", "Pot")))
    for name in ("open the room and look for the CreditCard", "spot the Lettuce"):
        named = search(episode, steps, name=name)
        assert score_episode(named, PAPER).success
        assert not score_episode(named, CORRECTED).success
    pencil = search(episode, steps, name="Look for the Pencil in the room.")
    assert score_episode(pencil, PAPER).success
    assert not score_episode(pencil, CORRECTED).success


@pytest.mark.parametrize(
    "steps",
    [
        ("navigate to CounterTop", "navigate to Shelf"),  # the last step was another
        ("navigate to CounterTop", "observe"),
        ("!navigate to CounterTop",),  # it failed
        (),
    ],
    ids=["another", "observe", "failed", "nothing"],
)
def test_a_search_that_found_nothing(episode, step, steps):
    end = step("end", interactable=("Mug", "Pen"))
    scored = score_episode(search(episode, (*steps, end)), PAPER)
    assert not scored.success
    assert scored.completeness == scored.ordered_completeness == 0.0
    assert scored.missing == ("end",)


def test_a_failed_step_does_not_hide_the_one_before(episode, step):
    played = ("navigate to CounterTop", "!open CounterTop", "!error", "end")
    assert score_episode(search(episode, played), PAPER).success


def test_only_the_exposed_search_is_judged_by_its_name(episode, step):
    keys = ("navigate to Cabinet", "open Cabinet", "end")
    kind = "single_search_from_closerep"
    scored = score_episode(episode(keys, ("open Cabinet", "end"), task_type=kind), PAPER)
    assert scored.success
    assert not score_episode(episode(keys, ("end",), task_type=kind), PAPER).success


def test_an_empty_type_is_never_matched_by_the_paper_scorer(episode):
    keys = ("pickup Egg", "put in = Plate|-01.47|+01.31|+00.24", "end")
    played = episode(keys, ("pickup Egg", "put in Plate", "end"))
    paper, corrected = score_episode(played, PAPER), score_episode(played, CORRECTED)
    assert not paper.success
    assert paper.completeness == pytest.approx(2 / 3)
    assert paper.missing == ("put",)
    assert corrected.success
    untyped = episode(keys, ("pickup Egg", "put in", "end"))
    assert not score_episode(untyped, PAPER).success


def test_the_corrected_scorer_reads_the_id(episode):
    keys = ("pickup Potato = Egg|-03.37|+01.30|+02.85", "end")
    egg, potato = episode(keys, ("pickup Egg", "end")), episode(keys, ("pickup Potato", "end"))
    assert [score_episode(egg, scorer).success for scorer in (PAPER, CORRECTED)] == [False, True]
    assert [score_episode(potato, scorer).success for scorer in (PAPER, CORRECTED)] == [True, False]


@pytest.mark.parametrize("said", ["Sink", "SinkBasin"])
@pytest.mark.parametrize(
    "key",
    [
        "put in SinkBasin = Sink|-01.99|+01.14|-00.98",
        "put in Sink = Sink|-01.99|+01.14|-00.98|SinkBasin",
    ],
)
def test_a_sink_and_its_basin_are_one_to_the_corrected_scorer(episode, said, key):
    played = episode((key, "end"), (f"put in {said}", "end"))
    assert score_episode(played, CORRECTED).success
    assert score_episode(played, PAPER).success == key.startswith(f"put in {said} ")


def test_an_unmet_goal_is_no_success_to_the_corrected_scorer(episode):
    played = episode(("pickup Egg", "end"), ("pickup Egg", "end"))
    unmet = played.model_copy(update={"goal_unmet": ["Egg is held"]})
    assert [score_episode(unmet, scorer).success for scorer in (PAPER, CORRECTED)] == [True, False]
    assert score_episode(played, CORRECTED).success
    assert score_episode(unmet, CORRECTED).search_efficiency == 0.0
    assert score_episode(unmet, CORRECTED).completeness == 1 / 2  # not the end
    assert score_episode(unmet, CORRECTED).missing == ("end",)


def test_an_object_that_is_singled_out_is_the_only_one_that_counts_to_the_corrected_scorer(
    episode, step
):
    wanted, other = "Egg|+00.00|+01.00|+02.00", "Egg|+09.00|+01.00|+02.00"
    exact = episode(("pickup Egg", "end"), ())
    key = exact.key_actions[0].model_copy(update={"exact": True})

    def scored(object_id, scorer):
        steps = [step(text) for text in ("init", "pickup Egg", "end")]
        steps[1] = steps[1].model_copy(update={"object_id": object_id})
        keys = [key, *exact.key_actions[1:]]
        return score_episode(exact.model_copy(update={"steps": steps, "key_actions": keys}), scorer)

    assert [scored(i, CORRECTED).success for i in (wanted, other)] == [True, False]
    assert [scored(i, PAPER).success for i in (wanted, other)] == [True, True]
    assert scored(other, CORRECTED).missing == (f"pickup Egg {wanted}", "end")


def test_wilson():
    # n = 10, k = 8: the textbook interval is 0.4902 to 0.9433.
    estimate = wilson(8, 10)
    assert estimate.mean == 0.8
    assert (estimate.low, estimate.high) == pytest.approx((0.490162, 0.943318), abs=1e-6)


def test_wilson_at_the_ends():
    # For k = n the lower bound is n / (n + z^2), for k = 0 the upper one its mirror.
    full, none = wilson(100, 100), wilson(0, 100)
    assert (full.low, full.high) == pytest.approx((100 / (100 + 1.959964**2), 1.0))
    assert (none.low, none.high) == pytest.approx((0.0, 1 - 100 / (100 + 1.959964**2)))
    for n in range(1, 400):  # whatever the rounding
        for estimate in (wilson(0, n), wilson(n, n)):
            assert estimate.low <= estimate.mean <= estimate.high


def test_normal():
    estimate = normal([0.0, 1.0, 1.0, 0.0])
    # The sample's variance is 4 * 0.25 / 3, the standard error its root over 2.
    half = 1.959964 * math.sqrt(1 / 3) / 2
    assert estimate.mean == 0.5
    assert (estimate.low, estimate.high) == pytest.approx((0.5 - half, 0.5 + half))


def test_one_value_has_no_interval():
    estimate = normal([0.25])
    assert dataclasses.astuple(estimate) == (0.25, None, None)


@pytest.mark.parametrize("estimate", [lambda: wilson(0, 0), lambda: normal([])])
def test_no_values_have_no_mean(estimate):
    with pytest.raises(ValueError, match="at least one"):
        estimate()


def test_means_over_tasks_types_and_groups(episode):
    good = score_episode(episode(TRANSPORT, TRANSPORT), PAPER)
    bad = score_episode(episode(TRANSPORT, ("pickup Egg", "end")), PAPER)
    found = score_episode(search(episode, SEARCH), PAPER)
    scores = [good, bad, found]

    overall = summarise(scores)
    assert overall.n == 3
    assert overall["success"].mean == pytest.approx(2 / 3)
    assert overall["completeness"].mean == pytest.approx((1 + 2 / 3 + 1) / 3)
    assert overall["search_efficiency"].mean == pytest.approx(2 / 3)  # a failure counts as 0

    groups = summarise_by(scores, lambda each: each.group, ("Search", "Manipulate", "Transport"))
    assert list(groups) == ["Search", "Transport"]
    assert [summary.n for summary in groups.values()] == [1, 2]
    assert groups["Transport"]["success"].mean == 0.5
    assert set(overall.metrics) == set(METRICS)


def test_every_metric_is_a_field_of_the_score():
    assert set(METRICS) < {field.name for field in dataclasses.fields(Score)}


def of_different_tasks(*scores):
    return [dataclasses.replace(each, task_id=str(n)) for n, each in enumerate(scores)]


def test_an_interval_ends_where_the_metric_does(episode):
    good = score_episode(episode(TRANSPORT, TRANSPORT), PAPER)
    bad = score_episode(episode(TRANSPORT, ("pickup Egg", "end")), PAPER)
    for scores in ([good, *[bad] * 5], [*[good] * 5, bad]):
        summary = summarise(of_different_tasks(*scores))
        for metric in METRICS[1:]:
            estimate = summary[metric]
            assert 0 <= estimate.low <= estimate.mean <= estimate.high <= 1, metric


def test_an_interval_goes_as_far_as_the_largest_value(episode):
    good = score_episode(episode(TRANSPORT, TRANSPORT), PAPER)
    short = [dataclasses.replace(good, search_efficiency=value) for value in (0.2, 1.4)]
    assert summarise(of_different_tasks(*short))["search_efficiency"].high == 1.4
