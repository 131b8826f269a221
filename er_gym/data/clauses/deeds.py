"""Claims about what the agent has done, in what order, and what the engine answered."""

from __future__ import annotations

import re
from collections.abc import Iterator

from er_gym.data.action_claims import PAST_VERB, has_done
from er_gym.data.clauses.reading import Span, Verdict, clauses_of, lexicon_of, sentences_of
from er_gym.data.knowledge import LastAction
from er_gym.data.mentions import Mention, all_interchangeable
from er_gym.data.reading import Clause
from er_gym.data.thought import Refusal, Thought, name_of
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES

_PAST_CONDITION = re.compile(
    r"^(?:and |but )?(?:once|after|when|before|by the time)\b.*(?:\bhad\b|'d\b)"
)
"""It looks like a condition, but tells what was."""
_FUTURE = re.compile(r"\b(?:will|shall|can|could|should|going to|need to|have to|next)\b|'ll\b")
_AFTERWARDS = re.compile(r"\b(?:after|once|when|by the time|as soon as)\b[^,§]*$")
_OF_ANY = re.compile(r"\bany\b|\bsingle\b|\bone of\b|\ba\b|一个|任何|哪个|从")
_OF_SOME = re.compile(r"s? (?:of (?:this|these|the)|here|on this|in this)\b")
_BEFORE = 13
"""Letters before a deed in which what denies it stands."""


def judge_deeds(thought: Thought) -> Iterator[Verdict]:
    """The agent has done something to a thing, or has not."""
    lexicon = lexicon_of(thought)
    for clause, span in clauses_of(thought):
        if clause.asks or clause.hedged or clause.usual:
            continue
        if clause.conditional and not _PAST_CONDITION.search(clause.text):
            continue
        coming = any(
            _FUTURE.search(each.text)
            for each in thought.clauses
            if each.sentence == clause.sentence
        )
        for verb, phrases in lexicon.deeds.items():
            if not clause.mentions or not lexicon.deed_words[verb].search(clause.text):
                continue
            group = "y" if verb == verbs.PUT else "x"
            for match in span.matches_of(phrases, thought.phrases.of_other):
                mention = span.named(match, group)
                if mention is None:
                    continue
                if coming and _AFTERWARDS.search(
                    clause.text, 0, match.start("x" if group == "x" else "y")
                ):
                    continue
                begin = max(0, match.start() - _BEFORE)
                if lexicon.unwilling.search(clause.text, begin, match.end()):
                    continue
                if lexicon.in_vain.match(clause.text, match.end()):
                    continue
                if _comes_next(thought, clause, verb, mention) or _is_told_in_vain(thought, clause):
                    continue
                if _FIRST_THEN.search(clause.text, match.start()):
                    continue
                denied = lexicon.undone.search(clause.text, begin, match.end())
                if denied and lexicon.once_more.search(clause.text, begin):
                    continue
                yield from _deed(thought, clause.sentence, verb, mention, bool(denied), match)
                if not denied and not clause.negated and lexicon.first_try.search(clause.text):
                    yield from _first_try(thought, clause.sentence, verb, mention)
        for verb, phrases in lexicon.denied_deeds.items():
            for match in span.matches(phrases):
                mention = span.named(match, "x")
                if mention is not None:
                    yield from _deed(thought, clause.sentence, verb, mention, True, match)
        for verb, phrase in lexicon.nothing.items():
            none = phrase.search(clause.text)
            before = any(
                each.mentions
                for each in thought.clauses
                if 0 <= clause.sentence - each.sentence <= 1 and each is not clause
            )
            if none and not (
                lexicon.none_here.match(clause.text, none.end())
                or ((clause.mentions or before) and lexicon.none_of_them.search(none.group()))
            ):
                done = [each for each in thought.known.actions if _counts(each, verb)]
                yield Verdict(
                    clause.sentence,
                    Refusal("history", f"That was done before: {done[-1].action}.")
                    if done
                    else None,
                )


_FIRST_THEN = re.compile(r"了[^，。；]{0,6}再(?!次|度)")
"""Chinese: what is done before something else, "关了柜门再看"."""
_NOW = re.compile(r"先|把|将|拿了|那就")
_TRIED = re.compile(
    r"试着|试过|尝试|试图|企图|伸手|够过|\b(?:tried|tries|trying|attempted|reached|meant)\b"
)
_VAIN = re.compile(
    r"没(?:能)?[^，。；§]{0,3}[成着到住起动]|落了?空|扑了?空|失手|失败|未果|不成"
    r"|\b(?:fail(?:ed)?|missed|in vain|couldn't|could not|no luck|didn't|without success)\b"
)


