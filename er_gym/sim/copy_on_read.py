"""Dictionaries that share nested values with others and copy one when it is read.

The metadata of an object have some forty single values and twenty small lists and dictionaries.
Copying these for every reader takes twenty times as long as everything else, and most readers look
at only a few of them.
"""

from __future__ import annotations

from collections.abc import ItemsView, Iterator, KeysView, Mapping, ValuesView
from typing import Any

_NOTHING: Mapping[str, Any] = {}
_CONTAINERS = (dict, list)


class CopyOnReadDict(dict[str, Any]):
    """A dict that copies a nested value when somebody asks for it.

    It is created with the values that need no copy. Its creator then sets :attr:`shared`.

    Attributes:
        shared: all other values, which must not be changed. They have no key in common with the
            first.
    """

    __slots__ = ("shared",)

    shared: Mapping[str, Any]

    def settle(self) -> None:
        """Copy every value that has not been copied yet."""
        shared, self.shared = self.shared, _NOTHING
        for key, value in shared.items():
            if not dict.__contains__(self, key):
                dict.__setitem__(self, key, copied(value))

    def __missing__(self, key: str) -> Any:
        value = copied(self.shared[key])
        dict.__setitem__(self, key, value)
        return value

    def __contains__(self, key: object) -> bool:
        return dict.__contains__(self, key) or key in self.shared

    def get(self, key: str, default: Any = None) -> Any:
        """As ``dict.get``."""
        return self[key] if key in self else default  # noqa: SIM401  (this is that method)

    # All other methods look at the whole dictionary.

    def __len__(self) -> int:
        self.settle()
        return super().__len__()

    def __iter__(self) -> Iterator[str]:
        self.settle()
        return super().__iter__()

    def __reversed__(self) -> Iterator[str]:
        self.settle()
        return super().__reversed__()

    def __delitem__(self, key: str) -> None:
        self.settle()
        super().__delitem__(key)

    def keys(self) -> KeysView[str]:  # type: ignore[override]
        """As ``dict.keys``."""
        self.settle()
        return super().keys()

    def items(self) -> ItemsView[str, Any]:  # type: ignore[override]
        """As ``dict.items``."""
        self.settle()
        return super().items()

    def values(self) -> ValuesView[Any]:  # type: ignore[override]
        """As ``dict.values``."""
        self.settle()
        return super().values()

    def pop(self, key: str, *default: Any) -> Any:
        """As ``dict.pop``."""
        self.settle()
        return super().pop(key, *default)

    def popitem(self) -> tuple[str, Any]:
        """As ``dict.popitem``."""
        self.settle()
        return super().popitem()

    def setdefault(self, key: str, default: Any = None) -> Any:
        """As ``dict.setdefault``."""
        self.settle()
        return super().setdefault(key, default)

    def clear(self) -> None:
        """As ``dict.clear``."""
        self.settle()
        super().clear()

    def copy(self) -> dict[str, Any]:
        """A plain dict with the same values."""
        return dict(self)

    def __or__(self, other: Any) -> Any:
        return dict(self) | other

    def __ror__(self, other: Any) -> Any:
        return other | dict(self)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, CopyOnReadDict):
            other.settle()
        self.settle()
        return super().__eq__(other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = None

    def __reduce__(self) -> tuple[type[dict[str, Any]], tuple[dict[str, Any]]]:
        return dict, (dict(self),)

    def __repr__(self) -> str:
        self.settle()
        return super().__repr__()


def copied(value: Any) -> Any:
    """A copy of plain data: of a dictionary at all depths, of a list and the lists in it."""
    if type(value) is dict:
        if any(type(part) in _CONTAINERS for part in value.values()):
            return {key: copied(part) for key, part in value.items()}
        return value.copy()
    if type(value) is list:
        if value and type(value[0]) is list:
            return [part[:] for part in value]
        return value[:]
    return value
