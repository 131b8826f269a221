"""Reads what er-gym and the paper write in conversations: thoughts in replies, and users' messages.

The reverse of :mod:`er_gym.data.dialects`. Thoughts are split at their tags, or by the sentences
with which a dialect begins thoughts of each kind.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache

from pydantic import BaseModel, ConfigDict

from er_gym.data.chat import IMAGE
from er_gym.data.dialects import DialectTexts, dialect_names, load_dialect
from er_gym.data.exports.paper import DECISION
from er_gym.data.exports.sharegpt import FEEDBACK_TOKEN
from er_gym.data.trajectory import TAG_OF_KIND, Language, ThoughtKind, ThoughtRecord
from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.files import validated
from er_gym.tasks.reading import read_yaml

WRITER = "imported"
_KIND_OF_TAG = {tag: kind for kind, tag in TAG_OF_KIND.items()}
_TAG = re.compile(rf"<(/?)({'|'.join(_KIND_OF_TAG)})>")
_DECIDED = re.compile(rf"<{DECISION}>[^<>]*</{DECISION}>[\s.]*\Z")
_SLOT = re.compile(r"(\{(?:picture|scene|task|actions|action|feedback)\})")
_TASK = re.compile(
    r"\bTask\s*[:：]\s*(?:[\"“”'](.+?)[\"“”']\s*(?=\n|$|Available)|([^\n]+))", re.DOTALL
)
_CHINESE = re.compile(r"[\u4e00-\u9fff]")
_BEGINS = r"(?:^|(?<=[\s.!?…。！？”\"']))"
"""Where a sentence of er-gym's own may begin: what a model thinks need not end in a full stop."""
_BEGINS_SENTENCE = r"(?:^|(?<=[.!?…。！？\n])[^\S\n]*)"
_LONGEST_INSTRUCTION = 300
_FEWEST_OWN = 20
"""The fewest characters that a dialect's text has beside its slots, to be known by them."""


class StockPhrases(BaseModel):
    """The paper's stock phrases: ``configs/dialects/heard.yaml``."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    openers: dict[ThoughtKind, list[str]]
    closers: list[str]


@dataclass(frozen=True)
class UserMessage:
    """What a user's message says.

    Attributes:
        language: of the dialect's text that it is; None if it is none of er-gym's.
        task: the instruction, ``""`` if it has none.
        failed: whether it says that the last action was not done.
        feedback: the environment's answer.
    """

    language: Language | None = None
    task: str = ""
    failed: bool = False
    feedback: str = ""


def user_message(text: str, *, first: bool, shows: bool) -> UserMessage:
    """Read a user's message.

    Args:
        text: the message, with or without places of pictures.
        first: whether it is the first.
        shows: whether it shows a picture; True in a conversation without pictures.
    """
    bare = text.replace(IMAGE, "").strip()
    for language, name, pattern in _patterns():
        if (name == "first") == first and (parts := _filled(pattern, bare)) is not None:
            return UserMessage(
                language,
                parts.get("task") or "",
                name in ("failed", "astray"),
                (parts.get("feedback") or "").strip(),
            )
    if first:
        task = _TASK.search(bare)
        told = (task[1] or task[2]).strip() if task else bare.partition("\n")[0].strip()
        return UserMessage(task=told[:_LONGEST_INSTRUCTION])
    before, token, after = bare.partition(FEEDBACK_TOKEN)
    if token or not shows:
        return UserMessage(failed=True, feedback=" ".join((after or before).split()))
    return UserMessage()


def thoughts_of(reply: str, language: Language, *, first: bool) -> list[ThoughtRecord]:
    """The thoughts in a reply, by their tags or by how they begin.

    Text before the first of these is a thought, too: an analysis in the first reply, else
    reasoning.
    """
    said = _DECIDED.sub("", reply).strip()
    tagged = list(_tagged(said))
    if tagged:
        return [_thought(_KIND_OF_TAG[tag], text) for tag, text in tagged if text.strip()]
    own = _openers(language)
    kinds, pattern, closers = own if own[1].match(said) else _stock()
    said = closers.sub("", said).strip()
    places = [
        (found.start(), found.end(), found[0].strip().lower()) for found in pattern.finditer(said)
    ]
    keeps = kinds is _stock()[0]  # the paper's phrases are parts of sentences
    found: list[ThoughtRecord] = []
    head = said[: places[0][0]] if places else said
    if head.strip():
        found.append(_thought("analysis" if first else "reasoning", head))
    for number, (start, end, opener) in enumerate(places):
        stop = places[number + 1][0] if number + 1 < len(places) else len(said)
        text = said[start if keeps else end : stop]
        if text.strip():
            found.append(_thought(kinds[opener], text))
    return found


def _tagged(text: str) -> Iterator[tuple[str, str]]:
    """The tag and the text of each thought between two tags, in time linear in the text."""
    ends: dict[str, list[re.Match[str]]] = {}
    for found in _TAG.finditer(text):
        if found[1]:
            ends.setdefault(found[2], []).append(found)
    for each in ends.values():
        each.reverse()
    at = 0
    for begun in _TAG.finditer(text):
        if begun[1] or begun.start() < at:
            continue
        later = ends.get(begun[2], [])
        while later and later[-1].start() < begun.end():
            later.pop()
        if later:
            end = later.pop()
            at = end.end()
            yield begun[2], text[begun.end() : end.start()]


def language_of(text: str) -> Language:
    """Chinese if a tenth of the characters are, else English."""
    return "zh" if len(_CHINESE.findall(text)) * 10 > len(text) else "en"


def _thought(kind: ThoughtKind, text: str) -> ThoughtRecord:
    return ThoughtRecord(kind=kind, text=text.strip(), writer=WRITER)


_Openers = tuple[Mapping[str, ThoughtKind], re.Pattern[str], re.Pattern[str]]
"""Kinds by opener in small letters, the openers, and the closers."""


def _dialects() -> Iterator[tuple[Language, DialectTexts]]:
    for name in dialect_names():
        yield from load_dialect(name).texts.items()


@lru_cache(maxsize=4)
def _openers(language: Language) -> _Openers:
    """Those of er-gym's own dialects in a language."""
    kinds: dict[str, ThoughtKind] = {}
    closers: list[str] = []
    for each, texts in _dialects():
        if each == language:
            kinds |= {
                opener.lower(): kind for kind, all_ in texts.openers.items() for opener in all_
            }
            closers += texts.closers
    return kinds, _any_of(kinds, _BEGINS), _last_of(closers)


