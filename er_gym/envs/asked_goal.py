"""What an instruction asks for, read from its words alone: verbs, and the object types it names."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from er_gym.tasks import verbs
from er_gym.tasks.wordings.names import SYNONYMS, apart, chinese_names
from er_gym.thor.objects import KIND_OF, TYPES

GOAL_VERBS: Mapping[str, str] = {
    "search": r"find|search|look|locate|where",
    "pickup": r"pick|take|grab|get|fetch|bring",
    "put": r"put|place|set|move|store|leave",
    "toggle": r"toggle|turn|switch|flip",
    "open": r"open",
    "close": r"close|shut",
    "then": r"then|after|before|first",
    **{verb.name: "|".join(map(re.escape, verb.said)) for verb in verbs.ADDED},
}
"""The words of an instruction that say what to do, by their meaning. The words of the verbs that
other packages add are included."""

_CHINESE: Mapping[str, str] = {
    "search": "找|搜|寻|看",
    "pickup": "拿|取|捡|握",
    "put": "放|搁|摆",
    "toggle": "打开|关掉",
    "then": "先|再|然后|之后|接着|最后|随后",
}
"""The same in Chinese, where to open a door and to switch on a lamp is one word."""
_PLACE_OF = re.compile("[里上]的(?!咖啡(?!机|杯|桌))")
_IN_CHINESE = re.compile(r"[\u4e00-\u9fff]")


@cache
def _named() -> Sequence[tuple[str, str, re.Pattern[str]]]:
    """The object types, the longest names first, each with the first word of a name in small
    letters, and with how an instruction has that name."""
    names = [(kind, apart(kind)) for kind in TYPES]
    names += [(kind, other) for kind, parts in SYNONYMS.items() for other in parts.all]
    found = []
    for kind, name in sorted(names, key=lambda each: len(each[1]), reverse=True):
        first, *others = name.split()
        spaced = r"[\s-]?".join((first, *others))
        pattern = re.compile(rf"\b{spaced}(?:s|es)?\b", re.IGNORECASE)
        found.append((kind, first.lower(), pattern))
    return found


@cache
def _named_in_chinese() -> tuple[re.Pattern[str], Mapping[str, str]]:
    """How a Chinese instruction names types, the longest names first, and the types by name."""
    kinds = {name: kind for kind, parts in chinese_names().items() for name in parts.all}
    kinds |= {kind: kind for kind in TYPES if kind not in chinese_names()}
    return re.compile("|".join(sorted(kinds, key=len, reverse=True))), kinds


@cache
def _asked() -> Sequence[re.Pattern[str]]:
    return [re.compile(rf"\b(?:{words})", re.IGNORECASE) for words in GOAL_VERBS.values()]


@lru_cache(maxsize=4096)
def goal(instruction: str) -> tuple[tuple[float, ...], tuple[tuple[str, float], ...]]:
    """What an instruction asks for, read from its words alone.

    Returns:
        A 0 or 1 for each of :data:`GOAL_VERBS`; and a weight for each object type that the
        instruction names: 1 for the first, then 1/2, 1/3 and so on. ``credit card`` names a
        CreditCard. A name inside a longer name in the same place does not count.
    """
    if _IN_CHINESE.search(instruction):
        return _goal_in_chinese(instruction)
    mentions = []
    taken = np.zeros(len(instruction) + 1, dtype=bool)
    small = instruction.casefold()
    for name, first_word, pattern in _named():
        if first_word not in small:  # quicker than the pattern, which most names do not match
            continue
        for match in pattern.finditer(instruction):
            span = slice(*match.span())
            if not taken[span].any():
                taken[span] = True
                mentions.append((match.start(), name))
    asked = tuple(float(bool(pattern.search(instruction))) for pattern in _asked())
    return asked, _weighted(name for _, name in sorted(mentions))


def _goal_in_chinese(
    instruction: str,
) -> tuple[tuple[float, ...], tuple[tuple[str, float], ...]]:
    named, kinds = _named_in_chinese()
    order: list[str] = []
    places: list[str] = []  # 冰箱里的苹果: the apple, then the fridge
    for match in named.finditer(instruction):
        kind = kinds[match.group()]
        if _PLACE_OF.match(instruction, match.end()):
            places.append(kind)
        else:
            order += [kind, *places]
            places.clear()
    order += places
    rest = named.sub("", instruction)
    asked = (verb in _CHINESE and re.search(_CHINESE[verb], rest) for verb in GOAL_VERBS)
    return tuple(float(bool(each)) for each in asked), _weighted(order)


def _weighted(names: Iterable[str]) -> tuple[tuple[str, float], ...]:
    return tuple((name, 1.0 / (rank + 1)) for rank, name in enumerate(dict.fromkeys(names)))


@lru_cache(maxsize=4096)
def goal_row(instruction: str) -> NDArray[np.float32]:
    """(T,) float32, the weight of each type in an instruction, see :func:`goal`; read-only."""
    row = np.zeros(len(TYPES), dtype=np.float32)
    for name, weight in goal(instruction)[1]:
        row[KIND_OF[name]] = weight
    return row
