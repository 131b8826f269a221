"""Kinds of odd thoughts that the grounded writer does not write, in both languages."""

from __future__ import annotations

import random
import re
from collections import Counter
from collections.abc import Sequence
from typing import Any, get_args

import pytest
from support import in_one_test

from agents.expert.writers.base import ThoughtRequest
from agents.expert.writers.facts import facts_of
from agents.expert.writers.grounded import GroundedWriter, clauses
from agents.expert.writers.nouns import nouns
from benchmarks.checks.odd_thoughts.moment import Moment
from benchmarks.checks.odd_thoughts.of_words import closer, half_sentences, strayed_pronouns
from er_gym.data.critic import check
from er_gym.data.knowledge import knowledge_at
from er_gym.data.mentions import find_mentions
from er_gym.data.trajectory import Language, SeenObject, Subgoal, ThoughtRecord, Trajectory, Turn
from er_gym.tasks import verbs

LANGUAGES: tuple[Language, ...] = get_args(Language)
WRITER = GroundedWriter()
GO, PICKUP, OPEN, PUT = verbs.NAVIGATE, verbs.PICKUP, verbs.OPEN, verbs.PUT
FIND = Subgoal(verb=PICKUP, thing="Mug", place="Sink")
BRING = Subgoal(verb=PUT, thing="Mug", place="Sink")
SEEDS = range(40)


def seen(kind: str, on: str = "", side: Any = "ahead", distance: float = 1.0) -> SeenObject:
    return SeenObject(type=kind, side=side, distance=distance, on=on)


def turn(verb: str, object_type: str = "", **fields: Any) -> Turn:
    plain = {"purpose": "search", "subgoal": FIND, "success": True}
    return Turn(verb=verb, object_type=object_type, **{**plain, **fields})


def thoughts(
    turns: Sequence[Turn], language: Language, seed: int, *kinds: str
) -> list[ThoughtRecord]:
    """The thoughts of the last turn."""
    known = knowledge_at(
        turns, len(turns) - 1, instruction="Put the Mug in the Sink.", language=language
    )
    request = ThoughtRequest(known, kinds, (150,) * len(kinds), seed=seed)  # type: ignore[arg-type]
    return list(WRITER.write(request).thoughts)


def moment(turns: Sequence[Turn], language: Language, written: list[ThoughtRecord]) -> Moment:
    now = turns[-1].model_copy(update={"thoughts": written})
    whole = Trajectory.model_construct(
        turns=[*turns[:-1], now],
        instruction="Put the Mug in the Sink.",
        language=language,
        kind="corrected",
        key_actions=[],
    )
    return Moment(whole, len(turns) - 1)


MUG_ON_DESK = [seen("Mug", "Desk"), seen("Desk"), seen("Book", "Desk"), seen("Sofa", "", "left")]
REMEMBERED = [
    turn(GO, "Sofa", view=MUG_ON_DESK, train=False),
    turn(GO, "Desk", view=[seen("Sofa"), seen("Book", "Sofa")], at="Sofa", purpose="approach"),
]


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_reflection_says_what_had_been_seen_and_where(language: Language) -> None:
    for seed in SEEDS:
        (reflection,) = thoughts(REMEMBERED, language, seed, "reflection")
        named = {kind for each in find_mentions(reflection.text) for kind in each.types}
        assert {"Mug", "Desk"} <= named, reflection.text
        known = knowledge_at(REMEMBERED, 1, instruction="Put the Mug.", language=language)
        assert not check(reflection.text, "reflection", known, limit=150), reflection.text


@pytest.mark.parametrize("language", LANGUAGES)
def test_what_was_seen_is_not_guessed_at_in_any_kind_of_thought(language: Language) -> None:
    known = knowledge_at(REMEMBERED, 1, instruction="Put the Mug.", language=language)
    for seed in SEEDS:
        for kinds in (("reasoning", "planning"), ("planning",), ("analysis", "planning")):
            for each in thoughts(REMEMBERED, language, seed, *kinds):
                assert not check(each.text, each.kind, known, limit=150), each.text


_RECALLS = re.compile(r"\b(?:saw|seen|seeing|was|remember|recall)\b|之前|先前|记得|一开始|刚")


@pytest.mark.parametrize("language", LANGUAGES)
def test_who_goes_back_says_so_in_other_kinds_of_thoughts_too(language: Language) -> None:
    for seed in SEEDS:
        for kind in ("reasoning", "planning"):
            (one,) = thoughts(REMEMBERED, language, seed, kind)
            assert _RECALLS.search(one.text), one.text


CARRIED = [
    turn(GO, "Desk", view=MUG_ON_DESK, purpose="approach", reward=1.0),
    turn(PICKUP, "Mug", view=MUG_ON_DESK, at="Desk", purpose="take", reward=1.0),
    turn(GO, "Sink", held="Mug", at="Desk", purpose="carry", subgoal=BRING),
]
SEARCHED = [turn(GO, "Bed"), turn(GO, "Shelf", at="Bed"), *CARRIED]


def facts(turns: Sequence[Turn]) -> dict[str, Any]:
    known = knowledge_at(turns, len(turns) - 1, instruction="Put the Mug.", language="en")
    return facts_of(known, random.Random(0))


