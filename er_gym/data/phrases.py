"""What the critic looks for in a text of one language: a record of compiled phrases.

:mod:`er_gym.data.phrases_en` and :mod:`er_gym.data.phrases_zh` fill it. The phrases are matched
against clauses in lower case in which every name of an object is a single :data:`MARK`, so that
they can say "MARK is on the MARK". Groups name the marks: ``x`` or ``xs`` what is spoken of, ``y``
the receptacle or the destination.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from re import Pattern

MARK = "§"
"""Stands for the name of an object."""
Phrase = Pattern[str]


@dataclass(frozen=True, kw_only=True)
class Phrases:
    """The phrases of a language.

    Attributes:
        sentence, clause: where a sentence and a clause end.
        verb: what makes a clause a clause: without it, it belongs to the one before.
        aside: a relative clause between a subject and its verb.
        question: a sentence that asks.
        asking: in such a sentence, a clause from which on it asks; the last one asks in any case.
        hedge, negation, condition, goal, custom, past, intention: marks of clauses that claim
            something else than what is so now: what may be, what is not, what would be, what is
            wanted, what is usual, what was, what the agent is going to do.
        supposition: a condition that covers the rest of its sentence, up to a contrast.
        coming: a sentence that tells what will be.
        contrast, contrast_after: at the beginning or the end of a clause: from there on it is told
            again what is so.
        seen: claims to see ``xs``.
        located: claims that ``xs`` are somewhere.
        on: claims that ``xs`` lie in or on ``y``.
        out_of: means to take ``xs`` out of ``y``.
        placing: before ``xs``: it is being put there.
        sides: phrases of place by direction: ``left``, ``right``, ``ahead``, ``behind``.
        nearly: before a side: a little.
        of_other: before a name, what makes it the place of another thing.
        is_so: after a side: the name that follows is what it is about.
        states: claims about ``x``, with the groups ``open``, ``closed``, ``on``, ``off`` and
            ``no`` (not so).
        it_states: the same of "it".
        held, not_held: claims to hold ``xs``, or to hold none of them.
        empty_hand: claims that the hand is empty.
        failed, succeeded: claims that the last action did so.
        failing: an action that failed is spoken of.
        decides: the beginning of a decision; one of ``acts`` follows.
        acts: the verbs of decisions, with the object ``x``, if they have one.
        before_act: what may stand between that and the act.
        weak: a decision that may be a need of the task.
        later, first, instead: marks of a step that is not the next, that is, or that replaces it.
        over: claims that the task is done.
        leak, labels, foreign: what no thought may say.
    """

    sentence: Phrase
    clause: Phrase
    verb: Phrase
    aside: Phrase
    question: Phrase
    asking: Phrase
    hedge: Phrase
    negation: Phrase
    condition: Phrase
    goal: Phrase
    custom: Phrase
    past: Phrase
    intention: Phrase
    supposition: Phrase
    coming: Phrase
    contrast: Phrase
    contrast_after: Phrase
    seen: Sequence[Phrase]
    located: Sequence[Phrase]
    on: Sequence[Phrase]
    out_of: Sequence[Phrase]
    placing: Phrase
    sides: Mapping[str, Phrase]
    nearly: Phrase
    of_other: Phrase
    is_so: Phrase
    states: Sequence[Phrase]
    it_states: Phrase
    held: Sequence[Phrase]
    not_held: Sequence[Phrase]
    empty_hand: Phrase
    failed: Phrase
    succeeded: Phrase
    failing: Phrase
    decides: Phrase
    before_act: Phrase
    weak: Phrase
    acts: Mapping[str, Phrase]
    later: Phrase
    first: Phrase
    instead: Phrase
    over: Phrase
    leak: Phrase
    labels: Phrase
    foreign: Phrase
