"""Clauses that name nothing, read with the name of what they speak of.

A pronoun stands for the one thing that was named before it. A sentence that only names or asks after
one thing ("The card?", "信用卡呢？") sets a topic: what follows speaks of it, with a pronoun or none.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from er_gym.data.mentions import Mention
from er_gym.data.phrases import MARK
from er_gym.data.reading import Clause
from er_gym.data.thought import Thought
from er_gym.data.trajectory import Language

_STANDS_FOR: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"^(?P<start>(?:and|but|so|no|yes|now|well|,| )*)(?P<it>it|they|both)(?=\b)"
        r"|(?<=see )(?P<none>none)(?=$|[,.;!]| (?:anywhere|here|in sight|in view"
        r"|around|that i can see))"
        r"|\b(?P<one>(?:of |see |seen |noticed |spotted )(?:one|it))"
        r"(?=$|[,.;!]| (?:anywhere|since))"
        r"|\b(?P<only>(?:only|just|no more than|nothing but) (?:one|a single one))"
        r"(?=$|[,.;!]| (?:around|here|in|to be seen))"
    ),
    "zh": re.compile(r"(?P<it>它(?!们|的(?!影|踪)|这|那|里|上))"),
}
"""A pronoun for a thing that was named before."""
_AS_OBJECT: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"(?<=[a-z] )(?P<it>it|them|that one)(?=$|[,.;!?]| (?:in|on|up|down|into|from|out|off|with|to|back|away|now|yet|and"
        r"|at|for|over|open|shut|closed|firmly|tight|tightly|safely|already|as|so|since|before|while)\b)"
    ),
    "zh": re.compile(r"(?!)"),
}
"""The same in the middle of a clause."""
PRONOUN = -1
"""Where the mention of a pronoun starts: nowhere in the text."""
_MOST = 3
"""So many things a pronoun may stand for: what is said must be false of each."""
_OF_TOPIC: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"\b(?P<none>none|nothing of the (?:sort|kind)|nowhere|no such thing)\b"
        r"|\b(?P<only>(?:no more than|only|just|but) (?:one|a single one)|a single one)\b"
        r"|\b(?P<one>one|any|anything of the (?:sort|kind))(?= (?:has|have|is|ever|here|around|yet|since|in"
        r"|on|at|before|so far)\b| i\b|$|[,.;!])"
        r"|\b(?P<it>it|they|them|that one|those)(?!(?:'s| is| was) (?:(?:a|an) (?:pity|shame|relief|good thing|wonder"
        r"|question|matter|start|chance)|no (?:use|wonder|good|matter)|time|clear|odd|only)\b)(?=\b)"
    ),
    "zh": re.compile(r"(?P<it>它们?|那东西|这东西)(?![这那])"),
}
"""The same after a sentence that sets a topic, at any place."""
_NO_SUBJECT: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"^(?:no|yes|well|and|but|so|oh|,|;|:|-| )*(?:(?:not|still|already|never|yet|no longer|nowhere|safely|right"
        r"|just|now|firmly|wide|in|on|under|beside|behind|gone|done|here|there|closed|shut|open|off|lit|straight"
        r"|to my|over|ahead|left|back|up|down)\b)"
    ),
    "zh": re.compile(
        r"^(?:不|没|还|就|早|已|正|都|也|压根|根本|一直|至今|刚|在|从|放|躺|搁|摆|明明|好好|稳|牢|我(?:没|还|已|刚|早|就|一直|从|正|压根|也|都))"
    ),
}
"""How a clause begins that leaves out what it is about."""
_ANSWERS: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(r"(?!)"),
    "zh": re.compile(r"^(?:也|都|还)?没有[。，！]?$"),
}
"""No: to whatever was asked."""
_PART_OF: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(r"^(?:and |but |with |yet )*(?:its|the) (?:doors?|lid|cover|screen)\b '?"),
    "zh": re.compile(
        r"^(?:而且|可|但|连)?(?:它的)?(?:柜门|门|盖子?|屏幕|抽屉门)(?=[^，。]{0,4}(?:开|关|敞|合|掀|盖|闭))"
    ),
}
"""A part of the thing before, whose state is that of the thing."""
_RECALLS: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(r"(?!)"),
    "zh": re.compile(
        r"^(?:我?(?:还)?记得|我(?:刚才|先前|之前|当时|早先)|刚才|先前|之前|原先|原来|当时|明明|本来)"
    ),
}
"""How a clause begins that goes on to tell where the topic was."""
_ONLY_NAMES: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        rf"^(?:and |but |now |so |as for |what about |how about |ah |oh |well |the |a |an |my |that |this |any |some|,| |[a-z]+ (?={MARK}))*"
        rf"{MARK}(?:, {MARK})*[?.!:…,; ]*$"
    ),
    "zh": re.compile(
        rf"^(?:那|这|至于|说到|说起|我的|要找的|[\u4e00-\u9fff]{{0,3}}的)?(?:[\u4e00-\u9fff]{{1,2}})?{MARK}(?:呢|嘛|啊|么)?[？?。！!…，]*$"
    ),
}
"""A sentence that names one thing and says nothing of it."""
_CALLS: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(rf"^(?:and |but |now |as for |what about )*(?:the |my |that )?{MARK}:$"),
    "zh": re.compile(
        rf"^(?:至于|说到|而|那)?(?:[一]?[个只张把台块条本支])?(?:[\u4e00-\u9fff]{{1,4}}的)?{MARK}(?:呢|嘛|么|啊)?[，,]$"
    ),
}
"""A clause that does so within a sentence."""
_REACH = 2
"""So many sentences speak of a topic."""


@dataclass
class _Topic:
    mention: Mention | None = None
    sentence: int = -9


def resolved(thought: Thought) -> Sequence[Clause]:
    """Clauses that speak of the one thing that was named before, with its name in the place of the
    pronoun."""
    found: Sequence[Clause] | None = thought.kept.get("resolved")
    if found is None:
        found = thought.kept["resolved"] = [*_resolved(thought)]
    return found


def _resolved(thought: Thought) -> Iterator[Clause]:
    language = thought.known.language
    last: tuple[Mention, ...] = ()
    named_in = -1
    topic = _Topic()
    for each in thought.parts:
        near = each.sentence - named_in <= 1
        if each.mentions:
            match = _STANDS_FOR[language].search(each.text)
            before = _meant(last)
            if match and match.start() == 0 and match["it"] and before and near:
                yield _with(each, before, match)
            within = topic.sentence == each.sentence
            if topic.mention and within and _RECALLS[language].match(each.text):
                yield _named(each, topic.mention, MARK + each.text)
            last = (*last, *each.mentions) if named_in == each.sentence else each.mentions
            named_in = each.sentence
            whole = [one for one in thought.parts if one.sentence == each.sentence]
            kinds = {mention.types for part in whole for mention in part.mentions}
            sets = len(kinds) == 1 and (
                each.asks or (len(whole) == 1 and _ONLY_NAMES[language].match(each.text))
            )
            sets = sets or (len(each.mentions) == 1 and bool(_CALLS[language].search(each.text)))
            topic = _Topic(each.mentions[-1], each.sentence) if sets else _Topic()
            continue
        part = _PART_OF[language].match(each.text)
        if part and near and (before := _meant(last)) and not each.asks:
            yield _named(each, before, MARK + " " * (language == "en") + each.text[part.end() :])
            continue
        about = 0 <= each.sentence - topic.sentence <= _REACH
        if about and topic.mention and not each.asks:
            match = _OF_TOPIC[language].search(each.text)
            if match:
                yield _with(each, topic.mention, match)
            elif not _ANSWERS[language].match(each.text) and _NO_SUBJECT[language].match(each.text):
                yield _named(each, topic.mention, MARK + " " * (language == "en") + each.text)
            continue
        match = _STANDS_FOR[language].search(each.text) or _AS_OBJECT[language].search(each.text)
        before = _meant(last)
        if match is not None and before and near:
            yield _with(each, before, match)


def _meant(last: tuple[Mention, ...]) -> Mention | None:
    """What a pronoun stands for: one thing, or one of a few."""
    kinds = {mention.types for mention in last}
    if not kinds or len(kinds) > _MOST:
        return None
    if len(kinds) == 1:
        return replace(last[-1], start=PRONOUN)
    text = "/".join(dict.fromkeys(mention.text for mention in last))
    return replace(last[-1], start=PRONOUN, text=text, types=frozenset().union(*kinds))


def _with(each: Clause, mention: Mention, match: re.Match[str]) -> Clause:
    """A clause with a name for its pronoun."""
    said = {name: text for name, text in match.groupdict().items() if text}
    pronoun = match.group()
    if "only" in said:
        text = f"only one {MARK}"
    elif "none" in said:
        text = f"no {MARK}"
    elif "one" in said:
        first = pronoun.split()[0]
        text = f"{first} a {MARK}" if " " in pronoun else f"a {MARK}"
    else:
        text = f"{said.get('start', '')}{MARK}"
    return _named(each, mention, each.text[: match.start()] + text + each.text[match.end() :])


def _named(each: Clause, mention: Mention, body: str) -> Clause:
    places = tuple(at for at, letter in enumerate(body) if letter == MARK)
    at = next((k for k, place in enumerate(places) if _is_new(each, body, place)), 0)
    mentions = (*each.mentions[:at], mention, *each.mentions[at:])
    return replace(each, text=body, mentions=mentions, places=places)


def _is_new(each: Clause, body: str, place: int) -> bool:
    """Whether the mark at a place is none of the clause's own."""
    return each.text[:place] == body[:place] and each.text[place : place + 1] != MARK
