"""Values of objects that depend on their places only, computed once for each place."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable, Hashable
from functools import lru_cache, wraps
from typing import TypeVar

from er_gym.sim.remembering import get_or_compute
from er_gym.sim.scene import Scene
from er_gym.sim.scene_objects import SceneObjects
from er_gym.sim.world_cache import ObjectCacheKey

T = TypeVar("T")
OfObject = Callable[[SceneObjects, int], T]
_SCENES_KEPT = 128
_PLACES_KEPT = 8192
"""Values of each kind at places that are not the recorded ones, 1 KB each."""
_DEPEND_ON_OTHERS = frozenset({"StoveBurner"})
"""Types whose values depend on where other objects are."""


def _place(world: SceneObjects, i: int) -> Hashable:
    """All that the values of an object depend on, besides its scene."""
    arrays = (world.position, world.rotation, world.low, world.high, world.obb)
    own = (world.properties, world.states)
    return (
        world.scene.name,
        i if i < len(world.scene) else -1,
        world.types[i],
        *(array[i].tobytes() for array in (*arrays, *own)),
    )


def kept_until_moved(name: str) -> Callable[[OfObject[T]], OfObject[T]]:
    """Keep what a function of the world and an object's row returns until that object moves.

    Values for an object at its recorded place are kept for its scene, for all worlds, and those of
    the last other places for all worlds, too.

    Args:
        name: describes the values in a debugger.
    """

    def keep(compute: OfObject[T]) -> OfObject[T]:
        key: ObjectCacheKey[T] = ObjectCacheKey(name, until_moved=True)

        @lru_cache(maxsize=_SCENES_KEPT)
        def recorded(scene: Scene) -> dict[int, T]:
            return {}

        @wraps(compute)
        def kept_value(world: SceneObjects, i: int) -> T:
            at_home = world.is_where_recorded(i)
            kept = recorded(world.scene) if at_home else world.cache.of_objects(key)
            found = kept.get(i)
            if found is None:
                found = kept[i] = compute(world, i) if at_home else elsewhere(world, i)
            return found

        places: OrderedDict[Hashable, T] = OrderedDict()

        def elsewhere(world: SceneObjects, i: int) -> T:
            if world.types[i] in _DEPEND_ON_OTHERS:
                return compute(world, i)
            return get_or_compute(places, _place(world, i), _PLACES_KEPT, lambda: compute(world, i))

        return kept_value

    return keep
