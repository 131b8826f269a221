"""Splits clauses further, so that each part has its own polarity and tense.

:func:`er_gym.data.reading.read` keeps what has no verb with the clause before it; for polarity that
is too coarse: "two bins stand to the left, neither of which matters" denies nothing of the bins.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace

from er_gym.data.phrases import MARK, Phrases
from er_gym.data.reading import Clause

_AT = re.compile(
    r",\s+(?=(?:neither|none|nor|which|hardly|plain|and no|and yet no|yet no|and nothing|not|no|that|where|who|i|i'm"
    r"|i've|i'll|so|but|though|with|there|it|it's|yet|because|since|as|let|let's|nothing|having|then"
    r"|and i|and then|and now|and that|and so|and there|and it|now|only to|hence|one)\b)"
    r"|\s+but\s+(?=i\b|no\b|not\b|it\b|there\b)|\s+and\s+(?=neither\b|none\b|nothing\b|never\b|not\b)"
)
"""What follows is no item of a list."""


def parts_of(clause: Clause, phrases: Phrases) -> Iterator[Clause]:
    """The parts of a clause. What is guessed, wanted or a condition stays so up to its end."""
    begin = 0
    before: Clause | None = None
    ends = [match.start() for match in _AT.finditer(clause.text)]
    if not ends:
        yield clause
        return
    for end in (*ends, len(clause.text)):
        text = clause.text[begin:end]
        inside = [
            (place - begin, mention)
            for place, mention in zip(clause.places, clause.mentions, strict=True)
            if begin <= place < end
        ]
        part = replace(
            clause,
            text=text.lstrip(" ,"),
            mentions=tuple(mention for _, mention in inside),
            places=(),
            hedged=_now_or_before(phrases.hedge, text, before is not None and before.hedged),
            negated=bool(phrases.negation.search(text)),
            conditional=_now_or_before(
                phrases.condition, text, before is not None and before.conditional
            ),
            wanted=_now_or_before(phrases.goal, text, before is not None and before.wanted),
            usual=_now_or_before(phrases.custom, text, before is not None and before.usual),
            past=bool(phrases.past.search(text)),
            intended=_now_or_before(
                phrases.intention, text, before is not None and before.intended
            ),
            it=before.mentions[0] if before and len(before.mentions) == 1 else clause.it,
        )
        places = tuple(at for at, letter in enumerate(part.text) if letter == MARK)
        yield replace(part, places=places)
        begin, before = end, part


def _now_or_before(phrase: re.Pattern[str], text: str, before: bool) -> bool:
    return before or phrase.search(text) is not None
