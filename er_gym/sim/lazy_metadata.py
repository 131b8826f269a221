"""Metadata whose values are computed when they are first read.

Most programs look at few values in most steps, and the objects are nine tenths of the work.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar

from er_gym.sim.incomplete_dict import IncompleteDict


class LazyMetadata(IncompleteDict):
    """A dict that computes some values when somebody asks for them.

    Code that is about to change the source has to call :meth:`settle` first.

    Args:
        ready: the values that are known.
        later: for each other key, the function that computes its value from the source.
        source: the argument of these functions.
    """

    instead: ClassVar[Mapping[str, Callable[[Any], Any]]] = {}
    """Functions that a subclass uses in place of those in ``later``."""

    def __init__(
        self, ready: dict[str, Any], later: Mapping[str, Callable[[Any], Any]], source: object
    ) -> None:
        super().__init__(ready)
        self.update(dict.fromkeys(later))
        self._later = {**later, **self.instead}
        self._source: object | None = source

    @property
    def source(self) -> object | None:
        """The source, None once the source may have changed."""
        return self._source

    def settle(self) -> None:
        """Compute all remaining values and let go of the source."""
        while self._later:
            key, make = self._later.popitem()
            super().__setitem__(key, make(self._source))
        self._source = None

    def read_whole(self) -> None:
        """Prepare for a reader that looks at all values."""
        self.settle()

    def __getitem__(self, key: str) -> Any:
        make = self._later.pop(key, None)
        if make is not None:
            super().__setitem__(key, make(self._source))
        return super().__getitem__(key)

    def __setitem__(self, key: str, value: Any) -> None:
        self._later.pop(key, None)
        super().__setitem__(key, value)
