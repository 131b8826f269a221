"""Rearranging a room: by given poses, or at random by a seed."""

from __future__ import annotations

from collections import OrderedDict
from contextlib import suppress
from itertools import islice

import numpy as np
from pydantic import BaseModel

from er_gym.sim import consequences
from er_gym.sim.actions.checks import FARTHEST, within
from er_gym.sim.actions.pick_place import fall, put_down
from er_gym.sim.actions.registry import action, quoted
from er_gym.sim.actions.vectors import Vector
from er_gym.sim.errors import ActionFailed
from er_gym.sim.placement_restrictions import accepts
from er_gym.sim.space.placement import free_spots, surface_height
from er_gym.sim.space.receptacles import receptacles_of
from er_gym.sim.world import World

_ARRANGEMENTS = 1024
"""Arrangements that are kept in a process, some 0.1 MB each."""
_arranged: OrderedDict[tuple[object, ...], World] = OrderedDict()

_SAME, _RELATIVE = 1e-3, 1e-5
"""An object whose coordinates and angles change by less has not moved; metres and degrees."""

_RESTING = 0.05
"""What is no higher above the surface of its receptacle lies on it, metres."""


class ObjectPose(BaseModel):
    """A pose for ``SetObjectPoses``: the object's ``name`` in the metadata, metres, degrees."""

    objectName: str
    position: Vector
    rotation: Vector


class ObjectTypeCount(BaseModel):
    """How many copies of an object ``InitialRandomSpawn`` makes."""

    objectType: str
    count: int


@action("SetObjectPoses", server_action=True)
def set_object_poses(
    world: World,
    *,
    objectPoses: list[ObjectPose] | None = None,
    placeStationary: bool = True,
    skipMoveable: bool = False,
) -> None:
    """Put the named pickupable and moveable objects at given poses, and remove the others.

    As in AI2-THOR, pickupable and moveable objects that are not named leave the scene. An object
    that is named again is copied. No free space is required. A moved object gets the id of its new
    place. ``placeStationary`` False lets objects fall from their poses. ``skipMoveable`` keeps the
    moveable objects that are not named. Nothing jitters here, so AI2-THOR's ``enablePhysicsJitter``
    and ``forceRigidbodySleep`` have no effect.
    """
    if objectPoses is None:
        raise ActionFailed("objectPoses was not initialized correctly: it lists no pose.")
    # Programs mostly rearrange a room right after loading it, and often in the same way.
    wanted = (world.scene.name, placeStationary, skipMoveable, *map(_key, objectPoses))
    fresh = world.untouched
    known = _arranged.get(wanted) if fresh else None
    if known is not None:
        with suppress(KeyError):  # another thread has just dropped it
            _arranged.move_to_end(wanted)
        world.restore(known)
        return
    for pose in objectPoses:
        for axis in "xyz":
            within(f"position.{axis}", getattr(pose.position, axis), -FARTHEST, FARTHEST)
            within(f"rotation.{axis}", getattr(pose.rotation, axis), -FARTHEST, FARTHEST)
    loose = {
        world.names[i]: i
        for i in np.flatnonzero(world.exists).tolist()
        if world.has(i, "pickupable") or world.has(i, "moveable")
    }
    cut_up = {world.names[i] for i in world.remains}
    objectPoses = [pose for pose in objectPoses if pose.objectName not in cut_up]
    for pose in objectPoses:
        if pose.objectName not in loose:
            raise ActionFailed(
                f"No pickupable or moveable object is named {quoted(pose.objectName)} in this "
                "scene; names are those of the metadata's objects, not their ids."
            )
    if not objectPoses:
        return
    named = {loose[pose.objectName] for pose in objectPoses}
    for i in sorted(set(loose.values()) - named):
        if not (skipMoveable and world.has(i, "moveable")):
            world.remove(i)
    placed: set[int] = set()
    moved = []
    for number, pose in enumerate(objectPoses):
        i = loose[pose.objectName]
        if i in placed:
            name = f"{world.names[i]}_copy_{number}"
            i = world.add_object(i, f"{world.object_ids[i]}_copy_{number}", world.types[i], name)
        placed.add(i)
        if _set_pose(world, i, pose):
            moved.append(i)
    left_behind = {child for i in moved for child in world.contents[i]}
    size = np.prod(world.high - world.low, axis=1)
    # Large objects first: things on a plate are also in every receptacle that the plate is in.
    for i in sorted({*moved, *left_behind}, key=lambda i: -float(size[i])):
        world.relocate_alone(i, receptacles_of(world, i))
    if not placeStationary:
        for i in moved:
            if not _rests(world, i):
                fall(world, i, (world.low[i] + world.high[i]) / 2)
    _name_after_places(world, moved)
    consequences.apply(world)
    if fresh:
        _arranged[wanted] = world.snapshot()
        if len(_arranged) > _ARRANGEMENTS:
            _arranged.popitem(last=False)


