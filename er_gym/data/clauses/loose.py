"""Claims read from the words of a clause, in whatever order they stand.

The other readers know how a claim is worded. These look for a word of each part of it: who, did
what, to which thing. They read a clause only if it names one thing, or as many as the claim is
about, and if no word in it may turn its sense.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from er_gym.data.action_claims import has_done
from er_gym.data.claims import is_placing, not_on
from er_gym.data.clauses.lexicon_beyond import NEVER_ANSWERED
from er_gym.data.clauses.lexicon_loose import (
    ANSWERED,
    ANSWERED_AFTER,
    EASE,
    FIRST,
    HAND,
    KINDS_OF_ANSWERS,
    LIES,
    ON_IT,
    OVER,
    QUOTED,
    REFUSES,
    REORDERS,
    SELF,
    SENT,
    TAKEN,
    TURNS,
)
from er_gym.data.clauses.reading import Span, Verdict, clauses_of, lexicon_of, sentences_of
from er_gym.data.mentions import Mention, all_interchangeable, find_mentions, named_in
from er_gym.data.phrases import MARK
from er_gym.data.reading import Clause
from er_gym.data.thought import Refusal, Thought, name_of
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES


def _plain(thought: Thought, clause: Clause) -> bool:
    """Whether a clause tells what is or was, and nothing turns it."""
    language = thought.known.language
    return not (clause.guessed or clause.negated or clause.wanted or clause.intended) and not TURNS[
        language
    ].search(clause.text)


def judge_hand_loosely(thought: Thought) -> Iterator[Verdict]:
    """One thing is named with a word for the hand that holds it."""
    held, language = thought.known.held, thought.known.language
    truth = f"the agent holds {held}" if held else "the hand is empty"
    for clause, span in clauses_of(thought):
        hand = HAND[language].search(clause.text)
        if not hand or len(span.mentions) != 1 or clause.past or not _plain(thought, clause):
            continue
        mention = span.mentions[0]
        if "放" in clause.text:
            continue
        named = hand.end() == span.places[0] and language == "zh"
        if not (named or _portable(mention)) or mention.types & thought.held:
            continue
        refusal = Refusal("held", f"{name_of(mention)} is not in the hand: {truth}.")
        yield Verdict(span.sentence, refusal)


def judge_ease(thought: Thought) -> Iterator[Verdict]:
    """A thing was taken easily, although the first attempt failed or none was made."""
    language = thought.known.language
    spans = [*sentences_of(thought), *(span for _, span in clauses_of(thought))]
    for span in spans:
        if any(each.guessed or each.wanted for each in span.clauses):
            continue
        ease, taken = EASE[language].search(span.text), TAKEN[language].search(span.text)
        if not ease or not taken or len(span.mentions) > 2:
            continue
        mention = next((each for each in span.mentions if _portable(each)), None)
        if mention is None or TURNS[language].search(
            span.text.replace(ease.group(), " ").replace(taken.group(), " ")
        ):
            continue
        tries = _tries(thought, mention)
        if tries and not tries[0]:
            detail = f"The first attempt to take {name_of(mention)} failed."
            yield Verdict(span.sentence, Refusal("history", detail))


def judge_taken(thought: Thought) -> Iterator[Verdict]:
    """The agent took a thing."""
    language = thought.known.language
    for clause, span in clauses_of(thought):
        taken = TAKEN[language].search(clause.text)
        if not taken or not SELF[language].search(clause.text) or not _plain(thought, clause):
            continue
        if language == "zh" and not OVER.search(clause.text):
            continue  # "so I take the newspaper"
        portable = [each for each in span.mentions if _portable(each)]
        if len(portable) != 1 or len(span.mentions) > 3 or (clause.past and language == "en"):
            continue
        if language == "en" and not re.match(
            rf".*?\bi(?:'ve| have)? (?:[a-z]+ly |just |already |also )*{taken.group()}"
            r"(?: up| hold of| out| away)?"
            rf" (?:the |a |that |this |my |one |an )?(?:[a-z]+ )?{MARK}",
            clause.text,
        ):
            continue
        if not has_done(thought, verbs.PICKUP, portable[0]):
            detail = f"The agent did not pick up {name_of(portable[0])} before."
            yield Verdict(span.sentence, Refusal("history", detail))


def judge_lies_loosely(thought: Thought) -> Iterator[Verdict]:
    """What can be carried is on another: its name, a verb, a preposition, the other name."""
    language = thought.known.language
    for clause, span in clauses_of(thought):
        if len(span.mentions) < 2 or clause.past or not clause.is_fact or clause.wanted:
            continue
        for k in range(len(span.mentions) - 1):
            thing, holder = span.mentions[k : k + 2]
            begin, end = span.places[k] + 1, span.places[k + 1]
            between = (MARK if language == "en" else "") + span.text[begin:end]
            if not _portable(thing) or "receptacle" not in _properties(holder):
                continue
            if not LIES[language].search(between) or TURNS[language].search(between):
                continue
            if not ON_IT[language].search(span.text[end + 1 :]):
                continue
            if (k and _joins(span, k)) or is_placing(clause, begin - 1, thought.phrases):
                continue
            if thought.phrases.of_other.search(span.text[: begin - 1]):
                continue
            wrong = not_on(thought, thing, holder)
            if wrong:
                detail = f"{name_of(thing)} is not in or on {name_of(holder)}: {wrong}."
                yield Verdict(span.sentence, Refusal("support", detail))


def _joins(span: Span, k: int) -> bool:
    """Whether a name is but a further one, such as "the mug on the desk is in the sink"."""
    between = span.text[span.places[k - 1] + 1 : span.places[k]]
    return bool(re.search(r"\b(?:on|in|by|near|from|of|at|beside)\b|[在从]", between))


def judge_wanted(thought: Thought) -> Iterator[Verdict]:
    """The task wants a thing."""
    known = thought.known
    asked = all_interchangeable((*named_in(known.instruction), *_own(thought)))
    for span in sentences_of(thought):
        match = SENT[known.language].search(span.text)
        if not match or lexicon_of(thought).undone.search(span.text[: match.end() + 25]):
            continue
        if any(each.conditional or each.hedged for each in span.clauses):
            continue
        mention = span.first(match.end(), match.end() + 25)
        first = _first_named(known.instruction)
        if mention is None:
            continue
        ordered = first and FIRST.search(match.group())
        late = ordered and _portable(mention) and not mention.types & first
        if late or not mention.types & asked:
            detail = f"The task says: “{known.instruction}”; do not say otherwise."
            yield Verdict(span.sentence, Refusal("task", detail))


def _first_named(instruction: str) -> frozenset[str]:
    """What an instruction names first, unless it may tell its jobs in another order."""
    named = find_mentions(instruction)
    if not named or REORDERS.search(instruction):
        return frozenset()
    return all_interchangeable(named[0].types)


def judge_quotes(thought: Thought) -> Iterator[Verdict]:
    """An answer of the engine is quoted: a refusal, to what never failed, or one that it never
    gave."""
    known, text = thought.known, thought.text
    for quote in QUOTED.finditer(text):
        words = (quote[1] or quote[2]).lower()
        before = text[max(0, quote.start() - 60) : quote.start()].lower()
        after = text[quote.end() : quote.end() + 40].lower()
        own = known.language == "en" and words.startswith("you can")
        alone = not before.strip() or before.rstrip().endswith((".", "!", "?", "。", "！", "？"))
        said = ANSWERED[known.language].search(before) or ANSWERED_AFTER[known.language].search(
            after
        )
        if not known.actions or not (own or said or alone) or words in known.instruction.lower():
            continue
        if lexicon_of(thought).undone.search(before[-25:]):
            continue
        number = text[: quote.start()].count(".") if known.language == "en" else 0
        wrong = _never_answered(thought, words)
        if wrong:
            yield Verdict(min(number, len(thought.clauses) - 1), Refusal("history", wrong))
        if not (own or ANSWERED[known.language].search(before)):
            continue
        if not REFUSES[known.language].search(words):
            continue
        near = [each for each in thought.clauses if each.mentions]
        types = all_interchangeable(
            name for each in near[:2] for mention in each.mentions[:1] for name in mention.types
        )
        meant = [each for each in known.actions if each.action.object_type in types]
        if meant and all(each.success for each in meant):
            last = meant[-1]
            detail = f"The answer to {last.action} was: {last.feedback.split('.')[0]}."
            yield Verdict(near[0].sentence, Refusal("history", detail))


def _never_answered(thought: Thought, words: str) -> str:
    """Why the engine cannot have said that, or ``""``."""
    answers = " ".join(each.feedback for each in thought.known.actions).lower()
    reason = NEVER_ANSWERED[thought.known.language].search(words)
    if reason and reason.group() not in answers:
        return f"No answer spoke of “{reason.group()}”."
    for kind in KINDS_OF_ANSWERS:
        if kind.search(words) and not kind.search(answers):
            return "No answer said that."
    return ""


def _own(thought: Thought) -> list[str]:
    goal = thought.known.subgoal
    return [each for each in (goal.thing, goal.place) if each in OBJECT_TYPES]


def _properties(mention: Mention) -> frozenset[str]:
    return frozenset(one for each in mention.types for one in OBJECT_TYPES[each].properties)


def _portable(mention: Mention) -> bool:
    return all("pickupable" in OBJECT_TYPES[each].properties for each in mention.types)


def _tries(thought: Thought, mention: Mention) -> list[bool]:
    wanted = all_interchangeable(mention.types)
    return [
        each.success
        for each in thought.known.actions
        if each.action.verb == verbs.PICKUP and each.action.object_type in wanted
    ]
