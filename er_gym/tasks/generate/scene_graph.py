"""A scene as the rules see it: an affiliation graph of who lies in what."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any, TypeAlias

Accepts: TypeAlias = Callable[[str, str], bool]
"""Whether a thing of the first type may be put into a receptacle of the second."""

NEVER_VISITED = frozenset({"Floor", "Toilet", "Chair", "Stool"})
"""Receptacle types that no task of its own accord sends the agent to: one stands on the floor
anyhow, a toilet does not count, and the boxes of chairs and stools reach under tables, so that the
scenes put things into both."""
WHOLES = frozenset({"Sink", "Bathtub"})
"""Receptacle types that nothing is put into: things go into their basins."""
WATER_REACH = 1.0
"""A Faucet is a basin's if their middles are so near, metres on the floor plan."""


@dataclass(frozen=True)
class Thing:
    """What the rules read of an object's metadata.

    Attributes:
        closed: whether it opens and is shut.
        on: whether it is switched on.
        controlled: ids of what it is the switch of, as a stove knob is of its burner.
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
    controlled: tuple[str, ...]
    dirtyable: bool
    fillable: bool
    cookable: bool
    sliceable: bool
    volume: float
    x: float
    z: float


@dataclass(frozen=True)
class Room:
    """A scene's things by id, in scene order, and what goes where."""

    things: Mapping[str, Thing]
    accepts: Accepts

    def parents(self, thing: Thing) -> list[Thing]:
        """What a thing lies in, as far as that is in the scene."""
        return [self.things[parent] for parent in thing.parents if parent in self.things]

    def of_type(self, *types: str) -> list[Thing]:
        """All things of these types."""
        return [thing for thing in self.things.values() if thing.type in types]

    def others(self, thing: Thing) -> list[Thing]:
        """All other things of its type."""
        return [other for other in self.of_type(thing.type) if other != thing]

    def stands_free(self, thing: Thing) -> bool:
        """Whether a thing stands on the floor or on nothing."""
        parents = self.parents(thing)
        return not parents or any(parent.type == "Floor" for parent in parents)

    def place_of(self, thing: Thing) -> Thing:
        """What one goes to for a thing: the receptacle that it lies in, else the thing itself.

        Of several, what is closed comes first, then what stands free, then what is not carried
        about itself, then what the metadata names first; a chair or the like only if there is
        nothing else.
        """
        parents = [parent for parent in self.parents(thing) if parent.receptacle]
        fit = [parent for parent in parents if may_visit(parent)] or [
            parent for parent in parents if parent.type != "Floor"
        ]
        if not fit:
            return thing
        return max(
            fit,
            key=lambda parent: (
                parent.closed,
                self.stands_free(parent),
                not parent.pickupable,
            ),
        )

    def is_exposed(self, thing: Thing) -> bool:
        """Whether it lies in something that does not open and that stands free."""
        return not any(parent.openable for parent in self.parents(thing)) and any(
            may_visit(parent) and self.stands_free(parent) for parent in self.parents(thing)
        )

    def is_enclosed(self, thing: Thing) -> bool:
        """Whether it lies in something closed that stands free."""
        return any(
            parent.receptacle and parent.closed and may_visit(parent) and self.stands_free(parent)
            for parent in self.parents(thing)
        )

    def carried(self, hidden: bool) -> Iterator[Thing]:
        """What there is to pick up: the enclosed things or the exposed ones."""
        qualifies = self.is_enclosed if hidden else self.is_exposed
        return (thing for thing in self.things.values() if thing.pickupable and qualifies(thing))

    def is_in(self, thing: Thing, target: Thing) -> bool:
        """Whether a thing is, or lies in, that target or another part of it (a Sink's basin)."""
        return any(same_whole(target.id, holder) for holder in (thing.id, *thing.parents))

    def washing_place(self) -> tuple[Thing, Thing] | None:
        """The SinkBasin and its Faucet, which is off: the scene has one of each, that one can name.

        None where a bathtub's basin is nearer to the Faucet: the water runs into that.
        """
        sinks, faucets = self.of_type("SinkBasin"), self.of_type("Faucet")
        if len(sinks) != 1 or len(faucets) != 1 or faucets[0].on:
            return None
        faucet = faucets[0]

        def gap(basin: Thing) -> float:
            return hypot(basin.x - faucet.x, basin.z - faucet.z)

        nearest = min(self.of_type("SinkBasin", "BathtubBasin"), key=gap)
        fed = nearest == sinks[0] and gap(nearest) <= WATER_REACH
        return (nearest, faucet) if fed else None


def read_room(objects: Sequence[Mapping[str, Any]], accepts: Accepts) -> Room:
    """Read ``metadata["objects"]``."""
    return Room({item["objectId"]: _thing(item) for item in objects}, accepts)


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
        controlled=tuple(item["controlledObjects"] or ()),
        dirtyable=item["dirtyable"],
        fillable=item["canFillWithLiquid"],
        cookable=item["cookable"],
        sliceable=item["sliceable"],
        volume=size["x"] * size["y"] * size["z"],
        x=box["center"]["x"],
        z=box["center"]["z"],
    )


def largest(things: Iterable[Thing]) -> Thing:
    """The thing with the largest box; the last id decides between equals."""
    return max(things, key=lambda thing: (thing.volume, thing.id))


def may_visit(thing: Thing) -> bool:
    """Whether tasks may send the agent to a thing."""
    return thing.type not in NEVER_VISITED


def may_fill(thing: Thing) -> bool:
    """Whether tasks may put something there, a receptacle given."""
    return may_visit(thing) and thing.type not in WHOLES


def same_whole(one_id: str, other_id: str) -> bool:
    """Whether two ids name one object or parts of it, as a Sink and its basin."""
    return _whole(one_id) == _whole(other_id)


def _whole(object_id: str) -> str:
    """The id of what an object is a part of: type and coordinates, without a part's name."""
    return "|".join(object_id.split("|")[:4])
