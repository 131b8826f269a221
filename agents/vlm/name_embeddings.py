"""Compares names with those of object types by meaning, with a sentence-transformers model."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from importlib import import_module
from os.path import expanduser, isdir

import numpy as np
from numpy.typing import NDArray

from er_gym.data.names_en import NAMES_EN
from er_gym.data.shared_names import SHARED_EN
from er_gym.thor import OBJECT_TYPES

_REMEMBERED = 4096
_INSIDE_A_NAME = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")


class NameEmbeddings:
    """Embeds the T names of all object types as vectors of length E, and caches queried names.

    Args:
        model: a sentence-transformers model. A name may be downloaded; a directory is local.

    Raises:
        ValueError: the model cannot be loaded, or the package is missing.
    """

    def __init__(self, model: str) -> None:
        self._encode = _encoder(model)
        self._vectors: dict[str, NDArray[np.float32]] = {}
        names: dict[str, tuple[str, ...]] = {
            _INSIDE_A_NAME.sub(" ", name).lower(): (name,) for name in OBJECT_TYPES
        }
        names |= {name: (kind,) for kind, others in NAMES_EN.items() for name in others}
        names.update(SHARED_EN)
        self.types = tuple(names.values())
        """(T,) the object types of each name."""
        self._names = self._encode(list(names))

    def scores(self, names: Sequence[str]) -> NDArray[np.float32]:
        """(N, T) cosines between the given names and the names of the types."""
        new = [name for name in dict.fromkeys(names) if name not in self._vectors]
        if new:
            if len(self._vectors) + len(new) > _REMEMBERED:
                self._vectors.clear()
                new = list(dict.fromkeys(names))
            self._vectors.update(zip(new, self._encode(new), strict=True))
        vectors = np.stack([self._vectors[name] for name in names])
        # Rounded, since the last digits depend on the other names in the batch.
        return np.asarray((vectors @ self._names.T).round(4))


def _encoder(model: str) -> Callable[[list[str]], NDArray[np.float32]]:
    """A function from N texts to unit vectors, (N, E)."""
    try:
        library = import_module("sentence_transformers")
    except ImportError as error:
        raise ValueError(
            f"matching.embeddings {model!r} needs sentence-transformers ({error}): "
            "pip install 'er-gym[match]'"
        ) from error
    where = expanduser(model)
    try:
        loaded = library.SentenceTransformer(where, device="cpu", local_files_only=isdir(where))
    except Exception as error:  # files, network, formats: each fails with errors of its own
        reason = (str(error).strip().splitlines() or [""])[0]
        raise ValueError(
            f"matching.embeddings {model!r} cannot be loaded ({type(error).__name__}: {reason}); "
            "give a directory that holds a model of sentence-transformers, the name of one that "
            "can be downloaded here, or '' for none"
        ) from error

    def encode(texts: list[str]) -> NDArray[np.float32]:
        vectors = loaded.encode(texts, normalize_embeddings=True, show_progress_bar=False)
        return np.asarray(vectors, dtype=np.float32)

    return encode
