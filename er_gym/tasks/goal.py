"""The goal of a task: conditions on the final state of its scene."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from er_gym.tasks.equivalence import BASIN_OF, is_among
from er_gym.thor.objects import is_present

_CUT_UP = frozenset({"isSliced", "isBroken"})

STATES: Mapping[str, tuple[bool | str, ...]] = {
    **dict.fromkeys(
        (
            "isToggled", "isOpen", "isSliced", "isCooked", "isBroken", "isDirty",
            "isFilledWithLiquid", "isUsedUp", "isPickedUp", "isMoving",
        ),
        (True, False),
    ),
    "temperature": ("Hot", "Cold", "RoomTemp"),
    "fillLiquid": ("water", "coffee", "wine"),
}  # fmt: skip
"""The metadata fields that a goal may test, and the values of each."""

State = tuple[tuple[str, bool | str], ...]
"""Fields of AI2-THOR's object metadata, such as ``isToggled``, and the values they must have."""


@dataclass(frozen=True)
class Condition:
    """A condition on an object. Without an id, any object of the type can fulfil it.

    Attributes:
        object_type: the type of the object.
        object_id: the id of the object if the task names one; ``""`` otherwise.
        held: the object must be in the agent's hand.
        in_reach: an object of the type must be visible and within the agent's reach.
        inside: the type of a receptacle in or on which the object must lie, ``""`` for anywhere. An
            object in a SinkBasin is in the Sink, too; one on the rim of a Sink is not in its basin.
        state: metadata fields of :data:`STATES` and the values they must have.

    Raises:
        ValueError: :data:`STATES` lacks a field of ``state``, or its value.
    """

    object_type: str
    object_id: str = ""
    held: bool = False
    in_reach: bool = False
    inside: str = ""
    state: State = ()

    def __post_init__(self) -> None:
        for name, value in self.state:
            allowed = STATES.get(name)
            if allowed is None:
                raise ValueError(f"unknown state {name!r}; choose one of: {', '.join(STATES)}")
            if (type(value), value) not in [(type(one), one) for one in allowed]:
                raise ValueError(
                    f"state {name} is one of {', '.join(map(str, allowed))}, not {value!r}"
                )

    def __str__(self) -> str:
        """In words: "Potato is in Plate, isCooked"."""
        claims = [
            *(["is held"] if self.held else []),
            *(["is in reach"] if self.in_reach else []),
            *([f"is in {self.inside}"] if self.inside else []),
            *(_claim(name, value) for name, value in self.state),
        ]
        return f"{self.object_id or self.object_type} {', '.join(claims)}"


def _claim(name: str, value: bool | str) -> str:
    if isinstance(value, str):
        return f"{name} {value}"
    return name if value else f"not {name}"


def unmet_conditions(
    goal: Iterable[Condition],
    objects: Sequence[Mapping[str, Any]],
    in_reach: Collection[str] = (),
) -> tuple[Condition, ...]:
    """The conditions of a goal that do not hold.

    Args:
        goal: the conditions.
        objects: ``event.metadata["objects"]``.
        in_reach: the types of which the agent sees an object within reach.
    """
    kind_of = {entry["objectId"]: entry["objectType"] for entry in objects}
    return tuple(
        condition
        for condition in goal
        if (condition.in_reach and not is_among(condition.object_type, in_reach))
        or not any(
            _holds(condition, entry, kind_of)
            for entry in objects
            if entry["objectType"] == condition.object_type
        )
    )


def _holds(condition: Condition, entry: Mapping[str, Any], kind_of: Mapping[str, str]) -> bool:
    """Whether a condition holds for an object of its type."""
    if not is_present(entry) and _CUT_UP.isdisjoint(name for name, _ in condition.state):
        return False  # the object was cut into parts, and the condition is not about that
    if condition.object_id and entry["objectId"] != condition.object_id:
        return False
    if condition.held and not entry["isPickedUp"]:
        return False
    holders = {kind_of.get(holder) for holder in entry["parentReceptacles"] or ()}
    places = {condition.inside, BASIN_OF.get(condition.inside, condition.inside)}
    if condition.inside and places.isdisjoint(holders):
        return False
    return all(entry[name] == value for name, value in condition.state)
