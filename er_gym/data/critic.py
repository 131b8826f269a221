"""The critic: checks a thought against what the agent could know.

It reads what a thought claims as a fact: guesses, questions, plans and wishes claim nothing. What
it cannot read it lets pass, so an honest thought stands, and a lie in words that it does not know
does as well.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from er_gym.data import claims, deeds, form
from er_gym.data.knowledge import Knowledge
from er_gym.data.thought import Refusal, Thought
from er_gym.data.trajectory import ThoughtKind

__all__ = ["CHECKS", "Refusal", "check"]

CHECKS: tuple[Callable[[Thought], Iterator[Refusal]], ...] = (
    form.length,
    form.language,
    form.tags,
    form.leak,
    form.repeat,
    claims.unseen,
    claims.hidden,
    claims.inside,
    claims.denied,
    claims.support,
    claims.side,
    claims.count,
    claims.state,
    claims.hand,
    deeds.history,
    deeds.outcome,
    deeds.decision,
)
"""Every check. Codes: ``length``, ``language``, ``tags``, ``leak``, ``repeat``, ``unseen``,
``hidden``, ``support``, ``side``, ``count``, ``state``, ``held``, ``history``, ``decision``."""


def check(text: str, kind: ThoughtKind, knowledge: Knowledge, *, limit: int) -> tuple[Refusal, ...]:
    """Check a thought.

    Args:
        text: the thought without its tag.
        kind: the kind that was asked for.
        knowledge: what the agent knew and decided.
        limit: the most words (in Chinese, two characters count as a word).

    Returns:
        Every reason to refuse it; empty if it may stand.
    """
    thought = Thought(text, kind, limit, knowledge)
    return tuple(dict.fromkeys(refusal for each in CHECKS for refusal in each(thought)))
