"""Sentences as the clause readers see them, and what they judge."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

from er_gym.data.clauses.adjuncts import reduced
from er_gym.data.clauses.lexicon import Lexicon, Words
from er_gym.data.clauses.lexicon_en import LEXICON as ENGLISH
from er_gym.data.clauses.lexicon_zh import LEXICON as CHINESE
from er_gym.data.mentions import Mention
from er_gym.data.phrases import MARK
from er_gym.data.pronouns import resolved
from er_gym.data.reading import Clause
from er_gym.data.thought import Refusal, Thought
from er_gym.data.trajectory import Language

LEXICONS: dict[Language, Lexicon] = {"en": ENGLISH, "zh": CHINESE}


@dataclass(frozen=True)
class Verdict:
    """A claim that was judged.

    Attributes:
        sentence: the number of its sentence.
        refusal: why it is false; None if it is true.
    """

    sentence: int
    refusal: Refusal | None = None


@dataclass(frozen=True)
class Span:
    """A text with the names in it: a clause, or a sentence as a whole.

    Attributes:
        text: in lower case, with marks.
        mentions, places: the names, and where their marks stand.
        sentence: its number.
        clauses: what it consists of.
    """

    text: str
    mentions: tuple[Mention, ...]
    places: tuple[int, ...]
    sentence: int
    clauses: tuple[Clause, ...]

    def named(self, match: re.Match[str], group: str) -> Mention | None:
        """The name in a group of a match, None if there is none."""
        if group not in match.re.groupindex or match.start(group) < 0:
            return None
        return self.first(match.start(group), match.end(group))

    def matches_of(self, phrases: Iterable[Words], of_other: Words) -> Iterator[re.Match[str]]:
        """Every match of some phrases but those that begin with the place of another thing.

        "The egg from the fridge is in my hand" tells nothing of the fridge.
        """
        for match in self.matches(phrases):
            before = self.text[: match.start()]
            begins = self.text[match.start() : match.start() + 1] == MARK
            if not (begins and MARK in before and of_other.search(before)):
                yield match

    def first(self, start: int, end: int) -> Mention | None:
        """The first name in a part of the text."""
        return next(iter(self.among(start, end)), None)

    def among(self, start: int, end: int) -> list[Mention]:
        """All names in a part of the text."""
        pairs = zip(self.places, self.mentions, strict=True)
        return [mention for place, mention in pairs if start <= place < end]

    def matches(self, phrases: Iterable[Words]) -> Iterator[re.Match[str]]:
        """Every match of some phrases, all of which have a name in them."""
        if not self.mentions:
            return
        for phrase in phrases:
            yield from phrase.finditer(self.text)


def lexicon_of(thought: Thought) -> Lexicon:
    """The words of a thought's language."""
    return LEXICONS[thought.known.language]


def clauses_of(thought: Thought) -> Sequence[tuple[Clause, Span]]:
    """Each clause of a thought, as a span too."""
    found: Sequence[tuple[Clause, Span]] | None = thought.kept.get("clauses")
    if found is None:
        found = thought.kept["clauses"] = [
            (each, Span(each.text, each.mentions, each.places, each.sentence, (each,)))
            for each in (*thought.parts, *resolved(thought), *reduced(thought))
        ]
    return found


def sentences_of(thought: Thought) -> Sequence[Span]:
    """Each sentence of a thought as a whole."""
    found: Sequence[Span] | None = thought.kept.get("sentences")
    if found is None:
        found = thought.kept["sentences"] = [*_sentences(thought)]
    return found


def _sentences(thought: Thought) -> Iterator[Span]:
    groups: dict[int, list[Clause]] = {}
    for each in thought.clauses:
        groups.setdefault(each.sentence, []).append(each)
    for number, clauses in groups.items():
        text = thought.sentences[number]
        mentions = tuple(one for each in clauses for one in each.mentions)
        places = tuple(at for at, letter in enumerate(text) if letter == MARK)
        yield Span(text, mentions, places, number, tuple(clauses))


def is_told(clause: Clause) -> bool:
    """Whether a clause tells something of what is or was: no question, guess, or condition."""
    return not clause.guessed
