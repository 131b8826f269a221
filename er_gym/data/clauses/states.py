"""Claims about states, the hand, and what lies where."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from er_gym.data.claims import is_placing, not_on, subjects, told_to_be_on
from er_gym.data.clauses.reading import Span, Verdict, clauses_of, is_told, lexicon_of
from er_gym.data.mentions import Mention, all_interchangeable
from er_gym.data.pronouns import PRONOUN
from er_gym.data.reading import Clause
from er_gym.data.thought import Refusal, Thought, name_of
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES

STATES: Mapping[str, tuple[bool, tuple[str, ...]]] = {
    "open": (True, ("open",)),
    "closed": (False, ("open",)),
    "on": (True, ("toggled",)),
    "off": (False, ("toggled",)),
    "loose_open": (True, ("open", "toggled")),
    "loose_closed": (False, ("open", "toggled")),
}
"""A word for a state, by its group in the phrases: whether it is so, and the attributes of
:class:`~er_gym.data.trajectory.SeenObject` that it is about. Chinese says open of what is on."""


def judge_states(thought: Thought) -> Iterator[Verdict]:
    """A thing is open, closed, on or off."""
    lexicon, phrases = lexicon_of(thought), thought.phrases
    for clause, span in clauses_of(thought):
        if not is_told(clause) or clause.past or clause.intended:
            continue
        of_it = phrases.it_states.search(clause.text) if clause.it else None
        claims = [
            *((span.named(match, "x"), match) for match in _state_matches(thought, clause, span)),
            *([(clause.it, of_it)] if of_it else ()),
        ]
        for mention, match in claims:
            before = clause.text[: match.start()]
            none = lexicon.none_of.search(before)
            if mention is None or (not none and phrases.negation.search(before)):
                continue
            if _is_to_be(thought, mention, match):
                continue
            if lexicon.state_since.match(clause.text, match.end()):
                continue
            said = match.groupdict()
            word = next((word for word in STATES if said.get(word)), "on")
            every = (
                lexicon.all_of.search(before)
                or lexicon.all_after.match(clause.text, match.end("x"))
                if "x" in said
                else None
            )
            yield _state(
                thought, span, mention, word, bool(said.get("no")) != bool(none), bool(every)
            )
        poured = lexicon.poured.search(clause.text)
        runs_from = span.named(poured, "x") if poured else None
        if runs_from is not None and not clause.negated:
            yield _state(thought, span, runs_from, "on", False)


def _state_matches(thought: Thought, clause: Clause, span: Span) -> Iterator[re.Match[str]]:
    """Where a clause may say in which state something is."""
    lexicon, phrases = lexicon_of(thought), thought.phrases
    yield from span.matches_of((*lexicon.states, *phrases.states), phrases.of_other)
    if clause.negated or len({each.types for each in span.mentions}) != 1:
        return
    for match in span.matches_of(lexicon.loose_states, phrases.of_other):
        if lexicon.being.search(match["said"]) or lexicon.is_someone.match(match["said"]):
            yield match


def _is_to_be(thought: Thought, mention: Mention, match: re.Match[str]) -> bool:
    """Whether "with the drawer closed" tells what is so after the next action."""
    decision = thought.known.decision
    return (
        match.group().startswith("with ")
        and decision.verb in (verbs.OPEN, verbs.CLOSE, verbs.TOGGLE)
        and decision.object_type in all_interchangeable(mention.types)
    )


def _state(
    thought: Thought, span: Span, mention: Mention, word: str, negated: bool, every: bool = False
) -> Verdict:
    wrong = is_not(thought, mention, word, negated, every)
    refusal = Refusal("state", f"{name_of(mention)} {wrong}; say so, or leave it out.")
    return Verdict(span.sentence, refusal if wrong else None)


def is_not(
    thought: Thought, mention: Mention, word: str, negated: bool, every: bool = False
) -> str:
    """What is so, if nothing of that name in view is in that state; else ``""``.

    Args:
        every: whether all of them must be.
    """
    wanted, attributes = STATES[word]
    wanted = wanted != negated
    there = [
        each
        for _, each in thought.things(mention.types)
        if len(mention.types) == 1
        or {"openable", "toggleable"} & OBJECT_TYPES[each.type].properties
    ]
    states = [
        [getattr(each, name) for name in attributes if getattr(each, name) is not None]
        for each in there
    ]
    known = [one for one in states if one]
    fits = all if every and len(known) == len(states) else any
    if len(known) < len(states) and not (every and known):
        return ""
    if not known or fits(wanted in one for one in known):
        return ""
    is_open = there[0].open is not None and "open" in attributes
    words = ("closed", "open") if is_open else ("switched off", "switched on")
    return f"is {words[not wanted]}"


def judge_hand(thought: Thought) -> Iterator[Verdict]:
    """A thing is in the hand or is not, or the hand is empty."""
    lexicon, phrases, held = lexicon_of(thought), thought.phrases, thought.known.held
    truth = f"the agent holds {held}" if held else "the hand is empty"
    for clause, span in clauses_of(thought):
        if clause.guessed or clause.past:
            continue
        empty = phrases.empty_hand.search(clause.text)
        if empty and not clause.intended and not lexicon.at_times.search(clause.text):
            refusal = Refusal("held", f"The hand is not empty: {truth}.")
            yield Verdict(span.sentence, refusal if held else None)
        for match in span.matches_of((*lexicon.held, *phrases.held), phrases.of_other):
            senses = (phrases.negation, phrases.intention, phrases.goal, lexicon.at_times)
            if any(clause.says_before(sense, match.end()) for sense in senses):
                continue
            for mention in clause.named(match, "xs", "x"):
                if _is_vague(mention):
                    continue
                refusal = Refusal("held", f"{name_of(mention)} is not in the hand: {truth}.")
                yield Verdict(span.sentence, None if mention.types & thought.held else refusal)
    # Whole clauses: "not the mug or the apple" denies both, and guesses nothing.
    for clause in thought.clauses:
        if clause.asks or clause.conditional or clause.usual or clause.past:
            continue
        for phrase in phrases.not_held:
            for match in phrase.finditer(clause.text):
                rest = f"{clause.text[: match.start()]} {clause.text[match.end() :]}"
                if phrases.hedge.search(rest) or lexicon.at_times.search(rest):
                    continue
                for mention in subjects(clause, match, phrases):
                    refusal = Refusal("held", f"Do not deny it: {truth}.")
                    yield Verdict(
                        clause.sentence, refusal if mention.types <= thought.held else None
                    )


def _is_vague(mention: Mention) -> bool:
    """Whether a pronoun stands for what nobody holds: it was misread."""
    return mention.start == PRONOUN and not any(
        "pickupable" in OBJECT_TYPES[each].properties for each in mention.types
    )


def judge_supports(thought: Thought) -> Iterator[Verdict]:
    """A thing in view lies on another."""
    lexicon, phrases = lexicon_of(thought), thought.phrases
    claims = [(clause.sentence, thing, holder) for clause, thing, holder in told_to_be_on(thought)]
    for clause, span in clauses_of(thought):
        if not clause.is_fact or (clause.past and "was left" not in clause.text):
            continue
        for match in span.matches(lexicon.lies_on):
            mention, under = span.named(match, "x"), span.named(match, "y")
            if mention and under and not is_placing(clause, match.start("x"), phrases):
                claims.append((span.sentence, mention, under))
    for sentence, thing, holder in claims:
        wrong = not_on(thought, thing, holder)
        if wrong:
            refusal = Refusal(
                "support", f"{name_of(thing)} is not in or on {name_of(holder)}: {wrong}."
            )
            yield Verdict(sentence, refusal)
        elif any(True for _ in thought.things(thing.types)):
            yield Verdict(sentence)
