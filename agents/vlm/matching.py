"""The object type that a name stands for which a model has written.

Names are looked up first, by letters alone: case, spaces, plurals, articles and numbers do not
matter. Where that fails they are compared, by letters with RapidFuzz and, where a model is given
for it, by meaning with sentence-transformers.
"""

from __future__ import annotations

import re
import threading
import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal, TypeAlias

import numpy as np

from agents.vlm.name_embeddings import NameEmbeddings
from agents.vlm.names_en import MODIFIERS, NAMES_EN, SHARED_EN
from agents.vlm.names_zh import NAMES_ZH, SHARED_ZH
from agents.vlm.settings import Matching
from er_gym.thor import OBJECT_TYPES

MatchMethod: TypeAlias = Literal["exact", "alias", "fuzzy", "meaning", "none"]

_SHORTEST_FUZZY = 5
"""Letters of the shortest names that may be misspelt: "Pan" is no "Pen", and "Cup" no "Cap"."""
_LETTERS_PER_EDIT = 6
"""A name may have one wrong letter, or one more for each so many: "baseball" is no "BasketBall"."""
_LONGEST = 100
_MAX_NEAREST = 3


@dataclass(frozen=True)
class Match:
    """What a name stands for.

    Attributes:
        name: as it was given.
        object_type: "" for none.
        how: by the type's own name, by another name of it, by letters, by meaning, or not at all.
        score: how alike, 1 for what was looked up: share of letters, or cosine; 0 for none.
        near: for none, the types that come nearest, at most three.
    """

    name: str
    object_type: str = ""
    how: MatchMethod = "none"
    score: float = 0.0
    near: tuple[str, ...] = ()

    @property
    def problem(self) -> str:
        """What to tell of a name that stands for none; "" for one that does."""
        if self.object_type:
            return ""
        name = self.name if len(self.name) <= _LONGEST else self.name[: _LONGEST - 1] + "…"
        words = f"There is no object type '{' '.join(name.split())}'"
        if not self.near:
            return f"{words}."
        *others, last = self.near
        known = f"{', '.join(others)} and {last}" if others else last
        return f"{words}; the nearest {'are' if others else 'is'} {known}."


# -- looked up -------------------------------------------------------------------------------------

_WORD = re.compile(r"[^\W_]+")
_NUMBER = re.compile(r"\d+$")
_PLURALS = (
    *(("ies", "y"), ("ves", "f"), ("ves", "fe"), ("s", "")),
    *((f"{end}es", end) for end in ("s", "x", "z", "ch", "sh", "o")),
)
"""Ends of plurals and of their singulars."""


def _key(name: str) -> str:
    return "".join(_WORD.findall(name)).casefold()


@dataclass(frozen=True)
class _Entry:
    types: tuple[str, ...]
    how: MatchMethod


def _entries() -> dict[str, _Entry]:
    """What can be looked up, by key."""
    entries = {_key(name): _Entry((name,), "exact") for name in OBJECT_TYPES}
    for names in (NAMES_EN, NAMES_ZH):
        for object_type, others in names.items():
            entries.update((_key(other), _Entry((object_type,), "alias")) for other in others)
    for shared in (SHARED_EN, SHARED_ZH):
        entries.update((_key(name), _Entry(types, "alias")) for name, types in shared.items())
    return entries


_ENTRIES: Mapping[str, _Entry] = _entries()


def _look_up(name: str) -> _Entry | None:
    return next((_ENTRIES[key] for key in _keys(name) if key in _ENTRIES), None)


def _keys(name: str) -> Iterator[str]:
    """By what to look a name up, the likeliest first."""
    first, *parts = name.split("|")  # AI2-THOR's ids: Sink|-00.50|+00.90|+01.20|SinkBasin
    if parts and parts[-1][:1].isalpha():
        first = parts[-1]
    words = _WORD.findall(first.replace("_", " ").casefold())
    while words and words[-1].isdigit():  # Fridge_1, Cabinet 2
        words.pop()
    plainer = list(words)
    while len(plainer) > 1 and (plainer[0] in MODIFIERS or plainer[0].isdigit()):
        plainer.pop(0)
    # "bowl of fruit", but not "slice of bread", which has been looked up as it stands before.
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


def _one_of(types: Sequence[str], prefer: Collection[str]) -> str:
    """The first that is preferred, else the first."""
    return next((each for each in types if each in prefer), types[0])


# -- compared by letters ---------------------------------------------------------------------------


