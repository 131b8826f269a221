"""Courses of the expert, of explorers and of corrections, played in many rooms.

Corrections in which another agent takes over are in test_takeover.py.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from random import Random

import pytest
from expert_courses import (
    SEED,
    TASKS,
    Played,
    environment,
    of_each_type,
    play,
    searched_though_seen,
)

from agents.expert.candidates import Candidate, CandidateSequence
from agents.expert.corrections import Beginning, first_mistake
from agents.expert.explorer import Strength
from agents.expert.legs import legs_of
from agents.expert.places import draw_places, likely_places, plan_of
from agents.expert.recipe import load_recipe
from agents.scripted.searcher import search_priors
from er_gym.data.course_checks import are_key_actions
from er_gym.data.trajectory import Subgoal
from er_gym.envs.actions import Action
from er_gym.envs.embodied_env import EmbodiedEnv
from er_gym.tasks import verbs
from er_gym.tasks.equivalence import same_type
from er_gym.tasks.task import type_of_id

RECIPE = load_recipe()
EXPERTS = RECIPE.parts["imitation"]
ANOMALIES = RECIPE.parts["anomalies"].model_copy(
    update={"faults": dict.fromkeys(RECIPE.parts["anomalies"].faults, 0.5), "repeats": 0.3}
)


@pytest.fixture(scope="module")
def env() -> Iterator[EmbodiedEnv]:
    env = environment()
    yield env
    env.close()


def of_kind(env: EmbodiedEnv, kind: str, number: int) -> list[Played]:
    part = EXPERTS.model_copy(update={"kinds": {kind: 1.0}})
    return [play(env, each) for each in of_each_type(part, number)]


def taken(every: list[Played]) -> list[Played]:
    return [each for each in every if not each.problem]


@pytest.fixture(scope="module")
def tried(env: EmbodiedEnv) -> list[Played]:
    """Candidates of the kinds a and c, taken or not."""
    return [*of_kind(env, "a", 8), *of_kind(env, "c", 8)]


@pytest.fixture(scope="module")
def searches(tried: list[Played]) -> list[Played]:
    """Those of them that are taken."""
    return taken(tried)


@pytest.fixture(scope="module")
def anomalies() -> Iterator[list[Played]]:
    env = environment(faults=ANOMALIES.faults)
    yield taken([play(env, each) for each in of_each_type(ANOMALIES, 8)])
    env.close()


def test_kind_b_is_the_key_actions_and_nothing_else(env: EmbodiedEnv) -> None:
    every = of_kind(env, "b", 8)
    fit = taken(every)
    assert len(fit) > len(every) // 3
    for each in fit:
        assert are_key_actions(each.course.actions, each.course.key_actions), each.candidate.id
        assert all(each.course.done)
    for each in every:
        if each.problem:  # it was given up at once, not after a detour
            *actions, last = each.course.actions
            assert last.verb == verbs.END
            for action, key in zip(actions, each.task.key_actions, strict=False):
                assert action.verb == key.verb, each.candidate.id
                assert same_type(action.object_type, key.actual_type), each.candidate.id


def wrong_places(played: Played) -> list[tuple[Action, str, str]]:
    """The places searched in vain, each with the object sought and the right place."""
    found = []
    by_subgoal = {each: leg for leg in legs_of(played.task) for each in leg.subgoals}
    for intent in played.intents:
        leg = by_subgoal[intent.subgoal]
        if intent.purpose == "search" and not same_type(intent.action.object_type, leg.place):
            found.append((intent.action, leg.thing, leg.place))
    return found


def test_kinds_a_and_c_search_plausible_wrong_places_first(searches: list[Played]) -> None:
    assert len(searches) > 40
    number = 0
    for each in searches:
        assert each.episode.success
        places = wrong_places(each)
        looked = any(intent.purpose == "look around" for intent in each.intents)
        assert places or looked, each.candidate.id
        number += len(places)
        for action, thing, right in places:
            place = action.object_type
            assert search_priors.has(place, "receptacle"), (each.candidate.id, place)
            assert not same_type(place, right)
            assert not same_type(place, thing)
            assert place not in search_priors.MOBILE
            fixed = not search_priors.has(thing, "pickupable")
            assert not (fixed and search_priors.opens(place)), (each.candidate.id, thing, place)
    assert number > 40


def test_plans_name_each_place_once_and_shrink(searches: list[Played]) -> None:
    """A plan begins with where the agent goes; what it has searched is planned no more."""
    shrunk = 0
    for each in searches:
        before: dict[Subgoal, tuple[str, ...]] = {}
        for intent in each.intents:
            if intent.purpose != "search":
                continue
            place, *rest = intent.plan
            assert place == intent.action.object_type
            assert len({*intent.plan}) == len(intent.plan)
            if earlier := before.get(intent.subgoal):
                shrunk += 1
                assert {*rest} <= {*earlier[1:]}
                assert earlier[0] not in intent.plan
            before[intent.subgoal] = intent.plan
    assert shrunk > 20


def test_a_wrong_container_is_opened_and_closed_again(searches: list[Played]) -> None:
    looks = [
        (one, two)
        for each in searches
        for one, two in pairwise(each.intents)
        if one.purpose == "open to look" and two.purpose != "take"
    ]
    closed = [(one, two) for one, two in looks if two.purpose == "close again"]
    assert len(closed) > 3
    assert all(one.action.object_type == two.action.object_type for one, two in closed)


def test_the_mode_says_how_many_places_are_wrong_and_which_is_right() -> None:
    assert plan_of("010", "Sink", ["Bed", "Desk"]) == ["Bed", "Sink", "Desk"]
    assert plan_of("001", "Sink", ["Bed"]) == ["Bed", "Sink"]
    assert plan_of("00", "Sink", ["Bed", "Desk"]) == ["Bed", "Desk"]


def test_it_looks_around_when_nothing_is_left_or_three_places_were_wrong(
    tried: list[Played],
) -> None:
    seen = 0
    for each in tried:
        wrong: dict[str, int] = {}
        for intent, view in each.noted:
            thing = intent.subgoal.thing
            if intent.purpose == "search" and not same_type(
                intent.action.object_type, right_place(each, intent.subgoal)
            ):
                wrong[thing] = wrong.get(thing, 0) + 1
                assert wrong[thing] <= 4, each.candidate.id  # the fourth is gone to for a view
            if intent.purpose == "look around":
                seen += 1
                place = right_place(each, intent.subgoal)
                assert not any(same_type(place, name) for name in view.navigable)
    assert seen > 1


def right_place(played: Played, subgoal: object) -> str:
    return next(leg.place for leg in legs_of(played.task) if subgoal in leg.subgoals)


def test_nobody_goes_where_it_may_not(searches: list[Played], anomalies: list[Played]) -> None:
    for each in (*searches, *anomalies):
        for intent, view in each.noted:
            if intent.action.verb == verbs.NAVIGATE:
                assert intent.action.object_type in view.navigable, each.candidate.id


def test_nobody_searches_for_what_it_has_seen(
    tried: list[Played], anomalies: list[Played], env: EmbodiedEnv
) -> None:
    explored = [play(env, each) for each in of_each_type(RECIPE.parts["exploration"], 4)]
    looked = 0
    for each in (*tried, *anomalies, *explored):
        assert not searched_though_seen(each)
        looked += sum(intent.purpose == "search" for intent in each.intents)
    assert looked > 100


def test_every_fault_is_followed_by_the_same_action(anomalies: list[Played]) -> None:
    faults = 0
    for each in anomalies:
        assert each.episode.success
        for index, fault in enumerate(each.faults):
            if fault:
                faults += 1
                now, then = each.intents[index], each.intents[index + 1]
                assert (then.action, then.purpose, then.train) == (now.action, "retry", True)
    assert faults > 50


def test_only_repeats_are_not_learnt_from(anomalies: list[Played]) -> None:
    repeats = 0
    for each in anomalies:
        for before, intent in pairwise(each.intents):
            assert intent.train == (intent.purpose != "repeat")
            if intent.purpose == "repeat":
                repeats += 1
                assert intent.action == before.action
    assert repeats > 10


def test_ordered_tasks_are_done_in_order(searches: list[Played], anomalies: list[Played]) -> None:
    ordered = [each for each in (*searches, *anomalies) if each.task.type.ordered]
    assert len(ordered) > 2
    for each in ordered:
        earned = [step for step in each.episode.steps[1:] if step.reward > 0]
        done = [(step.verb, step.object_type) for step in earned if step.verb != verbs.NAVIGATE]
        keys = [(key.verb, key.actual_type) for key in each.task.key_actions]
        wanted = [key for key in keys if key[0] != verbs.NAVIGATE]
        assert [verb for verb, _ in done] == [verb for verb, _ in wanted]
        assert all(
            same_type(here, there) for (_, here), (_, there) in zip(done, wanted, strict=True)
        )


def test_what_is_checked_is_done_before(searches: list[Played]) -> None:
    checks = [
        (each, intent, view) for each in searches for intent, view in each.noted if intent.checked
    ]
    assert {intent.checked for _, intent, _ in checks} == {"check", "think and check"}
    for each, _, view in checks:
        assert {key.verb for key in view.left} <= {verbs.END}, each.candidate.id
    assert any(intent.purpose == "check" for _, intent, _ in checks)
    assert not any(intent.checked for each in searches for intent in each.intents[:-2])


def test_a_sure_explorer_visits_the_likeliest_places_first(env: EmbodiedEnv) -> None:
    part = RECIPE.parts["exploration"].model_copy(
        update={"explorers": {"sure": Strength(temperature=0.0)}}
    )
    visits = 0
    for candidate in of_each_type(part, 6):
        each = play(env, candidate)
        visited: dict[Subgoal, list[str]] = {}
        for intent, view in each.noted:
            place = intent.action.object_type
            before = visited.setdefault(intent.subgoal, [])
            if intent.purpose == "approach":
                before.append(place)
            if intent.purpose != "search":
                continue
            visits += 1
            leg = next(one for one in legs_of(each.task) if intent.subgoal in one.subgoals)
            there = likely_places(leg.thing, view.navigable, without=before)
            assert (place, intent.plan[0]) == (draw_places(there, 1, Random(0), 0.0)[0], place)
            before.append(place)
    assert visits > 40


def test_where_things_are_is_nothing_to_an_explorer(env: EmbodiedEnv) -> None:
    """Its course up to the object is the same if the task names other places."""
    part = RECIPE.parts["exploration"]
    compared = 0
    for candidate in of_each_type(part, 8):
        task = candidate.task
        leg = legs_of(task)[0]
        if not leg.hidden or leg.navigate is None:
            continue
        first = play(env, candidate)
        unseen = [
            intent
            for intent, view in first.noted
            if not any(same_type(name, leg.thing) for name in view.visible)
        ]
        moved = play(env, with_place(candidate, leg.place, "Desk|+01.00|+00.00|+01.00"))
        again = moved.intents[: len(unseen)]
        searched = [each for each in unseen if each.purpose in ("search", "look around")]
        if len(searched) == len(unseen):
            assert [each.action for each in again] == [each.action for each in unseen]
            compared += bool(unseen)
    assert compared > 5


def with_place(candidate: Candidate, place: str, object_id: str) -> Candidate:
    """The candidate with another place in its first key action."""
    key, *rest = candidate.task.key_actions
    assert key.actual_type == place
    other = replace(key, object_id=object_id, object_type=type_of_id(object_id))
    return replace(candidate, task=replace(candidate.task, key_actions=(other, *rest)))


def test_a_correction_begins_like_the_failed_episode(env: EmbodiedEnv) -> None:
    part = RECIPE.parts["corrections"]
    corrected = 0
    for candidate in of_each_type(part, 4):
        failed = play(env, candidate)
        beginning = first_mistake(failed.episode)
        if beginning.problem:
            assert not beginning.actions
            continue
        steps = failed.episode.steps[1:]
        assert [step.reward > 0 for step in steps[: len(beginning.actions)]] == [
            *[True] * beginning.first_wrong,
            False,
        ]
        one = play(env, replace(candidate, beginning=beginning, strength=None))
        assert all(intent.train for intent in one.intents[len(beginning.actions) :])
        replayed = one.intents[: len(beginning.actions)]
        assert tuple(intent.action for intent in replayed) == beginning.actions
        assert not any(intent.train for intent in replayed)
        assert not searched_though_seen(one)
        if not one.problem:
            assert one.episode.success
            corrected += 1
    assert corrected > 8


def test_a_correction_can_begin_after_a_failure(env: EmbodiedEnv) -> None:
    part = RECIPE.parts["corrections"]
    corrected = 0
    for candidate in of_each_type(part, 6):
        failed = play(env, candidate).episode
        beginning = first_mistake(failed, "failure")
        if beginning.problem or failed.steps[1 + beginning.first_wrong].success:
            continue
        one = play(env, replace(candidate, beginning=beginning, strength=None))
        replayed = one.episode.steps[1 : 1 + len(beginning.actions)]
        assert [each.success for each in replayed] == [
            each.success for each in failed.steps[1 : 1 + len(beginning.actions)]
        ]
        corrected += one.episode.success
    assert corrected


def test_a_correction_opens_one_container_after_another() -> None:
    """Where the environment chooses another container of the type than the task's."""
    closed = [
        task
        for task in TASKS
        if task.type.name == "single_pickup_from_closerep"
        and task.key_actions[0].actual_type in ("Cabinet", "Drawer")
    ]
    part = RECIPE.parts["corrections"]
    sequence = CandidateSequence("part", part, closed, SEED)
    beginning = Beginning((Action(verbs.OBSERVE),))
    several = 0
    env = environment(instances="explore")
    for index in range(10):
        one = play(env, replace(sequence[index], beginning=beginning, strength=None))
        opened = sum(action.verb == verbs.OPEN for action in one.course.actions)
        several += one.episode.success and opened > 1
    env.close()
    assert several


def test_a_fault_is_no_mistake_to_be_corrected(env: EmbodiedEnv) -> None:
    """A run with faults fails at right actions, too; repeated without a fault, they earn."""
    task = next(task for task in TASKS if task.type.name == "single_pickup")
    sequence = next(
        each
        for each in of_each_type(EXPERTS.model_copy(update={"kinds": {"b": 1.0}}), 12)
        if each.task.type == task.type and not play(env, each).problem
    )
    right = play(env, sequence).intents[0].action
    beginning = Beginning((right,))
    again = play(env, replace(sequence, kind="corrected", mode="", beginning=beginning))
    assert again.problem == "no success"
    assert len(again.intents) == 2


def test_the_same_seed_gives_the_same_course(env: EmbodiedEnv) -> None:
    part = RECIPE.parts["exploration"]
    for candidate in of_each_type(part, 1):
        one, two = play(env, candidate), play(env, candidate)
        assert one.intents == two.intents
