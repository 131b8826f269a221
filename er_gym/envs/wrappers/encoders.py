"""Encoders: an instruction as a vector, for agents that do not read."""

from __future__ import annotations

import re
import zlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import import_module
from itertools import pairwise
from os.path import expanduser
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from er_gym.envs.arguments import short_repr

HASHED = "hashed"
MODEL = "sentence-transformers:"
"""The prefix of the names of encoders that are models of sentence-transformers."""
BUCKETS = 64
"""The dimension of ``hashed``."""
_ALLOWED = f"{HASHED!r} or '{MODEL}NAME_OR_DIRECTORY'"
_REMEMBERED_TEXTS = 4096

_WORD = re.compile(r"\w+")
_INSIDE_A_NAME = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")


class Encoder(Protocol):
    """Turns a text into a vector. The same text always gives the same vector."""

    @property
    def dimension(self) -> int:
        """The length E of the vectors."""

    def __call__(self, text: str, /) -> NDArray[np.float32]:
        """(E,) float32 in [-1, 1], of length 1; zeros for a text without words.

        The array is the caller's own.
        """


@dataclass(frozen=True, eq=False)
class _Named:
    """An encoder that is pickled as its name; the other process loads the model anew."""

    name: str
    dimension: int
    embed: Callable[[str], NDArray[np.float32]]

    def __call__(self, text: str, /) -> NDArray[np.float32]:
        return self.embed(text).copy()  # the caller may change its array

    def __reduce__(self) -> tuple[Callable[[str], Encoder], tuple[str]]:
        return make_encoder, (self.name,)


def make_encoder(name: str = HASHED) -> Encoder:
    """The encoder of a name. A process makes each encoder once; it caches recent texts.

    Args:
        name: ``"hashed"``: words and pairs of neighbouring words, hashed into 64 signed buckets.
            This encoder needs no further package and gives the same bytes on every machine. It
            knows words, but not their meaning. ``CreditCard`` and ``credit card`` are the same
            words.
            ``"sentence-transformers:NAME_OR_DIRECTORY"``: a model of that library, on the CPU. A
            named model may be downloaded; a directory is on this machine. It needs the extra
            ``match``.

    Raises:
        ValueError: the name is unknown, or the model cannot be loaded.
        ImportError: the name asks for sentence-transformers, which is not installed.
    """
    # The name may come from a configuration file, which may hold any type.
    is_model = isinstance(name, str) and name.startswith(MODEL) and name != MODEL
    if name != HASHED and not is_model:
        raise ValueError(f"unknown encoder {short_repr(name)}; give {_ALLOWED}")
    return _made(name)


@cache
def _made(name: str) -> Encoder:
    embed = _hashed if name == HASHED else _model(name)

    @lru_cache(maxsize=_REMEMBERED_TEXTS)
    def remembered(text: str) -> NDArray[np.float32]:
        return _unit(embed(text))

    # The dimension is that of a vector. The model's method has had two names, and may return None.
    return _Named(name, remembered("find").size, remembered)


def _unit(vector: NDArray[Any]) -> NDArray[np.float32]:
    """A vector scaled to length 1; computed in float64, so that rounding keeps it in [-1, 1]."""
    exact = vector.astype(np.float64)
    length = np.linalg.norm(exact)
    return (exact / length if length else exact).astype(np.float32)


def _hashed(text: str) -> NDArray[np.float64]:
    """(BUCKETS,) counts with signs, so that collisions in a bucket cancel out on average."""
    words = _WORD.findall(_INSIDE_A_NAME.sub(" ", text).casefold())
    vector = np.zeros(BUCKETS)
    for feature in (*words, *map(" ".join, pairwise(words))):
        code = zlib.crc32(feature.encode())  # hash() differs from process to process
        vector[code % BUCKETS] += 1.0 if code >> 31 else -1.0
    return vector


def _model(name: str) -> Callable[[str], NDArray[Any]]:
    try:
        # Imported by name, since the type checker may run without the extra.
        library = import_module("sentence_transformers")
    except ImportError as error:
        raise ImportError(
            f"encoder {name!r} needs sentence-transformers ({error}): pip install 'er-gym[match]'; "
            f"allowed is {_ALLOWED}, and {HASHED!r} needs nothing"
        ) from error
    try:
        model = library.SentenceTransformer(expanduser(name.removeprefix(MODEL)), device="cpu")
    except Exception as error:  # files, network and formats each raise errors of their own
        reason = (str(error).strip().splitlines() or [""])[0]
        raise ValueError(
            f"encoder {name!r}: the model cannot be loaded ({type(error).__name__}: {reason}); "
            f"give '{MODEL}' with a local directory that holds a model, or with a name that can "
            f"be downloaded here; or give {HASHED!r}, which needs neither"
        ) from error

    def embed(text: str) -> NDArray[Any]:
        # Passed by position, since the argument's name has changed between versions. A log level
        # could turn on the progress bar.
        return np.asarray(model.encode(text, show_progress_bar=False))

    return embed
