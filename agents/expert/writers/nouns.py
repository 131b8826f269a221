"""Object types in words: "a mug", "the fridge", "on the coffee table", "一把椅子", "冰箱里"."""

from __future__ import annotations

import random
import re
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from functools import lru_cache
from typing import Any

from er_gym.tasks.config_folder import config_directory
from er_gym.tasks.reading import read_yaml
from er_gym.tasks.wordings.words import HOLLOW, PLURAL, UNCOUNTED
from er_gym.thor import OBJECT_TYPES

_FIRST_NAME = 0.6
"""The probability of a type's first name, where it has several."""
_ONES = frozenset({"RoomDecor", "TableTopDecor"})
"""Types that take "some", whose names here are countable: "a table decoration"."""


class Nouns(ABC):
    """The words for object types within a piece of writing. A type keeps its first name.

    Args:
        names: object type to its names.
        said: earlier texts of the same writer; a type keeps the name that it has there.

    Attributes:
        latest: the type mentioned last, ``""`` at the beginning of a text.
        earlier: the one mentioned before it.
        subject: the type mentioned first in this sentence; until there is one, in the sentence
            before. What is listed with others is none.
    """

    def __init__(self, names: Mapping[str, Sequence[str]], said: str = "") -> None:
        self._names = names
        self._said = said
        self._chosen: dict[str, str] = {}
        self.forget()

    def word(self, value: str, form: str, choices: random.Random) -> str:
        """A fact in a form; what is no object type stays as it is.

        Forms: ``""`` bare, ``the``, ``name`` (never a pronoun), ``a``, ``in`` with the preposition,
        ``that`` a pronoun if it is clear what is meant, else ``the``, and ``to``, the way there.
        English also has ``those`` (``that`` as a subject), ``into``, ``it`` and ``they`` (pronouns
        in any case), ``is``, ``was`` and ``s`` (the plural), and ``the``, ``in`` and ``into`` are
        pronouns if that is clear. It is clear if the type was mentioned last, and first in its
        sentence.
        """
        if value not in self._names:
            return value
        if value not in self._chosen:
            first, *others = self._names[value]
            usual = not others or choices.random() < _FIRST_NAME
            drawn = first if usual else choices.choice(others)
            self._chosen[value] = self._kept(value) or drawn
        form = self._short(value, form) or form
        if form not in _NO_MENTION:
            self._mention(value)
        return self._formed(value, self._chosen[value], form)

    def forget(self) -> None:
        """Begin a new text."""
        self.latest = self.earlier = self.subject = ""
        self._begins = False

    def end_sentence(self) -> None:
        """What comes next is another sentence."""
        self._begins = True

    def end_list(self) -> None:
        """Several types were listed; no pronoun stands for one of them."""
        self.latest = self.subject = ""

    def mark(self) -> tuple[str, str, str, bool]:
        """What has been mentioned so far, to :meth:`go_back` to."""
        return self.latest, self.earlier, self.subject, self._begins

    def go_back(self, mark: tuple[str, str, str, bool]) -> None:
        """Take back what was mentioned since a mark."""
        self.latest, self.earlier, self.subject, self._begins = mark

    def _mention(self, value: str) -> None:
        if self._begins or not self.latest:
            self.subject = value
        self._begins = False
        if self.latest != value:
            self.earlier, self.latest = self.latest, value

    def _is_clear(self, value: str) -> bool:
        """Whether a pronoun can mean nothing else."""
        return self.latest == value == self.subject

    def _short(self, value: str, form: str) -> str:
        """The form of a pronoun where it is clear what is meant, else ``""``."""
        if form == "that":
            return "it" if self._is_clear(value) else "the"
        if form == "to" and (self.latest == value or (self.earlier == value and self._is_carried)):
            return "there"
        return ""

    @property
    def _is_carried(self) -> bool:
        """Whether the type mentioned last is no place that one could mean by "there"."""
        kind = OBJECT_TYPES.get(self.latest)
        return kind is not None and "pickupable" in kind.properties

    def _kept(self, value: str) -> str:
        """The name that the type has in the earlier texts, the longest if there are several."""
        names = self._names[value] if len(self._names[value]) > 1 else ()
        said = [name for name in names if self._is_said(name)]
        return max(said, key=len, default="")

    @abstractmethod
    def _is_said(self, name: str) -> bool:
        """Whether the earlier texts have a name."""

    @abstractmethod
    def _formed(self, object_type: str, name: str, form: str) -> str:
        """A name in a form."""

    @abstractmethod
    def counted(self, thing: Mapping[str, Any], choices: random.Random) -> str:
        """A thing of a pool, one or more: "a chair", "two chairs"."""

    @abstractmethod
    def joined(self, words: Sequence[str]) -> str:
        """A list of words: "a, b and c"."""


