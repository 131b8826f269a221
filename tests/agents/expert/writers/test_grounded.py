"""The grounded writer says what is so, in sentences that a person could have written."""

from __future__ import annotations

import random
import re
from dataclasses import replace
from functools import lru_cache
from itertools import product
from typing import get_args

import pytest

from agents.expert.writers.base import ThoughtRequest
from agents.expert.writers.facts import facts_of, outcome_of
from agents.expert.writers.grammar import Rule, Writing, grammar, parse
from agents.expert.writers.grounded import GroundedWriter, length_in_words, sentences
from agents.expert.writers.nouns import names, nouns
from agents.expert.writers.registry import WRITERS
from benchmarks.checks.thought_variety import played, written
from er_gym.data.critic import check
from er_gym.data.knowledge import AROUND, Knowledge, LastAction, knowledge_at
from er_gym.data.trajectory import TAG_OF_KIND, THOUGHT_KINDS, Language, Purpose, Subgoal, Turn
from er_gym.envs.actions import Action
from er_gym.tasks import verbs
from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.task import Task
from er_gym.thor import OBJECT_TYPES
from tests.support import in_one_test

LANGUAGES: tuple[Language, ...] = get_args(Language)
PURPOSES: tuple[Purpose, ...] = get_args(Purpose)
WRITER = GroundedWriter()
VERB_OF: dict[Purpose, str] = {
    "look around": verbs.OBSERVE,
    "get closer": verbs.MOVE_FORWARD,
    "check": verbs.MOVE_FORWARD,
    "open to look": verbs.OPEN,
    "open to put": verbs.OPEN,
    "close again": verbs.CLOSE,
    "take": verbs.PICKUP,
    "put": verbs.PUT,
    "switch": verbs.TOGGLE,
    "use": verbs.SLICE,
    "finish": verbs.END,
}
"""The verb of each purpose that does not go anywhere and repeats nothing."""
LOST = "The action failed: you arrived at Sofa instead."
"""The feedback to a walk that a fault has led astray, as a fault of any verb has it here."""
BARE = (verbs.OBSERVE, verbs.MOVE_FORWARD, verbs.END)


@lru_cache(maxsize=1)
def episodes() -> list[tuple[Task, list[Turn]]]:
    return list(played(12, seed=5, suite="mini"))


@lru_cache(maxsize=2)
def knowledges(language: Language) -> list[Knowledge]:
    return [
        knowledge_at(turns, index, instruction=task.instruction, language=language)
        for task, turns in episodes()
        for index in range(len(turns))
    ]


def request_of(
    knowledge: Knowledge, *kinds: str, limit: int = 150, seed: int = 1
) -> ThoughtRequest:
    return ThoughtRequest(knowledge, kinds, (limit,) * len(kinds), seed=seed)  # type: ignore[arg-type]


