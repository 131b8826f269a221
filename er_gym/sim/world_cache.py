"""Values that are computed from a world's state and kept until that state changes.

The world does not know what is kept. Each reader declares a typed key for its values. So the
renderer, the metadata and the lines of sight can keep values here, and the world imports none of
them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar, cast

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class CacheKey(Generic[T]):
    """The key of one value that is computed from the whole state.

    Attributes:
        name: describes the value in a debugger.
    """

    name: str


@dataclass(frozen=True, eq=False)
class ObjectCacheKey(Generic[T]):
    """The key of one value for each object.

    Attributes:
        name: describes the values in a debugger.
        until_moved: True for values that depend only on where the object is and what it is in,
            False for values that depend on any of its states.
        in_snapshots: whether a snapshot of the world includes the values.
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
    """All values that are kept for one world.

    Attributes:
        state: values that hold until anything in the world changes.
        arrangement: values that hold until an object moves, opens or closes. Worlds in the same
            arrangement share this cache, so a change replaces it and does not clear it.
    """

    state: Cache = field(default_factory=Cache)
    arrangement: Cache = field(default_factory=Cache)
    _objects: dict[ObjectCacheKey[Any], dict[int, Any]] = field(default_factory=dict)

    def of_objects(self, key: ObjectCacheKey[T]) -> dict[int, T]:
        """The values of objects, by row. Readers look values up in this dictionary and add new
        ones."""
        found = self._objects.get(key)
        if found is None:
            found = self._objects[key] = {}
        return found

    def state_changed(self) -> None:
        """Forget the values that depend on the whole state."""
        self.state.clear()

    def arrangement_changed(self) -> None:
        """Forget the values that depend on the whole state or on the places of objects."""
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
        """A cache for a snapshot. It shares the values of the arrangement."""
        objects = {key: dict(values) for key, values in self._objects.items() if key.in_snapshots}
        return WorldCache(arrangement=self.arrangement, _objects=objects)
