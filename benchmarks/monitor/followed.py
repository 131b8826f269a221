"""Directories that are followed while they grow, for pages that many threads make."""

from __future__ import annotations

import threading
from collections import OrderedDict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Generic, Protocol, TypeVar

from benchmarks.monitor.directories import Directory


class Follower(Protocol):
    """Follows a directory; one thread at a time may use it."""

    def read(self) -> None:
        """Read what is new."""


_Follower = TypeVar("_Follower", bound=Follower)


class Followed(Generic[_Follower]):
    """What was read of the directories that were looked at last; safe for threads.

    Args:
        follow: begins to follow a directory.
        most: how many are kept; None for all.
    """

    def __init__(self, follow: Callable[[Directory], _Follower], most: int | None = None) -> None:
        self._follow, self._most = follow, most
        self._lock = threading.Lock()
        self._kept: OrderedDict[str, tuple[_Follower, threading.Lock]] = OrderedDict()

    @contextmanager
    def use(self, directory: Directory) -> Iterator[_Follower]:
        """A directory for a ``with`` block, up to date."""
        with self._lock:
            if directory.id not in self._kept:
                self._kept[directory.id] = self._follow(directory), threading.Lock()
            self._kept.move_to_end(directory.id)
            while self._most is not None and len(self._kept) > self._most:
                self._kept.popitem(last=False)
            follower, lock = self._kept[directory.id]
        with lock:
            follower.read()
            yield follower
