"""The critic's checks of claims about actions: those done, and the one decided on."""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass

from er_gym.data.claims import PARTS
from er_gym.data.mentions import Mention, all_interchangeable
from er_gym.data.reading import Clause
from er_gym.data.thought import Refusal, Thought
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES

PAST_VERB = {
    verbs.OPEN: "open",
    verbs.CLOSE: "close",
    verbs.PICKUP: "pick up",
    verbs.PUT: "put anything in or on",
    verbs.TOGGLE: "switch",
    verbs.NAVIGATE: "go to",
    "searched": "search",
}
_RECENT = 3
"""So many actions ago, a failure can still be spoken of as the last one."""
_LAST = re.compile(r"\b(?:last|previous|preceding)\b|上一|上次|前一|刚")
_DENIES = re.compile(
    r"\b(?:not|none|no|never|nothing|neither|without|hardly)\b|n't\b|没有?一|从没|没有?哪"
)
"""Before a failure: there was none."""
_STORY = re.compile(r"后来|才去的|之后才|(?:末了|最后|临了|末尾)(?:才|是)|才(?:去|到|轮到)")
"""A sentence that tells what was done, one thing after another."""


# -- what was done ---------------------------------------------------------------------------------


def has_done(thought: Thought, verb: str, mention: Mention) -> bool:
    """Whether the agent did that to something of that name, or is where it must have."""
    known, types = thought.known, all_interchangeable(mention.types)
    if verb == verbs.PICKUP and types & thought.held:
        return True
    if verb == verbs.NAVIGATE and known.at in types:
        return True
    if verb == verbs.NAVIGATE and known.at in OBJECT_TYPES:
        return (
            any(each.on in types for _, each in thought.things([known.at]))
            or thought.done(verb, types)
            or _was_near(thought, types)
        )
    if verb in (verbs.OPEN, verbs.CLOSE) and thought.done(verbs.TOGGLE, types):
        return True
    if verb == verbs.TOGGLE and (
        thought.done(verbs.OPEN, types) or thought.done(verbs.CLOSE, types)
    ):
        return True  # Chinese says open and close of both
    if verb != "searched":
        return thought.done(verb, types)
    if known.at in types or any(
        thought.done(each, types)
        for each in (verbs.NAVIGATE, verbs.OPEN, verbs.CLOSE, verbs.PUT, verbs.TOGGLE)
    ):
        return True
    # What cannot be opened is searched by looking at it from near by.
    opens = any("openable" in OBJECT_TYPES[each].properties for each in mention.types)
    return not opens and any(place for each in types for place in (known.seen.get(each),))


_FRONTS = ("Drawer", "Shelf")
"""Who goes to these goes to what they are in."""


def _was_near(thought: Thought, types: frozenset[str]) -> bool:
    """Whether the agent went to something that lay on one of some types, or is part of it."""
    gone = {
        each.action.object_type
        for each in thought.known.actions
        if each.success and each.action.verb == verbs.NAVIGATE
    }
    return any(
        thought.known.where(each) in types or (each in _FRONTS and PARTS[each] & types)
        for each in gone
    )


def check_outcome(thought: Thought) -> Iterator[Refusal]:
    """Claims that the last action succeeded when it failed, or the other way round."""
    actions = thought.known.actions
    last = thought.known.last
    failed_lately = any(not each.success for each in actions[-_RECENT:])
    phrases = thought.phrases
    admits = any(phrases.failing.search(each.text) for each in thought.clauses if not each.guessed)
    for clause in thought.clauses:
        if clause.guessed and "seem" not in clause.text:
            continue
        failed = phrases.failed.search(clause.text)
        if failed and _DENIES.search(clause.text, 0, failed.start()):
            failed = None  # "not one of them went wrong"
        lately = failed and _LAST.search(failed.group())
        if failed and not (failed_lately if lately else _has_failed(thought, clause)):
            yield Refusal(
                "history",
                "No action failed: do not say that one did."
                if last
                else "Nothing was done yet: do not say that an action failed.",
            )
        if last is None or last.success or admits:
            continue
        said = phrases.succeeded.search(clause.text)
        senses = (phrases.negation, phrases.intention)
        if said and not any(clause.says_before(sense, said.start()) for sense in senses):
            yield Refusal(
                "history", f"The last action, {last.action}, failed; say so, or say nothing."
            )


