"""The grounded writer: it composes thoughts from what the agent knows, without a model."""

from __future__ import annotations

import random
import re
from collections.abc import Collection, Sequence
from typing import Any

from agents.expert.writers.base import ThoughtRequest, WrittenThoughts
from agents.expert.writers.facts import facts_of
from agents.expert.writers.grammar import Writing, grammar
from agents.expert.writers.nouns import nouns
from er_gym.data.trajectory import Language, ThoughtKind, ThoughtRecord

FULLNESS = (0.65, 0.65, 0.3, 0.0, 0.0, 0.0)
"""The probability of optional parts at each try to stay below the limit."""
_SENTENCE = {
    "en": re.compile(r"(?<=[.!?])\"?\s+(?=[\"A-Z])"),
    "zh": re.compile(r"(?<=[。！？])"),
}
_CLAUSE = {
    "en": re.compile(r"[.,;:?!]\s*|\s(?:so|because|since|and)\s"),
    "zh": re.compile(r"[。，；：？！]"),
}
_REASON = {"en": 20, "zh": 6}
"""Letters from which a clause says something of its own."""
_WORD_START = re.compile(r"((?:^|[.!?]\s+)\"?)([a-z])")
_HAN = re.compile(r"[一-鿿]")


class GroundedWriter:
    """Composes thoughts from a grammar of wordings and the facts of a turn.

    It states only what the request's knowledge contains. Equal requests get equal texts. The
    wordings are data, in ``configs/thoughts``.
    """

    name = "grounded"

    def write(self, request: ThoughtRequest) -> WrittenThoughts:
        """Write the thoughts of a turn; see :class:`~agents.expert.writers.base.ThoughtWriter`."""
        knowledge = request.knowledge
        choices = random.Random(request.seed)
        facts = facts_of(knowledge, choices)
        language = knowledge.language
        earlier = [thought.text for turn in knowledge.earlier for thought in turn]
        writing = Writing(grammar(language), nouns(language, "\n".join(earlier)), choices)
        said = {clause for text in earlier for clause in clauses(text, language)}
        thoughts = []
        for index, (kind, limit) in enumerate(zip(request.kinds, request.limits, strict=True)):
            place = {"first": index == 0, "final": index == len(request.kinds) - 1}
            place["told"] = index > 0 or facts.get("told", False)
            text = _fitting(writing, kind, {**facts, **place}, limit, language, said)
            said.update(clauses(text, language))
            thoughts.append(ThoughtRecord(kind=kind, text=text, writer=self.name))
        return WrittenThoughts(tuple(thoughts))


def _fitting(
    writing: Writing,
    kind: ThoughtKind,
    facts: dict[str, Any],
    limit: int,
    language: Language,
    said: Collection[str],
) -> str:
    """A thought within the limit that, if possible, says nothing in the same words again."""
    shortest, best, least = "", "", 0
    before = set(writing.mentioned)
    for fullness in FULLNESS:
        writing.fullness = fullness
        writing.mentioned = set(before)
        writing.nouns.forget()
        text = polished(writing.write(kind, facts), language)
        if length_in_words(text, language) <= limit:
            parts = clauses(text, language)
            again = len(parts) - len({*parts}.difference(said))
            if not again:
                return text
            if not best or again < least:
                best, least = text, again
        if not shortest or length_in_words(text, language) < length_in_words(shortest, language):
            shortest = text
    return best or _cut(sentences(shortest, language), limit, language)


def _cut(parts: Sequence[str], limit: int, language: Language) -> str:
    """The last sentences, which hold the decision, that fit into the limit; at least one."""
    space = "" if language == "zh" else " "
    while len(parts) > 1 and length_in_words(space.join(parts), language) > limit:
        parts = parts[1:]
    return space.join(parts)


def polished(text: str, language: Language) -> str:
    """A composed text with spaces and capital letters where they belong."""
    if language == "zh":
        return re.sub(r"\s+", "", text) if text.isascii() is False else text
    text = " ".join(text.split())
    text = re.sub(r"\s+([.,;:?!])", r"\1", text)
    return _WORD_START.sub(lambda found: found[1] + found[2].upper(), text)


def sentences(text: str, language: Language) -> list[str]:
    """The sentences of a text."""
    return [part.strip() for part in _SENTENCE[language].split(text) if part.strip()]


def clauses(text: str, language: Language) -> list[str]:
    """The sentences of a text, and its longer clauses in lower case, each once."""
    parts = (part.strip().lower() for part in _CLAUSE[language].split(text))
    long = (part for part in parts if len(part) >= _REASON[language])
    return [*dict.fromkeys((*sentences(text, language), *long))]


def length_in_words(text: str, language: Language) -> int:
    """The length in words; in Chinese two characters count as a word."""
    han = len(_HAN.findall(text)) if language == "zh" else 0
    rest = _HAN.sub(" ", text) if han else text
    return len(rest.split()) + (han + 1) // 2
