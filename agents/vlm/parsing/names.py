"""Names of things: reads one from the words behind a verb, and looks up which types it may mean.

Known are types, aliases in two languages, plurals, numbers and AI2-THOR's ids.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal, TypeAlias

from agents.vlm.parsing.vocabulary import ARTICLE, CLAUSE, EDGES, NO_NAME, PART_OF
from er_gym.data.names_en import MODIFIERS, NAMES_EN
from er_gym.data.names_zh import NAMES_ZH
from er_gym.data.shared_names import SHARED_EN, SHARED_ZH
from er_gym.thor import OBJECT_TYPES

MatchMethod: TypeAlias = Literal["exact", "alias", "fuzzy", "meaning", "none"]

_WORD = re.compile(r"[^\W_]+")
_NUMBER = re.compile(r"\d+$")
_PLURALS = (
    *(("ies", "y"), ("ves", "f"), ("ves", "fe"), ("s", "")),
    *((f"{end}es", end) for end in ("s", "x", "z", "ch", "sh", "o")),
)
"""Plural endings and the singular endings that replace them."""


def _key(name: str) -> str:
    return "".join(_WORD.findall(name)).casefold()


@dataclass(frozen=True)
class Entry:
    """The types that a name may stand for, and whether it is a type's own name or an alias."""

    types: tuple[str, ...]
    how: MatchMethod


def _entries() -> dict[str, Entry]:
    """All known names, by lookup key."""
    entries = {_key(name): Entry((name,), "exact") for name in OBJECT_TYPES}
    for names in (NAMES_EN, NAMES_ZH):
        for object_type, others in names.items():
            entries.update((_key(other), Entry((object_type,), "alias")) for other in others)
    for shared in (SHARED_EN, SHARED_ZH):
        entries.update((_key(name), Entry(types, "alias")) for name, types in shared.items())
    return entries


ENTRIES: Mapping[str, Entry] = _entries()


def look_up(name: str) -> Entry | None:
    """What a name stands for; None for an unknown name."""
    return next((ENTRIES[key] for key in keys_of(name) if key in ENTRIES), None)


def keys_of(name: str) -> Iterator[str]:
    """The lookup keys of a name, most likely first."""
    first, *parts = name.split("|")  # AI2-THOR's ids: Sink|-00.50|+00.90|+01.20|SinkBasin
    if parts and parts[-1][:1].isalpha():
        first = parts[-1]
    words = _WORD.findall(first.replace("_", " ").casefold())
    while words and words[-1].isdigit():  # Fridge_1, Cabinet 2
        words.pop()
    plainer = list(words)
    while len(plainer) > 1 and (plainer[0] in MODIFIERS or plainer[0].isdigit()):
        plainer.pop(0)
    # "bowl of fruit" becomes "bowl"; "slice of bread" is found as it stands before that.
    outer = plainer[: plainer.index("of")] if "of" in plainer else plainer
    for each in (words, plainer, outer):
        yield from _with_singulars(_NUMBER.sub("", "".join(each)))
    if "的" in first:  # 红色的苹果
        yield from _with_singulars(_key(first.rpartition("的")[2]))


def _with_singulars(key: str) -> Iterator[str]:
    yield key
    for plural, singular in _PLURALS:
        if key.endswith(plural):
            yield key.removesuffix(plural) + singular


def clean_name(text: str) -> tuple[str, tuple[str, ...]]:
    """A name without surrounding marks, article and clause, and the rules that this needed."""
    name = text.strip(EDGES)
    rules = ["marks"] if name != text.strip() else []
    if found := PART_OF.search(name):
        name = name[: found.start()]
        rules.append("clause")
    if found := ARTICLE.match(name):
        name = name[found.end() :]
        rules.append("article")
    if found := CLAUSE.search(name):
        name = name[: found.start()].strip(EDGES)
        rules.append("clause")
    return ("" if name.casefold() in NO_NAME else name), tuple(rules)
