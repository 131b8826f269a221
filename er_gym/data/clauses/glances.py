"""Claims of what is in view, was never seen, or lay somewhere, read from their words in any order.

A clause is read only if it speaks of one thing, and if no word in it may turn its sense.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

from er_gym.data.claims import is_placing, not_remembered_on
from er_gym.data.clauses.lexicon_glances import (
    ANSWERED_NO,
    ASKED_EVER,
    BEFORE_ME,
    IS_SEEN,
    LAY,
    LIMITS,
    NEVER,
    PERCEIVED,
    RECALLED,
    REMEMBERS,
    SINCE_START,
    TURNED,
    VIEW_OF,
    WHERE,
)
from er_gym.data.clauses.reading import Span, Verdict, clauses_of, lexicon_of, sentences_of
from er_gym.data.mentions import Mention
from er_gym.data.reading import Clause
from er_gym.data.thought import Refusal, Thought, name_of
from er_gym.thor import OBJECT_TYPES


def only_thing(mentions: tuple[Mention, ...]) -> Mention | None:
    """The one thing that is named, however often; None if there are more or none."""
    return mentions[0] if len({each.types for each in mentions}) == 1 else None


def judge_before_me(thought: Thought) -> Iterator[Verdict]:
    """One thing is said to be here, before the eyes."""
    language = thought.known.language
    for clause, span in clauses_of(thought):
        if not clause.is_fact or clause.past or not span.mentions:
            continue
        for mention, text in _before_me(thought, clause, span):
            if TURNED[language].search(text):
                continue
            if mention.types & (thought.in_view | thought.held | {"Floor"}):
                yield Verdict(span.sentence)
            else:
                yield Verdict(
                    span.sentence,
                    Refusal("unseen", f"{name_of(mention)} is not in view now. Do not say it is."),
                )


def _before_me(thought: Thought, clause: Clause, span: Span) -> Iterator[tuple[Mention, str]]:
    """What is said to be in view, with the words that say so."""
    language = thought.known.language
    of_other = thought.phrases.of_other
    for match in span.matches(VIEW_OF[language]):
        mention = span.named(match, "x")
        if mention is not None:
            yield mention, match.group()
    if language == "en":
        for match in span.matches(IS_SEEN):
            mention = span.named(match, "x")
            if mention is not None and not of_other.search(clause.text[: match.start("x")]):
                yield mention, clause.text
    mention = only_thing(span.mentions)
    here = BEFORE_ME[language].search(clause.text)
    if mention and here and not of_other.search(clause.text[: span.places[0]]):
        text = clause.text
        yield mention, text[: here.start()] + text[here.end() :]


def judge_never_loosely(thought: Thought) -> Iterator[Verdict]:
    """One thing was never seen."""
    language = thought.known.language
    spans = [*(span for _, span in clauses_of(thought)), *sentences_of(thought)]
    for span in spans:
        mention = only_thing(span.mentions)
        if mention is None or any(each.asks or each.conditional for each in span.clauses):
            continue
        never = NEVER[language].search(span.text)
        if any(each.hedged for each in span.clauses) or never is None:
            continue
        if not PERCEIVED[language].search(span.text, never.start()):
            continue
        text = SINCE_START[language].sub(" ", span.text)
        limited = lexicon_of(thought).until_then.search(thought.sentences[span.sentence])
        if not (limited or LIMITS[language].search(text)):
            yield _unseen_so_far(thought, span.sentence, mention)
    sentences = sentences_of(thought)
    for asked, answer in pairwise(sentences):
        mention = only_thing(asked.mentions)
        if mention is None or not any(each.asks for each in asked.clauses):
            continue
        if not ASKED_EVER[language].search(asked.text) or not PERCEIVED[language].search(
            asked.text
        ):
            continue
        if ANSWERED_NO[language].search(answer.text) and not answer.mentions:
            text = SINCE_START[language].sub(" ", asked.text)
            if not LIMITS[language].search(text):
                yield _unseen_so_far(thought, answer.sentence, mention)


def _unseen_so_far(thought: Thought, sentence: int, mention: Mention) -> Verdict:
    known = thought.known
    only_now = all(known.sightings.get(each) == (known.at,) for each in mention.types)
    if not mention.types <= {*known.seen} or (only_now and mention.types <= known.in_view):
        return Verdict(sentence)
    return Verdict(
        sentence,
        Refusal("memory", f"{name_of(mention)} was in view before; do not say it never was."),
    )


def judge_whereabouts(thought: Thought) -> Iterator[Verdict]:
    """It is not known where a thing is: it was seen, and nobody has moved it since."""
    language, known = thought.known.language, thought.known
    if any(RECALLED[language].search(each.text) for each in sentences_of(thought)):
        return
    done = {each.action.object_type for each in known.actions if each.success}
    for span in sentences_of(thought):
        if any(each.conditional for each in span.clauses):
            continue
        for clause in span.clauses:
            mention = clause.mentions[0] if clause.mentions else None
            if mention is None or not WHERE[language].search(clause.text):
                continue
            moved = {*done} | thought.held | thought.in_view
            if not mention.types <= {*known.seen} or mention.types & moved:
                continue
            if not all("pickupable" in OBJECT_TYPES[each].properties for each in mention.types):
                continue
            detail = f"{name_of(mention)} was in view before; do not wonder where it is."
            yield Verdict(span.sentence, Refusal("memory", detail))


def judge_lay(thought: Thought) -> Iterator[Verdict]:
    """A thing lay on another when it was seen."""
    language, known = thought.known.language, thought.known
    for clause, span in clauses_of(thought):
        if clause.asks or clause.negated or clause.conditional or clause.usual or clause.intended:
            continue
        if not REMEMBERS[language].search(clause.text) or len(span.mentions) < 2:
            continue
        for match in span.matches(LAY[language]):
            thing, place = span.named(match, "x"), span.named(match, "y")
            if thing is None or place is None or is_placing(clause, match.start(), thought.phrases):
                continue
            if thought.phrases.of_other.search(clause.text[: match.start("x")]):
                continue
            wrong = not_remembered_on(thought, thing, place)
            if wrong:
                refusal = Refusal(
                    "memory", f"{name_of(thing)} was not on {name_of(place)}: {wrong}."
                )
                yield Verdict(span.sentence, refusal)
            elif thing.types & {*known.rested}:
                yield Verdict(span.sentence)
