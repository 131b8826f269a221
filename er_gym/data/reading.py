"""Parses a thought: its clauses, their subjects, and whether each states a fact.

A clause states a fact unless it is a question, a negation, a guess, a plan, a condition, or about
what is usual.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from er_gym.data.mentions import Mention, find_mentions
from er_gym.data.phrases import MARK, Phrase, Phrases
from er_gym.data.phrases_en import PHRASES as ENGLISH
from er_gym.data.phrases_zh import PHRASES as CHINESE
from er_gym.data.trajectory import Language

PHRASES: dict[Language, Phrases] = {"en": ENGLISH, "zh": CHINESE}
_AND = ("and ", "but ", "while ", "，")
_SPACES = re.compile(r"[ \t\r\f\v]+")


@dataclass(frozen=True)
class Clause:
    """A part of a sentence that makes one statement.

    Attributes:
        text: in lower case, each name a :data:`~er_gym.data.phrases.MARK`.
        mentions: the names, in order.
        sentence, last: the number of its sentence, and whether that is the last one.
        asks, hedged, negated, conditional, wanted, usual, past, intended: in which sense it is
            said.
        it: what "it" is at its beginning, if the clause before says so.
    """

    text: str
    mentions: tuple[Mention, ...]
    sentence: int
    last: bool
    asks: bool
    hedged: bool
    negated: bool
    conditional: bool
    wanted: bool
    usual: bool
    past: bool
    intended: bool
    it: Mention | None = None
    places: tuple[int, ...] = field(default=())

    @property
    def guessed(self) -> bool:
        """Whether it makes no claim about the present state."""
        return self.asks or self.hedged or self.conditional or self.usual

    @property
    def is_fact(self) -> bool:
        """Whether it claims that something is so."""
        return not (self.guessed or self.negated or self.intended)

    def among(self, start: int, end: int) -> list[Mention]:
        """The names in a part of the text."""
        pairs = zip(self.places, self.mentions, strict=True)
        return [mention for place, mention in pairs if start <= place < end]

    def says_before(self, phrase: Phrase, place: int) -> bool:
        """Whether a phrase stands before a place in the text."""
        return phrase.search(self.text, 0, place) is not None

    def named(self, match: re.Match[str], *groups: str) -> list[Mention]:
        """The names in the groups of a match; groups that it does not have count as empty."""
        spans = (match.span(group) for group in groups if group in match.re.groupindex)
        return [mention for start, end in spans if start >= 0 for mention in self.among(start, end)]


def read(text: str, language: Language) -> tuple[Clause, ...]:
    """The clauses of a thought."""
    phrases = PHRASES[language]
    mentions = find_mentions(text)
    masked = _masked(text, mentions)
    queue = list(mentions)
    sentences = [each for each in _parts(masked, phrases.sentence) if each.strip()]
    found: list[Clause] = []
    for number, sentence in enumerate(sentences):
        sentence = phrases.aside.sub("", sentence)
        asks = bool(phrases.question.search(sentence))
        before: tuple[Mention, ...] = ()
        parts = _clauses(sentence, phrases)
        asking = False
        supposed = coming = bool(phrases.coming.search(sentence))
        for k, part in enumerate(parts):
            count = part.count(MARK)
            mine, queue = tuple(queue[:count]), queue[count:]
            body = part.strip()
            asking = asking or bool(phrases.asking.search(body))
            if phrases.contrast.search(body):
                supposed = coming
            supposed = supposed or bool(phrases.supposition.search(body))
            found.append(
                Clause(
                    text=body,
                    mentions=mine,
                    sentence=number,
                    last=number == len(sentences) - 1,
                    asks=asks and (asking or k == len(parts) - 1),
                    hedged=bool(phrases.hedge.search(body)),
                    negated=bool(phrases.negation.search(body)),
                    conditional=supposed or bool(phrases.condition.search(body)),
                    wanted=bool(phrases.goal.search(body)),
                    usual=bool(phrases.custom.search(body)),
                    past=bool(phrases.past.search(body)),
                    intended=bool(phrases.intention.search(body)),
                    it=before[0] if len(before) == 1 else None,
                    places=tuple(k for k, letter in enumerate(body) if letter == MARK),
                )
            )
            before = (*before, *mine)
            if phrases.contrast_after.search(body):
                supposed = coming
    return tuple(found)


def _masked(text: str, mentions: tuple[Mention, ...]) -> str:
    """The text in lower case with a mark for each name."""
    pieces, end = [], 0
    for mention in mentions:
        pieces += [text[end : mention.start].replace(MARK, " "), MARK]
        end = mention.end
    pieces.append(text[end:].replace(MARK, " "))
    plain = "".join(pieces).lower().replace("’", "'")
    return _SPACES.sub(" ", plain)


def _parts(text: str, at: Phrase) -> Iterator[str]:
    """The parts of a text, each with what ends it."""
    begin = 0
    for match in at.finditer(text):
        yield text[begin : match.end()]
        begin = match.end()
    yield text[begin:]


def _clauses(sentence: str, phrases: Phrases) -> list[str]:
    """The clauses of a sentence. What has no verb belongs to the clause before it."""
    clauses: list[str] = []
    waiting = ""  # words without a verb or a name, such as "on my left,"
    for each in _parts(sentence, phrases.clause):
        part, waiting = waiting + each, ""
        begins = not clauses or clauses[-1].endswith(_AND)
        if begins and MARK not in part and not phrases.verb.search(part):
            waiting = part
        elif clauses and not (phrases.verb.search(part) and phrases.verb.search(clauses[-1])):
            clauses[-1] += part
        else:
            clauses.append(part)
    if waiting:
        clauses[-1:] = [*clauses[-1:], waiting] if not clauses else [clauses[-1] + waiting]
    return clauses
