"""A scene as the rules see it: its things, and the spots where one finds them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

Accepts: TypeAlias = Callable[[str, str], bool]
"""Whether a thing of the first type may be put into a receptacle of the second."""

NEVER_VISITED = frozenset({"Floor", "Toilet", "Chair", "Stool"})
"""Receptacle types that no task sends the agent to."""


@dataclass(frozen=True)
class Thing:
    """What the rules read of an object's metadata.

    Attributes:
        closed: whether it opens and is shut.
        on: whether it is switched on.
        volume: of its axis-aligned box, m³.
        x, z: the middle of that box, metres, AI2-THOR's world frame.
    """

    id: str
    type: str
    parents: tuple[str, ...]
    receptacle: bool
    pickupable: bool
    openable: bool
    closed: bool
    toggleable: bool
    on: bool
    volume: float
    x: float
    z: float


@dataclass(frozen=True)
class Spot:
    """Something to handle, and the receptacle that one goes to for it."""

    thing: Thing
    place: Thing


@dataclass(frozen=True)
class Room:
    """A scene's things by id, in scene order, sorted into what the rules speak of."""

    things: Mapping[str, Thing]
    accepts: Accepts
    exposed: tuple[Spot, ...] = ()
    enclosed: tuple[Spot, ...] = ()

    def parents(self, thing: Thing) -> list[Thing]:
        """What a thing lies in, as far as that is in the scene."""
        return [self.things[parent] for parent in thing.parents if parent in self.things]

    def stands_free(self, thing: Thing) -> bool:
        """Whether a thing stands on the floor or on nothing."""
        parents = self.parents(thing)
        return not parents or any(parent.type == "Floor" for parent in parents)

    def of_type(self, *types: str) -> list[Thing]:
        """All things of these types."""
        return [thing for thing in self.things.values() if thing.type in types]

    def carried(self, hidden: bool) -> Iterator[Spot]:
        """Where there are things to pick up: the enclosed ones or the exposed ones."""
        spots = self.enclosed if hidden else self.exposed
        return (spot for spot in spots if spot.thing.pickupable)


def read_room(objects: Sequence[Mapping[str, Any]], accepts: Accepts) -> Room:
    """Sort ``metadata["objects"]``; only what is alone of its type gets a spot."""
    things = {item["objectId"]: _thing(item) for item in objects}
    counts = Counter(thing.type for thing in things.values())
    bare = Room(things, accepts)
    only = [thing for thing in things.values() if counts[thing.type] == 1]
    return Room(
        things,
        accepts,
        exposed=tuple(spot for thing in only for spot in _exposed(bare, thing)),
        enclosed=tuple(spot for thing in only for spot in _enclosed(bare, thing)),
    )


def _thing(item: Mapping[str, Any]) -> Thing:
    box = item["axisAlignedBoundingBox"]
    size = box["size"]
    return Thing(
        id=item["objectId"],
        type=item["objectType"],
        parents=tuple(item["parentReceptacles"] or ()),
        receptacle=item["receptacle"],
        pickupable=item["pickupable"],
        openable=item["openable"],
        closed=item["openable"] and not item["isOpen"],
        toggleable=item["toggleable"],
        on=item["isToggled"],
        volume=size["x"] * size["y"] * size["z"],
        x=box["center"]["x"],
        z=box["center"]["z"],
    )


def _exposed(room: Room, thing: Thing) -> list[Spot]:
    """Where an exposed thing is gone to: one spot, or none."""
    parents = room.parents(thing)
    return [] if any(parent.openable for parent in parents) else _spots(room, thing, parents)


def _enclosed(room: Room, thing: Thing) -> list[Spot]:
    """Where an enclosed thing is gone to: one spot, or none."""
    closed = [parent for parent in room.parents(thing) if parent.receptacle and parent.closed]
    return _spots(room, thing, closed)


def _spots(room: Room, thing: Thing, parents: Iterable[Thing]) -> list[Spot]:
    """The largest of those parents that stand free, or nothing."""
    places = [parent for parent in parents if may_visit(parent) and room.stands_free(parent)]
    return [Spot(thing, largest(places))] if places else []


def largest(things: Iterable[Thing]) -> Thing:
    """The thing with the largest box; the last id decides between equals."""
    return max(things, key=lambda thing: (thing.volume, thing.id))


def may_visit(thing: Thing) -> bool:
    """Whether tasks may send the agent to a thing."""
    return thing.type not in NEVER_VISITED


def same_whole(one_id: str, other_id: str) -> bool:
    """Whether two ids name one object or parts of it, as a Sink and its basin."""
    return _whole(one_id) == _whole(other_id)


def _whole(object_id: str) -> str:
    """The id of what an object is a part of: type and coordinates, without a part's name."""
    return "|".join(object_id.split("|")[:4])
