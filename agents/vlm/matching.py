"""Finds the object type for a name that a model has written.

A name is first looked up. Case, spaces, plurals, articles and numbers do not matter. If the lookup
fails, RapidFuzz compares the spelling. If the settings name a sentence-transformers model, that
model then compares the meaning.
"""

from __future__ import annotations

import threading
import unicodedata
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from agents.vlm.name_embeddings import NameEmbeddings
from agents.vlm.parsing.names import ENTRIES, MatchMethod, keys_of, look_up
from agents.vlm.settings import Matching
from er_gym.extras import MissingPackage

_SHORTEST_FUZZY = 5
"""Shorter names are not matched fuzzily: "Pan" is not "Pen", and "Cup" is not "Cap"."""
_LETTERS_PER_EDIT = 6
"""One edit is allowed per this many letters, at least one: "baseball" is not "BasketBall"."""
_LONGEST = 100
_MAX_NEAREST = 3


@dataclass(frozen=True)
class Match:
    """The result of matching a name.

    Attributes:
        name: the name as it was given.
        object_type: the matched type; "" for none.
        how: by the type's own name, by an alias, by spelling, by meaning, or not at all.
        score: similarity from 0 to 1: 1 for a lookup, else the spelling ratio or the cosine; 0 for
            none.
        near: without a match, the nearest types, at most three.
    """

    name: str
    object_type: str = ""
    how: MatchMethod = "none"
    score: float = 0.0
    near: tuple[str, ...] = ()

    @property
    def problem(self) -> str:
        """The feedback for an unmatched name; "" for a matched one."""
        if self.object_type:
            return ""
        name = self.name if len(self.name) <= _LONGEST else self.name[: _LONGEST - 1] + "…"
        words = f"There is no object type '{' '.join(name.split())}'"
        if not self.near:
            return f"{words}."
        *others, last = self.near
        known = f"{', '.join(others)} and {last}" if others else last
        return f"{words}; the nearest {'are' if others else 'is'} {known}."


def _one_of(types: Sequence[str], prefer: Collection[str]) -> str:
    """The first preferred type, else the first type."""
    return next((each for each in types if each in prefer), types[0])


# -- spelling --------------------------------------------------------------------------------------


@cache
def _rapidfuzz() -> tuple[Callable[..., Any], Callable[..., Any], Callable[..., Any]]:
    """RapidFuzz's ``extract``, its scorer ``ratio`` and its distance in edits."""
    try:
        from rapidfuzz import fuzz, process
        from rapidfuzz.distance import OSA
    except ImportError as error:
        raise MissingPackage("matching names", str(error.name), "er-gym[vlm]") from error
    # ratio, not WRatio: WRatio takes "Towel" for a HandTowelHolder.
    return process.extract, fuzz.ratio, OSA.distance


_MISSPELLABLE = tuple(key for key in ENTRIES if key.isascii() and len(key) >= _SHORTEST_FUZZY)


def _fuzzy_match(name: str, at_least: float, prefer: Collection[str]) -> tuple[str, float]:
    """The type with the most similar spelling and its score from 0 to 1; "" and 0 for none."""
    extract, ratio, edits = _rapidfuzz()
    for key in dict.fromkeys(keys_of(name)):
        if len(key) < _SHORTEST_FUZZY:
            continue
        found = [
            (score, ENTRIES[other].types)
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
    found = extract(next(keys_of(name)), ENTRIES.keys(), scorer=ratio, score_cutoff=1, limit=20)
    return _first_types(ENTRIES[key].types for key, _, _ in found)


def _first_types(ranked: Iterable[Sequence[str]]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(each for types in ranked for each in types))[:_MAX_NEAREST]


# -- the matcher -----------------------------------------------------------------------------------


class Matcher:
    """Finds object types for names. Many threads may use it at once.

    Args:
        settings: the similarity that a match needs.
    """

    def __init__(self, settings: Matching) -> None:
        self._settings = settings
        self._lock = threading.Lock()
        self._embeddings: NameEmbeddings | None = None

    def prepare(self) -> None:
        """Load packages and the model now rather than at the first hard name.

        Raises:
            ValueError: a package is missing, or the model cannot be loaded.
        """
        _rapidfuzz()
        if self._settings.embeddings:
            with self._lock:
                self._embeddings = self._embeddings or NameEmbeddings(self._settings.embeddings)

    def match(self, name: str, prefer: Collection[str] = ()) -> Match:
        """Match one name; see :meth:`match_many`."""
        return self.match_many((name,), prefer)[0]

    def match_many(self, names: Sequence[str], prefer: Collection[str] = ()) -> list[Match]:
        """Match names. The embedding model gets all names that spelling does not match in one
        batch.

        Args:
            names: as a model wrote them.
            prefer: the types within reach. If a name ("table") stands for several types, one of
                these is chosen.

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
        if entry := look_up(plain):
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
