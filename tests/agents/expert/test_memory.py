"""What a course remembers: where things were, what it moved, and where to go for them."""

from __future__ import annotations

from dataclasses import replace
from random import Random
from typing import Any

import pytest
from support import in_one_test

from agents.expert.course import View
from agents.expert.expert import ExpertCourse
from agents.expert.explorer import ExplorerCourse, Strength
from agents.expert.legs import legs_of
from agents.expert.memory import Memory, Sighting
from agents.expert.players import Thinkers
from agents.expert.replayed_intents import replayed_intent
from agents.expert.task_course import GiveUp
from agents.expert.writers.registry import WRITERS
from er_gym.data.trajectory import SeenObject, Subgoal, Trajectory, Turn
from er_gym.envs.actions import Action
from er_gym.envs.object_view import ObjectView
from er_gym.tasks import verbs
from er_gym.tasks.task import KeyAction
from tests.support import make_task

SHELF, MUG, DESK = (f"{kind}|+00.00|+00.00|+00.00" for kind in ("Shelf", "Mug", "Desk"))
PLAIN = make_task(
    "pickup_and_put",
    (verbs.NAVIGATE, SHELF),
    (verbs.PICKUP, MUG),
    (verbs.NAVIGATE, DESK),
    (verbs.PUT, DESK),
)
_GO, *_REST = PLAIN.key_actions
TASK = replace(PLAIN, key_actions=(replace(_GO, related_objects=(SHELF, MUG)), *_REST))
"""The mug is hidden: the instruction does not say where it is."""


def seen(kind: str, on: str = "", bearing: float = 0.0, distance: float = 1.0) -> ObjectView:
    return ObjectView(f"{kind}|+00.00|+00.00|+00.00", kind, bearing, distance, on)


def view(*ahead: ObjectView, around: tuple[ObjectView, ...] = (), **fields: Any) -> View:
    plain = View(
        visible=frozenset(each.object_type for each in ahead),
        held="",
        navigable=("Shelf", "Desk", "Sofa"),
        reach=frozenset(),
        legal=(),
        action=None,
        success=True,
        done=0,
        left=TASK.key_actions,
        steps_left=20,
        info={"object_views": ahead, "object_views_around": {"left": around}},
    )
    return replace(plain, **fields)


def remembering(*views: View) -> Memory:
    memory = Memory()
    for each in views:
        memory.take(each)
    return memory


def test_it_remembers_what_was_in_view_anywhere_and_where_it_lay() -> None:
    memory = remembering(view(seen("Mug", "Shelf")), view(around=(seen("Egg", "Sink"),)), view())
    assert (memory.of("Mug").on, memory.of("Egg").on) == ("Shelf", "Sink")  # type: ignore[union-attr]
    assert memory.of("Fork") is None
    both = remembering(view(seen("SinkBasin")))
    assert both.of("Sink") is not None  # counts as the same


def test_what_it_takes_it_has_and_what_it_puts_down_lies_there() -> None:
    took = view(held="Mug", action=Action(verbs.PICKUP, "Mug"))
    put = view(action=Action(verbs.PUT, "Sofa"))
    assert remembering(view(seen("Mug", "Shelf")), took).of("Mug") is None
    assert remembering(view(seen("Mug", "Shelf")), took, put).of("Mug") == Sighting("Mug", "Sofa")
    failed = replace(put, success=False, held="Mug")
    assert remembering(took, failed).of("Mug") is None


def test_the_nearest_of_a_type_is_the_one_remembered_with_what_is_near_it() -> None:
    near, far = seen("Mug", "Desk", 0, 1), seen("Mug", "Shelf", 90, 3)
    memory = remembering(view(near, far, seen("Sofa", "", 80, 3), seen("Lamp", "", 5, 1)))
    found = memory.of("Mug")
    assert found is not None
    assert (found.on, found.ways[:3]) == ("Desk", ("Desk", "Mug", "Lamp"))


@in_one_test(
    "row",
    [  # on what it lay; a place; whether it may have been there
        ("Shelf", "Shelf", True),
        ("", "Sofa", True),
        ("Sink", "SinkBasin", True),
        ("StoveBurner", "CounterTop", True),  # a part of it
        ("CounterTop", "Drawer", False),  # not in its drawer
        ("Shelf", "Sofa", False),
    ],
)
def test_whether_the_one_that_was_seen_can_be_the_one_of_the_task(
    row: tuple[str, str, bool],
) -> None:
    on, place, fits = row
    assert Sighting("Mug", on).fits(place) == fits


