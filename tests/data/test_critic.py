"""The critic finds planted lies and refuses nothing honest."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace

import pytest
from planted_lies import Planted, honest, planted
from support import in_one_test

from benchmarks.harness.played_turns import knowledge
from er_gym.data.critic import CHECKS, check
from er_gym.data.form import thought_length
from er_gym.data.knowledge import Knowledge
from er_gym.data.trajectory import SeenObject, Subgoal, ThoughtRecord
from er_gym.envs.actions import Action
from er_gym.tasks import verbs

LIMIT = 200
"""The most words of the thoughts here."""


@pytest.fixture(scope="module")
def known() -> list[Knowledge]:
    """What the agent knew at the turns of six real episodes, in both languages."""
    english = knowledge()
    return [*english, *(replace(each, language="zh") for each in english)]


def refused(one: Planted) -> tuple[str, ...]:
    return tuple(each.code for each in check(one.text, "planning", one.knowledge, limit=LIMIT))


CODES = {
    "unseen": {"unseen"},
    "sighting": {"unseen", "hidden"},
    "hidden": {"hidden", "unseen"},
    "side": {"side"},
    "support": {"support", "hidden"},
    "state": {"state"},
    "holding": {"held"},
    "empty hand": {"held"},
    "visited": {"history"},
    "succeeded": {"history"},
    "failed": {"history"},
    "decision": {"decision"},
    "language": {"language"},
    "tags": {"tags"},
    "leak": {"leak"},
    "length": {"length"},
}
"""The codes that name a sort of lie."""


def test_planted_lies_are_caught(known: list[Knowledge]) -> None:
    """At least 195 of every 200, of sixteen sorts in two languages, and under the right code."""
    lies = planted(known)
    missed = [one for one in lies if not refused(one)]
    wrong = [(one.sort, one.text) for one in lies if not CODES[one.sort] & {*refused(one)}]
    by_sort = Counter((one.sort, one.knowledge.language) for one in lies)
    assert len(lies) >= 200
    assert {sort for sort, _ in by_sort} == {*CODES}
    assert len({language for _, language in by_sort}) == 2
    assert len(missed) <= len(lies) * 5 // 200, [(one.sort, one.text) for one in missed]
    assert len(wrong) <= len(lies) * 8 // 200, wrong


def test_honest_thoughts_stand(known: list[Knowledge]) -> None:
    thoughts = honest(known)
    false = [
        (one.text, check(one.text, "planning", one.knowledge, limit=LIMIT)) for one in thoughts
    ]
    assert len(thoughts) >= 150
    assert not [each for each in false if each[1]]


def test_a_refusal_says_what_is_wrong(known: list[Knowledge]) -> None:
    for one in planted(known, per_template=1):
        for refusal in check(one.text, "planning", one.knowledge, limit=LIMIT):
            assert refusal.detail.endswith((".", '."'))
            assert len(refusal.detail.split()) >= 4


def scene(**changes: object) -> Knowledge:
    """A kitchen: a mug on the counter to the left, a closed fridge ahead, nothing in the hand."""
    plain = Knowledge(
        language="en",
        instruction="Find the Egg.",
        turn=0,
        view=[
            SeenObject(type="CounterTop", side="left", distance=1.5),
            SeenObject(type="Mug", side="left", distance=1.6, on="CounterTop"),
            SeenObject(type="Fridge", side="ahead", distance=2.0, open=False),
            SeenObject(type="StoveBurner", side="right", distance=2.5),
        ],
        held="",
        at="",
        decision=Action("navigate to", "Fridge"),
        purpose="search",
        subgoal=Subgoal(thing="Egg"),
    )
    return replace(plain, **changes)  # type: ignore[arg-type]


def codes(text: str, known: Knowledge) -> set[str]:
    return {each.code for each in check(text, "reasoning", known, limit=LIMIT)}


@pytest.mark.parametrize(
    "text",
    [
        "I see a cup on the counter.",  # people call a mug a cup
        "The mug is a little to my left, on the kitchen counter.",
        "Does the counter to my right hold an egg?",
        "The stove is on the right, to the left of the window that I imagine.",
        "If the fridge is open, I can look inside at once.",
        "The fridge, which could hold the egg, is closed.",
        "I will go to the fridge and open it, then I will check the counter.",
        "The counter might do as well, but I am going to check the fridge first.",
        "The egg is neither on the counter nor on the stove, as far as I can see.",
    ],
)
def test_what_is_true_in_another_way_stands(text: str) -> None:
    assert codes(text, scene()) == set()


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("First I will check the counter, and after that I will go to the fridge.", "decision"),
        ("I am done: the task is complete.", "decision"),
        ("There are two mugs on the counter.", "count"),
        ("I cannot see any fridge from here.", "unseen"),
        ("I will take the egg out of the fridge.", "hidden"),
        ("The fridge is not closed at the moment.", "state"),
    ],
)
def test_a_lie_between_the_lines_is_found(text: str, code: str) -> None:
    assert code in codes(text, scene())


@in_one_test(
    "text",
    [
        "I am not holding the egg or the apple.",
        "I'm not holding the apple or the egg.",
        "I am no longer holding the egg, the potato or the apple.",
        "I do not have the egg, or the apple, in my hand.",
        "I hold neither the egg nor the apple.",
        "Neither the apple nor the egg is in my hand.",
        "The apple and the egg are not in my hand.",
        "The egg and the apple are not in my hand.",
        "我没有拿着鸡蛋或苹果。",
        "鸡蛋和苹果都不在我手里。",
        "我手里没有苹果和鸡蛋。",
    ],
)
def test_a_denial_of_two_things_denies_both(text: str) -> None:
    """One of the two is in the hand; with the other in the hand the denial is as false."""
    language = "en" if text.isascii() else "zh"
    for held in ("Apple", "Egg"):
        assert codes(text, scene(language=language, held=held)) == {"held"}
    assert codes(text, scene(language=language, held="")) == set()


@in_one_test(
    "text",
    [
        "I cannot see the egg or the fridge from here.",
        "There is no fridge or egg in sight.",
        "The fridge and the egg are not in view.",
        "看不到鸡蛋和冰箱。",
    ],
)
def test_what_is_in_view_is_not_denied_beside_what_is_not(text: str) -> None:
    language = "en" if text.isascii() else "zh"
    assert "unseen" in codes(text, scene(language=language))
    assert codes(text, scene(language=language, view=[], decision=Action("observe"))) == set()


def test_a_deed_that_is_only_guessed_stands() -> None:
    assert "history" in codes("I opened the fridge before.", scene())
    for text in ("Perhaps I opened the fridge before.", "Did I open the fridge before?"):
        assert codes(text, scene()) == set()


def test_a_denial_that_is_only_guessed_stands() -> None:
    known = scene(held="Apple")
    for text in (
        "If I am not holding the mug or the apple, I have to look for them.",
        "Perhaps I am not holding the mug or the apple.",
        "Am I not holding the mug or the apple?",
    ):
        assert codes(text, known) == set()


ANNOUNCED = {
    "open": ("open the fridge", {verbs.OPEN, verbs.NAVIGATE, verbs.TOGGLE}),
    "close": ("close the fridge", {verbs.CLOSE, verbs.NAVIGATE, verbs.TOGGLE}),
    "toggle": ("switch on the fridge", {verbs.TOGGLE, verbs.NAVIGATE}),
    "slice": ("slice the fridge", {verbs.SLICE, verbs.NAVIGATE}),
    "put": ("put it in the fridge", {verbs.PUT, verbs.NAVIGATE, verbs.OPEN}),
    "take": ("pick up the fridge", {verbs.PICKUP, verbs.NAVIGATE, verbs.OPEN}),
    "go": ("go to the fridge", {verbs.NAVIGATE, verbs.OPEN, verbs.PICKUP, verbs.TOGGLE}),
    "check": ("check the fridge", {verbs.NAVIGATE, verbs.OPEN}),
    "look around": ("look around", {verbs.OBSERVE}),
    "end": ("end the task", {verbs.END}),
    "forward": ("take a step forward", {verbs.MOVE_FORWARD, verbs.NAVIGATE}),
}
"""What a thought decides on, and the verbs of actions that are it, or that lead to it."""


@in_one_test("act", ANNOUNCED)
def test_what_is_announced_is_done_or_led_to(act: str) -> None:
    said, fitting = ANNOUNCED[act]
    stands = {
        verb.name
        for verb in verbs.OWN
        if "decision"
        not in codes(
            f"I will {said} now.",
            scene(decision=Action(verb.name, "" if verb.alone else "Fridge"), purpose="use"),
        )
    }
    assert stands == fitting


def test_what_is_announced_is_done_to_that_thing() -> None:
    known = scene(decision=Action(verbs.NAVIGATE, "StoveBurner"))
    for said, _ in ANNOUNCED.values():
        if "fridge" in said:
            assert "decision" in codes(f"I will {said} now.", known)


def test_after_observe_sides_are_those_of_all_views() -> None:
    behind = scene(views={"behind": [SeenObject(type="Sofa", side="left", distance=3.0)]})
    assert codes("The sofa is behind me.", behind) == set()
    assert codes("The sofa is to my left.", behind) == {"side"}


def test_a_thought_is_not_said_twice() -> None:
    text = "The egg may be in the fridge."
    earlier = [[ThoughtRecord(kind="planning", text=text)]]
    assert codes("The egg may be in the fridge!", scene(earlier=earlier)) == {"repeat"}
    assert codes(text, scene()) == set()


def test_what_the_instruction_tells_may_be_said() -> None:
    text = "The egg is in the fridge, so that is where I go."
    assert codes(text, scene()) == {"hidden"}
    assert codes(text, scene(instruction="Fetch the Egg that is in the Fridge.")) == set()


def test_length_is_counted_in_words() -> None:
    assert thought_length("I look around, then I go on.") == 7
    assert thought_length("我先看看周围。") == 3
    assert [each.code for each in check("One two three four.", "planning", scene(), limit=3)] == [
        "length"
    ]


def test_every_check_can_refuse(known: list[Knowledge]) -> None:
    """A check that no lie here trips would be a check that nobody has seen working."""
    assert len(CHECKS) == len({*CHECKS})
    found = {code for one in planted(known, per_template=1) for code in refused(one)}
    assert found >= {
        *("unseen", "hidden", "side", "support", "state", "held", "history", "decision"),
        *("language", "length", "tags", "leak"),
    }