def situations(language: Language) -> list[Knowledge]:
    """Every purpose after every outcome, in scenes that were really seen, and some in the dark."""
    choices = random.Random(0)
    lasts: list[LastAction | None] = [None]
    done = [verb.name for verb in verbs.OWN if verb.name != verbs.END]
    lasts += [
        LastAction(Action(verb), "search", success, False)
        for verb, success in product(done, (True, False))
    ]
    lasts.append(LastAction(Action(verbs.NAVIGATE), "carry", True, True))
    lasts.append(LastAction(Action(verbs.MOVE_FORWARD), "check", True, False))
    lasts.append(LastAction(Action(verbs.OPEN), "repeat", True, False))
    lasts.append(LastAction(Action(verbs.PUT), "put down", True, False))
    lasts += [LastAction(Action(verb), "retry", False, False, LOST, verb) for verb in done]
    found = []
    for number, (purpose, last) in enumerate(product(PURPOSES, lasts)):
        seen = choices.choice(knowledges(language))
        kinds = sorted(seen.in_view) or ["Fridge"]
        kind = choices.choice(kinds)
        verb = VERB_OF.get(purpose, verbs.NAVIGATE)
        if purpose in ("retry", "repeat") and last is not None:
            verb = last.action.verb
        if last is not None and last.action.verb not in BARE:
            last = replace(last, action=Action(last.action.verb, choices.choice(kinds)))
        action = Action(verb) if verb in BARE else Action(verb, kind)
        seen = replace(seen, purpose=purpose, last=last, decision=action)
        if last is not None and last.action.verb == verbs.OBSERVE:
            ways = [choices.choice(knowledges(language)).view for _ in AROUND]
            seen = replace(seen, views=dict(zip(sorted(AROUND), ways, strict=True)))
        found.append(seen)
        bare = replace(seen, view=(), views={}, seen={}, subgoal=Subgoal(), at="", visits=())
        found += [bare] if number % 3 == 0 else []
    return found


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_kind_purpose_and_outcome_has_words(language: Language) -> None:
    """Each kind alone where much is in view, and all of a turn, in turns, where nothing is."""
    outcomes = set()
    for number, knowledge in enumerate(situations(language)):
        outcomes.add(outcome_of(knowledge, knowledge.subgoal.thing))
        first = number % len(THOUGHT_KINDS)
        all_kinds = THOUGHT_KINDS[first:] + THOUGHT_KINDS[:first]
        for kinds in [all_kinds] if not knowledge.view else zip(all_kinds, strict=True):
            thoughts = WRITER.write(request_of(knowledge, *kinds, seed=number)).thoughts
            assert [each.kind for each in thoughts] == list(kinds)
            for thought in thoughts:
                assert_well_formed(thought.text, language)
    assert outcomes >= {"start", "failed", "astray", "blocked", "repeated", "found", "nothing"}
    assert outcomes >= {"put away", "refused", "looked", "looked found", "wrong object"}
    assert outcomes >= {"opened nothing", "closed", "looked", "taken", "put", "toggled", "checked"}


def assert_well_formed(text: str, language: Language) -> None:
    assert text == text.strip()
    assert text[-1] in ".?!。？！"
    assert not re.search(r"[{}\[\]|~<>_]", text), text
    assert not any(f"{tag}:" in text for tag in TAG_OF_KIND.values())
    if language == "en":
        assert not re.search(r"  | [,.;:?!]|,,|\.\.", text), text
        assert not re.search(r"\b(\w+) \1\b", text.lower()), text
        assert not re.search(r"\ba [aeiou]|\ban [^aeiou]|\b(a|the) some\b", text.lower()), text
        assert all(part.lstrip('"')[0].isupper() for part in sentences(text, "en")), text
    else:
        assert not re.search(r"[，。：、；]{2}|\s", text), text
        assert not re.search(r"(的|了|先|去|我|就)\1", text), text


def test_the_same_request_gets_the_same_text_and_another_seed_another() -> None:
    knowledge = knowledges("en")[0]
    texts = [
        WRITER.write(request_of(knowledge, "analysis", "planning", seed=seed)).thoughts
        for seed in (1, 1, 2)
    ]
    assert texts[0] == texts[1] != texts[2]


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("limit", [80, 30, 12])
def test_keeps_to_the_limit(language: Language, limit: int) -> None:
    for seed, knowledge in enumerate(knowledges(language)):
        written = WRITER.write(request_of(knowledge, "planning", limit=limit, seed=seed))
        text = written.thoughts[0].text
        assert length_in_words(text, language) <= limit or len(sentences(text, language)) == 1


def test_says_nothing_twice_in_an_episode() -> None:
    for number, (task, turns) in enumerate(episodes()):
        said = [
            sentence
            for _, thoughts in written(WRITER, turns, task.instruction, "en", number)
            for thought in thoughts
            for sentence in sentences(thought.text, "en")
        ]
        assert len(set(said)) >= 0.9 * len(said)


@in_one_test("language", LANGUAGES)
def test_every_type_has_names(language: Language) -> None:
    assert set(names(language)) == set(OBJECT_TYPES)
    choices = random.Random(0)
    for kind, theirs in names(language).items():
        assert all(theirs)
        if language == "zh":
            assert all(re.fullmatch(r"[一-鿿] [一-鿿]+", name) for name in theirs), kind
        assert nouns(language).word(kind, "a", choices)