_PRONOUNS = {"the": "it", "in": "in it", "into": "into it"}
_NO_MENTION = frozenset({"is", "was"})
"""Forms that do not name the type."""


class EnglishNouns(Nouns):
    """See :class:`Nouns`."""

    def _is_said(self, name: str) -> bool:
        return re.search(rf"\b{re.escape(name)}\b", self._said) is not None

    def _short(self, value: str, form: str) -> str:
        if form == "those":
            return "they" if self._is_clear(value) else "name"
        if form in _PRONOUNS and self._is_clear(value) and value not in PLURAL:
            return _PRONOUNS[form]
        return super()._short(value, form)

    def _formed(self, object_type: str, name: str, form: str) -> str:
        plural = object_type in PLURAL
        match form:
            case "the" | "name":
                return f"the {name}"
            case "to":
                return f"to the {name}"
            case "there":
                return "there"
            case "in it":
                return "in it" if object_type in HOLLOW else "on it"
            case "into it":
                return "into it" if object_type in HOLLOW else "onto it"
            case "in":
                return f"{'in' if object_type in HOLLOW else 'on'} the {name}"
            case "into":
                return f"{'into' if object_type in HOLLOW else 'onto'} the {name}"
            case "a":
                if object_type in UNCOUNTED - _ONES or plural:
                    return f"some {name}"
                return f"{'an' if name[0] in 'aeiou' else 'a'} {name}"
            case "it":
                return "them" if plural else "it"
            case "they":
                return "they" if plural else "it"
            case "is":
                return "are" if plural else "is"
            case "was":
                return "were" if plural else "was"
            case "s":
                return _plural(name)
            case _:
                return name

    def counted(self, thing: Mapping[str, Any], choices: random.Random) -> str:
        kind, count = thing["o"], thing.get("count", 1)
        if count > 1 and kind not in UNCOUNTED | PLURAL:
            several = ("two", "a couple of") if count == 2 else ("several", "a few")
            return f"{choices.choice(several)} {self.word(kind, 's', choices)}"
        return self.word(kind, "a", choices)

    def joined(self, words: Sequence[str]) -> str:
        *others, last = words
        return f"{', '.join(others)} and {last}" if others else last


class ChineseNouns(Nouns):
    """See :class:`Nouns`. Names are written with their measure word: ``把 椅子``."""

    def _is_said(self, name: str) -> bool:
        return name.rpartition(" ")[2] in self._said

    def _formed(self, object_type: str, name: str, form: str) -> str:
        measure, _, noun = name.rpartition(" ")
        match form:
            case "a":
                return f"一{measure or '个'}{noun}"
            case "this":
                return f"这{measure or '个'}{noun}"
            case "it":
                return "它"
            case "in":
                return f"{noun}{'里' if object_type in HOLLOW else '上'}"
            case "to":
                return f"{noun}那里"
            case "there":
                return "那里"
            case _:
                return noun

    def counted(self, thing: Mapping[str, Any], choices: random.Random) -> str:
        one = self.word(thing["o"], "a", choices)
        count = thing.get("count", 1)
        if count == 1:
            return one
        return ("两" if count == 2 else "几") + one[1:]

    def joined(self, words: Sequence[str]) -> str:
        *others, last = words
        return f"{'、'.join(others)}和{last}" if others else last


def _plural(name: str) -> str:
    head, of, rest = name.partition(" of ")
    if of:
        return f"{_plural(head)} of {rest}"
    if name.endswith("shelf"):
        return f"{name[:-1]}ves"
    if name.endswith("knife"):
        return f"{name[:-2]}ves"
    if name.endswith(("s", "x", "ch", "sh", "potato", "tomato")):
        return f"{name}es"
    return f"{name}s"


@lru_cache(maxsize=4)
def names(language: str) -> Mapping[str, tuple[str, ...]]:
    """The names of object types in a language, from ``configs/thoughts/LANGUAGE/names.yaml``."""
    table = read_yaml(config_directory("thoughts") / language / "names.yaml")
    return {kind: tuple(map(str.strip, line.split(","))) for kind, line in table.items()}


def nouns(language: str, said: str = "") -> Nouns:
    """Nouns for a piece of writing that follows earlier texts."""
    return (ChineseNouns if language == "zh" else EnglishNouns)(names(language), said)
