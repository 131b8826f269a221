"""Removing and disabling objects, and choosing those that the metadata list."""

from __future__ import annotations

import numpy as np

from er_gym.sim.actions.registry import action
from er_gym.sim.errors import ActionFailed
from er_gym.sim.space.receptacles import receptacles_of
from er_gym.sim.world import World


def _to_go(world: World, object_id: str) -> int:
    i = world.find(object_id)
    if world.types[i] == "Floor":
        raise ActionFailed(f"{object_id} cannot be taken away: the agent stands on it.")
    return i


@action("RemoveFromScene")
def remove_from_scene(world: World, *, objectId: str) -> None:
    """Remove an object from the scene for good; its contents stay where they are."""
    world.remove(_to_go(world, objectId))


@action("RemoveFromScene", "RemoveObjsFromScene")
def remove_several_from_scene(world: World, *, objectIds: list[str]) -> None:
    """Remove objects from the scene for good; if one does not exist, none is removed."""
    if not objectIds:
        raise ActionFailed("objectIds must not be empty!")
    for i in [_to_go(world, object_id) for object_id in objectIds]:
        if world.exists[i]:  # the list may name an object twice
            world.remove(i)


@action("DisableObject")
def disable_object(world: World, *, objectId: str) -> None:
    """Disable an object: it leaves the scene until EnableObject brings it back."""
    world.disable(_to_go(world, objectId))


@action("DisableAllObjectsOfType", server_action=True)
def disable_all_of_type(world: World, *, objectType: str = "", objectId: str = "") -> None:
    """Disable all objects of a type. As in AI2-THOR, ``objectId`` may hold the type."""
    rows = [_to_go(world, world.object_ids[i]) for i in world.of_type(objectType or objectId)]
    for i in rows:
        world.disable(i)


@action("EnableObject")
def enable_object(world: World, *, objectId: str) -> None:
    """Bring a disabled object back to its place. Objects that are there now stay."""
    i = None if objectId is None else world.index.get(objectId)
    if i is None or i not in world.disabled:
        world.find(objectId)
        return
    lay_in_it = world.enable(i)
    back = [k for k in lay_in_it if world.exists[k] and k not in world.carried]
    # Large objects first: things on a plate are also in every receptacle that the plate is in.
    size = np.prod(world.high - world.low, axis=1)
    for k in sorted({i, *back}, key=lambda k: -float(size[k])):
        world.relocate_alone(k, receptacles_of(world, k))


@action("SetObjectFilter")
def set_object_filter(world: World, *, objectIds: list[str]) -> None:
    """List only these objects in the metadata until ResetObjectFilter; unknown ids are ignored.

    Nothing else changes: objects that are not listed exist and can be acted on.
    """
    world.listed = frozenset(world.index[each] for each in objectIds if each in world.index)


@action("ResetObjectFilter")
def reset_object_filter(world: World) -> None:
    """List all objects in the metadata again."""
    world.listed = None
