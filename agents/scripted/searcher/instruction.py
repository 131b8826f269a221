"""Parses an instruction into goals with a table of verbs.

The words are read once, from left to right. The object of a verb comes after it ("put the Mug …"),
as a pronoun ("… and put it …"), or, in the passive, before it ("the Mug should be put …").
Redundant goals are then merged: finding an object in order to take it is one goal, taking it.
"""

from __future__ import annotations

import re
from dataclasses import replace
from functools import lru_cache

from agents.scripted.searcher.chinese import read_chinese
from agents.scripted.searcher.goals import (
    BREW,
    CHILL,
    CLOSE,
    FIND,
    HEAT,
    OPEN,
    PUT,
    SLICE,
    TAKE,
    TOAST,
    TOGGLE,
    WASH,
    Goal,
    tidied,
)
from er_gym.envs.actions import applies
from er_gym.tasks import verbs
from er_gym.tasks.wordings.names import SYNONYMS
from er_gym.thor import OBJECT_TYPES

_VERBS = {
    FIND: "find finding found search searching locate locating look looking spot see seeing"
    " identify check checking investigate where seek come",
    TAKE: "take taking pick picking picked grab grabbing get getting fetch fetching hold holding"
    " held keep retrieve retrieving collect collecting carry carrying lift remove bring bringing",
    PUT: "put putting place placing placed set setting move moving lay laying leave leaving go"
    " store stored kept end ended be arrange transfer return drop deposit stow followed"
    " moved ends belongs belong goes keeps throw toss",
    TOGGLE: "turn turning turned switch switching switched toggle flip power activate press light"
    " start ignite igniting deactivate",
    WASH: "wash washing rinse rinsing clean fill filling",
    BREW: "pour brew brewing",
    HEAT: "heat heating warm warming cook cooking microwave",
    CHILL: "cool cooling chill chilling",
    TOAST: "toast toasting",
    SLICE: "slice slicing cut cutting chop",
    OPEN: "open opening",
    CLOSE: "close closing shut shutting",
}
_KIND = {word: kind for kind, words in _VERBS.items() for word in words.split()}
_SYNONYMS = {
    **{name: kind for kind, parts in SYNONYMS.items() for name in parts.all},
    "refrigerator": "Fridge", "fridge": "Fridge", "stove": "StoveBurner", "burner": "StoveBurner",
    "fire": "StoveBurner", "counter": "CounterTop", "tap": "Faucet", "tv": "Television",
    "couch": "Sofa", "armchair": "ArmChair", "phone": "CellPhone", "bin": "GarbageCan",
    "trash": "GarbageCan", "lamp": "DeskLamp", "sponge": "DishSponge", "basin": "SinkBasin",
    "cupboard": "Cabinet", "remote": "RemoteControl",
}  # fmt: skip
# fmt: off
_ARTICLES = frozenset({
    "a", "an", "the", "this", "that", "my", "your", "his", "her", "its", "their", "our", "one",
    "some", "any",
})
# fmt: on
_IN = frozenset({"in", "on", "inside", "within", "upon", "at"})
_TO = frozenset({"into", "onto", "to"})
_PRONOUNS = frozenset({"it", "them"})
_BE = frozenset({"be", "is", "are", "get", "gets", "being", "been"})
_ADJECTIVES = frozenset({"closed", "clean", "open", "hot", "cold", "warm", "shut"})
_ACTION = {TAKE: verbs.PICKUP, PUT: verbs.PICKUP, TOGGLE: verbs.TOGGLE, SLICE: verbs.SLICE,
           OPEN: verbs.OPEN, CLOSE: verbs.CLOSE}  # fmt: skip
"""The action that an object must allow for a verb; for verbs not listed, picking it up."""


def _spelling(name: str) -> str:
    words = re.findall(r"[A-Z]+(?![a-z])|[A-Z][a-z]+|\d+", name)
    plural = r"(?:s|es)?" if len(name) > 2 else ""
    return r"[\s-]?".join(words) + plural


