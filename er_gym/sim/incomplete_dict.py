"""Dictionaries that are filled only as far as somebody reads them."""

from __future__ import annotations

from collections.abc import ItemsView, Iterator, KeysView, ValuesView
from typing import Any


class IncompleteDict(dict[str, Any]):
    """A dict that may lack values until somebody reads it as a whole.

    A subclass says how to look up one value, how to complete the rest, and, if it lacks keys too,
    which there are.
    """

    __slots__ = ()

    def read_whole(self) -> None:
        """Complete all values, for a reader that looks at all of them."""
        raise NotImplementedError

    def get(self, key: str, default: Any = None) -> Any:
        """As ``dict.get``."""
        return self[key] if key in self else default  # noqa: SIM401  (this is that method)

    # All other methods look at the whole dictionary. dict(x), {**x}, json and msgpack use one of
    # the first two.

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

    def __reversed__(self) -> Iterator[str]:
        self.read_whole()
        return super().__reversed__()

    def __delitem__(self, key: str) -> None:
        self.read_whole()
        super().__delitem__(key)

    def pop(self, key: str, *default: Any) -> Any:
        """As ``dict.pop``."""
        self.read_whole()
        return super().pop(key, *default)

    def popitem(self) -> tuple[str, Any]:
        """As ``dict.popitem``."""
        self.read_whole()
        return super().popitem()

    def setdefault(self, key: str, default: Any = None) -> Any:
        """As ``dict.setdefault``."""
        self.read_whole()
        return super().setdefault(key, default)

    def clear(self) -> None:
        """As ``dict.clear``."""
        self.read_whole()
        super().clear()

    def copy(self) -> dict[str, Any]:
        """A plain dict with the same values."""
        return dict(self)

    def __or__(self, other: Any) -> Any:
        return dict(self) | other

    def __ror__(self, other: Any) -> Any:
        return other | dict(self)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, IncompleteDict):
            other.read_whole()
        self.read_whole()
        return super().__eq__(other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None

    def __reduce__(self) -> tuple[type[dict[str, Any]], tuple[dict[str, Any]]]:
        return dict, (dict(self),)

    def __repr__(self) -> str:
        self.read_whole()
        return super().__repr__()