@cache
def _rapidfuzz() -> tuple[Callable[..., Any], Callable[..., Any], Callable[..., Any]]:
    """RapidFuzz's ``extract``, its scorer ``ratio`` and its distance in edits."""
    try:
        from rapidfuzz import fuzz, process
        from rapidfuzz.distance import OSA
    except ImportError as error:
        raise ValueError(
            f"matching names needs RapidFuzz ({error}): pip install 'er-gym[vlm]'"
        ) from error
    # ratio, not WRatio and its like: these take "Towel" for a HandTowelHolder.
    return process.extract, fuzz.ratio, OSA.distance


_MISSPELLABLE = tuple(key for key in _ENTRIES if key.isascii() and len(key) >= _SHORTEST_FUZZY)


def _fuzzy_match(name: str, at_least: float, prefer: Collection[str]) -> tuple[str, float]:
    """The type whose name differs by few letters, and how alike it is, 0 to 1; or "" and 0."""
    extract, ratio, edits = _rapidfuzz()
    for key in dict.fromkeys(_keys(name)):
        if len(key) < _SHORTEST_FUZZY:
            continue
        found = [
            (score, _ENTRIES[other].types)
            for other, score, _ in extract(
                key, _MISSPELLABLE, scorer=ratio, score_cutoff=at_least, limit=None
            )
            if edits(key, other) <= max(1, len(other) // _LETTERS_PER_EDIT)
        ]
        best = dict.fromkeys(types for score, types in found if score == found[0][0])
        types = [each for types in best for each in types]
        if len(best) == 1 or any(each in prefer for each in types):
            return _one_of(types, prefer), round(found[0][0] / 100, 4)
    return "", 0.0


def _nearest_by_letters(name: str) -> tuple[str, ...]:
    extract, ratio, _ = _rapidfuzz()
    found = extract(next(_keys(name)), _ENTRIES.keys(), scorer=ratio, score_cutoff=1, limit=20)
    return _first_types(_ENTRIES[key].types for key, _, _ in found)


def _first_types(ranked: Iterable[Sequence[str]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(each for types in ranked for each in types))[:_MAX_NEAREST]


# -- all of it -------------------------------------------------------------------------------------


class Matcher:
    """Finds object types for names. May be asked by many threads at once.

    Args:
        settings: how alike a name must be to one that is known.
    """

    def __init__(self, settings: Matching) -> None:
        self._settings = settings
        self._lock = threading.Lock()
        self._embeddings: NameEmbeddings | None = None

    def prepare(self) -> None:
        """Load what the first name that is hard to match would load.

        Raises:
            ValueError: a package is missing, or the model cannot be loaded.
        """
        _rapidfuzz()
        if self._settings.embeddings:
            with self._lock:
                self._embeddings = self._embeddings or NameEmbeddings(self._settings.embeddings)

    def match(self, name: str, prefer: Collection[str] = ()) -> Match:
        """What a name stands for; see :meth:`match_many`."""
        return self.match_many((name,), prefer)[0]

    def match_many(self, names: Sequence[str], prefer: Collection[str] = ()) -> list[Match]:
        """What names stand for; what letters do not tell is asked of the model all at once.

        Args:
            names: as models write them.
            prefer: the types that are at hand. Of several types that one name has ("table") one of
                these is meant.

        Raises:
            ValueError: see :meth:`prepare`.
        """
        plain = {name: " ".join(_normal(name).split()) for name in names}
        found = {name: self._by_letters(name, plain[name], prefer) for name in plain}
        unknown = [name for name in plain if not found[name].object_type and plain[name]]
        if unknown and self._settings.embeddings:
            found.update(self._by_meaning({name: plain[name] for name in unknown}, prefer))
        return [found[name] for name in names]

    def _by_letters(self, name: str, plain: str, prefer: Collection[str]) -> Match:
        if entry := _look_up(plain):
            return Match(name, _one_of(entry.types, prefer), entry.how, 1.0)
        object_type, score = _fuzzy_match(plain, self._settings.fuzzy, prefer)
        if object_type:
            return Match(name, object_type, "fuzzy", score)
        return Match(name, near=_nearest_by_letters(plain))

    def _by_meaning(
        self, names: Mapping[str, str], prefer: Collection[str]
    ) -> Iterator[tuple[str, Match]]:
        self.prepare()
        assert self._embeddings is not None
        with self._lock:
            scores = self._embeddings.scores(list(names.values()))
        for name, row in zip(names, scores, strict=True):
            order = np.argsort(-row, kind="stable")
            types, score = self._embeddings.types[order[0]], round(float(row[order[0]]), 4)
            if score >= self._settings.threshold:
                yield name, Match(name, _one_of(types, prefer), "meaning", score)
            else:
                yield name, Match(name, near=_first_types(self._embeddings.types[i] for i in order))


def _normal(name: str) -> str:
    return unicodedata.normalize("NFKC", name[:_LONGEST])
