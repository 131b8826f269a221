"""Values of objects that depend on their places only, computed once for each place."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, wraps
from typing import TypeVar

from er_gym.sim.scene import Scene
from er_gym.sim.scene_objects import SceneObjects
from er_gym.sim.world_cache import ObjectCacheKey

T = TypeVar("T")
OfObject = Callable[[SceneObjects, int], T]
_SCENES_KEPT = 128


def kept_until_moved(name: str) -> Callable[[OfObject[T]], OfObject[T]]:
    """Keep what a function of the world and an object's row returns until that object moves.

    Values for an object at its recorded place are kept for its scene, for all worlds.

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
                found = kept[i] = compute(world, i)
            return found

        return kept_value

    return keep