def _has_failed(thought: Thought, clause: Clause) -> bool:
    """Whether an action failed that a clause may speak of."""
    types = all_interchangeable(each for mention in clause.mentions for each in mention.types)
    return any(
        not each.success and (not types or each.action.object_type in types)
        for each in thought.known.actions
    )


# -- what is decided -------------------------------------------------------------------------------


@dataclass(frozen=True)
class Decided:
    """An action that a thought decides on.

    Attributes:
        act: a key of :attr:`er_gym.data.phrases.Phrases.acts`.
        thing: what it is to be done to.
        text: as it is written.
        clause: where it stands.
        weak: whether it may be a need of the task rather than a decision.
        later: whether it is not the next step.
    """

    act: str
    thing: Mention | None
    text: str
    clause: Clause
    weak: bool
    later: bool


def _hangs_on_another(thought: Thought, clause: Clause) -> bool:
    """Whether a clause before it in its sentence says on which condition it holds."""
    before = itertools.takewhile(lambda each: each is not clause, thought.clauses)
    return any(
        each.sentence == clause.sentence
        and each.conditional
        and not each.text.startswith("before ")
        for each in before
    )


def _is_coming_job(thought: Thought, decided: Decided) -> bool:
    """Whether "the mug must go into the sink first" tells the order of jobs: the hand is empty."""
    needed = decided.weak or _NEEDED.search(decided.clause.text)
    return decided.act == "put" and not thought.known.held and bool(needed)


_NEEDED = re.compile(r"\b(?:must|need to|have to|has to|should)\b|得先|必须|应该|该先|要先")


def check_decision(thought: Thought) -> Iterator[Refusal]:
    """Announces another action than the one that the turn takes."""
    known, phrases = thought.known, thought.phrases
    those = [
        each
        for each in decided(thought)
        if (each.act != "look around" or each.clause.last) and not _is_coming_job(thought, each)
    ]
    fitting = [each for each in those if _fits(thought, each)]
    over = known.decision.verb == verbs.END
    others = [
        each
        for each in those
        if each not in fitting and not (each.later and not (over and _is_next(each)))
    ]
    wrong = None
    if those and not fitting:
        strong = [each for each in others if not each.weak]
        wrong = strong[-1] if strong else next((each for each in others if each.clause.last), None)
    elif others:
        first = [each for each in others if phrases.first.search(each.clause.text)]
        replaced = [
            each
            for each in others
            if each is those[-1] and phrases.instead.search(each.clause.text)
        ]
        wrong = next(iter((*first, *replaced)), None)
    if wrong is not None:
        yield Refusal(
            "decision",
            f"The thought decides to “{wrong.text}”, but the next action is {known.decision}.",
        )
    if known.decision.verb != verbs.END and known.purpose != "check":
        for clause in thought.clauses:
            if clause.guessed or clause.negated or clause.intended:
                continue
            if _hangs_on_another(thought, clause):
                continue
            if phrases.over.search(clause.text):
                yield Refusal(
                    "decision", f"The task is not done: the next action is {known.decision}."
                )


def _is_next(decided: Decided) -> bool:
    """Whether it is to follow for certain: after the end, nothing does."""
    clause = decided.clause
    return not (clause.conditional or clause.negated or clause.hedged or clause.past)