_NAMES = {
    **{f"type{index}": name for index, name in enumerate(OBJECT_TYPES)},
    **{f"also{index}": name for index, name in enumerate(_SYNONYMS.values())},
}
_SPELLINGS = {
    **{f"type{index}": _spelling(name) for index, name in enumerate(OBJECT_TYPES)},
    **{f"also{index}": rf"{name}(?:s|es)?" for index, name in enumerate(_SYNONYMS)},
}
_TOKEN = re.compile(
    "|".join(
        [
            *(
                rf"(?P<{group}>\b{spelling}\b)"
                for group, spelling in sorted(_SPELLINGS.items(), key=lambda item: -len(item[1]))
            ),
            r"(?P<word>\w+)",
            r"(?P<mark>[.,;:?!])",
        ]
    ),
    re.IGNORECASE,
)


def _tokens(instruction: str) -> list[tuple[str, str]]:
    """The words in lower case, each with the object type that it names, or ""."""
    found = []
    for match in _TOKEN.finditer(instruction):
        name = _NAMES.get(match.lastgroup or "", "")
        found.append((match.group().lower(), name))
    return found


class _Reader:
    """Reads the words one after the other and collects goals."""

    def __init__(self, instruction: str) -> None:
        self.words = _tokens(instruction)
        self.goals: list[Goal] = []
        self.said: list[str] = []  # object types in the order of mention
        self.verb = ""
        self.theme = ""
        self.source: dict[str, str] = {}
        self.goes_there = False  # "go to", "see to": the next type is not a target of "put"
        self.of_last = False  # "that is": what follows says where the last object is

    def read(self) -> list[Goal]:
        position = 0
        while position < len(self.words):
            word, name = self.words[position]
            before = self._before(position)
            if name:
                self._mention(name, before)
            elif word in _PRONOUNS:
                self._pronoun(before)
            elif word == "coffee" and self.verb in (WASH, BREW):
                self._coffee()
            elif word in ("that", "which") and self._next(position) in ("is", "are"):
                self.of_last = True
            elif word in _KIND and before not in _ARTICLES - {"that", "this"}:
                self._verb(_KIND[word], word, before)
            position += 1
        return self._in_order()

    # -- neighbouring words ----------------------------------------------------------------------

    def _before(self, position: int) -> str:
        """The word before, without articles and adjectives."""
        named = bool(self.words[position][1])
        article = False
        while position > 0:
            position -= 1
            word = self.words[position][0]
            adjective = word in _ADJECTIVES and not article  # "to clean the Cup" is a verb
            if not named or not (word in _ARTICLES or adjective):
                return word
            article |= word in _ARTICLES
        return ""

    def _next(self, position: int) -> str:
        return self.words[position + 1][0] if position + 1 < len(self.words) else ""

    # -- kinds of words --------------------------------------------------------------------------

    def _verb(self, kind: str, word: str, before: str) -> None:
        if word == "be" and self.verb == TOGGLE:
            return
        if word in ("see", "look", "come") and self.verb == PUT and not self.theme:
            return
        self.verb, self.of_last = kind, False
        self.goes_there = word in ("see", "go", "going", "walk") and before not in (
            "should",
            "must",
        )
        if self.goes_there:
            self.verb = FIND
        if before in _BE and not word.endswith("ing") and kind != PUT and self.theme:
            self._do(self.theme)

    def _mention(self, name: str, before: str) -> None:
        self.said.append(name)
        if before in _TO and self.goes_there:
            self._do(name)
        elif before in _TO or (before in _IN and not self._is_particle(before)):
            self._where(name, before)
        elif before in ("of", "from") and self.verb in (TAKE, PUT):
            self.source.setdefault(self.theme, name)
        elif before == "with" and self.verb == SLICE:
            if self.goals and self.goals[-1].kind == SLICE:
                self.goals[-1] = replace(self.goals[-1], target=name)
        elif before == "from":
            return
        else:
            self._do(name)
        self.of_last = False

    def _is_particle(self, before: str) -> bool:
        """Whether "on" belongs to "switch" rather than to what follows."""
        switched = bool(self.goals) and self.goals[-1].kind == TOGGLE
        return (
            self.verb == TOGGLE
            and before == "on"
            and not self.of_last
            and not (switched and self.goals[-1].object_type == self.said[-1])
        )

    def _where(self, place: str, before: str) -> None:
        if not self.theme or place == self.theme:
            if self.verb in (OPEN, CLOSE, TOGGLE):
                self._do(place)
            return
        if self.of_last or (self.verb in (FIND, TAKE) and before in _IN):
            self.source[self.theme] = place
            self.goals = [
                replace(goal, source=place) if goal.object_type == self.theme else goal
                for goal in self.goals
            ]
        elif self.verb in ("", PUT, TAKE, FIND):
            source = self.source.get(self.theme, "")
            self.goals.append(Goal(PUT, self.theme, place, source))

    def _pronoun(self, before: str) -> None:
        """ "it": the last object that fits the verb; "into it": the target of the last object."""
        if self.verb == BREW or (before in _TO and self.verb == PUT):
            others = [name for name in reversed(self.said) if name != self.theme or not before]
            if self.verb == BREW and self.said:
                self.goals.append(Goal(BREW, self.said[-1]))
                self.theme = self.said[-1]
            elif others:
                self._where(others[0], before)
            return
        fits = [name for name in (self.theme, *reversed(self.said)) if self._can(name)]
        if fits:
            self._do(fits[0])

    def _coffee(self) -> None:
        self.verb = BREW
        if self.goals and self.goals[-1].kind == WASH:
            self.goals[-1] = replace(self.goals[-1], kind=BREW)

    def _can(self, name: str) -> bool:
        if not name or self.verb == FIND:
            return bool(name)
        return applies(_ACTION.get(self.verb, verbs.PICKUP), name)

    def _do(self, name: str) -> None:
        """Apply the verb to an object; "put" waits for its target."""
        if self.verb and self.verb not in (PUT, FIND) and not self._can(name):
            return
        self.theme = name
        if self.verb not in ("", PUT):
            self.goals.append(Goal(self.verb, name, "", self.source.get(name, "")))

    # -- merging goals ---------------------------------------------------------------------------

    def _in_order(self) -> list[Goal]:
        if not self.goals and self.theme:
            return [Goal(FIND, self.theme)]
        return tidied(self.goals)


def _first_things_first(instruction: str) -> str:
    """ "Before you do B, do A" rewritten as "Do A. Then do B"."""
    return re.sub(
        r"(?:^|(?<=[.!?]\s))(?:before|prior to)\s+([^.?!,]+),\s*([^.?!]+)([.?!])",
        r"\2. Then \1\3",
        instruction,
        flags=re.IGNORECASE,
    )


_LONGEST = 2_000
_CHINESE = re.compile(r"[\u4e00-\u9fff]")


@lru_cache(maxsize=4096)
def parse_instruction(instruction: str) -> tuple[Goal, ...]:
    """The goals of an instruction in the order in which they are to be done; () if it has none.

    Only its first 2,000 characters are read, each run of white space as one.
    """
    instruction = " ".join(instruction.split())[:_LONGEST]
    if _CHINESE.search(instruction):
        return tuple(tidied(read_chinese(instruction)))
    text = re.sub(r"'s\b", "", _first_things_first(instruction))
    text = re.sub(
        r"([^.?!,;]+?),?\s+after\s+(?:having\s+)?((?!that|this)\w+ing\s[^.?!,;]+)",
        r"\2, \1",
        text,
    )
    return tuple(_Reader(text).read())
