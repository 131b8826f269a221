"""Claims about what the agent sees, saw or never saw, and guesses at what it has seen."""

from __future__ import annotations

import re
from collections.abc import Iterator

from er_gym.data.claims import is_given, is_placing, not_on
from er_gym.data.clauses.reading import Span, Verdict, clauses_of, is_told, lexicon_of, sentences_of
from er_gym.data.mentions import Mention, all_interchangeable
from er_gym.data.reading import Clause
from er_gym.data.remembered import BELIEVED, HEARD
from er_gym.data.thought import Refusal, Thought, name_of
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES

_NEAR_BY = 40
"""Letters after a claim in which what limits it stands."""
_HERE = re.compile(r"here|in here")
"""Of what was never seen, it means the room."""
_KEEPS = frozenset({"Fridge", "Microwave", "Cabinet", "Drawer", "Safe", "Toilet", "Box"})
"""What keeps things out of sight while it is closed."""
_START = "the start"


_OUGHT = re.compile(r"(?:应该|该)[^，。；§]{0,3}[放搁送摆挂塞装收移扔丢还]")


def judge_never_seen(thought: Thought) -> Iterator[Verdict]:
    """The agent never saw a thing."""
    lexicon = lexicon_of(thought)
    for span in sentences_of(thought):
        for match in span.matches_of(lexicon.never_seen, thought.phrases.of_other):
            mention = span.named(match, "x")
            rest = span.text[match.end() : match.end() + _NEAR_BY].split(",")[0].split("，")[0]
            inside = span.text[match.start() : match.end()]
            limit = lexicon.here_only.search(rest) or lexicon.until_then.search(span.text)
            if mention is None or (limit and not _HERE.fullmatch(limit.group())):
                continue
            if lexicon.another.search(inside):
                continue
            if mention.types <= {*thought.known.seen}:
                where = next((thought.known.seen[each] for each in sorted(mention.types)), "")
                yield Verdict(
                    span.sentence,
                    Refusal(
                        "memory",
                        f"{name_of(mention)} was in view before (last from {where or _START}); "
                        "do not say that it never was, and do not guess where it is.",
                    ),
                )
            elif not mention.types & thought.seen:
                yield Verdict(span.sentence)


def judge_memories(thought: Thought) -> Iterator[Verdict]:
    """The agent saw a thing while it was at some place."""
    lexicon, known = lexicon_of(thought), thought.known
    for span in sentences_of(thought):
        if any(each.asks or each.hedged or each.conditional for each in span.clauses):
            continue
        here = lexicon.since_here.search(span.text)
        at = next((each for each in span.matches(lexicon.while_at) if span.named(each, "y")), None)
        for match in span.matches_of(lexicon.seen_then, thought.phrases.of_other):
            mention = span.named(match, "x")
            if mention is None or lexicon.undone.search(
                span.text, max(0, match.start() - 2), match.end()
            ):
                continue
            if not mention.types & thought.seen:
                if not mention.types & thought.mentionable or at:
                    yield Verdict(span.sentence, _never(mention))
                continue
            place = span.named(at, "y") if at else None
            types = place.types if place else frozenset({known.at} if here and known.at else ())
            if not types or place is mention:
                continue
            from_where = [
                each for one in sorted(mention.types) for each in known.sightings.get(one, ())
            ]
            if not from_where:
                continue
            wanted = all_interchangeable(each for each in types if each in OBJECT_TYPES)
            if not thought.done(verbs.NAVIGATE, wanted):
                continue  # it may have been near by
            if lexicon.last_then.search(span.text):
                from_where = [known.seen[each] for each in mention.types if each in known.seen]
            elif lexicon.only_then.search(span.text):
                from_where = from_where[:1]
            fits = any(each in wanted for each in from_where)
            yield Verdict(
                span.sentence,
                None
                if fits
                else Refusal(
                    "memory",
                    f"{name_of(mention)} was not seen then: it was in view from "
                    f"{' and from '.join(each or _START for each in from_where)}.",
                ),
            )


def _never(mention: Mention) -> Refusal:
    return Refusal(
        "unseen", f"{name_of(mention)} is not and was not in view. Do not say that it was."
    )


def judge_denials(thought: Thought) -> Iterator[Verdict]:
    """A thing is not in view, or not on another."""
    lexicon = lexicon_of(thought)
    for clause, span in clauses_of(thought):
        if clause.asks or clause.conditional or clause.usual or clause.past:
            continue
        if lexicon.another.search(clause.text) or _searches(thought, span):
            continue
        if not clause.negated and "out of" not in clause.text:
            continue
        if lexicon.not_of_view.search(clause.text) or _lies_elsewhere(thought, clause):
            continue
        for match in span.matches_of(lexicon.not_in_view, thought.phrases.of_other):
            # "Not the mug or the apple" denies both, and guesses nothing.
            if thought.phrases.hedge.search(
                f"{clause.text[: match.start()]} {clause.text[match.end() :]}"
            ):
                continue
            sides = {
                side for side, phrase in thought.phrases.sides.items() if phrase.search(clause.text)
            }
            for mention in span.among(match.start("xs"), match.end("xs")):
                there = {each.side for each in thought.known.view if each.type in mention.types}
                if sides and not sides & there:
                    continue
                if mention.types <= thought.known.in_view:
                    yield Verdict(
                        span.sentence,
                        Refusal("unseen", f"{name_of(mention)} is in view; do not say it is not."),
                    )
                elif not mention.types & thought.in_view:
                    yield Verdict(span.sentence)
        for match in span.matches(lexicon.not_on):
            thing, holder = span.named(match, "x"), span.named(match, "y")
            if thing is None or holder is None or clause.hedged:
                continue
            if any(each.on in holder.types for _, each in thought.things(thing.types)):
                yield Verdict(
                    span.sentence,
                    Refusal("support", f"{name_of(thing)} is on {name_of(holder)}."),
                )