def decided(thought: Thought) -> Iterator[Decided]:
    """All actions that a thought decides on, in order."""
    phrases = thought.phrases
    for clause in thought.clauses:
        if clause.asks or any(
            each.sentence == clause.sentence and _STORY.search(each.text)
            for each in thought.clauses
        ):
            continue
        for start in phrases.decides.finditer(clause.text):
            rest = clause.text[start.end() :]
            skipped = phrases.before_act.match(rest)
            body = rest[skipped.end() :] if skipped else rest.lstrip(" ,，")
            offset = len(clause.text) - len(body)
            for act, phrase in phrases.acts.items():
                match = phrase.match(body)
                if match is None:
                    continue
                thing = None
                groups = {"x", "x2"} & match.re.groupindex.keys()
                at = max((match.start(group) for group in groups), default=-1)
                if at >= 0:
                    inner = _INNER.match(body, at)
                    last = inner.end() - 1 if inner else at
                    thing = next(iter(clause.among(last + offset, last + offset + 1)), None)
                before = clause.text[: start.end()] + (skipped.group() if skipped else "")
                yield Decided(
                    act,
                    thing,
                    _unmasked(match.group(), clause, offset),
                    clause,
                    bool(phrases.weak.search(start.group())),
                    bool(phrases.later.search(before))
                    or clause.conditional
                    or _hangs_on_another(thought, clause)
                    or bool(phrases.later.match(body[match.end() :].lstrip(" ,"))),
                )
                break


_INNER = re.compile(r"§(?:上|里|旁边?|边上|前面?|后面?|下面?)(?:的|那|这)[^，。§]{0,4}§")
"""Chinese: "the laptop on the table", whose own name stands last."""


def _unmasked(text: str, clause: Clause, offset: int) -> str:
    names = iter(clause.among(offset, offset + len(text)))
    return re.sub("§", lambda _: next(names).text, text).strip()


_ABOUT = {"go", "visit", "check", "open", "toggle", "slice"}


def _fits(thought: Thought, decided: Decided) -> bool:
    """Whether an action that a thought decides on is the one that is taken, or begins with it."""
    known = thought.known
    verb, target = known.decision.verb, known.decision.object_type
    things = all_interchangeable(decided.thing.types) if decided.thing else frozenset()
    same = not decided.thing or target in things
    act = decided.act
    if verb == verbs.OBSERVE:
        return act == "look around" or (act == "check" and not decided.thing)
    if verb == verbs.END:
        return act == "end"
    if verb == verbs.MOVE_FORWARD:
        near = act in ("go", "visit", "check", "take") and known.purpose in ("get closer", "check")
        return act == "forward" or near
    if act in ("look around", "end"):
        return False
    if act == "forward":
        return verb == verbs.NAVIGATE
    if act == "go" and decided.thing is None:
        return verb == verbs.NAVIGATE
    if act in ("go", "visit"):
        lies_there = any(target in known.rested.get(each, ()) for each in things)
        begins = (verbs.NAVIGATE, verbs.OPEN, verbs.PICKUP, verbs.TOGGLE)
        return (same or lies_there) and verb in begins
    if act == "check":
        return same and verb in (verbs.NAVIGATE, verbs.OPEN)
    if act == "open":
        return same and verb in (verbs.OPEN, verbs.NAVIGATE, verbs.TOGGLE)
    if act == "close":
        return same and verb in (verbs.CLOSE, verbs.NAVIGATE, verbs.TOGGLE)
    if act == "put":
        return same and verb in (verbs.PUT, verbs.NAVIGATE, verbs.OPEN)
    if act == "take" and not decided.thing:
        return verb in (verbs.PICKUP, verbs.NAVIGATE, verbs.OPEN)
    if act == "take":
        return _takes(thought, things, verb, target)
    verb_of = {"toggle": verbs.TOGGLE, "slice": verbs.SLICE}
    return same and verb in (verb_of[act], verbs.NAVIGATE)


def _takes(thought: Thought, things: frozenset[str], verb: str, target: str) -> bool:
    """Whether an action leads to taking a thing: picking it up, or going to where it lies."""
    if verb == verbs.PICKUP:
        return target in things
    holders = {each.on for _, each in thought.things(things)} | {
        thought.known.seen.get(each, "") for each in things
    }
    return verb in (verbs.NAVIGATE, verbs.OPEN) and (
        target in things
        or bool(all_interchangeable(each for each in holders if each in OBJECT_TYPES) & {target})
    )
