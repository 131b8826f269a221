"""The scene graph: the objects of a scene, and which object lies in which."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import hypot
from typing import Any, TypeAlias

from er_gym.tasks.equivalence import BASIN_OF
from er_gym.tasks.task import whole_id

Accepts: TypeAlias = Callable[[str, str], bool]
"""Whether an object of the first type may be put into a receptacle of the second type."""

NEVER_VISITED = frozenset({"Floor", "Toilet", "Chair", "Stool"})
"""Receptacle types to which no generated task sends the agent.

The agent stands on the floor anyway, and toilets do not count. The bounding boxes of chairs and
stools reach under tables, so that the scenes list some objects in both.
"""
NEVER_FILLED = frozenset(BASIN_OF)
"""Receptacle types into which nothing is put: objects go into their basins."""
WATER_REACH = 1.0
"""The largest distance between the centres of a basin and its Faucet, metres, floor plan."""


@dataclass(frozen=True)
class SceneObject:
    """The metadata of an object that the rules read.

    Attributes:
        parents: ids of its parent receptacles.
        closed: whether it is openable and closed.
        on: whether it is switched on.
        controlled: ids of the objects that it switches, as a StoveKnob switches its StoveBurner.
        volume: of its axis-aligned bounding box, m³.
        x, z: the centre of that box, metres, AI2-THOR's world frame.
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
    """The objects of a scene by id, in the order of the metadata, and what receptacles accept."""

    objects: Mapping[str, SceneObject]
    accepts: Accepts

    def parents(self, obj: SceneObject) -> list[SceneObject]:
        """The parent receptacles of an object that are in the scene."""
        return [self.objects[parent] for parent in obj.parents if parent in self.objects]

    def of_type(self, *types: str) -> list[SceneObject]:
        """All objects of these types."""
        return [obj for obj in self.objects.values() if obj.type in types]

    def others_of_type(self, obj: SceneObject) -> list[SceneObject]:
        """All other objects of its type."""
        return [other for other in self.of_type(obj.type) if other != obj]

    def stands_free(self, obj: SceneObject) -> bool:
        """Whether an object stands on the floor or on nothing."""
        parents = self.parents(obj)
        return not parents or any(parent.type == "Floor" for parent in parents)

    def place_of(self, obj: SceneObject) -> SceneObject:
        """The object to navigate to for an object: its receptacle, else the object itself.

        Among several receptacles, closed ones come first, then free-standing ones, then those that
        cannot be picked up, then the metadata's order decides. Those of :data:`NEVER_VISITED` come
        last, and the Floor never.
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
        """Whether an object lies in a free-standing receptacle that does not open."""
        return not any(parent.openable for parent in self.parents(obj)) and any(
            may_visit(parent) and self.stands_free(parent) for parent in self.parents(obj)
        )

    def is_enclosed(self, obj: SceneObject) -> bool:
        """Whether an object lies in a free-standing receptacle that is closed."""
        return any(
            parent.receptacle and parent.closed and may_visit(parent) and self.stands_free(parent)
            for parent in self.parents(obj)
        )

    def pickupable_objects(self, hidden: bool) -> Iterator[SceneObject]:
        """The pickupable objects that are enclosed (``hidden``) or exposed."""
        qualifies = self.is_enclosed if hidden else self.is_exposed
        return (obj for obj in self.objects.values() if obj.pickupable and qualifies(obj))

    def is_in(self, obj: SceneObject, target: SceneObject) -> bool:
        """Whether an object is or lies in a target, or another part of it (a Sink's basin)."""
        return any(same_whole(target.id, holder) for holder in (obj.id, *obj.parents))

    def sink_and_faucet(self) -> tuple[SceneObject, SceneObject] | None:
        """The SinkBasin and its Faucet, if the scene has exactly one of each and the Faucet is off.

        None if a BathtubBasin is nearer to the Faucet: the water runs into the bathtub.
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


_PROPERTIES = (
    *("receptacle", "pickupable", "openable", "toggleable"),
    *("dirtyable", "cookable", "sliceable"),
)
"""Properties that go by their names in the metadata."""


def _scene_object(item: Mapping[str, Any]) -> SceneObject:
    box = item["axisAlignedBoundingBox"]
    size = box["size"]
    return SceneObject(
        id=item["objectId"],
        type=item["objectType"],
        parents=tuple(item["parentReceptacles"] or ()),
        closed=item["openable"] and not item["isOpen"],
        on=item["isToggled"],
        controlled=tuple(item["controlledObjects"] or ()),
        fillable=item["canFillWithLiquid"],
        volume=size["x"] * size["y"] * size["z"],
        x=box["center"]["x"],
        z=box["center"]["z"],
        **{name: item[name] for name in _PROPERTIES},
    )


def largest(objects: Iterable[SceneObject]) -> SceneObject:
    """The object with the largest bounding box; the last id decides between equals."""
    return max(objects, key=lambda obj: (obj.volume, obj.id))


def may_visit(obj: SceneObject) -> bool:
    """Whether tasks may send the agent to an object."""
    return obj.type not in NEVER_VISITED


def may_put_into(obj: SceneObject) -> bool:
    """Whether tasks may put objects into a receptacle."""
    return may_visit(obj) and obj.type not in NEVER_FILLED


def same_whole(one_id: str, other_id: str) -> bool:
    """Whether two ids name the same object or parts of it, as a Sink and its SinkBasin."""
    return whole_id(one_id) == whole_id(other_id)