def _lies_elsewhere(thought: Thought, clause: Clause) -> bool:
    """Whether what follows says where the thing is: it is denied only to be here."""
    rest = [each.text for each in thought.clauses if each.sentence == clause.sentence]
    after = "".join(rest[rest.index(clause.text) + 1 :] if clause.text in rest else [])
    return bool(lexicon_of(thought).but_there.search(f"{clause.text}{after}"))


def _searches(thought: Thought, span: Span) -> bool:
    """Whether a clause tells of a search: what it did not find may have come into view since."""
    lexicon = lexicon_of(thought)
    searching = (*lexicon.deeds[verbs.OPEN], *lexicon.deeds["searched"])
    return any(True for _ in span.matches(searching))


def judge_guesses(thought: Thought) -> Iterator[Verdict]:
    """A thing may be in or on another: a guess, though it is in view elsewhere."""
    lexicon = lexicon_of(thought)
    for clause, span in clauses_of(thought):
        if not clause.hedged or clause.asks or clause.conditional or clause.intended:
            continue
        if any(each.asks for each in thought.clauses if each.sentence == clause.sentence):
            continue
        if BELIEVED[thought.known.language].search(clause.text):
            continue
        if clause.usual or clause.negated or lexicon.another.search(clause.text):
            continue
        if HEARD[thought.known.language].search(clause.text):
            continue
        for match in span.matches(lexicon.perhaps_on):
            mention, holder = span.named(match, "x"), span.named(match, "y")
            if mention is None or holder is None or mention.types & holder.types:
                continue
            if is_placing(clause, match.start("x"), thought.phrases):
                continue
            if not mention.types & thought.seen or lexicon.of_memory.search(span.text):
                continue
            if mention.types & thought.held and _OUGHT.search(clause.text):
                continue  # "it should be put on the table" is no guess
            if thought.known.sought in mention.types and not mention.types & thought.in_view:
                continue  # what is sought: er_gym.data.remembered
            wrong = not_on(thought, mention, holder)
            if wrong:
                yield Verdict(
                    span.sentence,
                    Refusal(
                        "memory",
                        f"{name_of(mention)} was seen, and {wrong}: do not guess where it is.",
                    ),
                )


def judge_sights(thought: Thought) -> Iterator[Verdict]:
    """A thing is in view now."""
    lexicon, known = lexicon_of(thought), thought.known
    for clause, span in clauses_of(thought):
        if not clause.is_fact or clause.past:
            continue
        stranger = lexicon.strangers.search(clause.text)
        if stranger and lexicon.sees.search(clause.text):
            yield Verdict(
                span.sentence,
                Refusal(
                    "unseen", f"“{stranger.group()}” is not and was not in view. Leave it out."
                ),
            )
        for match in span.matches_of(lexicon.seeing_now, thought.phrases.of_other):
            mention = span.named(match, "x")
            if mention is None or clause.wanted:
                continue
            if mention.types & (thought.in_view | thought.held | {"Floor"}):
                yield Verdict(span.sentence)
            elif mention.types & thought.seen:
                yield Verdict(span.sentence, _not_now(mention))
        for match in span.matches(lexicon.beside):
            mention, other = span.named(match, "x"), span.named(match, "y")
            if mention is None or other is None or clause.wanted:
                continue
            if mention.types & (thought.in_view | thought.held) or not other.types & known.in_view:
                continue
            places = [
                {each for one in those.types for each in known.sightings.get(one, ())}
                for those in (mention, other)
            ]
            if places[0] and not places[0] & places[1]:
                yield Verdict(span.sentence, _not_now(mention))


def _not_now(mention: Mention) -> Refusal:
    return Refusal(
        "unseen", f"{name_of(mention)} was in view before, but is not now. Say so, or leave it out."
    )


def judge_contents(thought: Thought) -> Iterator[Verdict]:
    """What a closed container holds that was never opened."""
    lexicon = lexicon_of(thought)
    for clause, span in clauses_of(thought):
        if not is_told(clause) or clause.intended or clause.past or clause.wanted:
            continue
        if lexicon.ignorance.search(thought.sentences[clause.sentence]):
            continue
        for match in span.matches(lexicon.contents):
            holder = span.named(match, "y")
            if holder is None or not holder.types & _KEEPS:
                continue
            if _is_known_inside(thought, span, match, holder):
                continue
            if lexicon.of_any.search(span.text[: match.start("y")]):
                continue  # one of those that are open, or none in particular
            if any(is_given(thought, each) for each in span.mentions if each is not holder):
                continue
            yield Verdict(
                span.sentence,
                Refusal(
                    "hidden",
                    f"The agent cannot know what is in {name_of(holder)}: it is closed and was not "
                    "opened. Say what may be there, or leave it out.",
                ),
            )


_TOUCHED = (verbs.OPEN, verbs.CLOSE, verbs.PUT)


def _is_known_inside(thought: Thought, span: Span, match: re.Match[str], holder: Mention) -> bool:
    """Whether the agent may have looked into a container of that name."""
    there = [each for _, each in thought.things(holder.types & _KEEPS)]
    if any(each.open is not False for each in there) or (not there and "Box" in holder.types):
        return True
    if any(each.on in holder.types for view in thought.views.values() for each in view):
        return True  # on its top, or behind glass
    shut = lexicon_of(thought).shut.search(span.text)
    if shut and match.start("y") in (shut.end() - 1, shut.start()):
        return False
    return any(thought.done(verb, holder.types) for verb in _TOUCHED)
