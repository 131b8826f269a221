"""The word classes of one language, from which clauses are read.

:mod:`er_gym.data.clauses.lexicon_en` and :mod:`er_gym.data.clauses.lexicon_zh` fill it. Texts are
in lower case, with a :data:`~er_gym.data.phrases.MARK` for each name of an object.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from re import Pattern

Words = Pattern[str]


@dataclass(frozen=True, kw_only=True)
class Lexicon:
    """The words of a language.

    Attributes:
        deeds: what the agent has done, by verb (``searched`` is one), with its object: group ``x``,
            or ``y`` for where something was put. Not to be said of somebody else.
        deed_words: without one of which none of these are said, by verb.
        denied_deeds: what the agent has not done, by verb, with its object ``x``.
        first_try: a deed succeeded at once.
        undone: before or in a deed: it was not done.
        unwilling: before or in a deed: it was not wanted, or only tried.
        in_vain: after a deed: it failed.
        once_more: a deed is denied in one direction or for a second time.
        nothing: what denies deeds of a kind altogether, by verb.
        none_here: after that: it is denied of some place or time.
        none_of_them: in that: it may be denied of what was named before.
        plain_verbs: the words for a verb in any form, by verb.
        failing: a deed that failed.
        order: says that one deed, group ``a``, came before another, group ``b``.
        planned: a part of such a sentence is a plan.
        told: the engine's answer to an action is quoted.
        answers: what it was, by reason.
        task: the task is quoted; what follows is what it asks for.
        chores: what a task may ask for, by the words that the instruction then has.
        goes_into: in that: something is to go into ``y``.
        rooms: the kinds of rooms.
        any_room: without which no room is named.
        room_in_general: a room is named, but not as this one.
        states: ``x`` is in a state, with the groups of
            :attr:`er_gym.data.phrases.Phrases.states`.
        loose_states: the same in looser words, ``said`` between the name and the state.
        being: in that: it is told that it is so.
        is_someone: that is who made it so.
        all_of, all_after: before or after ``x``: every one of them.
        none_of: before ``x``: none of them.
        state_since: after a state: it is another one since.
        at_times: what is told is told of another time.
        poured: water runs from ``x``.
        held: ``x`` is in the hand.
        lies_on: ``x`` is on or in ``y``.
        never_seen: the agent never saw ``x``.
        here_only: limits what was never seen to a place or time.
        seen_then: the agent saw ``x``.
        since_here: ever since it came to where it is now.
        while_at: when it was at ``y``.
        only_then, last_then: it saw ``x`` for the first or the last time then.
        not_in_view: none of ``xs`` is in view.
        not_of_view: what is denied is something else than that a thing is in view.
        but_there: a thing is not here but in another place.
        until_then: limits what was never seen to the time before something.
        not_on: ``x`` is not on ``y``, which is in view.
        perhaps_on: ``x`` is in or on ``y``, after a guess.
        of_memory: what was seen is spoken of.
        another: not the thing that is known.
        seeing_now: what is seen now is ``x``.
        beside: ``x`` is next to ``y``.
        strangers: things that no scene has.
        sees: before or after a stranger: it is there.
        numbers: words for numbers.
        counted: ``n`` of ``x``.
        only: no more than one of ``x``.
        only_before: before a number: no more than that.
        uncounted: no count of what is in view.
        near, far: phrases of distance.
        metres: a distance in metres, ``n``.
        compared: a distance that is only compared.
        of_any: before ``y``: it is none in particular.
        contents: says what ``y`` contains.
        shut: says that a name, at its beginning or its end, is closed.
        ignorance: that is not known.
    """

    deeds: Mapping[str, Sequence[Words]]
    deed_words: Mapping[str, Words]
    denied_deeds: Mapping[str, Sequence[Words]]
    first_try: Words
    undone: Words
    unwilling: Words
    in_vain: Words
    once_more: Words
    nothing: Mapping[str, Words]
    none_here: Words
    none_of_them: Words
    plain_verbs: Mapping[str, Words]
    failing: Words
    order: Sequence[Words]
    planned: Words
    told: Words
    answers: Mapping[str, Words]
    task: Words
    chores: Mapping[str, tuple[Words, Words]]
    goes_into: Words
    rooms: Mapping[str, Words]
    any_room: Words
    room_in_general: Words
    states: Sequence[Words]
    loose_states: Sequence[Words]
    being: Words
    is_someone: Words
    all_of: Words
    all_after: Words
    none_of: Words
    state_since: Words
    at_times: Words
    poured: Words
    held: Sequence[Words]
    lies_on: Sequence[Words]
    never_seen: Sequence[Words]
    here_only: Words
    seen_then: Sequence[Words]
    since_here: Words
    while_at: Sequence[Words]
    only_then: Words
    last_then: Words
    not_in_view: Sequence[Words]
    not_of_view: Words
    but_there: Words
    until_then: Words
    not_on: Sequence[Words]
    perhaps_on: Sequence[Words]
    of_memory: Words
    another: Words
    seeing_now: Sequence[Words]
    beside: Sequence[Words]
    strangers: Words
    sees: Words
    numbers: Mapping[str, int]
    counted: Words
    only: Sequence[Words]
    only_before: Words
    uncounted: Words
    near: Words
    far: Words
    metres: Words
    compared: Words
    of_any: Words
    contents: Sequence[Words]
    shut: Words
    ignorance: Words
