"""Judges the claims of a thought's clauses: true, false or unknown."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from er_gym.data.action_claims import decided
from er_gym.data.clauses import deeds, measures, reasons, sights, states
from er_gym.data.clauses.reading import Verdict
from er_gym.data.thought import Refusal, Thought

JUDGES: tuple[Callable[[Thought], Iterator[Verdict]], ...] = (
    deeds.judge_deeds,
    deeds.judge_order,
    deeds.judge_answers,
    sights.judge_never_seen,
    sights.judge_memories,
    sights.judge_denials,
    sights.judge_guesses,
    sights.judge_sights,
    sights.judge_contents,
    states.judge_states,
    states.judge_hand,
    states.judge_supports,
    measures.judge_numbers,
    measures.judge_distances,
    measures.judge_rooms,
    measures.judge_tasks,
    reasons.judge_purposes,
    reasons.judge_losses,
    reasons.judge_failures,
    reasons.judge_untouched,
    reasons.judge_turned_down,
    reasons.judge_own_words,
)
"""Every reader of claims."""


def unknown_sentences(thought: Thought) -> tuple[int, int]:
    """The sentences of which no claim was judged, and all sentences.

    A sentence counts as judged if one of its claims is read: here, or by the phrases of the other
    checks.
    """
    phrases = thought.phrases
    read = {verdict.sentence for judge in JUDGES for verdict in judge(thought)}
    others = (
        *(*phrases.seen, *phrases.located, *phrases.on),
        *(phrases.failed, phrases.succeeded, phrases.over, *phrases.sides.values()),
    )
    for clause in thought.clauses:
        if clause.sentence not in read and any(each.search(clause.text) for each in others):
            read.add(clause.sentence)
    read |= {each.clause.sentence for each in decided(thought)}
    every = {clause.sentence for clause in thought.clauses}
    return len(every - read), len(every)


def check_clauses(thought: Thought) -> Iterator[Refusal]:
    """The claims that are false."""
    for judge in JUDGES:
        for verdict in judge(thought):
            if verdict.refusal is not None:
                yield verdict.refusal
