"""Claims about states, the hand, and what lies where."""

from __future__ import annotations

from collections.abc import Iterator

from er_gym.data.claims import STATES, is_not, is_placing, not_on
from er_gym.data.clauses.reading import Verdict, clauses_of, is_told, lexicon_of
from er_gym.data.thought import Refusal, Thought, name_of


def judge_states(thought: Thought) -> Iterator[Verdict]:
    """A thing is open, closed, on or off."""
    lexicon = lexicon_of(thought)
    for clause, span in clauses_of(thought):
        if not is_told(clause) or clause.past or clause.intended:
            continue
        for match in span.matches(lexicon.states):
            mention = span.named(match, "x")
            said = match.groupdict()
            word = next((word for word in STATES if said.get(word)), "")
            if mention is None or not word:
                continue
            wrong = is_not(thought, mention, word, bool(said.get("no")))
            refusal = Refusal("state", f"{name_of(mention)} {wrong}; say so, or leave it out.")
            yield Verdict(span.sentence, refusal if wrong else None)
        poured = lexicon.poured.search(clause.text)
        mention = span.named(poured, "x") if poured else None
        if mention is not None and not clause.negated:
            wrong = is_not(thought, mention, "on", False)
            refusal = Refusal("state", f"{name_of(mention)} {wrong}; say so, or leave it out.")
            yield Verdict(span.sentence, refusal if wrong else None)


def judge_hand(thought: Thought) -> Iterator[Verdict]:
    """A thing is in the hand."""
    lexicon, held = lexicon_of(thought), thought.known.held
    truth = f"the agent holds {held}" if held else "the hand is empty"
    for clause, span in clauses_of(thought):
        if not clause.is_fact or clause.past or clause.wanted:
            continue
        for match in span.matches(lexicon.held):
            mention = span.named(match, "x")
            if mention is not None:
                refusal = Refusal("held", f"{name_of(mention)} is not in the hand: {truth}.")
                yield Verdict(span.sentence, None if mention.types & thought.held else refusal)


def judge_supports(thought: Thought) -> Iterator[Verdict]:
    """A thing in view lies on another."""
    lexicon = lexicon_of(thought)
    for clause, span in clauses_of(thought):
        if not clause.is_fact or (clause.past and "was left" not in clause.text):
            continue
        for match in span.matches(lexicon.lies_on):
            mention, holder = span.named(match, "x"), span.named(match, "y")
            if mention is None or holder is None:
                continue
            if is_placing(clause, match.start("x"), thought.phrases):
                continue
            wrong = not_on(thought, mention, holder)
            if wrong:
                yield Verdict(
                    span.sentence,
                    Refusal(
                        "support", f"{name_of(mention)} is not in or on {name_of(holder)}: {wrong}."
                    ),
                )
            elif any(True for _ in thought.things(mention.types)):
                yield Verdict(span.sentence)
