"""The critic: checks a thought against what the agent could know.

It checks what a thought states as a fact, and refuses guesses at what is in view or was seen; other
guesses, questions, plans and wishes state nothing. It accepts sentences that it cannot parse. So it
does not refuse a true thought for its wording, but it also accepts a false one in a wording that it
does not know.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from er_gym.data import action_claims, claims, form, remembered
from er_gym.data.clauses.judging import read_otherwise, verdicts
from er_gym.data.knowledge import Knowledge
from er_gym.data.thought import Refusal, Thought
from er_gym.data.trajectory import ThoughtKind

__all__ = ["CHECKS", "LONGEST_WORD", "Refusal", "Review", "check", "review"]

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
)
"""Every check but those of clauses. All codes: ``length``, ``language``, ``tags``, ``leak``,
``repeat``, ``unseen``, ``hidden``, ``support``, ``side``, ``count``, ``state``, ``held``,
``history``, ``decision``, ``remembered``, ``memory``, ``distance``, ``room``, ``task``."""


@dataclass(frozen=True)
class Review:
    """What the rules find in a thought.

    Attributes:
        refusals: every reason to refuse it; empty if it is accepted.
        true, false, unknown: the sentences of which a claim was read and none is false, of which
            one is false, and of which no claim was read.
        open: the sentences that have clauses of which no claim was read, as they are written.
    """

    refusals: tuple[Refusal, ...]
    true: int = 0
    false: int = 0
    unknown: int = 0
    open: tuple[str, ...] = ()


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
    thought = _read(text, kind, knowledge, limit)
    if isinstance(thought, Refusal):
        return (thought,)
    claims = (each.refusal for each in verdicts(thought))
    return tuple(
        dict.fromkeys((*_otherwise(thought), *(each for each in claims if each is not None)))
    )


def review(text: str, kind: ThoughtKind, knowledge: Knowledge, *, limit: int) -> Review:
    """Check a thought, and tell how much of it was read.

    Args:
        text, kind, knowledge, limit: as :func:`check` takes them.
    """
    thought = _read(text, kind, knowledge, limit)
    if isinstance(thought, Refusal):
        return Review((thought,), false=1)
    others, found = [*_otherwise(thought)], [*verdicts(thought)]
    refusals = (*others, *(each.refusal for each in found if each.refusal is not None))
    read = Counter(each.sentence for each in found)
    read.update(read_otherwise(thought))
    false = {each.sentence for each in found if each.refusal is not None}
    clauses = Counter(each.sentence for each in thought.parts)
    unknown = len(clauses.keys() - read.keys())
    wrong = max(len(false), bool(refusals))
    return Review(
        tuple(dict.fromkeys(refusals)),
        true=max(0, len(clauses) - unknown - wrong),
        false=wrong,
        unknown=unknown,
        open=_written(thought, {each for each in clauses if read[each] < clauses[each]}),
    )


def _read(text: str, kind: ThoughtKind, knowledge: Knowledge, limit: int) -> Thought | Refusal:
    if len(text) > LONGEST_WORD * limit:
        return Refusal("length", f"The thought is far too long; write at most {limit} words.")
    plain = _SPACE.sub(lambda run: "\n" if "\n" in run[0] else " ", text)
    return Thought(plain, kind, limit, knowledge)


def _otherwise(thought: Thought) -> Iterator[Refusal]:
    for each in CHECKS:
        yield from each(thought)


def _written(thought: Thought, numbers: set[int]) -> tuple[str, ...]:
    """Some sentences as they are written; all, if that cannot be told."""
    pieces = [each for each in thought.phrases.sentence.split(thought.text) if each.strip()]
    if not numbers or len(pieces) <= max(numbers):
        pieces, numbers = [thought.text], {0} if numbers else set()
    return tuple(pieces[each].strip() for each in sorted(numbers))
