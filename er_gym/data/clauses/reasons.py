"""Claims about what an action is for, about failures, and about the agent's own earlier words."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from er_gym.data.clauses.lexicon_reasons import REASONS
from er_gym.data.clauses.reading import Span, Verdict, clauses_of, lexicon_of, sentences_of
from er_gym.data.mentions import Mention, all_interchangeable, find_mentions, named_in
from er_gym.data.reading import Clause
from er_gym.data.thought import Refusal, Thought, name_of
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES

_TOUCHING = (verbs.OPEN, verbs.CLOSE, verbs.PICKUP, verbs.PUT, verbs.TOGGLE)


def judge_purposes(thought: Thought) -> Iterator[Verdict]:
    """The task wants a thing in or on another."""
    known, words = thought.known, REASONS[thought.known.language]
    asked = all_interchangeable(
        (*named_in(known.instruction), *_types(known.subgoal.thing, known.subgoal.place))
    )
    pairs = _asked_pairs(known.instruction)
    for span in sentences_of(thought):
        for match in span.matches(words.goes_to):
            if any(_is_open(each) or each.negated for each in _told_in(span, match)):
                continue
            thing, place = span.named(match, "x"), span.named(match, "y")
            own = frozenset(_types(known.decision.object_type))
            if thing is None or not (place.types if place else own):
                continue
            if place is None and not words.reason.search(span.text):
                continue
            places = place.types if place else all_interchangeable(own)
            settled = len(pairs) == 1 or any(
                thing.types & all_interchangeable(each) for each, _ in pairs
            )
            wrong = (
                not thing.types & asked
                or not places & asked
                or (settled and not _is_pair(thing.types, places, pairs))
            )
            refusal = Refusal(
                "task", f"The task says: “{known.instruction}”; it does not want that."
            )
            yield Verdict(span.sentence, refusal if wrong else None)


def _told_in(span: Span, match: re.Match[str]) -> Sequence[Clause]:
    """The clauses of a sentence in which a match begins; all if that cannot be told."""
    mark = match.start("x")
    mention = span.first(mark, mark + 1)
    return [each for each in span.clauses if mention in each.mentions] or span.clauses


_Pair = tuple[frozenset[str], frozenset[str]]


def _asked_pairs(instruction: str) -> Sequence[_Pair]:
    """The things and places of an instruction that names them in turn; else nothing."""
    named = [each.types for each in find_mentions(instruction)]
    if len(named) % 2:
        return ()
    pairs = list(zip(named[::2], named[1::2], strict=True))
    for thing, place in pairs:
        if not all("pickupable" in OBJECT_TYPES[each].properties for each in thing):
            return ()
        if not any("receptacle" in OBJECT_TYPES[each].properties for each in place):
            return ()
    return pairs


def _is_pair(things: frozenset[str], places: frozenset[str], pairs: Iterable[_Pair]) -> bool:
    return any(
        things & all_interchangeable(thing) and places & all_interchangeable(place)
        for thing, place in pairs
    )


def _types(*names: str) -> list[str]:
    return [each for each in names if each in OBJECT_TYPES]


def judge_losses(thought: Thought) -> Iterator[Verdict]:
    """A thing was not found, or fell out of the hand."""
    words = REASONS[thought.known.language]
    for clause, span in clauses_of(thought):
        if _is_open(clause):
            continue
        for match in span.matches_of(words.missing, thought.phrases.of_other):
            mention = span.named(match, "x")
            if mention is not None and not clause.past and mention.types & thought.held:
                refusal = Refusal("held", f"{name_of(mention)} is in the hand: it was found.")
                yield Verdict(span.sentence, refusal)
        for match in span.matches_of(words.dropped, thought.phrases.of_other):
            mention = span.named(match, "x")
            if mention is None or clause.negated:
                continue
            tried = _tries(thought, verbs.PICKUP, mention)
            if not tried or mention.types & thought.held:
                refusal = Refusal("history", f"{name_of(mention)} did not fall out of the hand.")
                yield Verdict(span.sentence, refusal)


def judge_failures(thought: Thought) -> Iterator[Verdict]:
    """An action failed, was easy, or none failed."""
    words, actions = REASONS[thought.known.language], thought.known.actions
    failed = [each for each in actions if not each.success]
    for span in sentences_of(thought):
        if any(each.asks for each in span.clauses) or words.except_one.search(span.text):
            continue
        if words.all_well.search(span.text) and not any(each.conditional for each in span.clauses):
            refusal = Refusal("history", f"{failed[-1].action} failed." if failed else "")
            yield Verdict(span.sentence, refusal if failed else None)
    for clause, span in clauses_of(thought):
        if _is_open(clause) or clause.intended:
            continue
        for match in span.matches_of(words.easily, thought.phrases.of_other):
            if thought.phrases.negation.search(
                _without(match.group(), ("without",)), 0
            ) or thought.phrases.negation.search(clause.text[: match.start()]):
                continue
            for taken in _listed(span, match.start("x")):
                tries = _tries(thought, verbs.PICKUP, taken)
                easy = bool(tries) and tries[0]
                refusal = Refusal("history", f"{name_of(taken)} was not taken at the first try.")
                yield Verdict(span.sentence, None if easy else refusal)
        for match in span.matches_of(words.failed_with, thought.phrases.of_other):
            mention = span.named(match, "x")
            if mention is None:
                continue
            wanted = all_interchangeable(mention.types)
            if " at " in match.group() and not _portable(mention):
                continue  # it is where, not what
            fits = any(each.action.object_type in wanted for each in failed)
            refusal = Refusal("history", f"No action with {name_of(mention)} failed.")
            yield Verdict(span.sentence, None if fits else refusal)


def judge_refused(thought: Thought) -> Iterator[Verdict]:
    """A deed failed, told with its verb and its thing in any order."""
    words, known = REASONS[thought.known.language], thought.known
    plain = lexicon_of(thought).plain_verbs
    for clause, span in clauses_of(thought):
        if _is_open(clause) or clause.intended or not span.mentions or len(span.mentions) > 2:
            continue
        failure = words.did_fail.search(clause.text)
        if failure is None or words.fails_not.search(clause.text):
            continue
        rest = clause.text[: failure.start()] + " " + clause.text[failure.end() :]
        said = {verb for verb, phrase in plain.items() if phrase.search(rest)} - {verbs.NAVIGATE}
        if not said:
            continue
        types = all_interchangeable(each for one in span.mentions for each in one.types)
        failed = [each.action for each in known.actions if not each.success]
        fits = any(
            each.object_type in types and (each.verb in said or len(said) > 1) for each in failed
        )
        names = " and ".join(map(name_of, span.mentions))
        refusal = Refusal("history", f"No such action with {names} failed.")
        yield Verdict(span.sentence, None if fits else refusal)


def _portable(mention: Mention) -> bool:
    return any("pickupable" in OBJECT_TYPES[each].properties for each in mention.types)


def _without(text: str, words: Iterable[str]) -> str:
    for word in words:
        text = text.replace(word, "")
    return text


def _listed(span: Span, place: int) -> list[Mention]:
    """The name at a place, and those that are joined to it before: "the card and the disc"."""
    at = [k for k, each in enumerate(span.places) if each <= place]
    found = [span.mentions[at[-1]]]
    for k in reversed(at[:-1]):
        between = span.text[span.places[k] + 1 : span.places[k + 1]]
        if between.strip(" ,") not in ("and", "and the", "and a", "和", "、", "跟", "与"):
            break
        found.append(span.mentions[k])
    return found


def _tries(thought: Thought, verb: str, mention: Mention) -> list[bool]:
    """The results of all attempts to do that to something of that name."""
    wanted = all_interchangeable(mention.types)
    return [
        each.success
        for each in thought.known.actions
        if each.action.verb == verb and each.action.object_type in wanted
    ]


def judge_untouched(thought: Thought) -> Iterator[Verdict]:
    """Nothing was done to a thing."""
    words = REASONS[thought.known.language]
    for clause, span in clauses_of(thought):
        if _is_open(clause):
            continue
        for match in span.matches(words.untouched):
            mention = span.named(match, "x")
            if mention is None or thought.are_several(mention.types):
                continue
            done = next((each for each in _TOUCHING if thought.done(each, mention.types)), "")
            refusal = Refusal("history", f"The agent did {done} {name_of(mention)} before.")
            yield Verdict(span.sentence, refusal if done else None)


def judge_turned_down(thought: Thought) -> Iterator[Verdict]:
    """The next action is not done to some thing."""
    words, known = REASONS[thought.known.language], thought.known
    target, plain = known.decision.object_type, lexicon_of(thought).plain_verbs
    for clause, span in clauses_of(thought):
        if clause.asks or clause.conditional or not target:
            continue
        if any(each.search(clause.text) for each in thought.phrases.sides.values()):
            continue
        for verb, phrases in words.not_next.items():
            if verb and verb != known.decision.verb:
                continue
            for match in span.matches(phrases):
                mention = span.named(match, "x")
                acts = {name for name, each in plain.items() if each.search(match.group())}
                if acts and known.decision.verb not in acts:
                    continue  # who goes to a thing need not open it
                if _is_aside(thought, clause, match):
                    continue
                if mention is not None and target in all_interchangeable(mention.types):
                    refusal = Refusal("decision", f"The next action is {known.decision}.")
                    yield Verdict(span.sentence, refusal)


def _is_aside(thought: Thought, clause: Clause, match: re.Match[str]) -> bool:
    """Whether "not bowls" stands in the midst of a sentence that tells of something else."""
    whole = next(each for each in thought.clauses if each.sentence == clause.sentence)
    return match.group().startswith("not ") and not whole.text.startswith(clause.text)


def judge_own_words(thought: Thought) -> Iterator[Verdict]:
    """The agent thought of a thing before, or never did: its earlier thoughts tell."""
    words, earlier = REASONS[thought.known.language], thought.known.earlier
    if not earlier or not all(earlier):
        return  # some thoughts are not known
    spoken: frozenset[str] | None = None
    for span in sentences_of(thought):
        if any(each.asks or each.conditional for each in span.clauses):
            continue
        for phrases, thinks in ((words.own_words, True), (words.never_thought, False)):
            for match in span.matches(phrases):
                mention = span.named(match, "x")
                denied = thought.phrases.negation.search(match.group())
                if mention is None or (thinks and denied):
                    continue
                if spoken is None:
                    spoken = _spoken_of(thought)
                did = bool(mention.types & spoken)
                said = "did" if did else "never did"
                refusal = Refusal(
                    "memory", f"Your earlier thoughts {said} speak of {name_of(mention)}."
                )
                yield Verdict(span.sentence, None if did == thinks else refusal)


def _spoken_of(thought: Thought) -> frozenset[str]:
    """All types that the earlier thoughts name."""
    return all_interchangeable(
        name
        for turn in thought.known.earlier
        for each in turn
        for mention in find_mentions(each.text)
        for name in mention.types
    )


def _is_open(clause: Clause) -> bool:
    """Whether it may be told of something that is not so."""
    return clause.asks or clause.conditional or clause.usual or clause.hedged
