"""Several agents in one room: turns, bodies, hands, and one agent as before."""

from __future__ import annotations

import copy

import numpy as np
import pytest
from floor_plan_1 import APPLE, BOWL, EGG, FRIDGE, ISLAND, MUG

from er_gym.sim.crew import as_agent
from er_gym.sim.engine import Engine
from er_gym.sim.house.build import EMPTY
from er_gym.sim.space.bodies import hidden, in_sight
from er_gym.sim.space.start_places import start_places
from er_gym.sim.space.visibility import visible
from er_gym.sim.world_state import restore_state, state_of

Y = 0.9009991


class Company:
    """An engine with some agents, without pictures."""

    def __init__(self, count: int, scene: str = "FloorPlan1", **settings: object) -> None:
        self.engine = Engine(96, 64)
        self.step("Reset", sceneName=scene)
        self.do("Initialize", agentCount=count, **settings)

    @property
    def world(self):
        return self.engine.world

    def step(self, action: str, agent: int | None = None, **arguments):
        request = {"action": action, "renderImage": False, **arguments}
        if agent is not None:
            request["agentId"] = agent
        return self.engine.step(request)[0]

    def do(self, action: str, agent: int | None = None, **arguments):
        """Do something that has to succeed; returns its metadata."""
        metadata = self.step(action, agent, **arguments)
        assert metadata["lastActionSuccess"], metadata["errorMessage"]
        return metadata

    def fails(self, action: str, agent: int, **arguments) -> str:
        metadata = self.step(action, agent, **arguments)
        assert not metadata["lastActionSuccess"]
        return metadata["errorMessage"]

    def place(self, agent: int, x: float, z: float, rotation: float = 0.0, **more) -> None:
        here = {"x": x, "y": Y, "z": z}
        self.do("Teleport", agent, position=here, rotation={"y": rotation}, **more)

    def told(self) -> list[list[object]]:
        """What all agents know of the room and of themselves."""
        all_of = [self.do("Pass", 1), *(each.metadata for each in self.engine.bystanders)]
        return [
            [each[name] for name in ("agent", "objects", "inventoryObjects")] for each in all_of
        ]

    def seen(self, agent: int) -> set[str]:
        world = as_agent(self.world, agent)
        return {world.object_ids[i] for i in np.flatnonzero(visible(world)).tolist()}


@pytest.fixture
def two() -> Company:
    return Company(2)


# -- turns -------------------------------------------------------------------------------------


def test_only_the_agent_of_the_request_acts(two):
    start = two.world.agent
    metadata = two.do("RotateRight", 1)
    assert metadata["agentId"] == 1
    assert metadata["agent"]["rotation"]["y"] == (start.rotation + 90) % 360
    (first,) = two.engine.bystanders
    assert first.metadata["agentId"] == 0
    assert first.metadata["agent"]["rotation"]["y"] == start.rotation
    assert two.do("Pass")["agent"] == first.metadata["agent"], "agent 0 if none is named"


def test_each_agent_is_told_what_it_did_itself(two):
    two.step("Pass", 0)
    two.step("Crouch", 1)
    assert two.fails("Crouch", 1)
    two.do("GetScenesInBuild", 0)
    (other,) = two.engine.bystanders
    told = other.metadata
    assert (told["lastAction"], told["lastActionSuccess"]) == ("Crouch", False)
    assert "crouching already" in told["errorMessage"]
    assert told["actionReturn"] is None
    assert told["agent"]["isStanding"] is False


def test_kept_metadata_of_any_agent_do_not_change(two):
    kept = [two.do("Pass", 0), *(each.metadata for each in two.engine.bystanders)]
    two.place(0, -1.0, -1.0)  # leaves all objects as they are, so nothing was computed yet
    two.do("OpenObject", 1, objectId=FRIDGE, forceAction=True)
    for each in kept:
        fridge = next(entry for entry in each["objects"] if entry["objectId"] == FRIDGE)
        assert not fridge["isOpen"]
    assert kept[0]["agent"]["position"]["z"] == 1.0


def test_a_field_of_view_belongs_to_one_agent(two):
    two.do("ChangeFOV", 1, fieldOfView=60)
    assert two.do("Pass", 0)["fov"] == 90
    assert two.do("Pass", 1)["fov"] == 60
    assert two.do("Initialize", agentCount=2)["fov"] == 90
    assert two.engine.bystanders[0].metadata["fov"] == 90


# -- how many ----------------------------------------------------------------------------------


def test_further_agents_start_where_steps_of_two_grid_lengths_lead(two):
    """From (-1, 1) on a grid of 0.5 m: two of four neighbours are floor, so the sixth place is
    three steps away."""
    places = start_places("FloorPlan1", (-1.0, 1.0), 0.25, 3)
    assert len(places) == 3
    other = two.world.others[1].agent
    assert tuple(other.position[[0, 2]]) == pytest.approx(places[0])
    assert other.rotation == two.world.agent.rotation
    for x, z in places:
        assert (2 * x).is_integer()
        assert (2 * z).is_integer()


