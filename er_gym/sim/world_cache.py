"""Values that are worked out from a world's state and kept until that state changes.

The world does not know who keeps what. Each reader declares a typed key for its value, so the
renderer, the metadata and the lines of sight can cache here without the world importing them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar, cast

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class CacheKey(Generic[T]):
    """The key of one value that is worked out from the whole state.

    Attributes:
        name: says in error messages and in a debugger what the value is.
    """

    name: str


@dataclass(frozen=True, eq=False)
class ObjectCacheKey(Generic[T]):
    """The key of one value for each object, by the object's row.

    Attributes:
        name: says in error messages and in a debugger what the values are.
        until_moved: True for values that depend only on where the object is and what it lies in,
            False for values that depend on any of its states.
        in_snapshots: whether a snapshot of the world takes the values along.
    """

    name: str
    until_moved: bool = False
    in_snapshots: bool = True


class Cache:
    """Values by their keys."""

    def __init__(self) -> None:
        self._values: dict[CacheKey[Any], Any] = {}

    def get(self, key: CacheKey[T]) -> T | None:
        """The value, or None if there is none."""
        return cast("T | None", self._values.get(key))

    def put(self, key: CacheKey[T], value: T) -> T:
        """Keep a value and return it."""
        self._values[key] = value
        return value

    def clear(self) -> None:
        """Forget all values."""
        self._values.clear()


@dataclass
class WorldCache:
    """All that is kept of one world.

    Attributes:
        state: values that hold until anything in the world changes.
        arrangement: values that hold until an object moves, opens or shuts. Worlds that are
            arranged alike share this cache, so it is replaced rather than cleared.
    """

    state: Cache = field(default_factory=Cache)
    arrangement: Cache = field(default_factory=Cache)
    _objects: dict[ObjectCacheKey[Any], dict[int, Any]] = field(default_factory=dict)

    def of_objects(self, key: ObjectCacheKey[T]) -> dict[int, T]:
        """The values kept for objects, by row. The caller reads this dictionary and adds to it."""
        found = self._objects.get(key)
        if found is None:
            found = self._objects[key] = {}
        return found

    def state_changed(self) -> None:
        """Forget what was worked out from the whole state."""
        self.state.clear()

    def arrangement_changed(self) -> None:
        """Forget that, and what was worked out from where things are."""
        self.state_changed()
        self.arrangement = Cache()

    def object_changed(self, i: int) -> None:
        """Forget the values of object i that depend on its states."""
        for key, values in self._objects.items():
            if not key.until_moved:
                values.pop(i, None)

    def objects_moved(self, rows: Iterable[int]) -> None:
        """Forget the values of some objects that depend on where they are."""
        for key, values in self._objects.items():
            if key.until_moved:
                for i in rows:
                    values.pop(i, None)

    def snapshot(self) -> WorldCache:
        """A cache for another world in the same state; the two share the arrangement's values."""
        objects = {key: dict(values) for key, values in self._objects.items() if key.in_snapshots}
        return WorldCache(arrangement=self.arrangement, _objects=objects)
