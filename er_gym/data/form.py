"""The critic's checks of a thought's form: its length, language and marks."""

from __future__ import annotations

import re
from collections.abc import Iterator

from er_gym.data.mentions import find_mentions
from er_gym.data.thought import Refusal, Thought
from er_gym.thor import OBJECT_TYPES

_FEWEST = 2
"""Words."""
_HAN = re.compile(r"[\u3400-\u4dbf\u4e00-\u9fff]")
_OTHER_SCRIPTS = re.compile(r"[\u0370-\u1fff\u3040-\u30ff\uac00-\ud7af]")
"""Greek to Cyrillic, Arabic and Indian scripts; Japanese kana; Korean."""
_LATIN = re.compile(r"[A-Za-z]+(?:['’][A-Za-z]+)?")
_MARKUP = re.compile(
    r"</?[A-Za-z_|][^<>\n]{0,40}>|<\|[^<>\n]{0,40}|\[/?(?:INST|SYS|IMG|image)\]"
    r"|</?(?:think|Observation|Thinking|Planning|Reflection|Verification|DecisionMaking)\b"
)
_HEADING = re.compile(
    r"^\s{0,3}#{1,6}\s|```|^[^\S\n]*(?:---|===)[^\S\n]*$|^[^\S\n]*[{\[]\s*[\"{]", re.MULTILINE
)
_ANSWERED = re.compile(r"提示(?:说|告诉)")
"""After a failed action, it speaks of the answer to it rather than of the hint."""
_PLAIN = re.compile(r"[\W_]+")
_MOST_LATIN = 2
"""So many words of Latin letters may stand in a Chinese thought beside object types: OK, TV ..."""
_FEW_FOREIGN = 3
"""So many different words of another language are no coincidence."""


def thought_length(text: str) -> int:
    """The length of a thought in words; in Chinese, two characters count as one, rounded up."""
    han = len(_HAN.findall(text))
    return (han + 1) // 2 + len(_HAN.sub(" ", text).split()) - _lonely(text)


def _lonely(text: str) -> int:
    """Pieces between characters that are punctuation only."""
    return sum(1 for each in _HAN.sub(" ", text).split() if not re.search(r"\w", each))


def check_length(thought: Thought) -> Iterator[Refusal]:
    """Empty, shorter than two words, or over the limit."""
    count = thought_length(thought.text)
    if not thought.text.strip():
        yield Refusal("length", "The thought is empty; write a sentence.")
    elif count < _FEWEST:
        yield Refusal("length", f"The thought has {count} words; write at least {_FEWEST}.")
    elif count > thought.limit:
        yield Refusal("length", f"The thought has {count} words; write at most {thought.limit}.")


def check_language(thought: Thought) -> Iterator[Refusal]:
    """It is not in the language that was asked for, or mixes two languages."""
    text = thought.text
    other = _OTHER_SCRIPTS.search(text)
    if thought.known.language == "zh":
        rest = text
        for name in find_mentions(text):
            if name.text in OBJECT_TYPES:
                rest = rest.replace(name.text, " ")
        latin = _LATIN.findall(rest)
        if other or len(latin) > _MOST_LATIN or (latin and not _HAN.search(text)):
            yield Refusal("language", "Write in Chinese only; object types may stay as spelled.")
        return
    foreign = {each.lower() for each in thought.phrases.foreign.findall(text.lower())}
    if other or _HAN.search(text) or len(foreign) >= _FEW_FOREIGN:
        yield Refusal("language", "Write in English only.")


def check_tags(thought: Thought) -> Iterator[Refusal]:
    """Marks that are no part of a thought: tags, names of speakers or of kinds, headings."""
    found = (
        _MARKUP.search(thought.text)
        or _HEADING.search(thought.text)
        or thought.phrases.labels.search(thought.text)
    )
    if found:
        yield Refusal(
            "tags",
            f"Leave out {found.group().strip()!r}: write the thought alone, without tags, names of "
            "speakers or headings.",
        )


def check_leak(thought: Thought) -> Iterator[Refusal]:
    """Mentions the prompt, the data or itself as a model, or contains an error's text."""
    refused = any(not each.success for each in thought.known.actions)
    found = next(
        (
            each
            for each in thought.phrases.leak.finditer(thought.text.lower().replace("’", "'"))
            if not (refused and _ANSWERED.match(each.group()))
        ),
        None,
    )
    if found:
        yield Refusal(
            "leak",
            f"Leave out “{found.group().strip()}”: the agent knows only the task and what it saw "
            "and did.",
        )


def check_repeat(thought: Thought) -> Iterator[Refusal]:
    """The text of an earlier thought of the episode."""
    plain = _PLAIN.sub("", thought.text).casefold()
    for turn in thought.known.earlier:
        for earlier in turn:
            if plain and _PLAIN.sub("", earlier.text).casefold() == plain:
                yield Refusal(
                    "repeat", "This is word for word an earlier thought; say what is new now."
                )
                return
