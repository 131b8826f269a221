"""A world's caches: their contents, and when they are discarded."""

from __future__ import annotations

import numpy as np
import pytest

from er_gym.sim.scene import load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.solids import solid_of
from er_gym.sim.world import World
from er_gym.sim.world_cache import CacheKey, ObjectCacheKey

STATE: CacheKey[str] = CacheKey("state")
ARRANGEMENT: CacheKey[str] = CacheKey("arrangement")
LOOKS: ObjectCacheKey[str] = ObjectCacheKey("looks")
PLACE: ObjectCacheKey[str] = ObjectCacheKey("place", until_moved=True)
DRAWN: ObjectCacheKey[str] = ObjectCacheKey("drawn", in_snapshots=False)


@pytest.fixture
def world() -> World:
    found = World.load(load_scene("FloorPlan1"), Settings())
    found.cache.state.put(STATE, "as loaded")
    found.cache.arrangement.put(ARRANGEMENT, "as loaded")
    for key in (LOOKS, PLACE, DRAWN):
        found.cache.of_objects(key).update(dict.fromkeys(range(len(found)), "as loaded"))
    return found


def test_another_state_keeps_what_depends_on_places_alone(world: World) -> None:
    apple, bread = next(world.of_type("Apple")), next(world.of_type("Bread"))
    world.set_state(apple, "isDirty", True)
    assert world.cache.state.get(STATE) is None
    assert world.cache.arrangement.get(ARRANGEMENT) == "as loaded"
    assert apple not in world.cache.of_objects(LOOKS)
    assert bread in world.cache.of_objects(LOOKS)
    assert apple in world.cache.of_objects(PLACE)


def test_another_place_keeps_nothing_of_what_moved(world: World) -> None:
    apple, bread = next(world.of_type("Apple")), next(world.of_type("Bread"))
    world.move_by(apple, np.array([0.0, 0.5, 0.0]))
    assert world.cache.state.get(STATE) is None
    assert world.cache.arrangement.get(ARRANGEMENT) is None
    for key in (LOOKS, PLACE):
        assert apple not in world.cache.of_objects(key)
        assert bread in world.cache.of_objects(key)


def test_a_snapshot_shares_the_arrangement_until_something_moves(world: World) -> None:
    apple = next(world.of_type("Apple"))
    snapshot = world.snapshot()
    assert snapshot.cache.arrangement is world.cache.arrangement
    assert snapshot.cache.state.get(STATE) is None
    assert snapshot.cache.of_objects(LOOKS) == world.cache.of_objects(LOOKS)
    assert not snapshot.cache.of_objects(DRAWN)
    world.move_by(apple, np.array([0.0, 0.5, 0.0]))
    assert snapshot.cache.arrangement.get(ARRANGEMENT) == "as loaded"
    assert apple in snapshot.cache.of_objects(PLACE)


def test_keys_of_one_name_are_two_keys(world: World) -> None:
    other: CacheKey[str] = CacheKey("state")
    assert world.cache.state.get(other) is None
    assert world.cache.of_objects(ObjectCacheKey("looks")) == {}


def test_a_solid_follows_its_object_and_comes_back_with_it(world: World) -> None:
    apple, offset = next(world.of_type("Apple")), np.array([0.0, 0.5, 0.0])
    recorded = solid_of(world, apple)
    assert solid_of(world, apple) is recorded
    world.move_by(apple, offset)
    moved = solid_of(world, apple)
    np.testing.assert_allclose(moved.middle - recorded.middle, offset)
    other = World.load(load_scene("FloorPlan1"), Settings())
    assert solid_of(other, apple) is recorded  # worlds of a scene share the recorded state
    world.forget()
    np.testing.assert_array_equal(solid_of(world, apple).boxes, moved.boxes)
