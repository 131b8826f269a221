"""When a task is done: conditions on how things are in the end."""

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
"""What a goal may ask of an object's metadata, and the values that each has."""

State = tuple[tuple[str, bool | str], ...]
"""Fields of AI2-THOR's object metadata, such as ``isToggled``, with the values they must have."""


@dataclass(frozen=True)
class Condition:
    """What has to be true of an object; any object of the type will do unless the id says which.

    Attributes:
        object_type: of the object.
        object_id: which one it must be, where the task says which; ``""`` otherwise.
        held: it must be in the agent's hand.
        in_reach: the agent must be where an object of that type can be seen and handled.
        inside: the type of a receptacle that it must lie in or on, ``""`` for anywhere. What lies
            in a SinkBasin is in the Sink, too; what lies on the rim of a Sink is not in its basin.
        state: what its metadata must say, of :data:`STATES`.

    Raises:
        ValueError: the metadata have no such state, or not with that value.
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


def unmet(
    goal: Iterable[Condition],
    objects: Sequence[Mapping[str, Any]],
    in_reach: Collection[str] = (),
) -> tuple[Condition, ...]:
    """The conditions of a goal that do not hold.

    Args:
        objects: ``event.metadata["objects"]``.
        in_reach: the types of which the agent sees something that it can handle.
    """
    kind_of = {entry["objectId"]: entry["objectType"] for entry in objects}
    return tuple(
        condition
        for condition in goal
        if (condition.in_reach and not is_among(condition.object_type, in_reach))
        or not any(_holds(condition, entry, kind_of) for entry in objects)
    )


def _holds(condition: Condition, entry: Mapping[str, Any], kind_of: Mapping[str, str]) -> bool:
    if entry["objectType"] != condition.object_type:
        return False
    if not is_present(entry) and _CUT_UP.isdisjoint(name for name, _ in condition.state):
        return False  # a whole of which only parts are there, and the condition is not about that
    if condition.object_id and entry["objectId"] != condition.object_id:
        return False
    if condition.held and not entry["isPickedUp"]:
        return False
    holders = {kind_of.get(holder) for holder in entry["parentReceptacles"] or ()}
    places = {condition.inside, BASIN_OF.get(condition.inside, condition.inside)}
    if condition.inside and places.isdisjoint(holders):
        return False
    return all(entry[name] == value for name, value in condition.state)
