"""The engine's columns agree with its metadata."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from er_gym.sim.controller import EmbeddedController
from er_gym.thor import ObjectTable, objects_of
from er_gym.thor.objects import _of_entries


def assert_same(one: ObjectTable, other: ObjectTable) -> None:
    for field in dataclasses.fields(ObjectTable):
        a, b = getattr(one, field.name), getattr(other, field.name)
        if isinstance(a, np.ndarray):
            assert np.allclose(a, b), field.name
        elif field.name == "has":
            assert a.keys() == b.keys()
            assert all(np.array_equal(a[name], b[name]) for name in a)
        elif field.name in ("parents", "contents", "controlled"):
            assert [tuple(rows) for rows in a] == [tuple(rows) for rows in b], field.name
        elif field.name != "derived":  # a cache, which others may have filled
            assert a == b, field.name


@pytest.mark.parametrize("scene", ["FloorPlan1", "FloorPlan212", "FloorPlan302", "FloorPlan410"])
def test_columns_are_those_of_the_metadata(scene: str) -> None:
    random = np.random.default_rng(3)
    verbs = ["OpenObject", "CloseObject", "PickupObject", "PutObject", "ToggleObjectOn", "Pass"]
    with EmbeddedController(scene=scene, headless=True, visibilityDistance=20) as controller:
        held = False
        for _ in range(150):
            ids = controller.server.engine.world.object_ids
            verb = str(random.choice(verbs))
            arguments = {"objectId": str(random.choice(ids)), "forceAction": True}
            event = controller.step(action=verb, **({} if verb == "Pass" else arguments))
            table, *seen = objects_of(event)
            expected, *also_seen = _of_entries(event.metadata)
            assert_same(table, expected)
            assert np.array_equal(seen, also_seen)
            held |= table.held >= 0
        assert held


def test_a_table_stays_as_it_was_and_is_shared_while_nothing_changes() -> None:
    with EmbeddedController(scene="FloorPlan1", headless=True) as controller:
        before, *_ = objects_of(controller.last_event)
        assert objects_of(controller.step(action="RotateRight"))[0] is before
        fridge = before.of_type("Fridge")[0]
        event = controller.step(action="OpenObject", objectId=before.ids[fridge], forceAction=True)
        after, *_ = objects_of(event)
        assert after.has["isOpen"][fridge]
        assert not before.has["isOpen"][fridge]


def test_what_follows_from_a_state_is_found_again_in_it() -> None:
    with EmbeddedController(scene="FloorPlan1", headless=True) as controller:
        before, *_ = objects_of(controller.last_event)
        opened = {"objectId": before.ids[before.of_type("Fridge")[0]], "forceAction": True}
        after, *_ = objects_of(controller.step(action="OpenObject", **opened))
        assert after.derived is not before.derived
        again, *_ = objects_of(controller.step(action="CloseObject", **opened))
        assert again is not before
        assert again.derived is before.derived
        assert (again.size == before.size).all()


def test_what_has_been_cut_up_is_no_row_any_more() -> None:
    with EmbeddedController(scene="FloorPlan1", headless=True) as controller:
        apple = next(
            o["objectId"]
            for o in controller.last_event.metadata["objects"]
            if o["objectType"] == "Apple"
        )
        event = controller.step(action="SliceObject", objectId=apple, forceAction=True)
        table, *_ = objects_of(event)
        assert apple not in table.row
        assert len(table.of_type("AppleSliced")) > 1
        assert_same(table, _of_entries(event.metadata)[0])


def test_an_event_that_is_kept_speaks_of_its_own_time() -> None:
    with EmbeddedController(scene="FloorPlan1", headless=True) as controller:
        kept = controller.step(action="Pass")
        fridge = objects_of(kept)[0].of_type("Fridge")[0]
        ids = objects_of(kept)[0].ids
        controller.step(action="OpenObject", objectId=ids[fridge], forceAction=True)
        assert not objects_of(kept)[0].has["isOpen"][fridge]
