"""Which trajectories are taken, and where failed episodes leave the key actions."""

from __future__ import annotations

import pytest
from episodes_by_hand import make_episode, make_key, make_step

from agents.expert.acceptance import PlayedCourse, rejection
from agents.expert.collect import CORRECTIONS, corrections_recipe
from agents.expert.corrections import DRAWS, correction_points, first_mistake
from er_gym.envs.actions import Action
from er_gym.rollout.records import EpisodeRecord

KEYS = ("navigate to Sink", "pickup Egg", "end")
SEARCHED = ("navigate to Bed", *KEYS)
STUMBLED = ("navigate to Sink", "!pickup Egg", "pickup Egg", "end")
COURSES = {
    # kind, mode, actions ("!": not done), and the reason
    "the key actions": ("b", "", KEYS, ""),
    "b searched": ("b", "", SEARCHED, "more than the key actions"),
    "a searched": ("a", "1", SEARCHED, ""),
    "a found it at once": ("a", "1", KEYS, "nothing was searched"),
    "c found it at once": ("c", "0", KEYS, "nothing was searched"),
    "an explorer searched": ("explored", "search", SEARCHED, ""),
    "an explorer found it at once": ("explored", "search", KEYS, "nothing was searched"),
    "an explorer may": ("explored", "", KEYS, ""),
    "refused": ("a", "1", STUMBLED, "an action was refused"),
    "an explorer was refused": ("explored", "", STUMBLED, "an action was refused"),
    "an anomaly": ("anomaly", "", STUMBLED, ""),
    "a repeat": ("anomaly", "", ("navigate to Sink", *KEYS), ""),
    "no anomaly": ("anomaly", "", KEYS, "nothing went wrong"),
    "a correction": ("corrected", "", STUMBLED, ""),
    "five actions": ("a", "1", ("navigate to Bed", *SEARCHED), ""),
    "six actions": ("a", "1", ("navigate to Bed", "observe", *SEARCHED), "too long"),
}


def course(kind: str, mode: str, actions: tuple[str, ...], *, success: bool = True) -> PlayedCourse:
    steps = [make_step(text) for text in actions]
    return PlayedCourse(
        kind,
        mode,
        success,
        [make_key(text) for text in KEYS],
        [Action(step.verb, step.object_type) for step in steps],
        [step.success for step in steps],
    )


@pytest.mark.parametrize("name", COURSES)
def test_a_course_is_taken_by_its_kind(name: str) -> None:
    kind, mode, actions, reason = COURSES[name]
    assert rejection(course(kind, mode, actions), 5) == reason


def test_what_failed_is_not_taken() -> None:
    for kind in ("a", "b", "c", "anomaly", "explored", "corrected"):
        assert rejection(course(kind, "", KEYS, success=False), 5) == "no success"


def failed(*steps: str, earned: int = 0, **more: object) -> EpisodeRecord:
    """A failed episode, whose first steps earned something."""
    episode = make_episode(KEYS, steps, **more)  # type: ignore[arg-type]
    told = [
        step.model_copy(update={"reward": float(0 < index <= earned)})
        for index, step in enumerate(episode.steps)
    ]
    return episode.model_copy(update={"steps": told})


def test_the_first_action_that_earned_nothing_was_wrong() -> None:
    for steps, earned in (
        (("pickup Bowl", "end"), 0),
        (("navigate to Sink", "pickup Bowl", "end"), 1),
        (("navigate to Sink", "!pickup Egg", "end"), 1),
        (("navigate to Sink", "navigate to Sink", "pickup Egg"), 1),
    ):
        beginning = first_mistake(failed(*steps, earned=earned))
        assert beginning.problem == ""
        assert beginning.first_wrong == earned
        wanted = [make_step(text) for text in steps[: earned + 1]]
        assert list(beginning.actions) == [Action(one.verb, one.object_type) for one in wanted]


def test_the_expert_can_take_over_after_a_failure() -> None:
    """After the first refused action since the last key action, if it has steps left."""
    steps = ("!pickup Egg", "navigate to Sink", "navigate to Sink", "!pickup Bowl", "!pickup Bowl")
    for earned_at, most, last in (
        ({2}, 30, 3),
        ({2, 5}, 30, 0),  # nothing failed since: the first wrong one
        ((), 30, 0),
        ({2}, 15, 3),
        ({2}, 14, 0),  # too few are left
    ):
        episode = failed(*steps, max_steps=most)
        told = [
            step.model_copy(update={"reward": float(index in earned_at)})
            for index, step in enumerate(episode.steps)
        ]
        beginning = first_mistake(episode.model_copy(update={"steps": told}), "failure")
        assert beginning.first_wrong == last, (earned_at, most)
    unusable = failed("navigate to Sink", "error", "!pickup Bowl", earned=1, max_steps=30)
    assert first_mistake(unusable, "failure").problem == "its first wrong reply names no action"


def test_nobody_takes_over_an_episode_that_is_over() -> None:
    """Where the fourth same action was refused and ended it, the third is the last."""
    steps = ("navigate to Sink", "navigate to Shelf", "navigate to Shelf", "navigate to Shelf")
    for last, reason, kept in (
        ("!navigate to Shelf", "repeated action", 4),
        ("!navigate to Shelf", "", 5),
        ("!pickup Egg", "repeated action", 4),
    ):
        episode = failed(*steps, last, earned=1, max_steps=30, end_reason=reason)
        assert len(first_mistake(episode, "failure").actions) == kept, (last, reason)
    refused = failed(*["!pickup Egg"] * 4, max_steps=30, end_reason="repeated action")
    assert len(first_mistake(refused, "failure").actions) == 1


