"""Metadata whose parts are made when they are first read.

Most steps of most programs look at few of them, and the objects are nine tenths of the work.
"""

from __future__ import annotations

from collections.abc import Callable, ItemsView, Iterator, KeysView, Mapping, ValuesView
from typing import Any, ClassVar


class LazyMetadata(dict[str, Any]):
    """A dict in every respect, but that some values are worked out when somebody asks.

    Whoever is about to change the source that it describes calls :meth:`settle` first.

    Args:
        ready: the values that are known.
        later: for each other key, what makes its value out of the source.
        source: what they are made from.
    """

    instead: ClassVar[Mapping[str, Callable[[Any], Any]]] = {}
    """What makes some of the values in this kind of metadata, in place of ``later``."""

    def __init__(
        self, ready: dict[str, Any], later: Mapping[str, Callable[[Any], Any]], source: object
    ) -> None:
        super().__init__(ready)
        self.update(dict.fromkeys(later))
        self._later = {**later, **self.instead}
        self._source: object | None = source

    @property
    def source(self) -> object | None:
        """What this describes; None once that may have become something else."""
        return self._source

    def settle(self) -> None:
        """Work out all that has not been, and keep nothing but the values."""
        while self._later:
            key, make = self._later.popitem()
            super().__setitem__(key, make(self._source))
        self._source = None

    def read_whole(self) -> None:
        """What is done before somebody looks at all of it."""
        self.settle()

    def __getitem__(self, key: str) -> Any:
        make = self._later.pop(key, None)
        if make is not None:
            super().__setitem__(key, make(self._source))
        return super().__getitem__(key)

    def __setitem__(self, key: str, value: Any) -> None:
        self._later.pop(key, None)
        super().__setitem__(key, value)

    def get(self, key: str, default: Any = None) -> Any:
        """As ``dict.get``."""
        return self[key] if key in self else default  # noqa: SIM401  (this is that method)

    def pop(self, key: str, *default: Any) -> Any:
        """As ``dict.pop``."""
        self.read_whole()
        return super().pop(key, *default)

    def setdefault(self, key: str, default: Any = None) -> Any:
        """As ``dict.setdefault``."""
        self.read_whole()
        return super().setdefault(key, default)

    # dict(x), {**x}, json and msgpack come in by one of these.

    def __iter__(self) -> Iterator[str]:
        self.read_whole()
        return super().__iter__()

    def keys(self) -> KeysView[str]:  # type: ignore[override]
        """As ``dict.keys``."""
        self.read_whole()
        return super().keys()

    def items(self) -> ItemsView[str, Any]:  # type: ignore[override]
        """As ``dict.items``."""
        self.read_whole()
        return super().items()

    def values(self) -> ValuesView[Any]:  # type: ignore[override]
        """As ``dict.values``."""
        self.read_whole()
        return super().values()

    def copy(self) -> dict[str, Any]:
        """A plain dict of the same."""
        return dict(self)

    def __eq__(self, other: object) -> bool:
        self.read_whole()
        return super().__eq__(other)

    __hash__ = None

    def __reduce__(self) -> tuple[type[dict[str, Any]], tuple[dict[str, Any]]]:
        return dict, (dict(self),)

    def __repr__(self) -> str:
        self.read_whole()
        return super().__repr__()
