"""Clauses without the words of place that stand between a thing and what is said of it.

"The towel on my right is draped over the chair" says that the towel is draped over the chair. What is
denied of a place is not denied altogether, so only clauses that deny nothing are cut.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace

from er_gym.data.clauses.lexicon import Words
from er_gym.data.phrases import MARK
from er_gym.data.reading import Clause
from er_gym.data.thought import Thought
from er_gym.data.trajectory import Language

_ADJUNCTS: Mapping[Language, Words] = {
    "en": re.compile(
        rf"(?<={MARK}),?(?: (?:over|right|just|straight|here|there))*(?: (?:on|to|at|off to) (?:my|the) (?:far |immediate |near )?"
        rf"(?:left|right)(?:[- ]hand side| side)?| (?:straight |dead )?ahead(?: of me)?| (?:in front of|before|beside|behind) me"
        rf"| over there| nearby| here| there),?(?= (?:is|are|was|were|has|have|had|stands?|sits?|lies|hangs?|stays?|remains?|looks?|holds?"
        rf"|contains?)\b|'s\b)"
        rf"|^(?:back |over |once |even )*(?:at|by|beside|near|next to|in front of|over by|over at) (?:the |that |this |my )?(?:[a-z-]+ )?{MARK},? (?=i\b|the\b|my\b)"
        rf"|(?<={MARK}) (?:at|by|beside|near|next to|in front of|over by|over at) (?:the |that |this |my )?(?:[a-z-]+ )?{MARK}(?=$|[,.;!])"
    ),
    "zh": re.compile(
        rf"(?:站|走|来|跑|还|早|刚|先)?(?:在|到){MARK}(?:那边|那儿|那里|这边|这儿|这里|旁边?|边上|跟前|附近|边|面前)(?:的时候|那会儿|时(?!候)|那(?:一)?(?:回|次))?"
        rf"|(?:跟|和|与|同|连)(?:那|这)?(?:[一]?[个只张把台块条本])?{MARK}一(?:起|块儿?|道|同)"
        rf"|(?<={MARK})(?:在(?:我的?)?(?:左|右)(?:手)?边|，?就?在(?:左|右)边)，(?=门|盖)"
    ),
}


def reduced(thought: Thought) -> Iterator[Clause]:
    """The clauses that have such words, without them."""
    phrase = _ADJUNCTS[thought.known.language]
    for each in thought.parts:
        if each.negated or each.asks or not each.mentions:
            continue
        match = phrase.search(each.text)
        if match is None:
            continue
        kept = [
            mention
            for place, mention in zip(each.places, each.mentions, strict=True)
            if not match.start() <= place < match.end()
        ]
        if not kept:
            continue
        body = (each.text[: match.start()] + each.text[match.end() :]).lstrip(" ,")
        places = tuple(at for at, letter in enumerate(body) if letter == MARK)
        yield replace(each, text=body, mentions=tuple(kept), places=places)
