"""What a generated task's name says, read back, so that it can be said in other words."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache

from er_gym.tasks.room_kinds import HOUSE, ROOM_KINDS
from er_gym.tasks.wordings.english import ENGLISH


@dataclass(frozen=True)
class Place:
    """A place of an object: in or on a type of receptacle.

    Attributes:
        preposition: ``in`` or ``on``.
        type: of the receptacle.
    """

    preposition: str
    type: str


@dataclass(frozen=True)
class Thing:
    """An object that a task is about.

    Attributes:
        type: its type.
        place: where it is, if that tells it from others of its type.
    """

    type: str
    place: Place | None = None


@dataclass(frozen=True)
class Told:
    """What a name says.

    Attributes:
        kind: of :attr:`~er_gym.tasks.wordings.grammar.Grammar.sentences`, or ``in order``.
        things: one, or the two of two transfers; none for ``in order``.
        places: where they are to be put.
        room: the kind of room; ``way``: ``on`` or ``off``; both ``""`` if the name says none.
        clauses: for ``in order``, the clauses in English, as imperatives.
    """

    kind: str
    things: tuple[Thing, ...] = ()
    places: tuple[Place, ...] = ()
    room: str = ""
    way: str = ""
    clauses: tuple[str, ...] = ()


IN_ORDER = "in order"
"""The kind of a task whose name joins clauses."""

_FIELDS: Mapping[str, str] = {
    "object": r"(?P<object>\w+)(?: that (?:is|are) (?P<object_in>in|on) the (?P<object_at>\w+))?",
    "place": r"(?P<place_in>in|on) the (?P<place>\w+)",
    "room": f"(?P<room>{'|'.join((*ROOM_KINDS, HOUSE))})",
    "way": r"(?P<way>on|off)",
}
_NEXT = re.compile(r"\. (?:Then|After that|Finally), ")


@cache
def _patterns() -> Mapping[str, re.Pattern[str]]:
    """The name of each kind of task, with its fields as groups."""
    found = {}
    for kind, sentences in ENGLISH.sentences.items():
        pattern = re.escape(sentences.whole.seen[0])
        for field, words in _FIELDS.items():
            pattern = pattern.replace(rf"\{{{field}\}}", words)
            other = re.sub(r"P<", "P<second_", words)
            pattern = pattern.replace(rf"\{{second_{field}\}}", other)
        found[kind] = re.compile(pattern)
    return found


@lru_cache(maxsize=4096)
def told_by(name: str) -> Told | None:
    """What the name of a generated task says; None for other names."""
    for kind, pattern in _patterns().items():
        if match := pattern.fullmatch(name):
            said = match.groupdict()
            prefixes = ("", "second_")
            return Told(
                kind,
                tuple(_thing(said, p) for p in prefixes if said.get(f"{p}object")),
                tuple(
                    Place(said[f"{p}place_in"], said[f"{p}place"])
                    for p in prefixes
                    if said.get(f"{p}place")
                ),
                said.get("room") or "",
                said.get("way") or "",
            )
    if name.startswith("First, ") and name.endswith("."):
        return Told(IN_ORDER, clauses=tuple(_NEXT.split(name[len("First, ") : -1])))
    return None


def _thing(said: Mapping[str, str], prefix: str) -> Thing:
    at = said[f"{prefix}object_at"]
    return Thing(said[f"{prefix}object"], Place(said[f"{prefix}object_in"], at) if at else None)
