"""Metadata whose list of objects is made when it is first read.

Most steps of most programs never look at it, and it is nine tenths of the work.
"""

from __future__ import annotations

from collections.abc import Callable, ItemsView, Iterator, ValuesView
from typing import Any

LATER = "objects"
"""The key whose value is made on demand."""


class LazyMetadata(dict[str, Any]):
    """A dict in every respect, but that ``["objects"]`` is worked out when somebody asks.

    Whoever is about to change the world that it describes calls :meth:`settle` first.
    """

    def __init__(self, ready: dict[str, Any], objects: Callable[[], list[dict[str, Any]]]) -> None:
        super().__init__(ready)
        super().__setitem__(LATER, None)
        self._objects: Callable[[], list[dict[str, Any]]] | None = objects

    def settle(self) -> None:
        """Work the objects out now, if that has not been done."""
        if self._objects is not None:
            objects, self._objects = self._objects, None
            super().__setitem__(LATER, objects())

    def __getitem__(self, key: str) -> Any:
        if key == LATER:
            self.settle()
        return super().__getitem__(key)

    def __setitem__(self, key: str, value: Any) -> None:
        if key == LATER:
            self._objects = None
        super().__setitem__(key, value)

    def get(self, key: str, default: Any = None) -> Any:
        """As ``dict.get``."""
        return self[key] if key in self else default  # noqa: SIM401  (this is that method)

    def pop(self, key: str, *default: Any) -> Any:
        """As ``dict.pop``."""
        self.settle()
        return super().pop(key, *default)

    def setdefault(self, key: str, default: Any = None) -> Any:
        """As ``dict.setdefault``."""
        self.settle()
        return super().setdefault(key, default)

    # dict(x), {**x}, json and msgpack come in by one of these.

    def __iter__(self) -> Iterator[str]:
        self.settle()
        return super().__iter__()

    def items(self) -> ItemsView[str, Any]:  # type: ignore[override]
        """As ``dict.items``."""
        self.settle()
        return super().items()

    def values(self) -> ValuesView[Any]:  # type: ignore[override]
        """As ``dict.values``."""
        self.settle()
        return super().values()

    def copy(self) -> dict[str, Any]:
        """A plain dict of the same."""
        return dict(self)

    def __eq__(self, other: object) -> bool:
        self.settle()
        return super().__eq__(other)

    __hash__ = None

    def __reduce__(self) -> tuple[type[dict[str, Any]], tuple[dict[str, Any]]]:
        return dict, (dict(self),)

    def __repr__(self) -> str:
        self.settle()
        return super().__repr__()
