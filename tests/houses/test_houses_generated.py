"""Generated houses: plans, furniture, names, tasks and the command."""

from __future__ import annotations

import json

import gymnasium
import numpy as np
import pytest
from click.testing import CliRunner
from support import in_one_test

from benchmarks.cli.houses import houses
from benchmarks.cli.render import render
from er_gym.envs.embodied_env import verification_env
from er_gym.envs.verify import Verifier
from er_gym.houses.checks import problems
from er_gym.houses.generate import MOST_ROOMS, generate_house
from er_gym.houses.names import house_name, is_house, named, scene_of
from er_gym.houses.openings import at_of, doors, span_of
from er_gym.houses.plan import plan_rooms, room_kinds
from er_gym.sim.house.build import house_scene
from er_gym.tasks.generate import Generator, generator_for
from er_gym.tasks.room_kinds import room_kind
from er_gym.tasks.task import type_of_id, whole_id
from er_gym.tasks.wordings.instructions import instruction, wording_of
from er_gym.thor import make_controller

COUNTS = range(1, MOST_ROOMS + 1)


def parts(objects):
    for each in objects:
        yield each
        yield from parts(each.get("children", ()))


@in_one_test("rooms", COUNTS)
def test_a_house_has_its_rooms_and_no_problem(rooms):
    house = generate_house(5, rooms)
    assert len(house["rooms"]) == rooms
    assert problems(house) == []


def test_a_house_is_the_same_for_the_same_seed():
    house = generate_house(5, 2)
    assert json.loads(json.dumps(house)) == house
    generate_house.cache_clear()
    assert generate_house(5, 2) == house
    assert generate_house(6, 2)["objects"] != house["objects"]


@in_one_test("rooms", COUNTS)
def test_every_room_can_be_entered_on_foot_from_every_other(rooms):
    scene = house_scene(generate_house(5, rooms))
    spots = {(round(x / 0.25), round(z / 0.25)) for x, z in scene.reachable.tolist()}
    todo, seen = [min(spots)], {min(spots)}
    while todo:
        x, z = todo.pop()
        near = {(x + 1, z), (x - 1, z), (x, z + 1), (x, z - 1)} & spots - seen
        seen |= near
        todo += near
    assert seen == spots
    x, z = scene.reachable.T
    assert all(room.contains(x, z).sum() >= 8 for room in scene.shell.rooms)


@in_one_test("rooms", COUNTS)
def test_rooms_fill_a_rectangle_and_doors_lead_to_each(rooms):
    rng = np.random.default_rng(rooms)
    plan = plan_rooms(rooms, rng)
    west, south = min(r.west for r in plan), min(r.south for r in plan)
    east, north = max(r.east for r in plan), max(r.north for r in plan)
    area = sum(np.prod(room.size) for room in plan)
    assert area == pytest.approx((east - west) * (north - south))
    assert sorted(r.kind for r in plan) == sorted(room_kinds(rooms, np.random.default_rng(rooms)))
    ways = doors(plan, rng)
    assert [way.other for way in ways if not way.open] == [0]
    reached = {1}
    for _ in plan:
        for way in ways:
            if way.open and {way.room, way.other} & reached:
                reached |= {way.room, way.other}
    assert reached == {room.number for room in plan}
    for way in ways:
        low, high = span_of(plan[way.room - 1], way.side)
        assert low < way.low < way.high < high
        if way.other:
            across = {"east": "west", "north": "south"}[way.side]
            assert at_of(plan[way.room - 1], way.side) == at_of(plan[way.other - 1], across)


def test_the_checks_see_what_is_wrong():
    house = json.loads(json.dumps(generate_house(5, 2)))
    first, *others = house["objects"]
    moved = next(o for o in others if o["assetId"].split("_")[0] != first["assetId"].split("_")[0])
    moved["position"] = {**first["position"], "y": moved["position"]["y"]}
    moved["children"] = []
    assert any("inside each other" in problem for problem in problems(house))
    house = json.loads(json.dumps(generate_house(5, 2)))
    house["objects"][0]["position"]["x"] = house["rooms"][0]["floorPolygon"][0]["x"]
    assert any("stands in a wall" in problem for problem in problems(house))
    house = json.loads(json.dumps(generate_house(5, 2)))
    for door in house["doors"]:
        door.update(assetId="Doorway_1", openness=0)
    assert any("cannot walk in" in problem for problem in problems(house))


