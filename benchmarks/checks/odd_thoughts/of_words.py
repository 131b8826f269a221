"""Odd thoughts that the words show: half sentences, strayed pronouns, the same words again."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping

from benchmarks.checks.odd_thoughts.moment import Moment, masked
from er_gym.data.mentions import Mention, all_interchangeable, find_mentions
from er_gym.data.phrases import MARK
from er_gym.data.reading import PHRASES
from er_gym.data.trajectory import Language, Trajectory
from er_gym.data.words import sentences
from er_gym.tasks import verbs
from er_gym.thor import OBJECT_TYPES

_VERBS: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        PHRASES["en"].verb.pattern
        + r"|\b(?:keeps?|gave|matche?s?|suggests|cost|comes?|belongs?|settles|matters|rules|fits"
        r"|turned|get|try|changed|said|made|happen|complete[sd]?|conclude[sd]?|no matter"
        r"|never mind|no harm done|one thing at a time|another try|one more try)\b|\w\?"
    ),
    "zh": re.compile(
        r"[是有在要去放拿看找打关开走得能可没不做处理过了想像会来到等用试回送取记切说给对比剩查收落留够结空滑算止摆靠近作顾]"
    ),
}
_HALF: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        rf"^(?:it|them|they|{MARK}|the {MARK}) (?:first|next|second|last)\b|^not .*then\b"
    ),
    "zh": re.compile(r"^(?!)"),
}
_NONE_THERE = re.compile(r"^(?:hm, |well, )?no § ")
"""Not half a sentence: people do speak like that."""


def half_sentences(at: Moment) -> Iterator[str]:
    """A sentence without a verb, or one that begins with what has none."""
    for text in at.texts:
        for sentence in sentences(text):
            plain = masked(sentence)
            whole = _VERBS[at.language].search(plain) or _NONE_THERE.search(plain)
            if not whole or _HALF[at.language].search(plain):
                yield sentence


_REFERS: Mapping[Language, tuple[tuple[re.Pattern[str], str], ...]] = {
    "en": (
        (re.compile(rf"\bthere (?P<it>it is|they are)\b(?!, the {MARK})"), "sought"),
        (re.compile(r"\b(?P<it>it|they)(?:'s| is| are) (?:within reach|close enough)"), "object"),
        (re.compile(r"^(?P<it>it|they) (?:has|have|needs|need) to go (?:in|on)"), "taken"),
        (re.compile(r"\b(?:pick|grab|take|taking) (?P<it>it|them)\b"), "taken"),
        (re.compile(r"\b(?P<it>it) shouldn't stay|(?:leave|get) (?P<it2>it) open"), "object"),
        (re.compile(r"\b(?P<it>it|they) (?:is|are) still there to be taken"), "object"),
        (re.compile(r"\b(?P<it>it) (?:has to be open|must be c)|perhaps (?P<it2>it)'s c"), "last"),
        (re.compile(r"^(?P<it>it) (?:holds|has) "), "last"),
        (re.compile(r"\b(?:put|set|bring|carry) (?P<it>it|them) (?:in|on|to|over|down)\b"), "held"),
    ),
    "zh": (
        (re.compile(r"(?P<it>它)(?:就)?在(?:§[里上]|[^手])"), "sought"),
        (re.compile(r"(?P<it>它)就在手边"), "object"),
        (re.compile(r"(?P<it>它)要放到"), "taken"),
        (re.compile(r"关好(?P<it>它)|不能让(?P<it2>它)|把(?P<it3>它)打开"), "object"),
    ),
}  # fmt: skip
"""A pronoun in its phrase, and what it means: a fact of the turn."""
_PRONOUN = re.compile(r"\b(?:it|they|them)\b|它")


def strayed_pronouns(at: Moment) -> Iterator[str]:
    """A pronoun that follows another thing than it means."""
    known = at.known
    meant = {
        "sought": known.subgoal.thing if known.decision.verb == verbs.END else known.sought,
        "object": known.decision.object_type,
        "taken": known.decision.object_type if known.decision.verb == verbs.PICKUP else "",
        "last": known.last.action.object_type if known.last else "",
        "held": known.held,
    }
    before: list[list[Mention]] = [[]]
    for text in at.texts:
        for sentence in sentences(text):
            mentions = list(find_mentions(sentence))
            plain = masked(sentence)
            marks = [place for place, letter in enumerate(plain) if letter == MARK]
            for phrase, name in _REFERS[at.language]:
                for match in phrase.finditer(plain):
                    places = (match.start(group) for group in match.re.groupindex)
                    start = max(places)
                    chained = _PRONOUN.search(plain[:start])
                    here = (
                        []
                        if chained
                        else [
                            one for one, place in zip(mentions, marks, strict=True) if place < start
                        ]
                    )
                    if meant[name] in OBJECT_TYPES and not _follows(
                        meant[name], here, before[-1], mentions
                    ):
                        yield f"{' '.join(one.text for one in before[-1][-1:])} … {sentence}"
            if mentions:
                before.append(mentions)


def _follows(
    meant: str, here: list[Mention], before: list[Mention], sentence: list[Mention]
) -> bool:
    """Whether a pronoun can mean a type: it was named last, or first in that sentence; or nothing
    was named, and the sentence itself names it."""
    names = here or before
    candidates = [names[0], names[-1]] if names else sentence[:1]
    types = all_interchangeable([meant])
    return any(each.types & types for each in candidates)


_LOOKS: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(
        r"look(?:ing)? around|turn (?:around )?once|turn on the spot|every direction|both sides"
    ),
    "zh": re.compile(r"环顾|看一圈|观察一下左右"),
}
_CLAUSE: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(r"[.,;:?!]\s*|\s(?:so|because|since|and)\s|^since "),
    "zh": re.compile(r"[。，；：？！]|^因为|^既然|^所以"),
}
_WORDS: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(rf"[\w']+|{MARK}"),
    "zh": re.compile(r"\S"),
}
_ALIKE: Mapping[Language, int] = {"en": 5, "zh": 6}
"""So many words, or Chinese characters, in a row are the same words."""


def same_reasons(at: Moment) -> Iterator[str]:
    """A look around is explained in words that explained one before, in this episode."""
    if at.turn.purpose != "look around":
        return
    said: set[str] = set()
    for turn in at.trajectory.turns[: at.index]:
        if turn.purpose == "look around":
            for thought in turn.thoughts:
                said.update(reasons(thought.text, at.language))
    for text in at.texts:
        mine = reasons(text, at.language)
        yield from (each for each in mine if each in said)
        said.update(mine)


def reasons(text: str, language: Language) -> list[str]:
    """The rows of words in a thought that tell why the agent looks around."""
    found = []
    for part in _CLAUSE[language].split(masked(text)):
        if part and not _LOOKS[language].search(part):
            words = _WORDS[language].findall(part)
            rows = range(len(words) - _ALIKE[language] + 1)
            found += [" ".join(words[k : k + _ALIKE[language]]) for k in rows]
    return found


_OPENS: Mapping[Language, re.Pattern[str]] = {
    "en": re.compile(r"^(?:so |now |then |since |because )+"),
    "zh": re.compile(r"^(?:那么|现在|我这就|我就|我)+"),
}


def closer(trajectory: Trajectory) -> str:
    """The last clause of an episode's thoughts, with a mark for each name; ``""`` for none."""
    thoughts = trajectory.turns[-1].thoughts
    if not thoughts:
        return ""
    parts = [part.strip() for part in _CLAUSE[trajectory.language].split(masked(thoughts[-1].text))]
    last = next((part for part in reversed(parts) if part), "")
    return _OPENS[trajectory.language].sub("", last)
