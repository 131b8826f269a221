"""Compares two captures of a room: a Unity build's, and the embedded engine's of the same poses."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.unity.captures import RoomCapture
from er_gym.tables import Table

NEAR = 0.01
"""Metres within which positions of objects agree."""
_SAME_PLACE = 0.05
"""Metres within which two reachable positions are one: less than half of the grid."""
_STATES = ("isOpen", "isToggled", "isBroken", "isFilledWithLiquid", "isDirty", "isUsedUp",
           "isCooked", "isSliced", "isPickedUp")  # fmt: skip
_FACTS = ("name", "assetId", "objectType", "receptacle", "pickupable", "openable", "toggleable",
          "parentReceptacles")  # fmt: skip


@dataclass(frozen=True)
class Agreement:
    """How much of something agrees.

    Attributes:
        what: in words.
        right: how many agree, of ``of``.
    """

    what: str
    right: int
    of: int


def compare(theirs: RoomCapture, ours: RoomCapture) -> Iterator[Agreement]:
    """The agreement of two captures of one room, always the same figures in the same order."""
    here = {each["objectId"]: each for each in ours.metadata["objects"]}
    there = {each["objectId"]: each for each in theirs.metadata["objects"]}
    both = [(there[name], here[name]) for name in there if name in here]
    yield Agreement("objects that both have, of those of either", len(both), len(there | here))
    for fact in _FACTS:
        yield Agreement(f"objects with the same {fact}", *_equal(both, fact))
    yield Agreement("objects with the same states", *_equal(both, *_STATES))
    near = sum(_distance(a, b) <= NEAR for a, b in both)
    yield Agreement(f"objects within {100 * NEAR:g} cm", near, len(both))
    yield Agreement(
        "reachable positions of Unity that are ours",
        _among(theirs.reachable, ours.reachable), len(theirs.reachable),
    )  # fmt: skip
    yield Agreement(
        "reachable positions of ours that are Unity's",
        _among(ours.reachable, theirs.reachable), len(ours.reachable),
    )  # fmt: skip
    pairs = list(zip(theirs.views, ours.views, strict=True))
    yield Agreement(
        "poses in which both can stand, or neither",
        sum(bool(a["error"]) == bool(b["error"]) for a, b in pairs), len(pairs),
    )  # fmt: skip
    seen = [(set(a["visible"]), set(b["visible"])) for a, b in pairs]
    common = sum(len(a & b) for a, b in seen)
    yield Agreement("visible objects of Unity that are ours", common, sum(len(a) for a, _ in seen))
    yield Agreement(
        "visible objects of ours that are Unity's", common, sum(len(b) for _, b in seen)
    )


def summed(rooms: Iterable[Iterable[Agreement]]) -> tuple[Agreement, ...]:
    """The figures of several rooms together."""
    return tuple(
        Agreement(parts[0].what, sum(p.right for p in parts), sum(p.of for p in parts))
        for parts in zip(*rooms, strict=True)
    )


def table(figures: Iterable[Agreement], title: str) -> Table:
    """The figures for people."""
    rows = tuple(
        (each.what, f"{each.right:,}", f"{each.of:,}",
         f"{100 * each.right / each.of:.2f}" if each.of else "-")
        for each in figures
    )  # fmt: skip
    return Table(title, ("Figure", "Agree", "Of", "%"), rows, text_columns=1)


def _equal(
    both: Iterable[tuple[Mapping[str, Any], Mapping[str, Any]]], *fields: str
) -> tuple[int, int]:
    pairs = [[(a.get(field), b.get(field)) for field in fields] for a, b in both]
    return sum(all(_same(x, y) for x, y in pair) for pair in pairs), len(pairs)


def _same(one: Any, other: Any) -> bool:
    if isinstance(one, list) and isinstance(other, list):
        return sorted(one) == sorted(other)
    return bool((one or None) == (other or None))


def _distance(one: Mapping[str, Any], other: Mapping[str, Any]) -> float:
    return float(np.linalg.norm([one["position"][a] - other["position"][a] for a in "xyz"]))


def _among(points: NDArray[np.float64], others: NDArray[np.float64]) -> int:
    """How many points on the floor are near one of the others."""
    if not len(points) or not len(others):
        return 0
    flat = points[:, None, ::2] - others[None, :, ::2]  # x and z
    return int((np.abs(flat).max(axis=2) < _SAME_PLACE).any(axis=1).sum())
