"""Dictionaries that share nested values with others and copy one when it is read.

The metadata of an object have some forty single values and twenty small lists and dictionaries.
Copying these for every reader takes twenty times as long as everything else, and most readers look
at only a few of them.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from er_gym.sim.incomplete_dict import IncompleteDict

_NOTHING: Mapping[str, Any] = {}
_CONTAINERS = (dict, list)


class CopyOnReadDict(IncompleteDict):
    """A dict that copies a nested value when somebody asks for it.

    It is created with the values that need no copy. Its creator then sets :attr:`shared`.

    Attributes:
        shared: all other values, which must not be changed. They have no key in common with the
            first.
    """

    __slots__ = ("shared",)

    shared: Mapping[str, Any]

    def read_whole(self) -> None:
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

    def __len__(self) -> int:
        self.read_whole()
        return super().__len__()


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