@pytest.mark.parametrize(
    ("kind", "form", "text"),
    [
        ("Egg", "a", "an egg"),
        ("ToiletPaper", "a", "some toilet paper"),
        ("Curtains", "is", "are"),
        ("Drawer", "in", "in the drawer"),
        ("Shelf", "in", "on the shelf"),
        ("Drawer", "into", "into the drawer"),
        ("Drawer", "to", "to the drawer"),
        ("Shelf", "s", "shelves"),
        ("Knife", "s", "knives"),
    ],
)
def test_english_forms(kind: str, form: str, text: str) -> None:
    assert nouns("en").word(kind, form, random.Random(0)) == text


def test_the_thing_just_mentioned_becomes_a_pronoun() -> None:
    words_for, choices = nouns("en"), random.Random(0)
    said = [words_for.word(kind, form, choices) for kind, form in PRONOUNS]
    assert said == ["the mug", "it", "the desk", "the mug"]


PRONOUNS = [("Mug", "the"), ("Mug", "that"), ("Desk", "that"), ("Mug", "that")]


def test_a_line_of_last_resort_waits_for_the_others() -> None:
    rules = {"greet": rule("hello {the:thing}", "~ hello")}
    with_thing = Writing(rules, nouns("en"), random.Random(0)).write("greet", {"thing": "Mug"})
    without = Writing(rules, nouns("en"), random.Random(0)).write("greet", {})
    assert (with_thing, without) == ("hello the mug", "hello")


def rule(*lines: str) -> Rule:
    return Rule(tuple(map(parse, lines)))


@pytest.mark.parametrize("line", ["[a|b", "a]b", "{a", "a}"])
def test_an_open_bracket_is_an_error(line: str) -> None:
    with pytest.raises(ValueError, match="closed"):
        parse(line)


@pytest.mark.parametrize("language", LANGUAGES)
def test_every_line_can_be_written(language: Language) -> None:
    """No line waits for a fact, a rule or a form that does not exist."""
    known = {"first", "final", *grammar(language)}
    for knowledge in [*knowledges(language), *situations(language)[::3], *ordered(language)]:
        for name, value in facts_of(knowledge, random.Random(0)).items():
            known.add(name)
            for thing in value if isinstance(value, tuple) else [value]:
                known.update(thing if isinstance(thing, dict) else ())
    slots = set(re.findall(r"\{([^{}]+)\}", "".join(texts_of(language))))
    parts = [slot.strip("?!").partition(":") for slot in slots]
    assert {form for form, colon, _ in parts if colon} <= FORMS[language]
    needed = {fact if colon else form for form, colon, fact in parts}
    assert {name for each in needed for name in each.split("@")} - known == set()


LISTS = {"all", "some", "several"}
FORMS: dict[str, set[str]] = {
    "en": {"a", "in", "into", "is", "it", "name", "that", "the", "they", "those", "to", "was"}
    | LISTS,
    "zh": {"a", "in", "that", "to"} | LISTS,
}
"""The lists of a pool, and the forms of :meth:`agents.expert.writers.nouns.Nouns.word`."""


def ordered(language: Language) -> list[Knowledge]:
    """Two turns of a task of two parts: before the first thing is put down, and just after it."""
    knowledge = next(each for each in knowledges(language) if each.view and not each.held)
    text = "First put the Mug on the Desk, then the Book on the Sofa."
    put = LastAction(Action(verbs.PUT, "Desk"), "put", True, True)
    took = LastAction(Action(verbs.PICKUP, "Mug"), "take", True, True)
    first, second = (
        replace(
            knowledge,
            instruction=text,
            subgoal=Subgoal(verb=verbs.PUT, thing=thing, place=place, text=text),
        )
        for thing, place in (("Mug", "Desk"), ("Book", "Sofa"))
    )
    return [first, replace(second, last=put, actions=[took, put])]


def texts_of(language: Language) -> list[str]:
    folder = config_directory("thoughts") / language
    return [file.read_text(encoding="utf-8") for file in sorted(folder.glob("*.yaml"))]


@pytest.mark.parametrize("language", LANGUAGES)
def test_the_critic_accepts_real_episodes(language: Language) -> None:
    for number, (task, turns) in enumerate(episodes()):
        for request, thoughts in written(WRITER, turns, task.instruction, language, number):
            for thought in thoughts:
                found = check(thought.text, thought.kind, request.knowledge, limit=150)
                assert not found, (thought.text, found)


def test_the_registry_knows_it() -> None:
    assert WRITERS.get("grounded")().name == "grounded"
