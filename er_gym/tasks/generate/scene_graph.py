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
class SceneObject:
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
class SceneGraph:
    """A scene's things by id, in scene order, and what goes where."""

    objects: Mapping[str, SceneObject]
    accepts: Accepts

    def parents(self, obj: SceneObject) -> list[SceneObject]:
        """What a thing lies in, as far as that is in the scene."""
        return [self.objects[parent] for parent in obj.parents if parent in self.objects]

    def of_type(self, *types: str) -> list[SceneObject]:
        """All things of these types."""
        return [obj for obj in self.objects.values() if obj.type in types]

    def others_of_type(self, obj: SceneObject) -> list[SceneObject]:
        """All other things of its type."""
        return [other for other in self.of_type(obj.type) if other != obj]

    def stands_free(self, obj: SceneObject) -> bool:
        """Whether a thing stands on the floor or on nothing."""
        parents = self.parents(obj)
        return not parents or any(parent.type == "Floor" for parent in parents)

    def place_of(self, obj: SceneObject) -> SceneObject:
        """What one goes to for a thing: the receptacle that it lies in, else the thing itself.

        Of several, what is closed comes first, then what stands free, then what is not carried
        about itself, then what the metadata names first; a chair or the like only if there is
        nothing else.
        """
        parents = [parent for parent in self.parents(obj) if parent.receptacle]
        fit = [parent for parent in parents if may_visit(parent)] or [
            parent for parent in parents if parent.type != "Floor"
        ]
        if not fit:
            return obj
        return max(
            fit,
            key=lambda parent: (
                parent.closed,
                self.stands_free(parent),
                not parent.pickupable,
            ),
        )

    def is_exposed(self, obj: SceneObject) -> bool:
        """Whether it lies in something that does not open and that stands free."""
        return not any(parent.openable for parent in self.parents(obj)) and any(
            may_visit(parent) and self.stands_free(parent) for parent in self.parents(obj)
        )

    def is_enclosed(self, obj: SceneObject) -> bool:
        """Whether it lies in something closed that stands free."""
        return any(
            parent.receptacle and parent.closed and may_visit(parent) and self.stands_free(parent)
            for parent in self.parents(obj)
        )

    def pickupable_objects(self, hidden: bool) -> Iterator[SceneObject]:
        """What there is to pick up: the enclosed things or the exposed ones."""
        qualifies = self.is_enclosed if hidden else self.is_exposed
        return (obj for obj in self.objects.values() if obj.pickupable and qualifies(obj))

    def is_in(self, obj: SceneObject, target: SceneObject) -> bool:
        """Whether a thing is, or lies in, that target or another part of it (a Sink's basin)."""
        return any(same_whole(target.id, holder) for holder in (obj.id, *obj.parents))

    def sink_and_faucet(self) -> tuple[SceneObject, SceneObject] | None:
        """The SinkBasin and its Faucet, which is off: the scene has one of each, that one can name.

        None where a bathtub's basin is nearer to the Faucet: the water runs into that.
        """
        sinks, faucets = self.of_type("SinkBasin"), self.of_type("Faucet")
        if len(sinks) != 1 or len(faucets) != 1 or faucets[0].on:
            return None
        faucet = faucets[0]

        def gap(basin: SceneObject) -> float:
            return hypot(basin.x - faucet.x, basin.z - faucet.z)

        nearest = min(self.of_type("SinkBasin", "BathtubBasin"), key=gap)
        fed = nearest == sinks[0] and gap(nearest) <= WATER_REACH
        return (nearest, faucet) if fed else None


def read_scene_graph(objects: Sequence[Mapping[str, Any]], accepts: Accepts) -> SceneGraph:
    """Read ``metadata["objects"]``."""
    return SceneGraph({item["objectId"]: _scene_object(item) for item in objects}, accepts)


def _scene_object(item: Mapping[str, Any]) -> SceneObject:
    box = item["axisAlignedBoundingBox"]
    size = box["size"]
    return SceneObject(
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


def largest(objects: Iterable[SceneObject]) -> SceneObject:
    """The thing with the largest box; the last id decides between equals."""
    return max(objects, key=lambda obj: (obj.volume, obj.id))


def may_visit(obj: SceneObject) -> bool:
    """Whether tasks may send the agent to a thing."""
    return obj.type not in NEVER_VISITED


def may_put_into(obj: SceneObject) -> bool:
    """Whether tasks may put something there, a receptacle given."""
    return may_visit(obj) and obj.type not in WHOLES


def same_whole(one_id: str, other_id: str) -> bool:
    """Whether two ids name one object or parts of it, as a Sink and its basin."""
    return _whole(one_id) == _whole(other_id)


def _whole(object_id: str) -> str:
    """The id of what an object is a part of: type and coordinates, without a part's name."""
    return "|".join(object_id.split("|")[:4])