@lru_cache(maxsize=1)
def _stock() -> _Openers:
    file = config_directory("dialects") / "heard.yaml"
    stock = validated(StockPhrases, read_yaml(file), f"{file}:")
    kinds = {opener.lower(): kind for kind, openers in stock.openers.items() for opener in openers}
    return kinds, _any_of(kinds, _BEGINS_SENTENCE), _last_of(stock.closers)


def _any_of(openers: Mapping[str, ThoughtKind], begins: str) -> re.Pattern[str]:
    longest = sorted(openers, key=len, reverse=True)
    return re.compile(f"{begins}(?:{'|'.join(map(re.escape, longest))})", re.IGNORECASE)


def _last_of(closers: list[str]) -> re.Pattern[str]:
    longest = sorted(closers, key=len, reverse=True)
    ends = "|".join(map(re.escape, longest))
    return re.compile(rf"{_BEGINS}(?:{ends})[\s.!…。！]*\Z", re.IGNORECASE)


@lru_cache(maxsize=1)
def _patterns() -> tuple[tuple[Language, str, tuple[str, ...]], ...]:
    """Each text of a user in er-gym's dialects without places of pictures: its own words and the
    slots between them, in turn."""
    found: dict[tuple[Language, str, str], tuple[str, ...]] = {}
    for language, texts in _dialects():
        for name in ("first", "failed", "astray", "observed", "forward", "after"):
            text = getattr(texts, name).replace("{picture}", "").strip()
            if len(_SLOT.sub("", text)) < _FEWEST_OWN:  # it would fit anything
                continue
            found[language, name, text] = tuple(_SLOT.split(text))
    return tuple((language, name, each) for (language, name, _), each in found.items())


def _filled(pattern: tuple[str, ...], text: str) -> dict[str, str] | None:
    """What stands in the slots of a text; None if it is another text.

    Each of the pattern's own words is taken where it comes first, the last one at the end. A slot
    that comes again must hold the same. The time is linear in the text.
    """
    words, slots = pattern[::2], [name.strip("{}") for name in pattern[1::2]]
    if not slots:
        return {} if text == words[0] else None
    if not text.startswith(words[0]) or not text.endswith(words[-1]):
        return None
    last = len(text) - len(words[-1])
    at = len(words[0])
    held: dict[str, str] = {}
    for number, (slot, after) in enumerate(zip(slots, words[1:], strict=True), start=1):
        end = last if number == len(slots) else text.find(after, at, last)
        if end < at or held.setdefault(slot, text[at:end]) != text[at:end]:
            return None
        at = end + len(after)
    return held
