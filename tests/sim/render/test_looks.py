"""Random materials, colours and lights: other pictures, the same depths and instances, undone."""

from __future__ import annotations

import msgpack
import numpy as np
import pytest

from er_gym.sim.controller import EmbeddedController


@pytest.fixture(scope="module")
def controller():
    controller = EmbeddedController(
        scene="FloorPlan402", width=80, height=60, renderDepthImage=True,
        renderInstanceSegmentation=True,
    )  # fmt: skip
    yield controller
    controller.stop()


@pytest.fixture
def look(controller):
    """A function that does an action in the fresh room and returns its picture."""
    controller.reset()

    def look(action="Pass", **arguments):
        event = controller.step(action, **arguments)
        assert event, event.metadata["errorMessage"]
        return event.frame.astype(float)

    return look


def far(one, other):
    return np.abs(one - other).mean() > 10.0  # AI2-THOR's own tests ask for as much


def test_materials_are_drawn_by_the_seed_and_undone(look, controller):
    own = look()
    look("SetRandomSeed", seed=41)
    one = look("RandomizeMaterials")
    depth, ids = (
        controller.last_event.depth_frame,
        controller.last_event.instance_segmentation_frame,
    )
    look("SetRandomSeed", seed=42)
    other = look("RandomizeMaterials")
    third = look("RandomizeMaterials")
    for first, second in ((one, other), (one, own), (other, own), (other, third)):
        assert far(first, second)
    assert (look("ResetMaterials") == own).all()
    assert (controller.last_event.depth_frame == depth).all()
    assert (controller.last_event.instance_segmentation_frame == ids).all()
    look("SetRandomSeed", seed=42)
    controller.reset()  # the seed outlives it
    assert (look() == own).all()
    assert (look("RandomizeMaterials") == other).all()


def test_colours_and_lights_change_pictures_too(look):
    own = look()
    coloured = look("RandomizeColors")
    assert far(coloured, own)
    assert (look("ResetColors") == own).all()
    assert far(look("RandomizeLighting", synchronized=True), own)
    dark = look("RandomizeLighting", brightness=[0.5, 0.5], randomizeColor=False)
    assert dark.mean() / own.mean() == pytest.approx(0.5, abs=0.05)
    assert (look("ResetLighting") == own).all()


def test_a_state_holds_the_look_and_the_chance(look, controller):
    look("RandomizeMaterials")
    shown = look("RandomizeLighting")
    saved = msgpack.unpackb(msgpack.packb(controller.world_state()))
    after = look("RandomizeColors")
    look("ResetMaterials")
    look("ResetLighting")
    controller.restore_world(saved)
    assert (look() == shown).all()
    assert (look("RandomizeColors") == after).all()


def test_the_answer_is_that_of_ai2thor(controller):
    for scene, used in ((20, (1, 0, 0, 1)), (221, (0, 1, 0, 0)), (426, (0, 0, 1, 0))):
        controller.reset(f"FloorPlan{scene}", renderDepthImage=False)
        answer = controller.step("RandomizeMaterials", renderImage=False).metadata["actionReturn"]
        flags = [answer[f"use{name}Materials"] for name in ("Train", "Val", "Test", "External")]
        assert flags == [bool(flag) for flag in used]
        assert answer["totalMaterialsConsidered"] == 48 * sum(used)
        assert len(answer["chosenRoomTypes"]) == 5
    for wrong, why in (
        ({"useTestMaterials": False}, "inside of a test scene"),
        ({"inRoomTypes": ["Kitchen"]}, "must include 'bathroom'"),
        ({"inRoomTypes": []}, "non-zero length"),
        ({"inRoomTypes": ["Attic"]}, "unknown room type"),
    ):
        event = controller.step("RandomizeMaterials", renderImage=False, **wrong)
        assert why in event.metadata["errorMessage"]
    for wrong in ({"hue": [0, 2]}, {"brightness": [1]}, {"randomizeColor": False, "hue": [0, 1]}):
        assert not controller.step("RandomizeLighting", renderImage=False, **wrong)