def course(mode: str = "1", *views: View, strict: bool = False) -> ExpertCourse:
    made = ExpertCourse(TASK, "a" if "0" in mode else "b", mode, Random(0), strict=strict)
    for each in views:
        made.view = each
    return made


def test_it_goes_back_to_what_it_has_seen_and_searches_nothing() -> None:
    leg = legs_of(TASK)[0]
    intent = next(course("1", view(seen("Mug", "Shelf")), view())._search(leg))
    assert (intent.action, intent.purpose) == (Action(verbs.NAVIGATE, "Shelf"), "approach")
    intent = next(course("1", view())._search(leg))
    assert intent.purpose == "search"


def test_it_gives_up_where_it_has_seen_another_one_or_would_search_elsewhere() -> None:
    leg = legs_of(TASK)[0]
    for made in (
        course("1", view(seen("Mug", "Sofa")), view()),
        course("01", view(seen("Mug", "Shelf")), view()),
    ):
        with pytest.raises(GiveUp):
            next(made._search(leg))


def test_it_goes_near_what_it_has_seen_where_it_may_not_go_there_itself() -> None:
    leg = legs_of(TASK)[0]
    beside = view(seen("Mug", "Shelf"), seen("Desk", "", 5, 1), seen("Sofa", "", 50, 4))
    blocked = replace(view(), navigable=("Desk", "Sofa"))
    walk = course("1", beside, blocked)._search(leg)
    first = next(walk)
    assert (first.action.object_type, first.purpose) == ("Desk", "approach")
    with pytest.raises(GiveUp):
        next(course("1", beside, blocked, strict=True)._search(leg))


def test_who_goes_where_a_thing_was_does_not_search_for_it() -> None:
    memory, legs = remembering(view(seen("Mug", "Shelf"))), legs_of(TASK)
    purposes = {
        (place, known): replayed_intent(
            Action(verbs.NAVIGATE, place),
            view(),
            legs,
            train=True,
            memory=memory if known else None,
        ).purpose
        for place in ("Shelf", "Sofa")
        for known in (True, False)
    }
    assert {each for each, purpose in purposes.items() if purpose == "approach"} == {
        ("Shelf", True)
    }


def test_a_course_that_searches_for_what_it_has_seen_is_not_taken() -> None:
    turns = [
        Turn(
            verb=verbs.NAVIGATE,
            object_type=place,
            purpose=purpose,
            subgoal=Subgoal(verb=verbs.PICKUP, thing="Mug"),
            view=[SeenObject(type="Mug", side="left", distance=1.0, on="Shelf")],
            success=True,
        )
        for place, purpose in (("Bed", "approach"), ("Sofa", "search"))
    ]
    thinkers = Thinkers(WRITERS.get("grounded"))
    whole = Trajectory.model_construct(
        kind="corrected", mode="", success=True, turns=turns, key_actions=[], language="en"
    )
    whole = whole.model_copy(update={"instruction": "Take the Mug."})
    assert thinkers.rejection(whole, 9) == "it searches for what it has seen"
    assert not thinkers.rejection(whole.model_copy(update={"turns": turns[:1]}), 9)


def test_only_the_place_of_the_task_is_one_to_carry_to() -> None:
    to_desk = legs_of(TASK)[1]
    explorer = ExplorerCourse(TASK, Strength(), Random(0))
    explorer.view = view(held="Mug")
    for place, purpose in (("Desk", "carry"), ("Sofa", "approach")):
        assert next(explorer._approach(place, to_desk)).purpose == purpose


def test_it_does_not_go_to_where_it_is() -> None:
    there = replace(view(), action=Action(verbs.NAVIGATE, "Desk"))
    made = course("1", view(seen("Mug", "Desk"), seen("Sofa", "", 5, 1)), there)
    found = made._memory.of("Mug")
    assert found is not None
    assert made._ways(found) == ["Sofa"]


def test_an_explorer_does_not_open_what_it_has_no_reason_to_open() -> None:
    leg = legs_of(TASK)[0]
    opening = KeyAction(verbs.OPEN, "Drawer|+00.00|+00.00|+00.00", "Drawer")
    legal = (Action(verbs.OPEN, "Drawer"),)
    explorer = ExplorerCourse(TASK, Strength(), Random(0))
    explorer.view = view(seen("Mug", "Shelf"), legal=legal)
    with pytest.raises(GiveUp):
        next(explorer._do_key(opening, leg))
    explorer = ExplorerCourse(TASK, Strength(), Random(0))
    explorer.view = view(legal=legal)
    assert next(explorer._do_key(opening, leg)).action in legal