def _comes_next(thought: Thought, clause: Clause, verb: str, mention: Mention) -> bool:
    """Whether Chinese "first take the phone" tells what the next action does, not what was done."""
    decision = thought.known.decision
    return (
        thought.known.language == "zh"
        and decision.verb == verb
        and decision.object_type in all_interchangeable(mention.types)
        and bool(_NOW.search(clause.text))
    )


def _is_told_in_vain(thought: Thought, clause: Clause) -> bool:
    """Whether a deed was only tried, or its sentence goes on to say that it failed."""
    if _TRIED.search(clause.text):
        return True
    parts = [each for each in thought.clauses if each.sentence == clause.sentence]
    at = next((k for k, each in enumerate(parts) if each.text == clause.text), len(parts))
    return any(not each.mentions and _VAIN.search(each.text) for each in parts[at + 1 : at + 2])


def _counts(each: LastAction, verb: str) -> bool:
    return each.success and each.action.verb == verb


def _deed(
    thought: Thought, sentence: int, verb: str, mention: Mention, denied: bool, match: re.Match[str]
) -> Iterator[Verdict]:
    verb = _as_opening(verb, mention)
    if verb in (verbs.OPEN, verbs.CLOSE) and not any(
        {"openable", "toggleable"} & OBJECT_TYPES[each].properties for each in mention.types
    ):
        return  # it was misread: nobody opens a bed
    if not denied:
        done = has_done(thought, verb, mention)
        yield Verdict(sentence, None if done else _not_done(thought, verb, mention))
        return
    act = verbs.OPEN if verb == "searched" else verb
    done = thought.done(act, mention.types) and not (
        act == verbs.PICKUP and _failed(thought, act, mention)
    )
    # Places are gone to by their type; whatever else is done is done to one of several.
    several = act != verbs.NAVIGATE and thought.are_several(mention.types)
    some = _OF_SOME.match(match.string, match.end())
    if (
        done
        and not some
        and not lexicon_of(thought).another.search(match.group())
        and (not several or _OF_ANY.search(match.group()))
    ):
        yield Verdict(
            sentence,
            Refusal(
                "history",
                f"The agent did {PAST_VERB[act]} {name_of(mention)} before; do not deny it.",
            ),
        )


def _first_try(thought: Thought, sentence: int, verb: str, mention: Mention) -> Iterator[Verdict]:
    """It succeeded at once, unless it failed first."""
    wanted = all_interchangeable(mention.types)
    tries = [
        each.success
        for each in thought.known.actions
        if each.action.verb == verb and each.action.object_type in wanted
    ]
    if True in tries and False in tries[: tries.index(True)]:
        detail = f"The first attempt to {PAST_VERB[verb]} {name_of(mention)} failed."
        yield Verdict(sentence, Refusal("history", detail))


def _as_opening(verb: str, mention: Mention) -> str:
    """Who lifts a lid opens what it is on."""
    fixed = not any("pickupable" in OBJECT_TYPES[each].properties for each in mention.types)
    opens = any("openable" in OBJECT_TYPES[each].properties for each in mention.types)
    return verbs.OPEN if verb == verbs.PICKUP and fixed and opens else verb


def _failed(thought: Thought, verb: str, mention: Mention) -> bool:
    wanted = all_interchangeable(mention.types)
    return any(
        not each.success and each.action.verb == verb and each.action.object_type in wanted
        for each in thought.known.actions
    )


def _not_done(thought: Thought, verb: str, mention: Mention) -> Refusal:
    why = ": the attempt failed" if _failed(thought, verb, mention) else " before"
    return Refusal(
        "history",
        f"The agent did not {PAST_VERB[verb]} {name_of(mention)}{why}. Do not claim it.",
    )


# -- order -----------------------------------------------------------------------------------------

_PAST = re.compile(
    r"\b(?:[a-z]+ed|took|went|got|had|was|were|came|did|gone|been|'d|fetched|shut|put)\b|'d\b"
    r"|[了过完才]|的§"
)


_ROUTE = re.compile(r"\b(?:that was|how i|was how|my route|was the order|how it went)\b")
"""It tells of a course that was taken."""
_SAYS_WHEN = re.compile(
    r"\b(?:first|before|after|afterwards?|then|later|subsequently|by the time)\b"
    r"|\b(?:started|began|start|outset)\b|[先后]|之前|以前|开始"
)
_LONGEST = 400
"""Letters of a sentence of which the order of deeds is read; the time grows with their square."""


def judge_order(thought: Thought) -> Iterator[Verdict]:
    """One deed came before another."""
    lexicon = lexicon_of(thought)
    if len(thought.known.actions) < 2:
        return
    for span in sentences_of(thought):
        if len(span.mentions) < 2 or len(span.text) > _LONGEST or not _SAYS_WHEN.search(span.text):
            continue
        for match in span.matches(lexicon.order):
            parts = (match["a"], match["b"])
            past = _PAST.search(match.group()) or _ROUTE.search(span.text)
            if any(lexicon.planned.search(part) for part in parts) or not (
                past or lexicon.failing.search(match.group())
            ):
                continue
            first, then = (_turns(thought, span, match, group) for group in "ab")
            if not first or not then or first == then:
                continue
            fits = min(first) < max(then)
            yield Verdict(
                span.sentence,
                None
                if fits
                else Refusal(
                    "history",
                    "It was the other way round: "
                    f"{thought.known.actions[max(then)].action} came before "
                    f"{thought.known.actions[min(first)].action}.",
                ),
            )


