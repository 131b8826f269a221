"""Programs that rely on what AI2-THOR's metadata hold, and programs that write into them."""

from __future__ import annotations

import copy
import json

import ai2thor.controller
import numpy as np
import pytest
from floor_plan_1 import FRIDGE

import er_gym

BASIN = "Sink|-01.90|+00.97|-01.50|SinkBasin"
LISTS = (
    *("actionFloatsReturn", "actionStringsReturn", "actionVector3sReturn", "distances", "normals"),
    *("flatSurfacesOnGrid", "isOpenableGrid", "objectIdsInBox", "segmentedObjectIds"),
)
DEFAULTS = {**{name: [] for name in LISTS}, "actionFloatReturn": 0.0, "actionIntReturn": 0}


def in_process(**arguments):
    """The embedded controller, which other programs of a process share the engine's memory with."""
    return er_gym.thor.make_controller(**arguments)


def by_the_player(**arguments):
    return ai2thor.controller.Controller(
        local_executable_path=er_gym.thor_executable(), x_display=":0", **arguments
    )


@pytest.fixture(params=[in_process, by_the_player], ids=lambda start: start.__name__)
def program(request, monkeypatch, tmp_path):
    """A function that starts a controller in one of the two ways."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.delenv("CUDA_VISIBLE_DEVICES", raising=False)
    started = []

    def start(**arguments):
        size = {"width": 300, "height": 300}
        started.append(request.param(scene="FloorPlan1", **size, **arguments))
        return started[-1]

    yield start
    for controller in started:
        controller.stop()


def spoil(value):
    """Write nonsense over everything within a list or a dictionary."""
    items = list(value.items() if isinstance(value, dict) else enumerate(value))
    for key, part in items:
        if isinstance(part, (dict, list)):
            spoil(part)
        value[key] = "spoilt"
    if isinstance(value, list):
        value.append("spoilt")


def test_a_program_that_changes_what_it_was_given_plays_on(program):
    controller = program()
    first = json.dumps(dict(controller.last_event.metadata), sort_keys=True)
    for action in ("Pass", "Pass", "RotateRight", "LookUp"):
        event = controller.step(action)
        before = copy.deepcopy(dict(event.metadata))
        spoil(event.metadata["objects"])
        spoil(event.metadata["agent"])
        spoil(event.metadata["sceneBounds"])
        again = dict(controller.step("Pass").metadata)
        assert {**again, "lastAction": before["lastAction"]} == before
    poses = controller.step("GetInteractablePoses", objectId=FRIDGE).metadata["actionReturn"]
    wanted = copy.deepcopy(poses)
    spoil(poses)
    event = controller.step("GetInteractablePoses", objectId=FRIDGE)
    assert event.metadata["actionReturn"] == wanted
    assert json.dumps(dict(controller.reset("FloorPlan1").metadata), sort_keys=True) == first


def test_entries_are_dictionaries_in_every_respect(program):
    controller = program()
    entry = controller.last_event.metadata["objects"][0]
    plain = json.loads(json.dumps(entry))
    fresh = controller.step("Pass").metadata["objects"][0]
    assert "position" in fresh
    assert fresh.get("position") == plain["position"]
    assert fresh["position"] is fresh["position"]
    assert len(fresh) == len(plain)
    assert sorted(fresh) == sorted(plain)
    assert fresh == plain
    assert {**fresh} == dict(fresh) == copy.copy(fresh) == copy.deepcopy(fresh) == plain
    del fresh["position"]
    assert "position" not in fresh
    with pytest.raises(KeyError):
        fresh["position"]


def test_legacy_keys_and_error_codes(program):
    controller = program()
    assert DEFAULTS.items() <= dict(controller.step("Pass").metadata).items()
    assert controller.last_event.metadata["errorCode"] is None
    failed = controller.step("OpenObject", objectId=FRIDGE, openness=-0.5, forceAction=True)
    assert failed.metadata["errorCode"] is None
    assert failed.metadata["errorMessage"]
    assert not any(
        entry["canBeUsedUp"] or entry["isUsedUp"] for entry in failed.metadata["objects"]
    )


@pytest.mark.parametrize("flag", ["renderInstanceSegmentation", "renderSemanticSegmentation"])
def test_types_have_colours_with_either_segmentation(program, flag):
    event = program(**{flag: True}).last_event
    for name in ("Fridge", FRIDGE):
        assert event.color_to_object_id[event.object_id_to_color[name]] == name
    assert event.instance_segmentation_frame is not None
    assert event.class_masks


def test_a_basin_is_told_from_its_sink(program):
    controller = program(renderInstanceSegmentation=True, renderSemanticSegmentation=True)
    poses = controller.step("GetInteractablePoses", objectId=BASIN, horizons=[60])
    for pose in poses.metadata["actionReturn"]:
        event = controller.step("TeleportFull", **pose)
        if BASIN in event.instance_masks:
            break
    basin = event.instance_masks[BASIN]
    np.testing.assert_array_equal(event.class_masks["SinkBasin"], basin)
    assert len(event.class_detections2D["SinkBasin"]) == 1
    assert (event.semantic_segmentation_frame[basin] == event.object_id_to_color["SinkBasin"]).all()
    assert event.object_id_to_color["SinkBasin"] != event.object_id_to_color["Sink"]
    pixel = tuple(event.instance_segmentation_frame[basin][0].tolist())
    assert event.color_to_object_id[pixel] == BASIN


def test_the_box_of_an_open_fridge_grows_to_the_front(program):
    controller = program()

    def box(**arguments):
        event = controller.step(objectId=FRIDGE, forceAction=True, **arguments)
        assert event, event.metadata["errorMessage"]
        found = event.get_object(FRIDGE)["axisAlignedBoundingBox"]
        assert np.ptp(found["cornerPoints"], axis=0) == pytest.approx(list(found["size"].values()))
        return found

    shut = controller.last_event.get_object(FRIDGE)["axisAlignedBoundingBox"]
    half = box(action="OpenObject", openness=0.5)
    wide = box(action="OpenObject", openness=1.0)
    width = shut["size"]["z"]  # it stands at the west wall and looks east
    for opened, share in ((half, 0.5**0.5), (wide, 1.0)):
        assert opened["size"]["x"] - shut["size"]["x"] == pytest.approx(share * width, abs=0.02)
        assert opened["size"]["z"] == pytest.approx(shut["size"]["z"])
        west = [b["center"]["x"] - b["size"]["x"] / 2 for b in (shut, opened)]
        assert west[0] == pytest.approx(west[1])
    assert box(action="CloseObject") == shut