@pytest.mark.parametrize("grid", [0.05, 0.25, 2.0, 5.0])
@pytest.mark.parametrize("scene", ["FloorPlan1", "FloorPlan405"])
def test_agents_start_apart_on_any_grid(scene, grid):
    company = Company(4, scene, gridSize=grid)
    agents = [company.world.agent, *(each.agent for each in company.world.others.values())]
    for k, one in enumerate(agents):
        for other in agents[:k]:
            assert np.hypot(*(one.position - other.position)[[0, 2]]) >= 0.4


def test_initialize_again_sets_how_many_there_are(two):
    two.do("PickupObject", 1, objectId=APPLE, forceAction=True)
    two.do("Initialize")
    assert not two.world.others
    apple = two.world.find(APPLE)
    assert not two.world.is_held(apple)
    assert two.world.parents[apple], "what it held has fallen"
    assert "the only agent is 0" in two.fails("Pass", 1)
    two.do("Initialize", agentCount=3)
    assert sorted(two.world.others) == [1, 2]
    two.do("Reset", sceneName="FloorPlan1")
    assert not two.world.others


def test_a_refused_initialize_changes_nothing(two):
    before = two.do("Pass", 1)["agent"]
    for wrong in ({"agentCount": 5}, {"agentCount": 3, "gridSize": 9}):
        assert two.step("Initialize", **wrong)["errorMessage"]
    assert two.do("Pass", 1)["agent"] == before


# -- bodies ------------------------------------------------------------------------------------


def test_bodies_are_upright_cylinders():
    eye, bodies = np.array([[0.0, 1.5, -2.0]]), ((0.0, 0.9, 0.0),)
    points = {
        (0.0, 1.0, 2.0): True,  # straight behind
        (0.0, 1.0, -1.0): False,  # before it
        (0.39, 1.0, 2.0): True,
        (0.42, 1.0, 2.0): False,  # beside its shadow, which is 0.4 m wide each way
        (0.0, 2.5, 2.0): False,  # over its head at 1.8
        (0.0, 1.9, 2.0): True,
        (0.1, 0.5, 0.05): True,  # inside
    }
    found = hidden(bodies, eye, np.array(list(points), np.float32))[0]
    assert dict(zip(points, found.tolist(), strict=True)) == points
    inside = hidden(bodies, np.array([[0.1, 1.5, 0.0]]), np.array([[3, 1, 0]], np.float32))
    assert not inside.any(), "who stands in a body looks out of it"


def test_a_body_is_in_sight_where_it_may_be_in_the_picture():
    eye, lens = (0.0, 1.575, 0.0), (0.0, 0.0, 90.0, 1.0)
    assert in_sight((0.0, 0.9, 2.0), eye, lens)
    assert in_sight((2.0, 0.9, 2.0), eye, lens)
    assert not in_sight((0.0, 0.9, -2.0), eye, lens)
    assert not in_sight((4.0, 0.9, 2.0), eye, lens)


def test_a_body_hides_what_is_behind_it(two):
    two.place(0, -1.0, 1.0, 180.0)
    two.place(1, 1.0, 1.0)
    far = {"visibilityDistance": 20.0}
    two.world.configure(visibility_distance=far["visibilityDistance"])
    alone = two.seen(0)
    two.place(1, -1.0, 0.5)
    before = two.seen(0)
    assert before < alone
    assert len(alone - before) > 3
    two.world.configure(agents_visible=False)
    assert two.seen(0) == alone
    two.world.configure(agents_visible=True)
    lost = min(alone - before)
    there = [{"x": -1.0, "y": Y, "z": 1.0}]
    question = {"objectId": lost, "positions": there, "rotations": [180.0], "standings": [True]}
    assert not two.do("GetInteractablePoses", 0, **question)["actionReturn"]
    assert lost not in two.do("GetVisibleObjects", 0)["actionReturn"]
    two.place(1, 1.0, 1.0)
    assert two.do("GetInteractablePoses", 0, **question)["actionReturn"]
    assert lost in two.do("GetVisibleObjects", 0)["actionReturn"]


def test_steps_end_where_bodies_would_touch(two):
    two.place(0, -1.0, 1.0, 180.0)
    two.place(1, -1.0, 0.5)
    said = two.fails("MoveAhead", 0)
    assert said == "Agent 1 is blocking Agent 0 from moving by (0.0000, 0.0000, -0.2500)."
    assert two.fails("MoveAhead", 0, moveMagnitude=1.0), "not through it either"
    two.do("MoveAhead", 0, moveMagnitude=0.1)
    two.do("MoveBack", 0)
    two.place(1, -1.0, 1.25, forceAction=True)
    two.do("MoveAhead", 0)  # an overlap may end
    reached = two.do("GetReachablePositions", 0)["actionReturn"]
    two.place(1, 1.0, 1.0)
    assert two.do("GetReachablePositions", 0)["actionReturn"] == reached


# -- hands -------------------------------------------------------------------------------------


