"""The goals of an instruction."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

FIND, TAKE, PUT, TOGGLE = "find", "take", "put", "toggle"
WASH, BREW, HEAT, CHILL, TOAST, SLICE = "wash", "brew", "heat", "chill", "toast", "slice"
OPEN, CLOSE = "open", "close"


@dataclass(frozen=True)
class Goal:
    """One goal of an instruction.

    Attributes:
        kind: :data:`FIND`, :data:`TAKE` and so on.
        object_type: the type of the object.
        target: the receptacle type to put it into, or the knife to slice it with; "" for none.
        source: the receptacle type that the instruction says holds the object; "" if it names none.
    """

    kind: str
    object_type: str
    target: str = ""
    source: str = ""


def tidied(goals: Iterable[Goal]) -> list[Goal]:
    """Goals without those that others include; repeated goals are kept."""
    kept: list[Goal] = []
    for goal in goals:
        last = kept[-1] if kept else None
        if last is not None:
            if goal.kind == FIND and goal.object_type == last.object_type:
                continue
            same = goal.object_type == last.object_type
            if same and last.kind in (FIND, TAKE) and goal.kind not in (OPEN, CLOSE):
                kept[-1] = goal if goal.source else replace(goal, source=last.source)
                continue
            if goal == last or (same and goal.kind == last.kind and goal.target == last.target):
                continue
            if same and goal.kind == TAKE and last.kind not in (FIND, PUT):
                continue
            if goal.kind == TOGGLE and last.kind == HEAT and goal.object_type == "Microwave":
                continue
        kept.append(goal)
    return kept