def test_somebody_can_take_over_anywhere() -> None:
    """At several actions drawn at random, none of which is unusable or leaves too few steps."""
    walk = ["navigate to Sink", "navigate to Shelf", "navigate to Bed", "pickup Egg", "open Fridge"]
    for steps, most, reason, last in (
        (walk, 30, "", 5),
        (walk, 14, "max_steps", 3),
        (walk * 3, 40, "", 15),
        ([*walk, *["!pickup Egg"] * 4], 30, "repeated action", 8),
        ([*walk, "error", *walk], 30, "", 5),
        (["navigate to Sink", "end"], 30, "", 1),
    ):
        drawn = set()
        for number in range(60):
            episode = failed(*steps, max_steps=most, end_reason=reason, task_id=f"task-{number}")
            begun = correction_points(episode, "anywhere")
            assert begun == correction_points(episode, "anywhere")
            lengths = [len(each.actions) for each in begun]
            assert lengths == sorted(set(lengths))
            assert len(lengths) == min(DRAWS, last)
            wanted = [make_step(text) for text in steps[: lengths[-1]]]
            assert begun[-1].actions == tuple(Action(one.verb, one.object_type) for one in wanted)
            drawn |= {*lengths}
        assert drawn == {*range(1, last + 1)}, (steps, most)
    many = failed(*walk, *["!pickup Egg", "navigate to Bed"] * DRAWS, max_steps=40)
    begun = correction_points(many, "anywhere")  # the refused ones come first
    assert [len(each.actions) for each in begun] == [6 + 2 * number for number in range(DRAWS)]
    for number in range(20):  # and the last one at which the fourth of a row could be avoided
        row = [*walk, *["!open Fridge", "pickup Egg"] * 4, *["navigate to Bed"] * 4]
        stuck = failed(*row, max_steps=60, end_reason="repeated action", task_id=f"task-{number}")
        last = correction_points(stuck, "anywhere")[-1]
        assert len(last.actions) == len(row) - 1
    for episode, problem in (
        (failed("error", "navigate to Sink"), "no action leaves room"),
        (failed("navigate to Sink", max_steps=10), "no action leaves room"),
        (failed("navigate to Sink", error="boom"), "the episode crashed"),
    ):
        (none,) = correction_points(episode, "anywhere")
        assert problem in none.problem
        assert none.actions == ()


def test_episodes_are_corrected_after_refusals() -> None:
    """After each refused action that leaves enough steps, up to a number; nowhere else."""
    go, refused = "navigate to Bed", "!pickup Egg"
    for steps, most, reason, wanted in (
        ([go, refused, go, refused, go], 30, "", {2, 4}),
        ([go, refused, go, refused, go], 14, "", {2}),
        ([go, *[refused] * 4], 30, "repeated action", {2, 3, 4}),
        ([refused, "!error", refused], 30, "", {1}),
    ):
        begun = correction_points(failed(*steps, max_steps=most, end_reason=reason), "refusal")
        assert {len(each.actions) for each in begun} == wanted, steps
        assert not any(each.problem for each in begun)
    late = failed(*[go] * 12, refused, go, max_steps=14)
    assert correction_points(late, "refusal")[0].problem
    assert [len(each.actions) for each in correction_points(late, "refusal", 30)] == [13]
    assert correction_points(late, "failure", 30)[0].first_wrong == 12
    for steps, most in ((None, 36), (60, 60), (10, 36)):
        assert corrections_recipe(steps).parts[CORRECTIONS].most_actions == most
    many = correction_points(failed(*[go, refused] * 9, max_steps=40), "refusal")
    assert len(many) == DRAWS
    assert all(len(each.actions) % 2 == 0 for each in many)
    for episode, problem in (
        (failed(go, go, max_steps=30), "no refused action leaves room"),
        (failed(go, refused, max_steps=10), "no refused action leaves room"),
        (failed(go, refused, error="boom"), "the episode crashed"),
    ):
        (none,) = correction_points(episode, "refusal")
        assert problem in none.problem
        assert none.actions == ()


def test_some_episodes_cannot_be_corrected() -> None:
    won = failed(*KEYS, earned=3).model_copy(update={"success": True})
    garbled = failed("navigate to Sink", "error", "pickup Egg", earned=1)
    appended = failed("navigate to Sink", "end", earned=1)
    last = appended.steps[-1].model_copy(update={"appended": True})
    for episode, problem in (
        (won, "the episode succeeded"),
        (failed("pickup Bowl", error="boom"), "the episode crashed"),
        (failed("end"), "it ended too early"),
        (appended, "it ended too early"),
        (appended.model_copy(update={"steps": [*appended.steps[:-1], last]}), "ended too early"),
        (garbled, "its first wrong reply names no action"),
        (failed("navigate to Sink", earned=1, end_reason="max_steps"), "nothing was wrong before"),
        (failed(), "nothing was wrong before"),
    ):
        beginning = first_mistake(episode)
        assert problem in beginning.problem
        assert beginning.actions == ()