def test_houses_by_name():
    assert house_name(17, 3) == "House3-17"
    assert is_house("House3-17")
    assert not is_house("House7-1")
    assert not is_house("FloorPlan1")
    assert scene_of("House2-5") == generate_house(5, 2)
    assert scene_of("FloorPlan1") == "FloorPlan1"
    assert named(generate_house(5, 2)) == "House2-5"
    other = {**generate_house(5, 2), "windows": []}
    name = named(other)
    assert name != "House2-5"
    assert is_house(name)
    assert scene_of(name) is other
    with pytest.raises(ValueError, match="another process"):
        scene_of("House_0123456789abcdef")
    with pytest.raises(ValueError, match="1 to 6 rooms"):
        generate_house(0, 7)
    assert room_kind("House3-17") == "house"


def test_instructions_speak_of_a_house():
    said = instruction("Find the Apple in the house.", "t", "House3-17", language="zh")
    assert "房子" in said
    for wording in ("seen", "unseen"):
        told = instruction("Find the HousePlant in the house.", "t", "House3-17", wording)
        assert "house" in told.replace("house plant", "")
        assert wording_of("Find the HousePlant in the house.", told) == wording


def test_ids_tell_types():
    assert type_of_id("Apple|surface|1|0") == "Apple"
    assert type_of_id("Dresser|2|1|Drawer_0") == "Drawer"
    assert whole_id("Dresser|2|1|Drawer_0") == "Dresser|2|1"
    assert whole_id("Sink|-01.90|+00.97|-01.50|SinkBasin") == "Sink|-01.90|+00.97|-01.50"


@pytest.fixture(scope="module")
def room():
    with make_controller(headless=True) as controller:
        yield generator_for(controller, "House2-5", 0)


def test_tasks_of_all_types_can_be_done_in_a_house(room: Generator):
    verify, solved = Verifier(verification_env()), {}
    for task in room.tasks():
        kind = task.type.name
        if solved.get(kind, 0) < 1:
            solved[kind] = solved.get(kind, 0) + verify(task).solved
    verify.close()
    assert sum(map(bool, solved.values())) >= 8, solved


def test_an_episode_begins_in_a_house():
    env = gymnasium.make("ER-SingleSearch-v0", obs_mode="state")
    _, info = env.reset(seed=1, options={"scene": "House2-5"})
    told = info["instruction"]
    _, info = env.reset(seed=1, options={"scene": generate_house(5, 2)})
    assert info["instruction"] == told
    for action in ("observe", "move forward"):
        env.step(action)
    with pytest.raises(ValueError, match="House"):
        env.reset(options={"scene": "House9-1"})
    with pytest.raises(ValueError, match="no rooms"):
        env.reset(options={"scene": {"rooms": []}})
    env.close()


def test_the_command_writes_houses(tmp_path):
    run = CliRunner()
    order = ["generate", "--rooms", "1-2", "--seed", "3", "--count", "3", "--out", str(tmp_path)]
    told = run.invoke(houses, order)
    assert told.exit_code == 0, told.output
    names = sorted(path.name for path in tmp_path.iterdir())
    assert names == ["House1-3.json", "House1-5.json", "House2-4.json"]
    assert json.loads((tmp_path / names[2]).read_text()) == generate_house(4, 2)
    assert run.invoke(houses, order).exit_code == 0  # the same files again
    (tmp_path / names[0]).write_text("mine")
    assert run.invoke(houses, order).exit_code != 0
    picture = tmp_path / "house.png"
    told = run.invoke(render, ["--scene", "House1-3", "--what", "map", "--out", str(picture)])
    assert told.exit_code == 0, told.output
    assert picture.exists()
    assert run.invoke(houses, ["generate", "--rooms", "0-9", "--out", str(tmp_path)]).exit_code
