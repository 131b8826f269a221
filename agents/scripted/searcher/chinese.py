"""Parses a Chinese instruction into goals, as :mod:`~agents.scripted.searcher.instruction` does.

Names become marks first (⟨0⟩, ⟨1⟩ …). A few patterns with two or three names read what is washed,
heated or sliced; else the verbs and names are read once, from left to right. The object of a verb
comes after it (拿起苹果) or before it (把苹果拿起来); what is put goes to the name after the verb.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping
from functools import cache

from agents.scripted.searcher.goals import (
    BREW,
    CHILL,
    FIND,
    HEAT,
    PUT,
    SLICE,
    TAKE,
    TOAST,
    TOGGLE,
    WASH,
    Goal,
)
from er_gym.tasks.wordings.names import chinese_names
from er_gym.thor import OBJECT_TYPES

_MARK = "⟨(\\d+)⟩"
_PROCESSES: tuple[tuple[re.Pattern[str], Callable[..., Goal]], ...] = tuple(
    (re.compile(pattern.replace("_", _MARK)), make)
    for pattern, make in (
        ("[把将]_放进_，用_的水(?:洗|冲洗|装满|灌满)", lambda thing, *_: Goal(WASH, thing)),
        ("给_(?:倒满|装满)_里的咖啡", lambda thing, _: Goal(BREW, thing)),
        ("[把将]_放进_烤", lambda thing, _: Goal(TOAST, thing)),
        ("[把将]_放进_(?:加热|热一热)，打开再关掉_", lambda thing, *_: Goal(HEAT, thing)),
        ("[把将]_放进(?:关着的)?_(?:冷却|冰一冰)", lambda thing, _: Goal(CHILL, thing)),
        ("[把将]_用_切", lambda thing, knife: Goal(SLICE, thing, knife)),
    )
)
_VERBS: Mapping[str, str] = {
    FIND: "找|搜|寻|看",
    TAKE: "拿|取|捡|握",
    PUT: "放|搁|摆",
    TOGGLE: "打开|关掉|关上|开启",
}
_WORD = re.compile(
    "|".join(
        [
            *(f"(?P<{kind}>{words})" for kind, words in _VERBS.items()),
            "(?P<before>[把将])",
            "(?P<it>它)",
            rf"(?P<source>{_MARK.replace('(', '(?:')}[里上]的)",
            rf"(?P<name>{_MARK.replace('(', '(?:')})",
            "(?P<end>[，。；？！：])",
        ]
    )
)


@cache
def _named() -> tuple[re.Pattern[str], Mapping[str, str]]:
    kinds = {name: kind for kind, parts in chinese_names().items() for name in parts.all}
    kinds |= {kind: kind for kind in OBJECT_TYPES}
    return re.compile("|".join(sorted(kinds, key=len, reverse=True))), kinds


def read_chinese(instruction: str) -> list[Goal]:
    """The goals of a Chinese instruction in their order, the redundant ones among them."""
    named, kinds = _named()
    types: list[str] = []

    def mark(match: re.Match[str]) -> str:
        types.append(kinds[match.group()])
        return f"⟨{len(types) - 1}⟩"

    return list(_goals(named.sub(mark, instruction), types))


def _goals(text: str, types: list[str]) -> Iterator[Goal]:
    position, plain = 0, _Plain(types)
    while position < len(text):
        for pattern, make in _PROCESSES:
            if match := pattern.match(text, position):
                goal = make(*(types[int(number)] for number in match.groups()))
                plain.theme, plain.verb = goal.object_type, ""
                yield goal
                break
        else:
            match = _WORD.match(text, position)
            if match:
                yield from plain.take(match.lastgroup or "", match.group())
        position = match.end() if match else position + 1


class _Plain:
    """Reads verbs and names, one after the other."""

    def __init__(self, types: list[str]) -> None:
        self._types = types
        self.theme = self.verb = self.source = ""
        self._waits = False  # for the verb of 把

    def take(self, kind: str, text: str) -> Iterator[Goal]:
        """The goals that a word completes."""
        if kind in ("name", "source"):
            name = self._types[int(re.sub(r"\D", "", text))]
            if kind == "source":
                self.source = name
            elif self.verb == PUT and self.theme:
                yield Goal(PUT, self.theme, name, self.source)
                self.verb = self.source = ""
            else:
                self.theme = name
                if self.verb and not self._waits:
                    yield self._goal()
        elif kind == "it":
            if self.verb == TOGGLE and self.theme:
                yield self._goal()
        elif kind == "before":
            self._waits, self.verb = True, ""
        elif kind == "end":
            self._waits = False
            if self.verb != FIND:
                self.verb = ""
        else:
            if self._waits and kind in (TAKE, TOGGLE) and self.theme:
                self.verb = kind
                yield self._goal()
            elif self.verb and kind == TAKE and self.theme:
                yield Goal(TAKE, self.theme, "", self.source)
            self.verb = kind

    def _goal(self) -> Goal:
        return Goal(self.verb, self.theme, "", self.source)
