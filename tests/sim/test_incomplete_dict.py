"""Dictionaries that are filled when read: as plain ones, whatever is done to them first."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from support import in_one_test

from er_gym.sim.copy_on_read import CopyOnReadDict
from er_gym.sim.incomplete_dict import IncompleteDict
from er_gym.sim.lazy_metadata import LazyMetadata

PLAIN = {"ready": 1, "later": [2]}


def lazy() -> IncompleteDict:
    return LazyMetadata({"ready": 1}, {"later": lambda source: [source]}, 2)


def copying() -> IncompleteDict:
    made = CopyOnReadDict(ready=1)
    made.shared = {"later": [2]}
    return made


def without(name: str) -> Callable[[dict[str, Any]], object]:
    def change(entries: dict[str, Any]) -> object:
        del entries[name]
        return dict(entries)

    return change


OPERATIONS: dict[str, Callable[[dict[str, Any]], object]] = {
    "==": lambda entries: entries == PLAIN,
    "!=": lambda entries: entries != PLAIN,
    "|": lambda entries: (entries | {"more": 3}, {"more": 3} | entries),
    "len": len,
    "list": list,
    "reversed": lambda entries: list(reversed(entries)),
    "repr": repr,
    "values": lambda entries: list(entries.values()),
    "get": lambda entries: (entries.get("later"), entries.get("gone", 4)),
    "pop": lambda entries: (entries.pop("later"), dict(entries)),
    "popitem": lambda entries: (entries.popitem(), dict(entries)),
    "setdefault": lambda entries: entries.setdefault("later", []),
    "clear": lambda entries: (entries.clear(), dict(entries)),
    "del": without("later"),
    "del the other": without("ready"),
}


@in_one_test("made", [lazy, copying])
def test_every_operation_does_as_with_a_plain_dict(made: Callable[[], IncompleteDict]) -> None:
    differ = [name for name, do in OPERATIONS.items() if do(made()) != do(dict(PLAIN))]
    assert not differ