def test_only_a_long_search_was_the_hard_part() -> None:
    assert "long_search" in facts(SEARCHED)
    assert "long_search" not in facts(CARRIED)
    said = dict.fromkeys((True, False), "")
    for long, turns in ((True, SEARCHED), (False, CARRIED)):
        for seed in range(100):
            said[long] += "".join(
                each.text for each in thoughts(turns, "en", seed, "reasoning", "planning")
            )
    assert "hard part" in said[True]
    assert "hard part" not in said[False]


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_repeat_does_not_doubt_what_was_seen_to_work(language: Language) -> None:
    opened = [turn(OPEN, "Fridge"), turn(OPEN, "Fridge", purpose="repeat", train=False)]
    for seed in SEEDS:
        for each in thoughts(opened, language, seed, "reasoning", "planning"):
            for doubt in ("can't tell", "not sure", "may not be enough", "不确定", "不够"):
                assert doubt not in each.text


@in_one_test("language", LANGUAGES)
def test_no_place_is_usual_for_a_thing_once_it_was_found_to_hold_another(
    language: Language,
) -> None:
    table = [seen("CounterTop"), seen("Bowl", "CounterTop")]
    new = turn(GO, "CounterTop", view=[seen("CounterTop", "", "left", 3.0)])
    again = turn(GO, "CounterTop", view=table, at="CounterTop")
    assert "typical" in facts([turn(GO, "Bed"), new])
    assert "typical" not in facts([new, again])


ENDING = [
    *CARRIED,
    turn(PUT, "Sink", held="Mug", at="Sink", purpose="put", subgoal=BRING, reward=1.0),
    turn(verbs.END, at="Sink", purpose="finish", subgoal=BRING),
]


@pytest.mark.parametrize("language", LANGUAGES)
def test_episodes_end_in_many_ways(language: Language) -> None:
    ends = Counter[str]()
    for seed in range(300):
        kinds = (("reasoning",), ("reasoning", "planning"), ("verification",))[seed % 3]
        at = moment(ENDING, language, thoughts(ENDING, language, seed, *kinds))
        ends[closer(at.trajectory)] += 1
    assert sum(number for _, number in ends.most_common(6)) < 150
    assert len(ends) > 20


FOUND = [
    turn(GO, "Sofa", view=[seen("Sofa"), seen("Fridge", "", "left")]),
    turn(GO, "Desk", at="Sofa", view=MUG_ON_DESK, purpose="approach"),
]
TAKING = [FOUND[0], turn(PICKUP, "Mug", at="Desk", view=MUG_ON_DESK, purpose="take")]
SWITCHING = [
    FOUND[0],
    turn(
        verbs.TOGGLE,
        "FloorLamp",
        at="Sofa",
        view=[seen("Sofa"), seen("FloorLamp", "", "left")],
        purpose="switch",
        subgoal=Subgoal(verb=verbs.TOGGLE, thing="FloorLamp"),
    ),
]
CLOSING = [
    turn(OPEN, "Fridge", at="Fridge", view=[seen("Fridge")], purpose="open to look"),
    turn(verbs.CLOSE, "Fridge", at="Fridge", view=[seen("Fridge")], purpose="close again"),
]


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_pronoun_means_what_was_named_and_a_sentence_is_whole(language: Language) -> None:
    for turns in (FOUND, TAKING, SWITCHING, CLOSING, CARRIED, ENDING, REMEMBERED):
        for seed in SEEDS:
            for kinds in (("analysis", "planning"), ("reasoning", "planning"), ("reflection",)):
                at = moment(turns, language, thoughts(turns, language, seed, *kinds))
                assert not [*strayed_pronouns(at), *half_sentences(at)], at.texts


def test_no_pronoun_stands_for_one_of_a_list_or_for_what_another_thing_follows() -> None:
    words, choices = nouns("en"), random.Random(0)
    assert words.word("Mug", "the", choices) == "the mug"
    assert words.word("Mug", "those", choices) == "it"
    words.word("Desk", "the", choices)
    assert words.word("Mug", "that", choices) == "the mug"
    words.end_sentence()
    assert words.word("Desk", "the", choices) == "the desk"
    words.end_sentence()
    assert words.word("Desk", "those", choices) == "it"
    words.word("Sofa", "the", choices)
    words.end_list()
    assert words.word("Desk", "to", choices) == "to the desk"
    words.end_list()
    assert words.word("Desk", "those", choices) == "the desk"
    assert words.word("Curtains", "those", choices) == "the curtains"


def test_to_be_is_no_mention() -> None:
    words, choices = nouns("en"), random.Random(0)
    words.word("Mug", "the", choices)
    assert words.word("Boots", "is", choices) == "are"
    assert words.word("Mug", "those", choices) == "it"


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_second_look_around_is_explained_in_other_words(language: Language) -> None:
    first = turn(verbs.OBSERVE, purpose="look around", view=[seen("Sofa")])
    walk = turn(GO, "Bed", view=[seen("Bed")])
    second = turn(verbs.OBSERVE, purpose="look around", view=[seen("Bed")], at="Bed")
    again = 0
    for seed in SEEDS:
        before = first.model_copy(
            update={"thoughts": thoughts([first], language, seed, "reasoning", "planning")}
        )
        said = {one for each in before.thoughts for one in clauses(each.text, language)}
        turns = [before, walk, second]
        now = thoughts(turns, language, seed + 99, "reflection", "planning")
        for each in now:
            mine = {*clauses(each.text, language)}
            again += bool(said & mine)
            said |= mine
    assert again <= 2
