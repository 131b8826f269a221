"""The critic: checks a thought against what the agent could know."""

from __future__ import annotations

from dataclasses import dataclass

from er_gym.data.knowledge import Knowledge
from er_gym.data.trajectory import ThoughtKind


@dataclass(frozen=True)
class Refusal:
    """Why a thought is refused.

    Attributes:
        code: the sort of fault, such as ``unseen``, ``side``, ``state``, ``decision``.
        detail: a sentence that a writer can act on: what was claimed, and what is so.
    """

    code: str
    detail: str


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
    raise NotImplementedError
