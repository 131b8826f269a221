"""Properties and receptacles of object types, compared with the scenes and AI2-THOR's own table."""

from __future__ import annotations

import json
from collections import Counter
from importlib.resources import files

import pytest

from er_gym.sim.data.build_object_types import object_types
from er_gym.sim.scene import PROPERTIES, SCENE_NAMES, load_scene
from er_gym.thor import OBJECT_TYPES, accepts, placement_table


def test_the_packaged_types_are_what_the_scenes_give():
    packaged = files("er_gym.sim.data").joinpath("object_types.json").read_text()
    assert json.loads(packaged) == object_types()


@pytest.mark.parametrize(
    ("name", "properties"),
    [
        ("Fridge", {"receptacle", "openable"}),
        ("Apple", {"pickupable", "sliceable"}),
        ("AppleSliced", {"pickupable"}),
        ("EggCracked", {"pickupable", "cookable"}),
        ("StoveBurner", {"receptacle"}),
        ("StoveKnob", {"toggleable"}),
        ("Mug", {"receptacle", "pickupable", "breakable", "dirtyable", "canFillWithLiquid"}),
        ("Floor", {"receptacle"}),
    ],
)
def test_what_a_type_can_do(name, properties):
    assert OBJECT_TYPES[name].properties >= properties
    sources = {"isHeatSource", "isColdSource", "moveable"}
    assert OBJECT_TYPES[name].properties - sources == properties


def test_types_are_in_alphabetical_order_and_read_only():
    assert list(OBJECT_TYPES) == sorted(OBJECT_TYPES)
    with pytest.raises(TypeError):
        OBJECT_TYPES["Apple"] = None


# -- what may be put where -------------------------------------------------------------------------


def pairs(table):
    return {(thing, receptacle) for thing, taken in table.items() for receptacle in taken}


@pytest.fixture(scope="session")
def documented(shared_data):
    """AI2-THOR's documented table; keys there carry marks for footnotes, and spaces."""
    table: dict[str, set[str]] = {}
    for name, receptacles in json.loads((shared_data / "placement_table.json").read_text()).items():
        table.setdefault(name.strip(" *"), set()).update(r.strip(" *") for r in receptacles)
    return table


def test_everything_documented_is_allowed(documented):
    assert pairs(documented) - pairs(placement_table()) == set()


def test_little_else_is_allowed(documented):
    """What else is, the recorded scenes show, or the table leaves a thing no place at all."""
    ours, theirs = pairs(placement_table()), pairs(documented)
    extra = sorted(ours - theirs)
    print(f"{len(extra)} of {len(ours)} pairs are not in AI2-THOR's table: {extra}")
    assert len(ours & theirs) / len(ours) >= 0.95


def test_the_table_names_types_that_there_are():
    """A Cart is in AI2-THOR's table and in no iTHOR scene."""
    assert set(placement_table()) <= set(OBJECT_TYPES)
    assert {receptacle for _, receptacle in pairs(placement_table())} - set(OBJECT_TYPES) == {
        "Cart"
    }


@pytest.mark.parametrize(
    ("thing", "receptacle", "allowed"),
    [
        ("Apple", "Fridge", True),
        ("Apple", "StoveBurner", False),
        ("Pot", "StoveBurner", True),
        ("BreadSliced", "Toaster", True),
        ("Bread", "Toaster", False),
        ("Mug", "CoffeeMachine", True),
        ("ToiletPaper", "ToiletPaperHanger", True),
        ("Fridge", "Fridge", False),
        ("NoSuchThing", "Fridge", False),
    ],
)
def test_what_goes_where(thing, receptacle, allowed):
    assert accepts(thing, receptacle) is allowed


def test_most_of_what_the_scenes_show_is_allowed():
    """Scenes are set by hand and hold placements that PutObject would refuse: a book on a chair."""
    shown: Counter[bool] = Counter()
    refused: Counter[tuple[str, str]] = Counter()
    for name in SCENE_NAMES:
        scene = load_scene(name)
        for i in range(len(scene)):
            for parent in scene.parents[i]:
                thing, receptacle = scene.types[i], scene.types[parent]
                if scene.properties[i, PROPERTIES.index("pickupable")] and receptacle != "Floor":
                    shown[accepts(thing, receptacle)] += 1
                    refused[thing, receptacle] += not accepts(thing, receptacle)
    print(f"{shown[True]} of {shown.total()} recorded placements are allowed; not: {+refused}")
    assert shown[True] > 1000
