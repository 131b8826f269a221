"""The critic: checks a thought against what the agent could know.

It checks what a thought states as a fact, and refuses guesses at what is in view or was seen; other
guesses, questions, plans and wishes state nothing. It accepts sentences that it cannot parse. So it
does not refuse a true thought for its wording, but it also accepts a false one in a wording that it
does not know.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator

from er_gym.data import action_claims, claims, form, remembered
from er_gym.data.clauses.judging import check_clauses
from er_gym.data.knowledge import Knowledge
from er_gym.data.thought import Refusal, Thought
from er_gym.data.trajectory import ThoughtKind

__all__ = ["CHECKS", "LONGEST_WORD", "Refusal", "check"]

_SPACE = re.compile(r"\s+")
"""Each run is read as one space, or one end of a line."""
LONGEST_WORD = 30
"""A text with more characters for each word that it may have is not read."""
CHECKS: tuple[Callable[[Thought], Iterator[Refusal]], ...] = (
    form.check_length,
    form.check_language,
    form.check_tags,
    form.check_leak,
    form.check_repeat,
    claims.check_unseen,
    claims.check_hidden,
    claims.check_inside,
    claims.check_side,
    action_claims.check_outcome,
    action_claims.check_decision,
    remembered.check_remembered,
    check_clauses,
)
"""Every check. Codes: ``length``, ``language``, ``tags``, ``leak``, ``repeat``, ``unseen``,
``hidden``, ``support``, ``side``, ``count``, ``state``, ``held``, ``history``, ``decision``,
``remembered``, ``memory``, ``distance``, ``room``, ``task``."""


def check(text: str, kind: ThoughtKind, knowledge: Knowledge, *, limit: int) -> tuple[Refusal, ...]:
    """Check a thought.

    Args:
        text: the thought without its tag.
        kind: the kind that was asked for.
        knowledge: what the agent knew and decided.
        limit: the most words (in Chinese, two characters count as a word).

    Returns:
        Every reason to refuse it; empty if the thought is accepted. A text with more than 30
        characters for each word of the limit is refused for its length alone and not read any
        further, since some checks take a time that grows faster than the text.
    """
    if len(text) > LONGEST_WORD * limit:
        return (Refusal("length", f"The thought is far too long; write at most {limit} words."),)
    plain = _SPACE.sub(lambda run: "\n" if "\n" in run[0] else " ", text)
    thought = Thought(plain, kind, limit, knowledge)
    return tuple(dict.fromkeys(refusal for each in CHECKS for refusal in each(thought)))