def _rests(world: World, i: int) -> bool:
    """Whether object i lies in or on a receptacle, and not in the air above it."""
    return any(
        world.has(holder, "openable") or world.low[i, 1] <= surface_height(world, holder) + _RESTING
        for holder in world.parents[i]
    )


def _key(pose: ObjectPose) -> tuple[object, ...]:
    at, turned = pose.position, pose.rotation
    return (pose.objectName, at.x, at.y, at.z, turned.x, turned.y, turned.z)


def _set_pose(world: World, i: int, pose: ObjectPose) -> bool:
    """Put object i at a pose; returns whether it has moved."""
    position = np.array([pose.position.x, pose.position.y, pose.position.z])
    rotation = np.array([pose.rotation.x, pose.rotation.y, pose.rotation.z])
    was_held = world.is_held(i)
    world.release(i)
    turned = np.abs((rotation - world.rotation[i] + 180.0) % 360.0 - 180.0)
    if not was_held and _is_close(position, world.position[i]) and (turned < _SAME).all():
        return False
    world.set_pose(i, position, rotation)
    return True


def _is_close(one: np.ndarray, other: np.ndarray) -> bool:
    """What ``numpy.allclose`` says of two (3,) positions: ten times as fast."""
    pairs = zip(one.tolist(), other.tolist(), strict=True)
    return all(abs(a - b) <= _SAME + _RELATIVE * abs(b) for a, b in pairs)


@action("InitialRandomSpawn")
def initial_random_spawn(
    world: World,
    *,
    randomSeed: int = 0,
    forceVisible: bool = False,
    placeStationary: bool = True,
    numPlacementAttempts: int = 5,
    excludedReceptacles: list[str] | None = None,
    excludedObjectIds: list[str] | None = None,
    numDuplicatesOfType: list[ObjectTypeCount] | None = None,
    allowFloor: bool = False,
    allowMoveable: bool = False,
) -> None:
    """Move every pickupable object to a random place, by a seed.

    Each object tries up to ``numPlacementAttempts`` receptacles in random order. They must be fixed
    and accept its type. It stays where it is if none has room. ``forceVisible`` leaves out
    receptacles that open. As in AI2-THOR, a moved object gets the id of its new place. Nothing
    rolls here, so ``placeStationary`` has no effect.
    """
    within("numPlacementAttempts", numPlacementAttempts, 1, 10**6)
    for name, wanted in (
        ("numDuplicatesOfType", numDuplicatesOfType),
        ("allowFloor", allowFloor),
        ("allowMoveable", allowMoveable),
    ):
        if wanted:
            raise ActionFailed(
                f"The embedded engine's InitialRandomSpawn has no {name}; backend='unity' has."
            )
    random = np.random.default_rng(randomSeed % 2**64)
    excluded_types = frozenset(excludedReceptacles or ())
    excluded_ids = frozenset(excludedObjectIds or ())
    receptacles = [
        r
        for r in np.flatnonzero(world.exists).tolist()
        if world.has(r, "receptacle")
        and not world.has(r, "pickupable")
        and world.types[r] not in excluded_types
        and not (forceVisible and (world.has(r, "openable") or world.hidden[r]))
    ]
    loose = [
        i
        for i in np.flatnonzero(world.exists).tolist()
        if world.has(i, "pickupable") and world.object_ids[i] not in excluded_ids
    ]
    moved = []
    for i in random.permutation(loose).tolist():
        inside = world.inside(i)  # SetObjectPoses may have put a table into a bowl
        taking = [
            r for r in receptacles if r not in inside and accepts(world.types[i], world.types[r])
        ]
        choices = random.permutation(taking).tolist()[:numPlacementAttempts]
        if any(_spawn(world, i, r, random) for r in choices):
            moved.append(i)
        elif world.is_held(i):
            fall(world, i, (world.low[i] + world.high[i]) / 2)
            moved.append(i)
    _name_after_places(world, moved)
    consequences.apply(world)


def _spawn(world: World, i: int, receptacle: int, random: np.random.Generator) -> bool:
    """Put object i at the free spot nearest to a random point of a receptacle, if there is one.

    A receptacle that is nearly full counts as full, because others remain.
    """
    point = random.uniform(world.low[receptacle], world.high[receptacle])[[0, 2]]
    for yaw, foot in islice(free_spots(world, i, receptacle, point, squeeze=False), 1):
        put_down(world, i, yaw, foot, [receptacle])
        return True
    return False


def _name_after_places(world: World, rows: list[int]) -> None:
    """Give objects the ids of their places, as AI2-THOR does: ``Apple|-00.47|+01.15|+00.48``."""
    for i in sorted(rows):
        wanted = id_of_place(world.types[i], world.position[i])
        if world.index.get(wanted, i) == i:
            world.rename(i, wanted)


def id_of_place(object_type: str, position: np.ndarray) -> str:
    """AI2-THOR's id for an object of a type at (3,) metres."""
    words = [f"{value:+06.2f}".replace("-00.00", "00.00") for value in position]
    return "|".join((object_type, *words))