def _turns(thought: Thought, span: Span, match: re.Match[str], group: str) -> set[int]:
    """The turns of the deeds that a part of a sentence may mean."""
    lexicon, part = lexicon_of(thought), match[group]
    named = span.among(match.start(group), match.end(group))
    types = all_interchangeable(each for mention in named for each in mention.types)
    failing = bool(lexicon.failing.search(part))
    acted = {
        index: each.action.verb
        for index, each in enumerate(thought.known.actions)
        if each.action.object_type in types and (each.success or failing)
    }
    said = {verb for verb, phrase in lexicon.plain_verbs.items() if phrase.search(part)}
    return {index for index, verb in acted.items() if verb in said} or {*acted}


# -- answers ---------------------------------------------------------------------------------------


def judge_answers(thought: Thought) -> Iterator[Verdict]:
    """The engine answered something to an action."""
    lexicon, actions = lexicon_of(thought), thought.known.actions
    if not actions:
        return
    for span in sentences_of(thought):
        told = lexicon.told.search(span.text)
        if told is None or any(each.asks for each in span.clauses):
            continue
        if _CANNOT_TELL.search(span.text, 0, told.start()):
            continue
        said = [why for why, each in lexicon.answers.items() if each.search(span.text)]
        if not said or lexicon.undone.search(
            span.text, max(0, told.start() - _ROUND), told.end() + 3
        ):
            continue
        meant = _meant(thought, span, told.start())
        if meant is None and "done" in said:
            continue
        if meant is None:
            meant = [*actions]
        if not meant:
            if span.mentions:
                yield Verdict(
                    span.sentence,
                    Refusal(
                        "history",
                        f"Nothing was tried with {name_of(span.mentions[0])}: there was no answer.",
                    ),
                )
            continue
        fits = any(_answers(each, why) for each in meant for why in said)
        last = meant[-1]
        yield Verdict(
            span.sentence,
            None
            if fits
            else Refusal("history", f"The answer to {last.action} was: {_quoted(last)}."),
        )


_AT = re.compile(r"(?:\b(?:by|near|beside|at)(?: (?:the|that|this|my))?(?: [a-z-]+)? |[在到])$")
_CANNOT_TELL = re.compile(
    r"(?:\b(?:nobody|no one|nothing|can|could|will|would|may|might|won't)\b[^,.;]{0,12}"
    r"|(?:没谁|没人|没有谁|没有人|无人|谁|能|会|可以|等)[^，。；]{0,3})$"
)
"""Before an answer: none was given."""
_ROUND = 3
"""Letters before an answer in which it is denied."""
_ENDED = re.compile(r"[.。]")


def _quoted(each: LastAction) -> str:
    return _ENDED.split(each.feedback)[0].split(" There is")[0] or "none"


def _meant(thought: Thought, span: Span, told: int) -> list[LastAction] | None:
    """The actions that a sentence speaks of; None if that is open.

    What stands before the answer is what it was given to.
    """
    lexicon = lexicon_of(thought)
    pairs = list(zip(span.places, span.mentions, strict=True))
    before = [each for each in pairs if each[0] < told]
    # "By the curtain I was told" says where, not what was tried.
    named = [each for at, each in before or pairs if not _AT.search(span.text, 0, at)]
    said = {verb for verb, phrase in lexicon.plain_verbs.items() if phrase.search(span.text)}
    types = all_interchangeable(each for mention in named for each in mention.types)
    if not types:
        return None
    of_things = [each for each in thought.known.actions if each.action.object_type in types]
    of_verbs = [each for each in of_things if each.action.verb in said]
    return of_verbs or of_things


def _answers(each: LastAction, said: str) -> bool:
    """Whether an action was answered so, or may have been."""
    if each.success or not each.feedback:
        return said == "done" if each.success else True
    for words, fitting in _ANSWERS:
        if any(word in each.feedback for word in words):
            return said in fitting
    return said not in ("done", "no action")


_ANSWERS = (
    (("names no action", "不是一个动作"), ("no action",)),
    (("none is within reach", "close enough", "够得着、看得见", "足够近"), ("far",)),
    (("hand is empty", "手里是空的"), ("empty hand", "stuck")),
)
"""Words of the engine's answers, in both languages (:mod:`er_gym.envs.feedback_words`), and the
reasons that a thought may give for them."""
