"""What is kept about lines of sight is what one would find anew."""

from __future__ import annotations

import numpy as np
import pytest

from er_gym.sim.controller import EmbeddedController
from er_gym.sim.space.visibility import Sights, sights, visible

CUT_UP = {"Apple": "SliceObject", "Egg": "BreakObject"}


def random_changes(controller, random, count):
    """Open, close, pick up, put, slice: whatever succeeds of random tries."""
    world = controller.server._engine.world
    for _ in range(count):
        i = int(random.integers(len(world)))
        objects = world.object_ids[i]
        verb = random.choice(
            ["OpenObject", "CloseObject", "PickupObject", "PutObject", "SliceObject", "MoveAhead"]
        )
        arguments = {} if verb == "MoveAhead" else {"objectId": objects, "forceAction": True}
        controller.step(action=str(verb), **arguments)


@pytest.mark.parametrize("scene", ["FloorPlan1", "FloorPlan16", "FloorPlan203", "FloorPlan403"])
def test_the_difference_from_the_record_gives_what_all_boxes_give(scene: str) -> None:
    random = np.random.default_rng(len(scene))
    with EmbeddedController(scene=scene, headless=True, visibilityDistance=20) as controller:
        world = controller.server._engine.world
        seen_changed = False
        for _ in range(25):
            random_changes(controller, random, 6)
            known = sights(world)
            seen_changed |= known.change is not None and len(known.change.come) > 0
            camera = world.agent.camera
            asked = random.random(len(known.of)) < 0.7
            whole = known.clear(camera[None], known.points, known.of)[0]
            assert (known.clear_from(camera, asked) == (whole & asked)).all()
            # And the whole is that of a world without any memory.
            anew = Sights.of_world(world)
            assert (anew.clear(camera[None], anew.points, anew.of)[0] == whole).all()
            assert (visible(world) == visible(world)).all()
        assert seen_changed
