"""Judges the claims of a thought's clauses: true, false or unknown."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from er_gym.data.action_claims import decided
from er_gym.data.clauses import beyond, deeds, glances, loose, measures, reasons, sights, states
from er_gym.data.clauses.reading import Verdict
from er_gym.data.thought import Thought

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
    beyond.judge_beyond,
    glances.judge_before_me,
    glances.judge_never_loosely,
    glances.judge_lay,
    glances.judge_whereabouts,
    reasons.judge_refused,
    loose.judge_hand_loosely,
    loose.judge_ease,
    loose.judge_taken,
    loose.judge_lies_loosely,
    loose.judge_wanted,
    loose.judge_quotes,
)
"""Every reader of claims."""


def verdicts(thought: Thought) -> Iterator[Verdict]:
    """All claims of a thought that are read."""
    for judge in JUDGES:
        yield from judge(thought)


def read_otherwise(thought: Thought) -> set[int]:
    """The sentences in which the phrases of the other checks read a claim."""
    phrases = thought.phrases
    others = (
        *(*phrases.seen, *phrases.located, *phrases.on),
        *(phrases.failed, phrases.succeeded, phrases.over, *phrases.sides.values()),
    )
    read = {each.clause.sentence for each in decided(thought)}
    for clause in thought.clauses:
        if clause.sentence not in read and any(each.search(clause.text) for each in others):
            read.add(clause.sentence)
    return read
