"""Judges the claims of a thought's clauses: true, false or unknown."""

from __future__ import annotations

from collections.abc import Callable, Iterator

from er_gym.data.clauses import deeds, measures, sights, states
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
)
"""Every reader of claims."""


def check_clauses(thought: Thought) -> Iterator[Refusal]:
    """The claims that are false."""
    for judge in JUDGES:
        for verdict in judge(thought):
            if verdict.refusal is not None:
                yield verdict.refusal
