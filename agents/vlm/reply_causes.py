"""Finds the causes of an unusable reply, by their names in :data:`er_gym.rollout.causes.CAUSES`."""

from __future__ import annotations

from agents.vlm.chat import Reply
from agents.vlm.parsing import ParsedReply
from er_gym.rollout.causes import (
    CUT,
    EMPTY,
    FILTERED,
    REFUSAL,
    UNFINISHED_THOUGHT,
    UNREADABLE,
)

_CUT = frozenset({"length", "max_tokens", "max_output_tokens", "model_length", "token_limit"})
_FILTERED = frozenset({"content_filter", "safety", "recitation", "prohibited_content", "sensitive"})
_REFUSED = frozenset({"refusal"})
"""Why a reply ended, in the words of servers, in lower case."""


def causes_of(reply: Reply, parsed: ParsedReply) -> tuple[str, ...]:
    """The names of the causes that hold for a reply; empty for a good one."""
    finish = reply.finish.casefold()
    said = reply.text.strip() or reply.call.strip()
    found = {
        CUT: finish in _CUT,
        FILTERED: finish in _FILTERED,
        REFUSAL: reply.refused or finish in _REFUSED,
        UNFINISHED_THOUGHT: (not said and bool(reply.reasoning.strip())) or _thinks_on(reply.text),
        EMPTY: not said and not reply.reasoning.strip(),
    }
    names = tuple(name for name, holds in found.items() if holds)
    return names or (UNREADABLE,) * bool(parsed.problem)


def _thinks_on(text: str) -> bool:
    """Whether a text ends within a thought of a reasoning model."""
    plain = text.casefold()
    return plain.rfind("<think>") > plain.rfind("</think>")
