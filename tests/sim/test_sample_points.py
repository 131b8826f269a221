"""The visibility of counters, cabinets and drawers agrees with the pictures."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.checks.picture_agreement import SIZES, Shares, sightings
from er_gym.sim.agent import Agent
from er_gym.sim.render.camera import Camera
from er_gym.sim.render.scene_graph import scene_graph_of
from er_gym.sim.scene import SCENE_NAMES, load_scene
from er_gym.sim.settings import Settings
from er_gym.sim.space.solids.built_in import fitted_rows, fronts, hosts
from er_gym.sim.space.solids.carcass import carcass
from er_gym.sim.space.solids.facing import SIDES, facings
from er_gym.sim.space.visibility import visible
from er_gym.sim.world import World

COUNTERS = [
    (name, i)
    for name in SCENE_NAMES[::3]
    for i, kind in enumerate(load_scene(name).types)
    if kind == "CounterTop"
]
_EDGE = 0.15
"""Who stands so little behind a front still sees its edge, metres."""


def far_sighted(name: str) -> World:
    return World.load(load_scene(name), Settings(visibility_distance=20.0))


@pytest.mark.parametrize("name", ["FloorPlan1", "FloorPlan8", "FloorPlan24", "FloorPlan423"])
def test_next_to_nothing_built_in_is_visible_from_behind(name: str) -> None:
    world, headings = far_sighted(name), facings(name)
    built_in = [k for k in hosts(name) if world.types[k] in ("Cabinet", "Drawer")]
    before = behind = 0
    for x, z in world.scene.reachable[::4]:
        for rotation in (0.0, 90.0, 180.0, 270.0):
            agent = Agent(np.array([x, world.agent.position[1], z]), rotation, 20.0)
            seen = visible(world, agent)
            for k in built_in:
                axis, sign = SIDES[round(headings[k] / 90.0) % 4]
                face = (world.high if sign > 0 else world.low)[k, 2 * axis]
                if seen[k]:
                    ahead = sign * ((x, z)[axis] - face)
                    before, behind = before + (ahead > 0), behind + (ahead < -_EDGE)
    assert before > 50
    assert behind < 0.05 * before  # round the corner of the last one of a row


@pytest.mark.parametrize(("name", "i"), [each for each in COUNTERS if [*fronts(*each)]])
def test_no_carcass_stands_before_what_is_built_into_it(name: str, i: int) -> None:
    found = carcass(name, i)
    assert len(found.footprint)
    for front in fronts(name, i):
        across = (front.low + front.high) / 2
        for x0, z0, x1, z1 in found.footprint:
            low, high = ((x0, z0), (x1, z1))
            point = np.empty(2)
            point[front.axis], point[1 - front.axis] = front.at + 0.02 * front.sign, across
            assert not ((low < point) & (point < high)).all(), (front, found.footprint)


@pytest.mark.parametrize("name", ["FloorPlan1", "FloorPlan6", "FloorPlan17", "FloorPlan407"])
def test_a_counter_is_its_slab_and_what_it_rests_on_is_no_object(name: str) -> None:
    world, low = far_sighted(name), 0
    for x, z in world.scene.reachable[::12]:
        for yaw in (0.0, 90.0, 180.0, 270.0):
            camera = Camera((x, world.agent.camera[1], z), yaw, 20.0, 90.0, 200, 200)
            ids = scene_graph_of(name).draw(world, camera).ids
            for i in world.of_type("CounterTop"):
                rows = np.nonzero(ids == i + 1)[0]
                corners = np.array(np.meshgrid(*np.stack([world.low[i], world.high[i]]).T))
                pixels = camera.project(corners.reshape(3, -1).T)
                if len(rows) and (pixels[:, 2] > 0.2).all():
                    low += 1
                    assert rows.max() <= pixels[:, 1].max() + 8
    assert low > 2


def test_drawers_at_the_back_of_a_table_in_the_open_face_the_other_way() -> None:
    for name in ("FloorPlan203", "FloorPlan226"):
        scene, headings = load_scene(name), facings(name)
        table = scene.types.index("CoffeeTable")
        inside = [k for k in fitted_rows(name, table) if scene.types[k] == "Drawer"]
        assert len(inside) == 6
        assert len({headings[k] % 360.0 for k in inside}) == 2


def test_picture_and_metadata_agree() -> None:
    """By the official client's means; 300 poses give the figures of docs/fidelity.md."""
    found = list(sightings(60, seed=5, opened=0.3))
    for size in SIZES:
        shares = Shares.of(s for s in found if s.size == size)
        assert shares.visible > 300
        assert shares.any_pixel >= 0.93 * shares.visible
        assert shares.shown >= 0.90 * shares.visible
        assert shares.told >= 0.95 * shares.in_picture


def test_what_lies_in_an_open_cabinet_under_a_counter_can_be_handled(enter) -> None:
    room = enter("FloorPlan403")
    cabinets = [o for o in room.event.metadata["objects"] if o["objectType"] == "Cabinet"]
    inside = [thing for o in cabinets for thing in o["receptacleObjectIds"]]
    assert inside
    for cabinet in cabinets:
        room.do("OpenObject", cabinet["objectId"], forceAction=True)
    for thing in inside:
        assert room.do("GetInteractablePoses", thing, maxPoses=1), thing