def test_no_one_takes_or_uses_what_another_holds(two):
    two.do("PickupObject", 1, objectId=BOWL, forceAction=True)
    two.do("PutObject", 1, objectId=ISLAND, forceAction=True)
    two.do("PickupObject", 1, objectId=EGG, forceAction=True)
    two.do("PutObject", 1, objectId=BOWL, forceAction=True)
    two.do("PickupObject", 1, objectId=BOWL, forceAction=True)
    for held in (BOWL, EGG):
        said = two.fails("PickupObject", 0, objectId=held, forceAction=True)
        assert said == f"{held} is in the hand of agent 1."
    assert "Throw" in two.fails("PushObject", 0, objectId=BOWL, forceAction=True)
    two.do("PickupObject", 0, objectId=MUG, forceAction=True)
    said = two.fails("PutObject", 0, objectId=BOWL, forceAction=True)
    assert said == f"{BOWL} is in the hand of agent 1."
    two.do("DropHandObject", 0)
    inventory = [each.metadata["inventoryObjects"] for each in two.engine.bystanders]
    assert [[entry["objectId"] for entry in each] for each in inventory] == [[BOWL]]


def test_what_another_holds_is_seen_by_the_usual_rules(two):
    two.do("PickupObject", 1, objectId=APPLE, forceAction=True)
    two.place(0, -1.0, 1.0, 180.0)
    two.place(1, -1.0, 0.0)
    assert APPLE in two.seen(0)
    assert APPLE in two.do("GetVisibleObjects", 0)["actionReturn"]
    assert APPLE in two.seen(1)
    two.do("RotateRight", 0)
    assert APPLE not in two.seen(0), "out of the picture"
    two.do("RotateLeft", 0)
    two.place(1, -1.0, 0.0, 180.0)
    assert APPLE not in two.seen(0), "behind its holder"
    two.place(1, -1.0, -1.5)
    assert APPLE not in two.seen(0), "too far away"


def test_an_object_that_leaves_the_scene_leaves_any_hand(two):
    two.do("PickupObject", 1, objectId=APPLE, forceAction=True)
    two.do("RemoveFromScene", 0, objectId=APPLE)
    assert two.do("Pass", 1)["inventoryObjects"] == []
    two.do("PickupObject", 1, objectId=MUG, forceAction=True)
    two.do("InitialRandomSpawn", 0, randomSeed=2)
    assert two.do("Pass", 1)["inventoryObjects"] == []


# -- pictures ----------------------------------------------------------------------------------


def test_pictures_depend_on_the_agents_alone_and_one_alone_is_drawn_as_before():
    alone, together = Engine(96, 64), Company(2)
    alone.step({"action": "Reset", "sceneName": "FloorPlan1", "renderImage": False})
    alone.step({"action": "Initialize"})
    camera = {
        "action": "AddThirdPartyCamera",
        "position": {"x": 0.5, "y": 1.6, "z": 0.5},
        "rotation": {"x": 20.0, "y": 270.0, "z": 0.0},
    }
    before = alone.step(camera)[1]
    _, shown = together.engine.step(camera)
    third = shown.third_party[0].rgb
    assert (third != before.third_party[0].rgb).any(), "the camera sees both"
    together.place(1, -1.0, 0.0)
    _, face = together.engine.step({"action": "RotateLeft"})  # from west to south
    unmoved = together.engine.step({"action": "Pass"})[1]
    assert unmoved is face, "nothing to draw anew"
    together.do("RotateRight", 1)
    turned = together.engine.step({"action": "Pass"})[1]
    assert (turned.rgb != face.rgb).any(), "the other has turned"
    together.engine.step({"action": "Initialize", "agentCount": 2, "makeAgentsVisible": False})
    unseen = together.engine.step({"action": "Pass"})[1].rgb
    assert (unseen != turned.rgb).any()
    together.do("Initialize")
    assert (together.engine.step({"action": "Pass"})[1].rgb == unseen).all()
    after = alone.step({"action": "Pass"})[1]
    assert (alone.step({"action": "RotateLeft"})[1].rgb == unseen).all()
    assert (after.third_party[0].rgb == before.third_party[0].rgb).all()


# -- houses and states -------------------------------------------------------------------------


def test_a_house_has_as_many_agents_as_were_asked_for():
    company = Company(3, "Procedural")
    company.do("CreateHouse", house=dict(EMPTY))
    assert sorted(company.world.others) == [1, 2]
    assert company.do("Pass", 2)["sceneName"] == "Procedural"


def test_a_state_has_all_agents(two):
    two.do("PickupObject", 1, objectId=APPLE, forceAction=True)
    two.do("Crouch", 1)
    state = copy.deepcopy(state_of(two.world))
    before = two.told()
    two.place(1, 1.0, 1.0)
    two.do("DropHandObject", 1)
    two.do("RotateRight", 0)
    two.engine.do(lambda world: restore_state(world, state))
    assert two.told() == before
    assert "others" not in state_of(Company(1).world)
